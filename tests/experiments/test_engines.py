"""Other engines: what is found in what one has read, in its equations and in its runs; one that errs fails, and alone."""

import csv
import dataclasses
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.edited import setup_of
from helpers.trees import tree_of_kinds

from compare import engines, experiments
from compare.core.check import About
from compare.core.errors import Refused
from compare.core.text import say
from compare.engines import EngineRecord
from compare.engines.outside import Outside
from compare.engines.outside.as_it_runs import Difference, Run
from compare.engines.outside.bodies import (
    OF_JOINTS,
    Body,
    combined,
    differences,
    links_of,
    numbers_of,
    size_of,
)
from compare.engines.outside.file import EngineError, File
from compare.engines.outside.model import Reading, ReadModel
from compare.engines.outside.order import Order
from compare.engines.tmt import TmtDynamics
from compare.experiments.engines import EnginesResult, add_runs, compare_numbers, compare_quantities, is_same
from compare.experiments.engines.readings import owner
from compare.judge.entries import Entries
from compare.judge.scale import FACTOR
from compare.robots.arm import ARM
from compare.run import examine
from compare.run.reference import compared_with

ROOT = Path(__file__).resolve().parents[2]
INSTALLED = [name for name, record in engines.RECORDS.items() if record.reads_file]
RECORDS = {name: EngineRecord("Other", precision=name) for name in ("float64", "float32")}
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
OF_ALL = "mass", "inertia", "com", "axis", "gravity", "armature"
NAMES = {"mass_matrix": "Mbar", "bias": "bias", "acceleration": "qdd"}
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


def other(**functions):
    """tmt as another engine, with other functions."""
    dynamics = TmtDynamics(ARM.case())
    vars(dynamics).update(functions)
    return dynamics


def empty(label="Other"):
    tables = {f"engines_{name}": [] for name in ("answer", "read", "runs")}
    return EnginesResult("engines", tables=tables, answers={label: {}})


@pytest.mark.parametrize("precision", RECORDS)
@pytest.mark.parametrize("share, fails", [(0.9, False), (1.1, True)])
@pytest.mark.parametrize("quantity, name", NAMES.items())
def test_a_quantity_just_inside_and_just_outside_its_tolerance(quantity, name, precision, share, fails):
    """A float32 engine is allowed what its own eps allows, and no more."""
    record, right, result = RECORDS[precision], getattr(other(), quantity), empty()

    def wrong(*state):
        values, scale = right(*state), Entries(ARM.tree, *state[:2])
        size = getattr(scale, quantity)
        if quantity == "acceleration":
            size = scale.acceleration(scale.force(state[2]), values)
        return values + share * FACTOR * record.eps * size

    compare_quantities(result, setup_of(), record, other(**{quantity: wrong}))
    assert [check.quantity for check in result.checks if not check.passed] == [f"{name} to exact"] * fails
    assert all(check.about is About.ENGINE for check in result.checks)
    differ = result.answers["Other"]["equations"]["differ"]
    assert len(differ) == fails and all(entry.startswith(f"{name}[") for entry in differ)


@pytest.mark.parametrize("number", OF_ALL)
def test_a_number_as_read_just_inside_and_just_outside(number):
    """Masses and inertias are checked; another number is a row alone."""
    stated = numbers_of(ARM.tree)
    for off, differs in ((60.0, False), (70.0, True)):
        result, read = empty(), {name: stated[name].copy() for name in OF_ALL}
        eps, size = RECORDS["float64"].eps, size_of(stated, number)
        read[number][..., -1] += off * eps * size if size else 1.0 * differs  # the arm has no armature
        found = differences(read, stated, FACTOR * eps)
        assert found == (number,) * differs
        reading = Reading(read, stated, (), found, (), 0.0)
        file = File(Path(ARM.mjcf), ARM.joints, ARM.coordinates.all_kinds)
        compare_numbers(result, ARM, RECORDS["float64"], file, reading)
        failed = [f"{number} as read"] * (differs and number in ("mass", "inertia"))
        assert [check.quantity for check in result.checks if not check.passed] == failed
        assert {row.number for row in result.tables["engines_read"]} == ({number} if differs else set())
        assert bool(result.answers["Other"]["reads"]["rows"]) == differs


