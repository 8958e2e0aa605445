"""What is judged of another engine: its equations, the numbers that it has read, their causes, its runs."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from helpers.edited import setup_of
from helpers.trees import tree_of_kinds
from models import PATHS

from compare.core.check import About
from compare.core.text import say
from compare.engines import EngineRecord
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
from compare.run.reference import compared_with

RECORDS = {name: EngineRecord("Other", precision=name) for name in ("float64", "float32")}
OF_ALL = "mass", "inertia", "com", "axis", "gravity", "armature"
NAMES = {"mass_matrix": "Mbar", "bias": "bias", "acceleration": "qdd"}


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


def compare_read(result, robot, numbers, differing, not_set=()):
    """What is said of an engine that has read these numbers of a robot's file."""
    file = File(Path(robot.mjcf), robot.joints, robot.coordinates.all_kinds)
    reading = Reading(numbers, numbers_of(robot.tree), (), differing, not_set, 0.0)
    compare_numbers(result, robot, RECORDS["float64"], file, reading)


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
        compare_read(result, ARM, read, found)
        failed = [f"{number} as read"] * (differs and number in ("mass", "inertia"))
        assert [check.quantity for check in result.checks if not check.passed] == failed
        assert {row.number for row in result.tables["engines_read"]} == ({number} if differs else set())
        assert bool(result.answers["Other"]["reads"]["rows"]) == differs


class OfTree(ReadModel):
    """A Tree as an engine that tells where its bodies are."""

    def __init__(self, tree):
        self.tree, self.stated, self.used = tree, numbers_of(tree), {}
        self.file = File(Path(), tree.joint_names, tree.kind)
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
    said = say(result.finding("cell_runs", answer=result.answers["Other"]))
    assert not result.checks and "no tendons" in said
    result = empty()
    add_runs(result, setup_of(), RECORDS["float32"], Stepping([None]))  # it steps no model of MuJoCo's
    assert not result.checks and not result.notes


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
    compare_read(result, robot, numbers, (number,), (number,))
    rows = result.tables["engines_read"]
    assert rows and {row.cause for row in rows} == {cause}
    assert not any(row.set_by_this_program for row in rows)
    said = say(result.notes[0])
    assert f"Not set: {number}" in said and (cause or "No feature") in said


def test_numbers_of_a_slide_are_in_its_own_units():
    robot = compared_with("model", str(PATHS["gripper"])).robot
    units = {unit: [owner(robot, name, place)[1] for name in ("armature", "damping", "stiffness")]
             for place, unit in enumerate(robot.coordinates.units)}  # fmt: skip
    assert units["m"] == ["kg", "N s/m", "N/m"] and units.get("rad", ["kg m2"])[0] == "kg m2"
