"""Compiled functions of tmt itself: their machine code is kept in the cache folder, and run only if it is the user's own."""

import importlib
import inspect
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from cache_folder import Planted, new_folder, posix, ran  # noqa: F401 (the fixture `folder`)

from tmt import cache, eight, inlined, loop_joints, loop_runs, loops, sine
from tmt.equations import composite
from tmt.equations import vectors as space
from tmt.machine_code import compiled, sources
from tmt.model import coordinates

ROOT = Path(__file__).resolve().parent.parent
# one of the loops for any tree, the one that is compiled fastest: whether it was read from the folder, and its result
PROGRAM = """
import numpy as np
from tmt import cache, loop_states
quaternion = np.array([0.0, 3.0, 0.0, 4.0])
loop_states.normalize(quaternion, 0)
print(sum(loop_states.normalize.stats.cache_hits.values()), quaternion.tolist(), cache.complaints)
"""
RESULT = "[0.0, 0.6, 0.0, 0.8] []\n"


def double(x):
    return 2.0 * x


def kept(folder) -> list[Path]:
    """The files with machine code of `double`."""
    return sorted(folder.glob("__pycache__/test_machine_code.double-*"))


def start(project, cwd, **settings):
    """PROGRAM in a process of its own."""
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment |= {"PYTHONPATH": str(project), "PYTHONDONTWRITEBYTECODE": "1"} | settings
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM], env=environment, cwd=cwd, stdout=-1, stderr=-1, encoding="utf-8"
    )


def test_machine_code_goes_to_the_cache_folder_and_is_read_there(folder):
    first, again = compiled(double), compiled(double)
    assert first(1.5) == again(1.5) == 3.0
    assert not first.stats.cache_hits and sum(again.stats.cache_hits.values()) == 1
    assert [path.suffix for path in kept(folder)] == [".nbc", ".nbi"] and cache.complaints == []


def test_nothing_is_written_beside_the_source_or_in_the_current_directory(tmp_path):
    """A package folder that cannot be written, and a home folder in which nothing is to be left."""
    project, elsewhere, home = (tmp_path / name for name in ("project", "elsewhere", "home"))
    shutil.copytree(ROOT / "tmt", project / "tmt", ignore=shutil.ignore_patterns("__pycache__"))
    for path in (elsewhere, home):
        path.mkdir()
    before = sorted(project.rglob("*"))
    for path in (*before, project, home):
        path.chmod(0o555 if path.is_dir() else 0o444)
    settings = {"HOME": str(home), "XDG_CACHE_HOME": "", "TMT_CACHE": str(tmp_path / "cache")}
    for hits in (0, 1):
        process = start(project, elsewhere, **settings)
        output, errors = process.communicate()
        assert (output, errors, process.returncode) == (f"{hits} {RESULT}", "", 0)
    assert sorted(project.rglob("*")) == before and not list(elsewhere.iterdir()) and not list(home.iterdir())
    for path in (home, project, *before):  # so that it can be removed
        path.chmod(0o755)


def test_processes_that_compile_at_once_do_not_disturb_each_other(tmp_path):
    processes = [start(ROOT, tmp_path, TMT_CACHE=str(tmp_path / "cache")) for _ in range(3)]
    for process in processes:
        output, errors = process.communicate()
        assert output.endswith(RESULT) and (errors, process.returncode) == ("", 0)
    assert start(ROOT, tmp_path, TMT_CACHE=str(tmp_path / "cache")).communicate() == (f"1 {RESULT}", "")


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
@pytest.mark.parametrize("junk", [b"", b"junk"])
def test_damaged_machine_code_is_compiled_anew(folder, suffix, junk):
    compiled(double)(1.5)
    (damaged,) = (path for path in kept(folder) if path.suffix == f".{suffix}")
    damaged.write_bytes(junk)
    assert compiled(double)(1.5) == 3.0
    again = compiled(double)
    assert again(1.5) == 3.0 and sum(again.stats.cache_hits.values()) == 1


