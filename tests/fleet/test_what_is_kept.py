"""What a fleet has computed is kept: whole, or not at all, and for the same program alone."""

import shutil

import pytest

from compare.fleet import kept as module
from compare.fleet import program
from compare.fleet.kept import Kept
from compare.fleet.piece import FleetError


@pytest.fixture
def kept(tmp_path):
    made = Kept(tmp_path / "fleet")
    yield made
    made.close()


def test_a_value_is_there_again_for_the_same_program_alone(kept, monkeypatch):
    key = kept.key("file", 1)
    assert kept.get(key) is None
    kept.put(key, {"a": [1.0]})
    (kept.out / "kept" / "older").mkdir()
    kept.forget_others()
    with pytest.raises(FleetError, match="another"):  # fleet is in that folder
        Kept(kept.out)
    kept.close()
    again = Kept(kept.out)
    assert again.get(key) == {"a": [1.0]} and again.key("file", 1) == key != again.key("file", 2)
    assert list((kept.out / "kept").iterdir()) == [kept.folder]
    again.close()
    monkeypatch.setattr(module, "program", lambda: "0" * 64)
    other = Kept(kept.out)
    assert other.get(other.key("file", 1)) is None is other.get(key) and other.key("file", 1) != key
    other.close()


@pytest.mark.parametrize("damaged", [
    lambda content: b"", lambda content: content[:-500] + b"x" + content[-499:],
])  # fmt: skip
def test_what_is_damaged_is_not_there(kept, damaged):
    key = kept.key("file")
    kept.put(key, bytes(1000))
    path = kept.folder / key
    path.write_bytes(damaged(path.read_bytes()))
    assert kept.get(key) is None
    kept.put(key, "anew")
    assert kept.get(key) == "anew"


def test_what_cannot_be_written_is_said(kept):
    shutil.rmtree(kept.folder)
    with pytest.raises(FleetError, match=f"{kept.folder / 'a'}: "):
        kept.put("a", 1)


SOURCES = ("compare/a.py", "compare/deep/page.html", "compare/page.js", "mjcf/arm.xml", "tmt/b.py")


def test_a_source_that_changes_or_moves_and_another_version_make_another_program(tmp_path, monkeypatch):
    for path in (tmp_path / one for one in (*SOURCES, "compare/a.pyc", "tests/test_a.py")):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1")
    monkeypatch.setattr(program, "ROOT", tmp_path)
    which = program.program.__wrapped__
    found = [which()]
    for name in SOURCES:
        (tmp_path / name).write_text("2")
        found.append(which())
        (tmp_path / name).rename((tmp_path / name).with_stem("other"))
        found.append(which())
    for package in ("mujoco", "numpy"):
        monkeypatch.setattr(program, "installed", lambda name, package=package: str(name == package))
        found.append(which())
    assert len(set(found)) == len(found)
    (tmp_path / "compare" / "a.pyc").unlink()
    (tmp_path / "tests" / "test_a.py").write_text("2")
    assert which() == found[-1]
