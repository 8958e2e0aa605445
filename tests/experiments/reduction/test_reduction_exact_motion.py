"""Swings and small oscillations: both engines meet what is known exactly, another model does not, and what is left out."""

import dataclasses
from pathlib import Path

import pytest
from trees import mjcf

import tmt
from compare import experiment
from compare.engines.mujoco import parse
from compare.experiments.reduction import exact_motion
from compare.judge.check import Result
from compare.robots import Robot
from compare.robots.arm import ARM


def swings(engines, *cases) -> Result:
    result = Result("reduction", curves={"apart": {}, "swings": {}})
    exact_motion.swings(result, experiment.Setup.small(ARM, engines), cases)
    return result


def failed(result) -> list[str]:
    return [check.scene for check in result.checks if not check.passed]


def test_both_engines_meet_the_elliptic_function_and_a_heavier_arm_does_not(engines):
    found = swings(engines, *ARM.cases)
    assert failed(found) == [] and len(found.checks) == 5
    text = ARM.mjcf.read_text(encoding="utf-8").replace('mass="1.5"', 'mass="1.50001"')
    heavier = swings(experiment.engines(parse(text, ARM.tree)), *ARM.cases)
    assert failed(heavier) == ["elbow swing, RK4, MuJoCo"]  # Euler's error hides it


@pytest.mark.parametrize(
    "scene",
    [
        {"posture": "zero", "speed": (0, 0, 2000)},  # it turns over
        {"posture": (0, 0, 89)},  # it hardly moves
        {"posture": "zero", "dt": 5 / 2**14},  # rounding hides the order
        {"posture": (90, 90, 0)},  # the forearm turns about a vertical
        {"posture": "zero", "damping": 0.1},
        {"posture": "zero", "torque": (0, 0, 1)},
        {"posture": "zero", "gravity": False},
    ],
)
def test_a_pendulum_that_shows_nothing_is_left_out(engines, scene):
    result = swings(engines, ARM.case("mine", **{"locked": ("alpha", "beta")} | scene))
    assert result.checks == [] and result.curves["swings"] == {}
    with_reason = not {"damping", "torque", "gravity"} & set(scene)
    assert [note.split(":")[0] for note in result.notes] == ["mine"] * with_reason


@pytest.mark.parametrize("start, order", [(90, 2), (90.5, None), (60, 1)])
def test_the_error_of_euler_has_order_2_where_a_swing_begins_without_force_and_none_where_there_is_little(
    engines, start, order
):
    result = swings(engines, ARM.case("mine", locked=("alpha", "beta"), posture=(0, 0, start), speed=(0, 0, 100)))
    assert result.curves["swings"]["mine"]["stated"] == {"RK4": 4, "Euler": order}
    assert failed(result) == [] and len(result.checks) == (5 if order else 3)


# small oscillations


def oscillations(robot, engine=None) -> Result:
    """What is found of a robot with the engine of its own numbers, or a given one."""
    result, engine = Result("reduction"), engine or parse(mjcf(robot.tree), robot.tree)
    few = exact_motion.AMPLITUDES[-2:], exact_motion.LESS_FINE
    exact_motion.small_oscillations(result, experiment.Setup.small(robot, experiment.engines(engine)), *few)
    return result


def another(tree, **postures) -> Robot:
    return Robot("double", Path("none.xml"), tree, postures, ())


CHAIN = dataclasses.replace(  # hangs straight down; the same on either side
    tmt.ARM, axis=((1, 0, 0), (0, 1, 0), (0, 1, 0)), com=((0, 0, -0.15), (0, 0, -0.1)), hinge_names=("a", "b", "c")
)
SKEW = dataclasses.replace(CHAIN, axis=((1, 0, 0), (0, 0.6, 0.8), (0, 1, 0)))
DOWN, UP, BENT = (0, 0, 0), (180, 0, 0), (0, 20, 0)


def test_the_equilibrium_is_the_lowest_that_is_stable():
    assert exact_motion.equilibrium(ARM) == "hanging"
    assert exact_motion.equilibrium(another(CHAIN, up=UP, bent=BENT, down=DOWN)) == "down"
    assert exact_motion.equilibrium(another(CHAIN, up=UP, bent=BENT)) is None
    # with the first body up the others may hang too, stable but higher
    cross = dataclasses.replace(CHAIN, body_hinge=(0, 2))
    assert exact_motion.equilibrium(another(cross, flipped=(180, 180, 0), down=DOWN)) == "down"
    assert exact_motion.equilibrium(another(cross, flipped=(180, 180, 0), up=UP)) == "flipped"
    for changed in ({"damping": (0, 0.1, 0)}, {"gravity": (0, 0, 0)}, {"stiffness": (1.0, 0.0, 0.0)}):
        result = oscillations(another(dataclasses.replace(CHAIN, **changed), down=DOWN))
        assert result.checks == [] and "small" not in result.curves and len(result.notes) == 1


def test_a_motion_is_mirrored_or_half_the_difference_of_two_is_taken():
    assert exact_motion.odd(ARM.tree, ARM.posture("hanging")) and not exact_motion.odd(ARM.tree, ARM.posture("bent"))
    for tree, sides in ((CHAIN, 1), (SKEW, 2)):
        result = oscillations(another(tree, down=DOWN))
        assert [(check.scene, check.passed) for check in result.checks] == [("down, TMT", True), ("down, MuJoCo", True)]
        assert result.curves["small"]["sides"] == sides and result.curves["small"]["duration"] <= 5.0


def test_a_wrong_frequency_is_no_linear_mode():
    heavier = parse(mjcf(dataclasses.replace(SKEW, mass=(1.9, 1.6))), SKEW)
    assert failed(oscillations(another(SKEW, down=DOWN), heavier)) == ["down, MuJoCo"]
