"""Object files on disk: made for what is asked, and run only if nobody else can have put them there."""

import dataclasses
import grp
import hashlib
import os
import stat
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import tmt
from tmt.compiled import Library, evaluator, store
from tmt.compiled.machine import object_code
from tmt.equations import composite
from tmt.methods import METHODS, RungeKutta

ROOT = Path(__file__).resolve().parents[2]
posix = pytest.mark.skipif(os.name != "posix", reason="rights are bits on POSIX only")
TEXT = "define double @f(double %x) {{\n  %y = fmul double %x, {}\n  ret double %y\n}}\n"
FACTORS = {"right": "2.0", "planted": "-7.0"}


def asked(*what) -> float:
    """f(1.5) of the library of a source of f(x) = 2 x."""
    return called(store.library(lambda: TEXT.format(FACTORS["right"]), "double", *what))


def called(library: Library) -> float:
    from ctypes import c_double

    return library.function("f", c_double, c_double)(1.5)


def files(folder) -> list[Path]:
    return sorted(folder.glob("*.o"))


def plant(path):
    """Code of somebody else, signed as what is written here."""
    code = object_code(TEXT.format(FACTORS["planted"]))
    path.write_bytes(hashlib.sha256(code).digest() + code)


def is_kept(folder) -> bool:
    assert asked() == 3.0
    return bool(folder.is_dir() and files(folder))