def test_another_source_is_compiled_anew(folder, tmp_path, monkeypatch):
    """A number that the function takes from its module is not in its own code."""
    source = tmp_path / "scaled.py"
    monkeypatch.syspath_prepend(tmp_path)
    for factor in (2.0, 30.0):
        source.write_text(f"FACTOR = {factor}\n\n\ndef scaled(x):\n    return FACTOR * x\n")
        importlib.invalidate_caches()
        sys.modules.pop("scaled", None)
        assert compiled(importlib.import_module("scaled").scaled)(1.5) == 1.5 * factor


def test_another_source_of_what_is_called_is_compiled_anew(folder, tmp_path, monkeypatch):
    """The machine code of a function has in it that of the functions of other modules that it calls, and their numbers."""
    sources = {
        "factors": "FACTOR = {}\n",
        "inner": "from factors import FACTOR\nfrom tmt.machine_code import compiled\n\n\n"
        "@compiled\ndef scaled(x):\n    return FACTOR * x\n",
        "outer": "from inner import scaled\n\n\ndef twice(x):\n    return 2.0 * scaled(x)\n",
    }
    monkeypatch.syspath_prepend(tmp_path)
    for factor in (2.0, 30.0):
        for name, source in sources.items():
            (tmp_path / f"{name}.py").write_text(source.format(factor))
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        assert compiled(importlib.import_module("outer").twice)(1.5) == 3.0 * factor


WAYS = ["nothing", "folder", "machine code", "its folder", "link", "owner"]


@posix
@pytest.mark.parametrize("open_to_others", WAYS)
def test_planted_code_is_not_run(folder, tmp_path, monkeypatch, open_to_others):
    compiled(double)(1.5)
    index = kept(folder)[1]
    index.write_bytes(pickle.dumps(Planted()))
    index.parent.chmod(0o755)
    if open_to_others == "link":
        index.rename(tmp_path / "elsewhere")
        index.symlink_to(tmp_path / "elsewhere")
    elif open_to_others == "owner":
        owner = os.geteuid()
        monkeypatch.setattr(os, "geteuid", lambda: owner + 1)
    elif open_to_others != "nothing":
        {"folder": folder, "machine code": index, "its folder": index.parent}[open_to_others].chmod(0o777)
    assert compiled(double)(1.5) == 3.0
    if open_to_others == "nothing":  # what is the user's own is run: else this test would show nothing
        assert set(ran) == {"planted"} and cache.complaints == []
    else:
        assert ran == [] and len(cache.complaints) == 1


@posix
def test_a_folder_of_numba_is_not_looked_at(folder, tmp_path, monkeypatch):
    compiled(double)(1.5)
    numbas = tmp_path / "numba"
    shutil.copytree(folder / "__pycache__", numbas)
    for index in numbas.glob("*.nbi"):
        index.write_bytes(pickle.dumps(Planted()))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(numbas))
    assert compiled(double)(1.5) == 3.0 and ran == [] and len(list(numbas.iterdir())) == 2


def test_a_folder_that_cannot_be_used_only_costs_time(tmp_path, folder, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("TMT_CACHE", str(tmp_path / "file" / "cache"))
    assert compiled(double)(1.5) == 3.0 and cache.complaints == []
    monkeypatch.setenv("TMT_CACHE", str(folder))
    function = compiled(double)
    shutil.rmtree(folder)
    assert function(1.5) == 3.0 and not folder.exists()


def test_the_loops_are_compiled_anew_where_what_is_written_in_them_changes():
    """Plain functions of other files are written in the place of their calls: all of these are in the loops' machine code."""
    found = sources(loop_runs)
    for module in (loop_runs, loops, loop_joints, inlined, eight, space, coordinates, composite, sine):
        assert inspect.getsource(module) in found, module
    assert inspect.getsource(cache) not in found
