"""Other engines in whole runs: one that errs fails, and alone; which take part."""

import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from compare import experiments
from compare.core.finding import Finding
from compare.core.text import say
from compare.engines.outside import Outside
from compare.robots.arm import ARM
from compare.run import examine
from compare.run.reference import compared_with

ROOT = Path(__file__).resolve().parents[2]
TWO_LINKS = """<mujoco><worldbody><body><joint name="hip" axis="0 1 0" armature="0.01" damping="0.1"/>
<inertial pos="0.1 0 -0.5" mass="1" diaginertia="0.1 0.1 0.01"/><body pos="0 0 -1"><joint name="knee" axis="1 0 0"/>
<inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.01"/></body></body></worldbody></mujoco>"""
AGAIN = '''"""tmt in a process of its own, which reads the file by MuJoCo."""

import dataclasses

import tmt

from .outside.bodies import OF_JOINTS, links_of, numbers_of
from .outside.model import ReadModel
from .outside.order import Order

METHODS = {{}}


class Model(ReadModel):
    def __init__(self, file, precision):
        from .mujoco import read

        self.file, tree = file, read(file.path).tree
        self.order = Order(file, {{0: (0, 0), 1: (1, 1)}})
        self.tree = dataclasses.replace(tree, {wrong})
        self.used = {{name: numbers_of(self.tree)[name] for name in OF_JOINTS if name != "{untold}"}}

    def links(self, at):
        return links_of(self.tree, at.x)

    def set(self, name, values):
        if name == "gravity":
            self.used["gravity"] = values
            self.tree = dataclasses.replace(self.tree, gravity=values)

    def dynamics(self, at, force):
        undamped = dataclasses.replace(self.tree, damping=[0.0] * len(force))
        M, h = tmt.mass_matrix(self.tree, at.x), tmt.bias(self.tree, at.x, at.u)
        return M, h, tmt.acceleration(undamped, at.x, at.u, force)
'''
RIGHT = {"label": "Right", "precision": "float64", "wrong": "", "untold": ""}
ENGINES = {
    "again": {}, "heavy": {"label": "Heavy", "wrong": "mass=[1.0, 1.001]"},
    "upside": {"label": "Upside", "wrong": "gravity=(0.0, 0.0, 9.81)"},
    "bare": {"label": "Bare", "wrong": "armature=[0.0, 0.0]", "untold": "armature"},
    "blind": {"label": "Blind", "wrong": "**{}[0]"},
    "slow": {"label": "Slow", "wrong": "mass=__import__('time').sleep(60.0)"},
}  # fmt: skip
ASKED = """import numpy as np
from compare.engines import outside
from compare.run.reference import compared_with

if __name__ == "__main__":  # processes of engines begin with this file
    case, q = compared_with("model", "robot.xml").robot.case(), np.array([[0.3, 0.4]])
    dies, other = (outside.Outside(name).of(case) for name in ("mortal", "again"))
    readings = set()  # by the seconds that they took
    for _ in range(2):
        readings.add(other.ask(outside.answers.reading).seconds)
        print(dies.bias(q, q).shape, other.mass_matrix(q).shape, len(readings))
        try:
            dies.mass_matrix(q)
        except outside.EngineError as error:
            print(error)
"""


def listed(root, line):
    """Add a line after the list of engines of a copy."""
    file = root / "compare/engines/__init__.py"
    before, after = file.read_text().split("\nLABELS = ")
    file.write_text(f"{before}\n{line}\nLABELS = {after}")


