"""Results of a fleet on disk: whole or not at all, and only for the same version of the program."""

import shutil

import pytest

from compare.fleet import cache as module
from compare.fleet.cache import Cache
from compare.fleet.tasks import FleetError


@pytest.fixture
def cache(tmp_path):
    made = Cache(tmp_path / "fleet")
    yield made
    made.close()


def test_a_value_is_there_again_for_the_same_program_alone(cache, monkeypatch):
    key = cache.key("file", 1)
    assert cache.get(key) is None
    cache.put(key, {"a": [1.0]})
    (cache.out / "cache" / "older").mkdir()
    cache.remove_other_versions()
    with pytest.raises(FleetError, match="another"):  # fleet is in that folder
        Cache(cache.out)
    cache.close()
    again = Cache(cache.out)
    assert again.get(key) == {"a": [1.0]} and again.key("file", 1) == key != again.key("file", 2)
    assert list((cache.out / "cache").iterdir()) == [cache.folder]
    again.close()
    monkeypatch.setattr(module, "program", lambda: "0" * 64)
    other = Cache(cache.out)
    assert other.get(other.key("file", 1)) is None is other.get(key) and other.key("file", 1) != key
    other.close()


@pytest.mark.parametrize("damaged", [
    lambda content: b"", lambda content: content[:-500] + b"x" + content[-499:],
])  # fmt: skip
def test_what_is_damaged_is_not_there(cache, damaged):
    key = cache.key("file")
    cache.put(key, bytes(1000))
    path = cache.folder / key
    path.write_bytes(damaged(path.read_bytes()))
    assert cache.get(key) is None
    cache.put(key, "anew")
    assert cache.get(key) == "anew"


def test_what_cannot_be_written_is_said(cache):
    shutil.rmtree(cache.folder)
    with pytest.raises(FleetError, match=f"{cache.folder / 'a'}: "):
        cache.put("a", 1)


SOURCES = ("compare/a.py", "compare/a.jinja", "compare/deep/page.html", "compare/page.js", "mjcf/arm.xml", "tmt/b.py")


def test_a_source_that_changes_or_moves_and_another_version_make_another_program(tmp_path, monkeypatch):
    for path in (tmp_path / one for one in (*SOURCES, "compare/a.pyc", "tests/test_a.py")):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    which = module.program.__wrapped__
    found = [which()]
    for name in SOURCES:
        (tmp_path / name).write_text("2")
        found.append(which())
        (tmp_path / name).rename((tmp_path / name).with_stem("other"))
        found.append(which())
    for package in ("mujoco", "numpy"):
        monkeypatch.setattr(module, "installed", lambda name, package=package: str(name == package))
        found.append(which())
    assert len(set(found)) == len(found)
    (tmp_path / "compare" / "a.pyc").unlink()
    (tmp_path / "tests" / "test_a.py").write_text("2")
    assert which() == found[-1]
