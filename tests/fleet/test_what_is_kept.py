"""What a fleet has computed is kept: whole, or not at all, and for the same program alone."""

import pickle
import resource
import signal
from contextlib import contextmanager

import pytest

from compare.fleet import kept as module
from compare.fleet import program
from compare.fleet.kept import Kept, write_report
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
    kept.close()
    again = Kept(kept.out)
    assert again.get(key) == {"a": [1.0]} and again.key("file", 1) == key != again.key("file", 2)
    assert list((kept.out / "kept").iterdir()) == [kept.folder]
    again.close()
    monkeypatch.setattr(module, "program", lambda: "0" * 64)
    other = Kept(kept.out)
    assert other.get(other.key("file", 1)) is None is other.get(key) and other.key("file", 1) != key
    other.close()


@pytest.mark.parametrize("damage", ["cut", "emptied", "changed", "another", "lengthened"])
def test_what_is_damaged_is_not_there(kept, damage):
    key = kept.key("file")
    kept.put(key, bytes(1000))
    path = kept.folder / key
    content = path.read_bytes()
    changed = content[:-500] + b"x" + content[-499:]
    texts = {
        "cut": content[:-1],
        "emptied": b"",
        "changed": changed,
        "another": pickle.dumps(0),
        "lengthened": content + b"0",
    }
    path.write_bytes(texts[damage])
    assert kept.get(key) is None
    kept.put(key, "anew")
    assert kept.get(key) == "anew"


def test_two_fleets_in_one_folder(kept):
    with pytest.raises(FleetError, match="another"):
        Kept(kept.out)
    kept.put("b", 2)
    kept.close()
    Kept(kept.out).close()


@pytest.mark.parametrize("what", ["a file", "below a file", "a link to nothing"])
def test_a_folder_that_cannot_be_one_is_named(tmp_path, what):
    place = tmp_path / "there"
    if what == "a link to nothing":
        place.symlink_to(tmp_path / "nowhere" / "deeper")
    else:
        place.write_text("mine")
    out = place / "fleet" if what == "below a file" else place
    with pytest.raises(FleetError, match=f"{out}"):
        Kept(out)
    assert what == "a link to nothing" or place.read_text() == "mine"


@contextmanager
def small_files(most):
    """No file may be larger than this number of bytes, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, before[1]))
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


def test_a_full_disk_leaves_what_was_there(kept):
    kept.put("a", "old")
    write_report(kept.out / "report", {"index.html": b"old"})
    for name, write in (
        (str(kept.folder / "a"), lambda: kept.put("a", bytes(10**5))),
        (str(kept.out / "report"), lambda: write_report(kept.out / "report", {"index.html": bytes(10**5)})),
    ):
        with small_files(4096), pytest.raises(FleetError, match=f"{name}: File too large"):
            write()
    assert kept.get("a") == "old" and [path.name for path in kept.folder.iterdir()] == ["a"]
    assert (kept.out / "report" / "index.html").read_bytes() == b"old"
    assert sorted(path.name for path in kept.out.iterdir()) == ["kept", "report"]


# which program it is: another one as soon as a source, a model or what it computes with is another

SOURCES = ["compare/a.py", "compare/deep/page.html", "compare/page.js", "mjcf/arm.xml", "tmt/b.py"]
OTHERS = ["compare/a.pyc", "tests/test_a.py"]


@pytest.mark.parametrize("name", [*SOURCES, *OTHERS])
def test_a_source_that_changes_or_moves_makes_another_program(name, tmp_path, monkeypatch):
    for path in (tmp_path / one for one in [*SOURCES, *OTHERS]):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1")
    monkeypatch.setattr(program, "ROOT", tmp_path)
    which, path = program.program.__wrapped__, tmp_path / name
    first = which()
    path.write_text("2")
    changed = which()
    path.rename(path.with_stem("other"))
    assert len({first, changed, which()}) == (3 if name in SOURCES else 1)


@pytest.mark.parametrize("changed", ["mujoco", "numpy", "scipy", "llvmlite", "mpmath"])
def test_another_version_of_what_it_computes_with_makes_another_program(changed, monkeypatch):
    found = set()
    for versions in ({}, {changed: "0"}):
        monkeypatch.setattr(program, "installed", lambda name, versions=versions: versions.get(name, "1"))
        found.add(program.program.__wrapped__())
    assert len(found) == 2