def test_a_process_that_ends_is_that_of_its_own_engine_alone_and_the_next_reads_again(report):
    root, ends = report[0].parent, "tmt.mass_matrix(*_) if at.u.any() else __import__('os')._exit(3)"
    mortal = AGAIN.replace("tmt.mass_matrix(self.tree, at.x)", ends.replace("*_", "self.tree, at.x"))
    add_engine(root, "mortal", mortal)
    (root / "asked.py").write_text(ASKED)
    command, environment = [sys.executable, "asked.py"], os.environ | {"PYTHONPATH": str(root)}
    run = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True)
    assert run.stdout.splitlines() == ["(1, 2) (1, 2, 2) 1", "its process was killed"] * 2, run.stderr


class OfTree(ReadModel):
    """A Tree as an engine that tells where its bodies are."""

    def __init__(self, tree):
        self.tree, self.stated, self.used = tree, numbers_of(tree), {}
        self.file = File(ROOT, tree.joint_names, tree.kind)
        joints = self.file.coordinates.places.joints
        self.order = Order(self.file, {k: (joint.q.start, joint.qd.start) for k, joint in enumerate(joints)})

    def links(self, at):
        return links_of(self.tree, at.x)

    dynamics = None


@pytest.mark.parametrize("number", ("axis", "offset", "mass"))
def test_axes_anchors_and_masses_are_those_by_which_the_bodies_move(number):
    """Of joints of all kinds; and with another axis, another place of a joint, another mass."""
    right = tree_of_kinds(np.random.default_rng(3))
    model = OfTree(right)
    for name, values in model.numbers().items():
        size = max(1.0, size_of(model.stated, name))
        assert np.abs(values - model.stated[name]).max() <= 1e-13 * size, name
    wrong = {"axis": np.roll(right.axis, 1, axis=1), "offset": np.add(right.offset, 0.1)}
    wrong["mass"] = np.multiply(right.mass, 2.0)
    model.tree = dataclasses.replace(right, **{number: wrong[number].tolist()})
    read = {"offset": "anchor"}.get(number, number)
    assert np.abs(model.numbers()[read] - model.stated[read]).max() > 1e-3


def test_bodies_that_move_as_one():
    """Two points of 1 kg at 1 m from each other: 2 kg, and moments 0, 1/2, 1/2 kg m2 about their centre."""
    mass, _, inertia = combined([Body(1.0, np.array([0.0, 0.0, z]), np.zeros((3, 3))) for z in (1.0, 2.0)])
    assert mass == 2.0 and np.linalg.eigvalsh(inertia) == pytest.approx([0.0, 0.5, 0.5])
    with_armature = dataclasses.replace(ARM.tree, armature=[0.1, 0.2, 0.3])
    assert numbers_of(with_armature)["armature"] == pytest.approx([0.1, 0.2, 0.3])


class Stepping:
    """An engine that steps MuJoCo's model, by what it has found: runs by their iterations, the file's own first."""

    def __init__(self, runs):
        self.runs, self.asked = runs, []

    def ask(self, act, iterations):
        self.asked.append(iterations)
        if isinstance(self.runs, Exception):
            raise self.runs
        if iterations is None:
            return self.runs[0]
        for run in self.runs:
            if run.iterations == iterations:
                return run
        raise EngineError("no answer")


def run(iterations, over):
    first = Difference(8, "qacc", "hip", 2.4) if over > 1.0 else None
    return Run(iterations, 50, {1: 1e-9, 10: 1e-7, 100: 5e-4}, first, {}, over, 1.0)


@pytest.mark.parametrize("runs, passes", (
    ([run(100, 0.99)], True), ([run(100, 1.01)], False), ([run(1, 9.0), run(2, 0.5)], True),
    ([run(1, 9.0), run(2, 9.0), run(4, 9.0), run(100, 9.0)], False), ([run(3, 9.0), run(4, 0.5)], True),
))  # fmt: skip
def test_a_field_that_more_iterations_make_the_same_is_no_error_of_the_engine(runs, passes):
    result = empty()
    add_runs(result, setup_of(), RECORDS["float32"], Stepping(runs))
    assert [check.passed for check in result.checks] == [passes] and result.checks[0].about is About.ENGINE
    rows = result.tables["engines_runs"]
    settings = [(one.iterations, k == 0) for k, one in enumerate(runs)]
    assert [(row.iterations, row.own_settings) for row in rows] == settings
    assert rows[0].apart_100 == 5e-4 and (rows[0].first_field == "qacc") == (runs[0].over > 1.0)
    answer = {"reads": {"rows": []}, "equations": {"differ": []}} | result.answers["Other"]
    assert is_same(answer) == passes
    said = say(result.finding("cell_runs", answer=answer))
    assert "0.0005 rad after 100 steps" in said and ("qacc" in said) == (runs[0].over > 1.0)


