"""Generated code on disk: kept where it should be, and run only if nobody else can have put it there."""

import grp
import os
import pickle
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cache_folder import Planted, new_folder, posix, ran  # noqa: F401 (the fixture `folder`)

from tmt import cache

ROOT = Path(__file__).resolve().parent.parent
TEXT = 'from numba import njit\n\n@njit("float64(float64)", cache=CACHE)\ndef f(x):\n    return 2.0 * x\n'


def mode(path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def on_disk(text="kept = CACHE\n") -> bool:
    return cache.load(text).kept


def test_generated_code_goes_to_the_cache_folder(folder):
    assert on_disk()
    (file,) = folder.glob("kernel_*.py")
    assert file.read_text(encoding="utf-8") == "kept = True\n"


@posix
def test_what_is_made_is_the_users_own_under_any_mask(folder):
    before = os.umask(0)
    try:
        assert cache.load(TEXT).f(1.5) == 3.0
    finally:
        os.umask(before)
    assert {mode(path) for path in (folder.parent, folder, folder / "__pycache__")} == {0o700}
    assert len(list(folder.glob("__pycache__/*.nbc"))) == 1
    assert cache.load(TEXT).f(1.5) == 3.0 and cache.complaints == []


def to_another_group(path):
    """Give a path to a group that is not the user's own."""
    own = os.stat(path).st_gid
    others = [12345] if os.geteuid() == 0 else [group for group in os.getgroups() if group != own]
    if not others:
        pytest.skip("the user is in one group only")
    os.chown(path, -1, others[0])


@posix
@pytest.mark.parametrize("rights, accepted", [(0o755, True), (0o775, False), (0o757, False), (0o1777, False)])
def test_others_may_read_the_folder_and_not_write(folder, rights, accepted, caplog):
    folder.mkdir(parents=True)
    to_another_group(folder)
    folder.chmod(rights)
    assert on_disk() == accepted
    assert on_disk("kept = CACHE  # another\n") == accepted
    lines = [record.getMessage() for record in caplog.records]
    assert len(lines) == (not accepted)  # once in a process
    assert all(f"{folder} can be written by others (mode {rights:04o})" in line and "\n" not in line for line in lines)
    assert mode(folder) == rights and bool(list(folder.iterdir())) == accepted


@posix
@pytest.mark.parametrize("rights, accepted", [(0o755, True), (0o1777, True), (0o777, False), (0o775, False)])
def test_others_may_not_exchange_a_folder_on_the_way(folder, rights, accepted):
    folder.mkdir(parents=True, mode=0o700)
    to_another_group(folder.parent)
    folder.parent.chmod(rights)
    assert on_disk() == accepted and len(cache.complaints) == (not accepted)
    if not accepted:
        folder.rmdir()
    assert on_disk() == accepted and folder.exists() == accepted  # nor is it made there


@posix
@pytest.mark.skipif(os.geteuid() != 0, reason="only root can say who is in a group")
@pytest.mark.parametrize(
    "name, members, accepted",
    [("root", [], True), ("root", ["root"], True), ("staff", [], False), ("root", ["root", "eve"], False)],
)
def test_a_group_of_the_user_alone_may_write(folder, name, members, accepted, monkeypatch):
    """With the mask 002 that many systems set, a folder is the group's too, and the group is the user's own."""
    folder.mkdir(parents=True)
    folder.chmod(0o775)
    monkeypatch.setattr("grp.getgrgid", lambda number: grp.struct_group((name, "x", number, members)))
    assert on_disk() == accepted


@posix
def test_a_folder_of_somebody_else_is_not_used(folder, monkeypatch):
    folder.mkdir(parents=True)
    me = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: me + 1)
    assert not on_disk()
    assert str(cache.complaints[0]).endswith(f"belongs to user {me}")


@posix
def test_a_link_counts_as_what_it_leads_to(folder, tmp_path, monkeypatch):
    shared = tmp_path / "shared"
    for target in (shared, folder):
        target.mkdir(parents=True)
    link = tmp_path / "link"
    link.symlink_to(folder)
    monkeypatch.setenv("TMT_CACHE", str(link))
    assert on_disk()
    shared.chmod(0o777)
    link.unlink()
    link.symlink_to(shared)
    assert not on_disk() and not list(shared.iterdir())


WAYS = ["nothing", "folder", "machine code", "its folder", "source", "link", "owner", "numba's folder"]


