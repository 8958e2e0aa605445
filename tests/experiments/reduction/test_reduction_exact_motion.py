"""Swings and small oscillations: both engines meet what is known exactly, another model does not, and what is left out."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from trees import mjcf

import tmt
from compare import experiment
from compare.engines.mujoco import parse
from compare.experiments.reduction import exact_motion
from compare.judge.check import Result
from compare.robots import Robot
from compare.robots.arm import ARM

XML = ARM.mjcf.read_text(encoding="utf-8")


def section() -> Result:
    return Result("reduction", curves={"apart": {}, "swings": {}})


def test_both_engines_meet_the_elliptic_function_and_a_heavier_arm_does_not(mujoco):
    def failed(engine):
        result = section()
        exact_motion.swings(result, experiment.Setup.small(ARM, experiment.engines(engine)), ARM.cases)
        assert len(result.checks) == 5
        return [check.scene for check in result.checks if not check.passed]

    assert failed(mujoco) == []
    heavier = parse(XML.replace('mass="1.5"', 'mass="1.50001"'), ARM.tree)
    assert failed(heavier) == ["elbow swing, RK4, MuJoCo"]  # Euler's error hides it


@pytest.mark.parametrize(
    "scene, says",
    [
        ({"posture": "zero", "speed": (0, 0, 2000)}, "it turns over"),
        ({"posture": (0, 0, 89)}, "it moves by 3.5e-02 rad only"),
        ({"posture": "zero", "dt": 5 / 2**14}, "its 16384 steps are so fine that rounding hides the order"),
        ({"posture": (90, 90, 0)}, "it moves by"),  # the forearm turns about a vertical
        ({"posture": "zero", "damping": 0.1}, None),
        ({"posture": "zero", "torque": (0, 0, 1)}, None),
        ({"posture": "zero", "gravity": False}, None),
    ],
)
def test_a_pendulum_that_shows_nothing_is_left_out_with_the_reason(engines, scene, says):
    result = section()
    case = ARM.case("mine", **{"locked": ("alpha", "beta")} | scene)
    exact_motion.swings(result, experiment.Setup.small(ARM, engines), [case])
    assert result.checks == [] and result.curves["swings"] == {}
    expected = [] if says is None else [f"mine: not compared with an elliptic function, for {says}"]
    assert len(result.notes) == len(expected) and all(map(str.startswith, result.notes, expected))


@pytest.mark.parametrize("start, order", [(90, 2), (90.5, None), (60, 1)])
def test_the_error_of_euler_has_order_2_where_a_swing_begins_without_force_and_none_where_there_is_little(
    engines, start, order
):
    result = section()
    case = ARM.case("mine", locked=("alpha", "beta"), posture=(0, 0, start), speed=(0, 0, 100))
    exact_motion.swings(result, experiment.Setup.small(ARM, engines), [case])
    assert result.curves["swings"]["mine"]["stated"] == {"RK4": 4, "Euler": order}
    assert all(check.passed for check in result.checks) and len(result.checks) == (5 if order else 3)
    assert sum("has no order" in note for note in result.notes) == (0 if order else 2)


# small oscillations


def oscillations(robot, engine=None) -> Result:
    """What is found of a robot with the engine of its own numbers, or a given one."""
    result, engine = section(), engine or parse(mjcf(robot.tree), robot.tree)
    few = exact_motion.AMPLITUDES[-2:], exact_motion.LESS_FINE
    exact_motion.small_oscillations(result, experiment.Setup.small(robot, experiment.engines(engine)), *few)
    return result


def another(tree, **postures) -> Robot:
    return Robot("double", Path("none.xml"), tree, postures, ())


CHAIN = dataclasses.replace(  # hangs straight down; the same on either side
    tmt.ARM, axis=((1, 0, 0), (0, 1, 0), (0, 1, 0)), com=((0, 0, -0.15), (0, 0, -0.1)), hinge_names=("a", "b", "c")
)
SKEW = dataclasses.replace(CHAIN, axis=((1, 0, 0), (0, 0.6, 0.8), (0, 1, 0)))


def test_the_equilibrium_is_the_lowest_that_is_stable():
    assert exact_motion.equilibrium(ARM) == "hanging"
    down, up = (0, 0, 0), (180, 0, 0)
    assert exact_motion.equilibrium(another(CHAIN, up=up, bent=(0, 20, 0), down=down)) == "down"
    assert exact_motion.equilibrium(another(CHAIN, up=up, bent=(0, 20, 0))) is None
    cross = dataclasses.replace(
        CHAIN, body_hinge=(0, 2)
    )  # with the first body up the others may hang too, stable but higher
    assert exact_motion.equilibrium(another(cross, flipped=(180, 180, 0), down=down)) == "down"
    assert exact_motion.equilibrium(another(cross, flipped=(180, 180, 0), up=up)) == "flipped"
    assert exact_motion.equilibrium(another(dataclasses.replace(CHAIN, damping=(0, 0.1, 0)), down=down)) is None
    assert exact_motion.equilibrium(another(dataclasses.replace(CHAIN, gravity=(0, 0, 0)), down=down)) is None


def test_a_robot_without_one_says_why():
    for tree, says in (
        (CHAIN, "no named posture is stable"),
        (dataclasses.replace(CHAIN, damping=(0, 0.1, 0)), "damping"),
    ):
        result = oscillations(another(tree, up=(180, 0, 0)))
        assert result.checks == [] and "small" not in result.curves
        assert (
            result.notes[0].startswith("Small oscillations of the double are not compared") and says in result.notes[0]
        )


def test_a_motion_is_mirrored_or_half_the_difference_of_two_is_taken():
    assert exact_motion.odd(ARM.tree, ARM.posture("hanging")) and exact_motion.odd(CHAIN, np.zeros(3))
    assert not exact_motion.odd(SKEW, np.zeros(3)) and not exact_motion.odd(ARM.tree, ARM.posture("bent"))
    for tree, sides in ((CHAIN, 1), (SKEW, 2)):
        result = oscillations(another(tree, down=(0, 0, 0)))
        assert [check.passed for check in result.checks] == [True, True], result.checks
        assert {check.scene for check in result.checks} == {"down, TMT", "down, MuJoCo"}
        assert result.curves["small"]["sides"] == sides and result.notes[0].startswith(
            "About down the linear modes have"
        )
        assert result.curves["small"]["duration"] <= 5.0


def test_a_wrong_frequency_is_no_linear_mode():
    heavier = parse(mjcf(dataclasses.replace(SKEW, mass=(1.9, 1.6))), SKEW)
    result = oscillations(another(SKEW, down=(0, 0, 0)), heavier)
    assert [check.scene for check in result.checks if not check.passed] == ["down, MuJoCo"]