def mode(path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_what_is_kept_is_read_the_next_time(folder):
    assert is_kept(folder)
    (file,) = files(folder)
    plant(file)  # one's own, so it is run: else the tests of planted code would show nothing
    assert asked() == 1.5 * -7.0 and asked("another") == 3.0
    assert len(files(folder)) == 2 and store.complaints == [] and store.size_of_cache() > 2 * 300


def test_each_question_has_a_file_of_its_own(folder):
    light = dataclasses.replace(tmt.ARM, mass=(1.0, 1.5))
    one, other = (dataclasses.replace(tmt.ARM, gravity=(0.0, zero, -9.81)) for zero in (0.0, -0.0))
    changed = dataclasses.replace(METHODS["rk4"], order=3)
    questions = [
        (), (1,), (4,), ("q",), (tmt.ARM,), (light,), (one,), (other,),
        *((tmt.ARM, stepping, 1) for stepping in (*METHODS.values(), changed)),
    ]  # fmt: skip
    assert np.signbit(other.gravity[1]) and METHODS["implicit"] != METHODS["discrete"]
    same = int(one == tmt.ARM)  # the arm's own zero is one of the two
    for question in (*questions, *questions):
        assert asked(*question) == 3.0
    assert len(files(folder)) == len(questions) - same


def test_another_version_of_tmt_or_another_processor_has_other_files(folder, tmp_path, monkeypatch):
    for name in ("own_sources", "versions"):
        before = len(files(folder)) if folder.exists() else 0
        asked()
        monkeypatch.setattr(store, name, lambda: "another")
        asked()
        assert len(files(folder)) == before + 2 - (name == "versions")
    monkeypatch.undo()
    monkeypatch.setattr(store, "__file__", str(tmp_path / "tmt" / "compiled" / "store.py"))
    found, path = set(), tmp_path / "tmt" / "model" / "tree.py"
    path.parent.mkdir(parents=True)
    for content in ("", "a = 1", "a = 2"):
        path.write_text(content)
        found.add(store.own_sources.__wrapped__())
    assert len(found) == 3


class Mine(tmt.Tree):
    """A user's own class of trees."""


def test_of_what_is_the_users_own_nothing_is_kept(folder, monkeypatch):
    """A method, a class of trees or a function may be another tomorrow, with the same name."""

    @dataclasses.dataclass(frozen=True)
    class Longer(RungeKutta):
        def step(self, slope, q, qd, dt):
            return super().step(slope, q, qd, 2.0 * dt)

    def terms(tree, q, qd):
        return composite.mass_matrix_and_bias(tree, q, qd)

    rk4, start = METHODS["rk4"], (np.full((9, 3), 0.1),) * 3
    monkeypatch.setitem(METHODS, "longer", Longer(rk4.order, rk4.A, rk4.b, rk4.c))
    own = Mine(**{field.name: getattr(tmt.ARM, field.name) for field in dataclasses.fields(tmt.ARM)})
    longer = tmt.simulate(*start, 0.01, 4, "longer")
    mine = tmt.simulate(*start, 0.02, 4, model=own)
    for given in ((tmt.ARM, "bias", terms), (own, "bias")):
        assert evaluator(*given).alone
    assert not folder.exists() or files(folder) == []
    assert np.array_equal(mine.q, tmt.simulate(*start, 0.02, 4).q) and np.allclose(mine.q, longer.q, rtol=0, atol=1e-15)


# who else can write there


@posix
def test_what_is_made_is_the_users_own_under_any_mask(folder):
    before = os.umask(0)
    try:
        assert is_kept(folder)
    finally:
        os.umask(before)
    assert {mode(path) for path in (folder.parent, folder)} == {0o700} and mode(*files(folder)) == 0o600


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
    assert is_kept(folder) == accepted and asked("another") == 3.0
    lines = [record.getMessage() for record in caplog.records]
    assert len(lines) == (not accepted)  # once in a process
    assert all(str(folder) in line and f"{rights:04o}" in line and "\n" not in line for line in lines)
    assert mode(folder) == rights and bool(list(folder.iterdir())) == accepted


@posix
@pytest.mark.parametrize("rights, accepted", [(0o755, True), (0o1777, True), (0o777, False), (0o775, False)])
def test_others_may_not_exchange_a_folder_on_the_way(folder, rights, accepted):
    folder.mkdir(parents=True, mode=0o700)
    to_another_group(folder.parent)
    folder.parent.chmod(rights)
    assert is_kept(folder) == accepted and len(store.complaints) == (not accepted)
    if not accepted:
        folder.rmdir()
        assert not is_kept(folder) and not folder.exists()  # nor is it made there


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
    assert is_kept(folder) == accepted


@posix
@pytest.mark.parametrize("open_to_others", ["folder", "file", "link", "owner"])
def test_planted_code_is_not_run(folder, tmp_path, monkeypatch, open_to_others):
    assert is_kept(folder)
    (file,) = files(folder)
    plant(file)
    if open_to_others == "link":
        file.rename(tmp_path / "elsewhere")
        file.symlink_to(tmp_path / "elsewhere")
    elif open_to_others == "owner":
        owner = os.geteuid()
        monkeypatch.setattr(os, "geteuid", lambda: owner + 1)
    else:
        {"folder": folder, "file": file}[open_to_others].chmod(0o777)
    assert asked() == 3.0 and len(store.complaints) == 1


# what goes wrong


@pytest.mark.parametrize("content", [b"", b"junk", b"\0" * 40, "cut", "turned"])
def test_a_damaged_file_is_written_anew(folder, content):
    assert is_kept(folder)
    (file,) = files(folder)
    whole = file.read_bytes()
    if content == "cut":
        content = whole[:-10]
    elif content == "turned":
        content = whole[:200] + bytes([whole[200] ^ 1]) + whole[201:]
    file.write_bytes(content)
    assert asked() == 3.0 and file.read_bytes() == whole


def test_a_disk_that_is_full_on_the_way_leaves_nothing_behind(folder, monkeypatch):
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    made = store.tempfile.NamedTemporaryFile

    def full(*arguments, **named):
        file = made(*arguments, **named)
        os.dup2(os.open("/dev/full", os.O_WRONLY), file.fileno())
        return file

    monkeypatch.setattr(store.tempfile, "NamedTemporaryFile", full)
    assert asked() == 3.0 and files(folder) == [] and list(folder.iterdir()) == []


def test_a_folder_that_cannot_be_made_or_written_only_costs_time(tmp_path, monkeypatch, folder):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("TMT_CACHE", str(tmp_path / "file" / "cache"))
    assert asked() == 3.0 and store.complaints == []
    read_only = tmp_path / "read_only"
    read_only.mkdir(mode=0o500)
    monkeypatch.setenv("TMT_CACHE", str(read_only))
    assert is_kept(read_only) == os.access(read_only, os.W_OK)  # whoever is root writes there all the same


def test_leftovers_of_killed_writers_go(folder):
    asked()
    kept = {}
    for age in (store.ABANDONED + 60.0, store.ABANDONED - 60.0):
        path = folder / f"tmp{age:.0f}.new"
        path.write_text("")
        os.utime(path, (time.time() - age,) * 2)
        kept[path] = age < store.ABANDONED
    asked("another")
    assert {path: path.exists() for path in kept} == kept


# other processes

PROGRAM = """
import sys, numpy as np, tmt
from tmt.compiled import machine, store
kinds, compile_one = [], machine.object_code
def count(text):
    kinds.append(len(text))
    return compile_one(text)
store.object_code = machine.object_code = count
q = np.linspace(-1.0, 1.0, 2700).reshape(900, 3)
energy = tmt.potential_energy(q)
print(len(kinds), energy.tobytes().hex()[-99:], ascii(store.complaints))
"""


def start(folder, cwd, **settings):
    """PROGRAM in a process of its own, where Python takes every text for ASCII."""
    environment = {name: os.environ[name] for name in ("PATH", "SYSTEMROOT") if name in os.environ}
    environment |= {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONDONTWRITEBYTECODE": "1"}
    environment |= {"PYTHONPATH": str(ROOT), "TMT_CACHE": str(folder)} | settings
    return subprocess.Popen([sys.executable, "-c", PROGRAM], env=environment, cwd=cwd, stdout=-1, stderr=-1, text=True)


def test_processes_share_what_they_compile(tmp_path):
    """Two at once from nothing, then one that finds all; in any path, and nothing is left elsewhere."""
    elsewhere, home = tmp_path / "elsewhere", tmp_path / "home"
    folder = tmp_path / "Zwischenlager für Übersetztes"
    for path in (elsewhere, home):
        path.mkdir()
    first = [start(folder, elsewhere, HOME=str(home)) for _ in range(2)]
    found = [process.communicate() for process in first]
    found.append(start(folder, elsewhere, HOME=str(home)).communicate())
    assert all(errors == "" for _, errors in found), found
    counts, *results = zip(*(output.split() for output, _ in found))
    assert all(len({*one}) == 1 for one in results) and results[-1][0] == "[]"
    assert 1 <= int(counts[0]) <= 2 and counts[2] == "0" and len(files(folder)) == 1
    assert not list(elsewhere.iterdir()) and not list(home.iterdir()) and not list(folder.glob("*.new"))


@posix
def test_a_refusal_is_one_line_on_stderr(folder, tmp_path):
    folder.mkdir(parents=True)
    folder.chmod(0o777)
    program = "from tmt import ARM; from tmt.compiled import evaluator; [evaluator(ARM, 'energy').alone for _ in 'ab']"
    run = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0 and run.stdout == ""
    (line,) = run.stderr.splitlines()
    assert line.startswith(f"{folder} can be written by others (mode 0777): ")