@posix
@pytest.mark.parametrize("open_to_others", WAYS)
def test_planted_code_is_not_run(folder, tmp_path, monkeypatch, open_to_others):
    cache.load(TEXT)
    (index,), (source,) = folder.glob("__pycache__/*.nbi"), folder.glob("*.py")
    index.write_bytes(pickle.dumps(Planted()))
    index.parent.chmod(0o755)
    if open_to_others == "link":
        index.rename(tmp_path / "elsewhere")
        index.symlink_to(tmp_path / "elsewhere")
    elif open_to_others == "owner":
        owner = os.geteuid()
        monkeypatch.setattr(os, "geteuid", lambda: owner + 1)
    elif open_to_others == "numba's folder":
        tmp_path.joinpath("numba").mkdir()
        tmp_path.joinpath("numba").chmod(0o777)
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    elif open_to_others != "nothing":
        what = {"folder": folder, "machine code": index, "its folder": index.parent, "source": source}
        what[open_to_others].chmod(0o777)
    assert cache.load(TEXT).f(1.5) == 3.0
    if open_to_others == "nothing":  # what is the user's own is run: else this test would show nothing
        assert set(ran) == {"planted"} and cache.complaints == []
    else:
        assert ran == [] and len(cache.complaints) == 1


def test_a_damaged_file_is_written_anew(folder):
    assert on_disk()
    (file,) = folder.glob("kernel_*.py")
    file.write_bytes(b"kept = 2\n\xff")
    assert on_disk() and file.read_bytes() == b"kept = True\n"


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_damaged_machine_code_is_compiled_anew(folder, suffix):
    assert cache.load(TEXT).f(1.5) == 3.0
    damaged = list(folder.glob(f"__pycache__/*.{suffix}"))
    assert damaged
    for file in damaged:
        file.write_bytes(b"junk")
    assert cache.load(TEXT).f(1.5) == 3.0
    assert cache.load(TEXT).f(2.5) == 5.0
    assert all(file.read_bytes() != b"junk" for file in damaged)


def test_leftovers_of_killed_writers_go(folder):
    cache.load(TEXT)
    old, young = (cache.ABANDONED + 60.0, cache.ABANDONED - 60.0)
    kept = {}
    for age in (old, young):
        for name in (f"tmp{age:.0f}.new", f"__pycache__/kernel.nbc.tmp.{age:.0f}"):
            (folder / name).write_text("")
            os.utime(folder / name, (time.time() - age,) * 2)
            kept[folder / name] = age == young
    cache.load("value = 4\n")
    assert {path: path.exists() for path in kept} == kept


def test_an_empty_setting_is_no_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("TMT_CACHE", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache.cache_folder() == tmp_path / "tmt"


def test_a_folder_that_cannot_be_made_only_costs_time(tmp_path, monkeypatch, folder):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("TMT_CACHE", str(blocked / "cache"))
    assert not on_disk() and cache.complaints == []
    read_only = tmp_path / "read_only"
    read_only.mkdir(mode=0o500)
    monkeypatch.setenv("TMT_CACHE", str(read_only))
    assert on_disk() == os.access(read_only, os.W_OK)  # whoever is root writes there all the same


@posix
def test_any_locale_and_any_path_will_do(tmp_path):
    """Umlauts in HOME and in $TMT_CACHE, where Python takes every text for ASCII; nothing is said."""
    plain = {name: os.environ[name] for name in ("PATH", "SYSTEMROOT") if name in os.environ}
    plain |= {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "HOME": str(tmp_path / "Jörg")}
    program = f"from tmt import cache; print(cache.load({TEXT!r}).f(1.5), ascii(cache.complaints))"
    for setting in ({}, {"TMT_CACHE": str(tmp_path / "Zwischenlager für Übersetztes")}):
        run = subprocess.run(
            [sys.executable, "-c", program], env=plain | setting, cwd=ROOT, capture_output=True, encoding="utf-8"
        )
        assert (run.returncode, run.stdout, run.stderr) == (0, "3.0 []\n", "")
    assert len(list(tmp_path.glob("**/__pycache__/*.nbc"))) == 2


@posix
def test_a_refusal_is_one_line_on_stderr(folder):
    folder.mkdir(parents=True)
    folder.chmod(0o777)
    program = "from tmt import cache; cache.load('a = 1'); cache.load('a = 2')"
    run = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, encoding="utf-8")
    assert run.returncode == 0 and run.stdout == ""
    (line,) = run.stderr.splitlines()
    assert line.startswith(f"{folder} can be written by others (mode 0777): ")
