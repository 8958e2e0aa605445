"""Swings and small oscillations: both engines meet what is known exactly, another model does not, and what is left out."""

import dataclasses
from pathlib import Path

import pytest
from edited import XML
from trees import mjcf

import tmt
from compare.engines.mujoco import parse
from compare.experiments.reduction import exact_motion
from compare.judge.check import Result
from compare.robots import Robot
from compare.robots.arm import ARM
from compare.setup import Setup
from compare.setup import engines as engines_of


def swings(engines, **scene) -> Result:
    """Of one scene, or of all the arm's."""
    result = Result("reduction", curves={"apart": {}, "swings": {}})
    cases = [ARM.case("mine", locked=("alpha", "beta"), **scene)] if scene else ARM.cases
    exact_motion.swings(result, Setup.small(ARM, engines), cases)
    return result


def failed(result) -> list[str]:
    return [check.scene for check in result.checks if not check.passed]


def test_both_engines_meet_the_elliptic_function_and_a_heavier_arm_does_not():
    heavier = engines_of(parse(XML.replace('mass="1.5"', 'mass="1.50001"'), ARM.tree))
    found = swings(heavier)
    assert failed(found) == ["elbow swing, RK4, MuJoCo"] and len(found.checks) == 5  # Euler's error hides it


@pytest.mark.parametrize(
    "scene, said",
    [
        ({"posture": "zero", "speed": (0, 0, 2000)}, True),  # it turns over
        ({"posture": (0, 0, 89)}, True),  # it hardly moves
        ({"posture": "zero", "dt": 5 / 2**14}, True),  # rounding hides the order
        ({"posture": (90, 90, 0)}, True),  # the forearm turns about a vertical
        ({"posture": "zero", "damping": 0.1}, False),
    ],
)
def test_a_pendulum_that_shows_nothing_is_left_out(engines, scene, said):
    result = swings(engines, **scene)
    assert result.checks == [] and result.curves["swings"] == {} and len(result.notes) == said


@pytest.mark.parametrize("start, order", [(90, 2), (90.5, None), (60, 1)])
def test_euler_has_order_2_where_a_swing_begins_without_force_and_none_where_there_is_little(engines, start, order):
    result = swings(engines, posture=(0, 0, start), speed=(0, 0, 100))
    assert result.curves["swings"]["mine"]["stated"] == {"RK4": 4, "Euler": order}
    assert failed(result) == [] and len(result.checks) == (5 if order else 3)


# small oscillations


def oscillations(tree, theirs=None) -> Result:
    """What is found of a robot that hangs down, MuJoCo with its own numbers or others."""
    result, robot = Result("reduction"), Robot("double", Path("none.xml"), tree, {"down": DOWN}, ())
    few = exact_motion.AMPLITUDES[-2:], exact_motion.LESS_FINE
    exact_motion.small_oscillations(result, Setup.small(robot, engines_of(parse(mjcf(theirs or tree), tree))), *few)
    return result


CHAIN = dataclasses.replace(  # hangs straight down; the same on either side
    tmt.ARM, axis=((1, 0, 0), (0, 1, 0), (0, 1, 0)), com=((0, 0, -0.15), (0, 0, -0.1)), hinge_names=("a", "b", "c")
)
SKEW = dataclasses.replace(CHAIN, axis=((1, 0, 0), (0, 0.6, 0.8), (0, 1, 0)))
CROSS = dataclasses.replace(CHAIN, body_hinge=(0, 2))  # with the first body up the others may hang, stable but higher
DOWN = (0, 0, 0)


@pytest.mark.parametrize(
    "tree, postures, found",
    [
        (CHAIN, {"up": (180, 0, 0), "bent": (0, 20, 0), "down": DOWN}, "down"),
        (CROSS, {"flipped": (180, 180, 0), "down": DOWN}, "down"),
        (CROSS, {"flipped": (180, 180, 0), "up": (180, 0, 0)}, "flipped"),
        (dataclasses.replace(CHAIN, stiffness=(1.0, 0.0, 0.0)), {"down": DOWN}, None),
    ],
)
def test_the_equilibrium_is_the_lowest_that_is_stable(tree, postures, found):
    assert exact_motion.equilibrium(Robot("double", Path("none.xml"), tree, postures, ())) == found


@pytest.mark.parametrize("tree, sides", [(CHAIN, 1), (SKEW, 2)])
def test_a_motion_is_mirrored_or_half_the_difference_of_two_is_taken_and_a_wrong_frequency_is_no_mode(tree, sides):
    right, wrong = oscillations(tree), oscillations(tree, dataclasses.replace(tree, mass=(1.9, 1.6)))
    assert failed(right) == [] and failed(wrong) == ["down, MuJoCo"] and right.curves["small"]["sides"] == sides
    without = oscillations(dataclasses.replace(tree, damping=(0, 0.1, 0)))
    assert without.checks == [] and "small" not in without.curves and len(without.notes) == 1
