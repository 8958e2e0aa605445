"""Parameters of a robot's file: stated beside compiled, what an option changed, the inventory, and what is switched off."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from models import PATHS

from compare.engines.mujoco import engine, read
from compare.engines.mujoco.stated import Stated
from compare.experiments import parameters
from compare.experiments.parameters.file import changes_in_words, compare_number, tolerance_of, treatments_in_words
from compare.judge.check import Result
from compare.judge.scale import EPS
from compare.robots.file import robot_of
from compare.setup import Setup, engines

TOTAL = """
<mujoco><compiler settotalmass="3"/><worldbody>
  <body name="arm"><joint name="turn"/><inertial pos="0.1 0 0" mass="1" diaginertia="0.1 0.2 0.25"/></body>
  <body name="rod"><joint name="lift" type="slide" damping="2"/><geom size="0.1" mass="0.5"/></body>
</worldbody></mujoco>"""


def result_of(source):
    """The result of a small run on a file."""
    reading = read(source)
    robot = robot_of(reading, "robot.xml")
    return parameters.rows(Setup.small(robot, engines(engine(reading)), reading=reading))


@pytest.mark.parametrize("name", PATHS)
def test_the_models_are_as_their_files_state_and_nothing_more_acts(name):
    result = result_of(PATHS[name])
    assert result.checks and all(check.passed for check in result.checks)
    assert result.curves["causes"] == []
    features = [row["feature"] for row in result.tables["inventory"]]
    assert features == [feature.feature for feature in read(PATHS[name]).features]
    columns = {"of", "quantity", "component", "stated", "compiled", "difference", "unit", "asked_by"}
    assert {key for row in result.rows for key in row} == columns
    forces = [check.quantity for check in result.checks if check.scene == "random states"]
    assert forces == [f"no forces of {what}" for what in ("fluid and tendons", "actuators", "constraints and contacts")]


def test_numbers_that_an_option_changes_are_no_checks_and_are_said():
    result = result_of(TOTAL)
    assert all(check.passed for check in result.checks)
    assert not [check for check in result.checks if check.quantity in ("mass", "inertia")]
    asked = {(row["of"], row["quantity"]): row["asked_by"] for row in result.rows if row["of"] != "file"}
    assert asked["arm", "mass"] == asked["rod", "mass"] == asked["arm", "inertia"] == "settotalmass"
    assert asked["rod", "com"] == "inertia from geoms" and asked["lift", "damping"] == ""
    said = next(note for note in result.notes if note.startswith("By settotalmass the compiler sets "))
    assert "mass of 2 bodies (most: arm, 1 to 2 kg)" in said and "inertia of 1 body (most: arm, by 0.25 kg m2)" in said
    units = {(row["of"], row["quantity"]): row["unit"] for row in result.rows}
    assert units["lift", "damping"] == "N s/m" and units["turn", "damping"] == "N m s/rad"


@pytest.mark.parametrize("source", [TOTAL, *PATHS.values()], ids=["total", *PATHS])
def test_a_number_that_is_not_the_stated_one_has_what_asked_for_it(source):
    rows = [row for row in result_of(source).rows if row["of"] != "file"]
    assert rows and all(isinstance(row["asked_by"], str) for row in rows)
    changed = [
        row for row in rows if row["stated"] is None or abs(row["difference"]) > 1e-5 * max(1, abs(row["stated"]))
    ]
    assert all(row["asked_by"] for row in changed) and (source is not TOTAL or changed)


def test_a_number_that_differs_for_no_reason_is_a_failed_check_and_a_cause():
    result = Result("parameters")
    number = Stated("arm", "mass", 2.0, 2.5, "")
    (cause,) = compare_number(result, number, "kg")
    assert cause["text"] == "mass of arm: the file states 2 kg, compiled 2.5 kg"
    assert (cause["rank"], cause["place"], cause["stated"], cause["found"]) == (2, "mass of arm", 2.0, 2.5)
    assert [check.passed for check in result.checks] == [False]
    vector = Stated("arm", "com", np.zeros(3), np.array([0.0, 1e-30, np.nan]), "")
    assert [cause["place"] for cause in compare_number(result, vector, "m")] == ["com y of arm", "com z of arm"]
    assert not result.checks[-1].passed


@pytest.mark.parametrize("quantity, stated, scale", [
    ("mass", 2.0, 2.0), ("com", np.array([0.0, -3.0, 1.0]), 3.0), ("inertia", np.diag([1.0, 2.0, 2.5]), 5.5),
])  # fmt: skip
def test_a_number_may_be_off_by_64_eps_of_its_scale(quantity, stated, scale):
    for share, passes in ((0.9, True), (1.1, False)):
        number = Stated("arm", quantity, stated, stated + share * 64 * EPS * scale, "")
        assert tolerance_of(number) == pytest.approx(64 * EPS * scale)
        result = Result("parameters")
        causes = compare_number(result, number, "")
        assert (result.checks[0].passed, not causes) == (passes, passes)


def test_a_force_of_what_is_switched_off_is_a_failed_check():
    reading = read(PATHS["arm6"])
    robot, mujoco = robot_of(reading, "robot.xml"), engine(reading)
    mujoco.bare, mujoco.model = False, reading.full_model  # as the file has it
    result = parameters.rows(Setup.small(robot, engines(mujoco), reading=reading))
    failed = [check.quantity for check in result.checks if not check.passed]
    assert "no forces of constraints and contacts" in failed


def test_what_is_switched_off_is_said_with_its_reason():
    known = {"count": 2, "names": ("a", "b")}
    features = [
        SimpleNamespace(feature="hinge", treatment="modelled", reason="", **known),
        SimpleNamespace(feature="limit", treatment="switched_off", reason="there are none", **known),
        SimpleNamespace(feature="equality", treatment="open_tree", reason="", **known),
    ]
    assert treatments_in_words(features) == [
        "Modelled: hinge (2).", "Switched off in MuJoCo for the comparison: limit (2), there are none.",
        "The open tree is compared: the equalities a and b are off.",
    ]  # fmt: skip
    assert treatments_in_words(features[:1]) == ["Modelled: hinge (2)."]
    assert changes_in_words([]) == []


def test_the_claim_is_that_of_a_file_and_the_arm_keeps_its_own():
    robot = robot_of(read(PATHS["loop"]), "loop.xml")
    stated = replace(robot, features=())
    assert "the file states" in parameters.claim(robot) and "the file states" not in parameters.claim(stated)
    assert "principal moments" in parameters.tolerance(robot) and "principal moments" not in parameters.tolerance(
        stated
    )
