"""Files of what was computed: made for what is asked, and read the next time."""

import ctypes
import dataclasses
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import tmt
from tmt.compiled import store
from tmt.compiled.machine import object_code
from tmt.methods import METHODS

ROOT = Path(__file__).resolve().parents[2]
TEXT = "define double @f(double %x) {{\n  %y = fmul double %x, {}\n  ret double %y\n}}\n"


def asked(*what) -> float:
    """f(1.5) of the library of a source of f(x) = 2 x."""
    library = store.library(lambda: TEXT.format("2.0"), "double", *what)
    return library.function("f", ctypes.c_double, ctypes.c_double)(1.5)


def files(folder) -> list[Path]:
    return sorted(folder.glob("*.o"))


def plant(path):
    """Code of another function, f(x) = -7 x, signed as what is written here."""
    code = object_code(TEXT.format("-7.0"))
    path.write_bytes(store.digest(path, code) + code)


@pytest.mark.parametrize("part, other", [("OWN_SOURCES", "another"), ("versions", lambda: "another")])
def test_what_is_stored_is_read_the_next_time_by_the_same_version_on_the_same_processor(
    part, other, folder, monkeypatch
):
    assert asked() == 3.0
    (file,) = files(folder)
    plant(file)  # it is run: the file was read
    assert asked() == 1.5 * -7.0 and asked("another") == 3.0 and len(files(folder)) == 2
    monkeypatch.setattr(store, part, other)
    assert asked() == 3.0 and len(files(folder)) == 3


def test_each_question_has_a_file_of_its_own(folder):
    light, turned = (
        dataclasses.replace(tmt.ARM, **x) for x in ({"mass": (1, 1.5)}, {"gravity": (0, -0.0, -9.81)})
    )
    changed = dataclasses.replace(METHODS["rk4"], order=3)
    questions = [(), (1,), ("q",), (tmt.ARM,), (light,), (turned,)]
    questions += [(tmt.ARM, stepping, 1) for stepping in (*METHODS.values(), changed)]
    own = type("Own", (tmt.Tree,), {})(**vars(tmt.ARM))  # which may be another tomorrow
    assert all(asked(*question) == 3.0 for question in (*questions, *questions, (own,)))
    assert len(files(folder)) == len(questions)


@pytest.mark.parametrize("change, is_other", [("", False), ("file.write_text(file.read_text() + '#')", True)])
def test_a_source_that_changes_has_another_name_in_the_next_process(change, is_other, tmp_path):
    shutil.copytree(ROOT / "tmt", tmp_path / "tmt", ignore=shutil.ignore_patterns("__pycache__"))
    code = "import tmt; from tmt.compiled import sources; from pathlib import Path; "
    code += f"file = Path(tmt.__file__).parent / 'arm.py'; {change or 'pass'}; print(sources.OWN_SOURCES)"
    command = [sys.executable, "-c", code]
    first, second = (subprocess.check_output(command, cwd=tmp_path, text=True).strip() for _ in range(2))
    assert len(first) == len(second) == 64 and (first != second) is is_other


@pytest.mark.parametrize(
    "content", [lambda own: own[:-1], lambda own: own + b" ", lambda _: b"", lambda own: own[::-1]]
)
def test_a_file_that_is_not_what_was_written_is_written_anew(folder, content):
    """Cut off, longer, empty, another's; and one's own code for another question."""
    assert asked() == 3.0
    (file,) = files(folder)
    own = file.read_bytes()
    file.write_bytes(content(own))
    assert asked() == 3.0 and file.read_bytes() == own
    plant(folder / "another.o")
    (folder / "another.o").rename(file)
    assert asked() == 3.0 and file.read_bytes() == own


def test_a_full_disk_or_a_folder_that_cannot_be_made_only_costs_time(folder, monkeypatch):
    def full(*_):
        raise OSError("no space")

    monkeypatch.setattr(os, "replace", full)
    assert asked() == 3.0 and list(folder.iterdir()) == []
    (folder / "file").write_text("")
    monkeypatch.setenv("TMT_CACHE", str(folder / "file" / "cache"))
    assert asked() == 3.0
