"""The folder of a fleet: for one fleet at a time, whole or not at all; and what makes another version of the program."""

import pytest

from compare.core.errors import Refused
from compare.fleet import cache as module
from compare.fleet.cache import locked, write_whole


def test_a_folder_is_for_one_fleet_at_a_time_and_what_cannot_be_written_is_said(tmp_path):
    with locked(tmp_path / "out"), pytest.raises(Refused, match="another"), locked(tmp_path / "out"):
        pass
    with locked(tmp_path / "out"):
        write_whole(tmp_path / "out" / "a", {"b/c": b"1"})
        write_whole(tmp_path / "out" / "a", {"d": b"2"})
    assert [path.name for path in (tmp_path / "out" / "a").iterdir()] == ["d"]
    with pytest.raises(Refused, match=f"{tmp_path / 'none' / 'a'}: "):
        write_whole(tmp_path / "none" / "a", b"1")


SOURCES = [f"compare/{name}" for name in ("a.py", "a.jinja", "deep/page.html.jinja")]
SOURCES += ["mjcf/arm.xml", "tmt/b.py"]


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