def add_engine(root, name, text=AGAIN, **more):
    about = RIGHT | more
    (root / "compare/engines" / f"{name}.py").write_text(text.format(**about))
    record = f"EngineRecord({about['label']!r}, reads_file=True, precision={about['precision']!r}, compiles={name == 'slow'})"
    listed(root, f"RECORDS[{name!r}] = {record}")


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The report of a copy of the package with these engines, and what it prints; its exit status is 1."""
    root = tmp_path_factory.mktemp("copy")
    for name in ("compare", "mjcf", "tmt"):
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    listed(root, "RECORDS = {name: record for name, record in RECORDS.items() if not record.reads_file}")
    for name, of in ENGINES.items():  # what is installed here does not count
        add_engine(root, name, **of)
    answers = root / "compare/engines/outside/answers.py"
    answers.write_text(answers.read_text().replace("LIMIT = 120.0", "LIMIT = 6.0"))
    (root / "robot.xml").write_text(TWO_LINKS)
    run = subprocess.run(
        [sys.executable, "-m", "compare", "engines", "--quick", "--mjcf", "robot.xml", "--out", "report"], cwd=root,
        env=os.environ | {"PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"}, capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 1, run.stdout + run.stderr
    return root / "report", run.stdout


def table(folder, name):
    return list(csv.DictReader((folder / "tables" / f"{name}.csv").read_text().splitlines()))


def test_each_seeded_error_fails_its_own_checks_and_no_others(report):
    checks = json.loads((report[0] / "results.json").read_text())["checks"]
    failed = {}
    for check in checks:
        if not check["passed"]:
            assert check["scene"], check
            failed.setdefault(check["scene"].split()[0].rstrip(","), set()).add(check["quantity"])
    assert "Right" not in failed and "Upside" not in failed
    assert failed["Heavy"] == {"mass as read", "Mbar to exact", "bias to exact", "qdd to exact"}
    assert {"Mbar to exact", "qdd to exact"} <= failed["Bare"] and "bias to exact" not in failed["Bare"]


def test_what_is_read_differently_is_a_row_and_says_whether_it_was_set(report):
    rows = {(row["engine"], row["number"], row["of"]): row for row in table(report[0], "engines_read")}
    assert rows["Upside", "gravity", "z"]["set_by_this_program"] == "true"
    (heavy,) = (row for (engine, number, _), row in rows.items() if (engine, number) == ("Heavy", "mass"))
    numbers = float(heavy["read"]), float(heavy["compared"]), heavy["set_by_this_program"]
    assert numbers == (1.001, 1.0, "false")
    assert ("Blind", "", "") in rows and rows["Blind", "", ""]["why_not"]  # it cannot read the file
    assert {engine for engine, *_ in rows} == {"Upside", "Heavy", "Blind", "Slow"}


def test_one_that_is_not_judged_is_not_said_to_compute_what_mujoco_does(report):
    """Gravity can be set, a mass cannot."""
    rows = {row["engine"]: row for row in table(report[0], "engines_answer")}
    same = [name for name, row in rows.items() if row["equations"].startswith("the same ")]
    assert sorted(same) == ["Right", "Upside"] and "M[" in rows["Heavy"]["equations"]
    assert "no answer within 6 s" in rows["Slow"]["reads_the_file"]
    (first,) = [line for line in report[1].splitlines() if line.startswith("robot.xml: ")]
    same = {*first.split(" compute")[0].replace(",", " ").split()}
    assert "Right" in same and not {"Heavy", "Upside", "Blind", "Slow"} & same
    assert "Heavy" in first.split(" do not")[0] and "Blind and Slow: not judged" in first


def test_what_one_engine_has_found_is_told_before_the_next_one_is_asked(report):
    """Slow compiles, comes last, and says nothing for 6 s; what it has found is said with the answer alone."""
    assert report[1].index("Heavy reads") < report[1].index("robot.xml: ") and "Slow reads" not in report[1]


def test_a_process_that_ends_is_that_of_its_own_engine_alone_and_the_next_reads_again(report):
    root, ends = report[0].parent, "tmt.mass_matrix(*_) if at.u.any() else __import__('os')._exit(3)"
    mortal = AGAIN.replace("tmt.mass_matrix(self.tree, at.x)", ends.replace("*_", "self.tree, at.x"))
    add_engine(root, "mortal", mortal)
    (root / "asked.py").write_text(ASKED)
    command, environment = [sys.executable, "asked.py"], os.environ | {"PYTHONPATH": str(root)}
    run = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True)
    assert run.stdout.splitlines() == ["(1, 2) (1, 2, 2) 1", "its process was killed"] * 2, run.stderr


def test_engines_are_chosen_by_their_names():
    def chosen(names):
        options = SimpleNamespace(quick=True, get={"engines": names}.get)
        return examine.setup_of(compared_with("arm", None), options).engines

    named = chosen("drake,mjx")
    assert {"drake", "mjx", "mujoco", "tmt"} <= named.keys() and not {"mjx_float32", "newton"} & named.keys()


def test_without_another_engine_there_is_nothing_to_answer(monkeypatch):
    monkeypatch.setattr(Outside, "unavailable", lambda engine: "not installed")
    assert experiments.skipped("engines", ARM, "mujoco,drake").kind == "none_installed"
    assert experiments.skipped("engines", ARM, "mujoco,tmt").kind == "none_chosen"


def test_an_engine_that_is_asked_for_and_not_installed_is_named_in_the_answer():
    about = {"name": "a.xml", "verdicts": {}, "absent": {"it is not installed": ["Drake"]}, "rows": []}
    assert "Drake not asked (it is not installed)" in say(Finding("engines", "answer", about))
