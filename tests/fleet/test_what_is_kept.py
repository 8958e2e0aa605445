"""What a fleet has computed is kept: whole, or not at all."""

import os
import pickle
import resource
import signal
from contextlib import contextmanager

import pytest

from compare.fleet import kept as module
from compare.fleet.kept import Kept, write_report
from compare.fleet.piece import FleetError


@pytest.fixture
def kept(tmp_path):
    made = Kept(tmp_path / "fleet")
    yield made
    made.close()


@contextmanager
def small_files(most):
    """No file may be larger than so many bytes, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, before[1]))
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


def test_a_value_is_there_again(kept):
    key = kept.key("file", 1)
    assert kept.get(key) is None
    kept.put(key, {"a": [1.0]})
    kept.close()
    again = Kept(kept.out)
    assert again.get(key) == {"a": [1.0]} and again.key("file", 1) == key != again.key("file", 2)
    again.close()


@pytest.mark.parametrize("damage", ["cut", "emptied", "changed", "another", "lengthened"])
def test_what_is_damaged_is_not_there(kept, damage):
    key = kept.key("file")
    kept.put(key, bytes(1000))
    path = kept.folder / key
    content = bytearray(path.read_bytes())
    content[-500] ^= damage == "changed"
    path.write_bytes(
        {
            "cut": content[:-1],
            "emptied": b"",
            "changed": content,
            "another": pickle.dumps(0),
            "lengthened": content + b"0",
        }[damage]
    )
    assert kept.get(key) is None
    kept.put(key, "anew")
    assert kept.get(key) == "anew"


def test_two_fleets_in_one_folder(kept):
    kept.put("a", 1)
    with pytest.raises(FleetError) as raised:
        Kept(kept.out)
    assert str(raised.value) == (
        f"another fleet is writing to {kept.out}; another folder (--out) is expected, or wait until it has ended"
    )
    assert kept.get("a") == 1
    kept.put("b", 2)
    kept.close()
    Kept(kept.out).close()


@pytest.mark.parametrize("what", ["a file", "below a file", "a link to nothing"])
def test_a_folder_that_cannot_be_one(tmp_path, what):
    place = tmp_path / "there"
    if what == "a link to nothing":
        place.symlink_to(tmp_path / "nowhere" / "deeper")
    else:
        place.write_text("mine")
    out = place / "fleet" if what == "below a file" else place
    with pytest.raises(FleetError, match=rf"^cannot write to {out}: [^\n]+; a folder that can be written is expected$"):
        Kept(out)
    assert what == "a link to nothing" or place.read_text() == "mine"


@pytest.mark.skipif(os.geteuid() == 0, reason="this user may write everywhere")
def test_a_folder_that_may_not_be_written(kept):
    kept.close()
    kept.folder.chmod(0o500)
    with pytest.raises(FleetError, match=r"^cannot write to .*: Permission denied; a folder that can be written"):
        Kept(kept.out)
    kept.folder.chmod(0o700)


def test_a_full_disk(kept):
    kept.put("a", "old")
    with small_files(4096), pytest.raises(FleetError) as raised:
        kept.put("a", bytes(10**5))
    assert str(raised.value) == f"cannot write {kept.folder / 'a'}: File too large; what is done is kept"
    assert kept.get("a") == "old" and [path.name for path in kept.folder.iterdir()] == ["a"]
    write_report(kept.out / "report", {"index.html": b"old"})
    with (
        small_files(4096),
        pytest.raises(FleetError, match=r"^cannot write .*report: File too large; what is done is kept$"),
    ):
        write_report(kept.out / "report", {"index.html": bytes(10**5)})
    assert (kept.out / "report" / "index.html").read_bytes() == b"old"
    assert sorted(path.name for path in kept.out.iterdir()) == ["kept", "report"]


def test_other_programs_are_forgotten(kept):
    kept.put("a", 1)
    (kept.out / "kept" / "another").mkdir()
    kept.forget_others()
    assert list((kept.out / "kept").iterdir()) == [kept.folder] and kept.get("a") == 1


def test_another_program_finds_nothing_of_this_one(kept, monkeypatch):
    key = kept.key("file")
    kept.put(key, 1)
    kept.close()
    monkeypatch.setattr(module, "program", lambda: "0" * 64)
    other = Kept(kept.out)
    assert other.get(other.key("file")) is None is other.get(key) and other.key("file") != key
    other.close()