def test_where_compilation_is_slow_only_the_most_iterations_are_tried():
    stepping, result = Stepping([run(1, 9.0)._replace(seconds=99.0), run(100, 0.5)]), empty()
    add_runs(result, setup_of(), RECORDS["float32"], stepping)
    assert stepping.asked == [None, 100] and result.checks[0].passed


def test_an_engine_that_does_not_run_the_file_is_not_judged_by_it():
    result = empty()
    add_runs(result, setup_of(), RECORDS["float32"], Stepping(EngineError("no tendons")))
    assert not result.checks and "no tendons" in say(
        result.finding("cell_runs", answer=result.answers["Other"])
    )
    result = empty()
    add_runs(result, setup_of(), RECORDS["float32"], Stepping([None]))  # it steps no model of MuJoCo's
    assert not result.checks and not result.notes


def test_engines_are_chosen_by_their_names():
    def chosen(names):
        options = SimpleNamespace(quick=True, get={"engines": names}.get)
        return examine.setup_of(compared_with("arm", None), options).engines

    named = chosen("drake,mjx")
    assert {"drake", "mjx", "mujoco", "tmt"} <= named.keys() and not {"mjx_float32", "newton"} & named.keys()
    with pytest.raises(Refused, match="draek is not an engine that reads"):
        chosen("draek")


def test_without_another_engine_there_is_nothing_to_answer(monkeypatch):
    monkeypatch.setattr(Outside, "unavailable", lambda engine: "not installed")
    assert experiments.skipped("engines", ARM, "mujoco,drake").kind == "none_installed"
    assert experiments.skipped("engines", ARM, "mujoco,tmt").kind == "none_chosen"


TWO_HINGES = """<mujoco><option gravity="1 2 -3"/><worldbody><body name="a">
<joint name="hip" axis="0 1 0" damping="0.2"/>
<inertial pos="0 0 -0.3" mass="1" diaginertia="0.03 0.03 0.01"/><body name="b" pos="0 0 -1">
<joint name="knee" axis="0 1 0" damping="0.3"/>
<inertial pos="0 0 -0.3" mass="1" diaginertia="0.03 0.03 0.01"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize("number, read, cause", (
    ("gravity", (0.0, 0.0, -9.81), "gravity of <option>"), ("gravity", (1.0, 2.0, 3.0), None),
    ("damping", (0.0, 0.0), "damping of joints"), ("damping", (0.0, 0.3), None), ("damping", (0.1, 0.3), None),
))  # fmt: skip
def test_a_feature_is_a_cause_where_mujoco_has_the_engines_numbers_without_it(number, read, cause, tmp_path):
    """Not where another number that it changes was read as it is stated."""
    path = tmp_path / "robot.xml"
    path.write_text(TWO_HINGES)
    robot, result = compared_with("model", str(path)).robot, empty()
    stated = numbers_of(robot.tree)
    numbers = {name: stated[name] for name in OF_JOINTS} | {number: np.array(read)}
    reading = Reading(numbers, stated, (), (number,), (number,), 0.0)
    file = File(path, robot.joints, robot.coordinates.all_kinds)
    compare_numbers(result, robot, RECORDS["float64"], file, reading)
    rows = result.tables["engines_read"]
    assert (
        rows and {row.cause for row in rows} == {cause} and not any(row.set_by_this_program for row in rows)
    )
    said = say(result.notes[0])
    assert f"Not set: {number}" in said and (cause or "No feature") in said


def test_numbers_of_a_slide_are_in_its_own_units():
    robot = compared_with("model", str(ROOT / "tests/models/gripper.xml")).robot
    units = {unit: [owner(robot, name, place)[1] for name in ("armature", "damping", "stiffness")]
             for place, unit in enumerate(robot.coordinates.units)}  # fmt: skip
    assert units["m"] == ["kg", "N s/m", "N/m"] and units.get("rad", ["kg m2"])[0] == "kg m2"
