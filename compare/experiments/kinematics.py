"""Positions, angular velocities, Jacobians and convective terms."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from ..engines import LABELS
from ..judge.check import Result
from ..judge.entries import has_own_scales, scales, unit
from ..judge.scale import reaches
from ..judge.words import listed
from ..robots import Robot
from ..setup import Setup

TITLE = "Kinematics: do the bodies move alike?"


OF_TMT = ("com_positions", "angular_velocities", "jacobians", "convective_terms")


def brought(robot: Robot) -> tuple[str, ...]:
    """What the equations that MuJoCo is compared with give of it."""
    return tuple(name for name in OF_TMT if not robot.own or name in robot.own)


def skipped(robot: Robot) -> str | None:
    """Why it cannot serve a robot, or None."""
    return None if brought(robot) else "your equations have neither com_positions nor jacobians"


def claim(robot: Robot) -> str:
    """What is claimed of any robot."""
    if robot.own:
        named = {"com_positions": "x_b (xipos)", "jacobians": "T_b and B_b (mj_jacBodyCom, its rotation in body axes)"}
        which = listed([named[name] for name in brought(robot)])
        return f"Of what lies between positions and equations of motion yours agree with MuJoCo in {which}."
    positions = "hinge angles" if set(robot.tree.kind) == {"hinge"} else "joints' positions"
    return (
        f"Every quantity between the {positions} and the equations of motion has a counterpart in MuJoCo, so that a wrong "
        "one can be named: x_b and omega_b (xipos, cvel), T_b and B_b (mj_jacBodyCom, its rotation turned into body axes), "
        "and both convective terms (mj_jacDot times the rates)."
    )


def tolerance(robot: Robot) -> str:
    """By what the claim is judged, with the robot's own scale."""
    if has_own_scales(robot.tree, robot.is_read):
        return (
            "64 eps x scale, each entry its own. With L the largest distance from the origin that a centre of mass can have at "
            "that state, S the sum of |rates| of the hinges and balls that move a body, V that of its slides: lengths L; T_b: L "
            "of a hinge or ball, 1 of a slide; B_b: 1; angular velocity S; convective terms 2 S (L S + V) and S^2; "
            "all times the number of hinges and balls that turn the body."
        )
    reach = reaches(robot.tree).max()
    return (
        f"64 eps x scale. Lengths and T_b: the largest distance from the {origin_in_words(robot)}, {reach:.2f} m. B_b: 1. "
        f"Angular velocity: the sum S of |rates|. Convective terms: {reach:.2f} m x S^2 and S^2."
    )


def origin_in_words(robot: Robot) -> str:
    """What is at the origin, in words: the landmark that is there."""
    landmarks = robot.landmarks(robot.posture()) if robot.landmarks else {}
    return next((name for name, point in landmarks.items() if not np.any(point)), "origin")


def rows(setup: Setup) -> Result:
    """Six quantities, or those that a user's own equations give, at the named postures and at random states."""
    result, tree = Result("kinematics", label=LABELS[setup.robot.compared[0]]), setup.robot.tree
    brings = brought(setup.robot)
    engines = tuple(setup.compared().values())
    per_speed = unit(tree, "m/rad", "m/m")
    for sample in (setup.named, setup.random):
        q, qd = sample.q, sample.qd
        scale = scales(tree, setup.robot.is_read, q, qd)
        found = {}
        if "com_positions" in brings:
            found["x_b"] = [dynamics.com_positions(q) for dynamics in engines]
        if "angular_velocities" in brings:
            found["omega_b"] = [dynamics.angular_velocities(q, qd) for dynamics in engines]
        if "jacobians" in brings:
            found["T_b"], found["B_b"] = zip(*(dynamics.jacobians(q) for dynamics in engines))
        if "convective_terms" in brings:
            found["v_conv"], found["w_conv"] = zip(*(dynamics.convective_terms(q, qd) for dynamics in engines))
        of_quantities = {
            "x_b": ("m", scale.positions, "com_positions"),
            "omega_b": ("rad/s", scale.angular_velocities, "angular_velocities"),
            "T_b": (per_speed, scale.T, "T"),
            "B_b": ("", scale.B, "B"),
            "v_conv": ("m/s2", scale.v_conv, "v_conv"),
            "w_conv": ("rad/s2", scale.w_conv, "w_conv"),
        }
        for quantity, (ours, theirs) in found.items():
            of, size, truth = of_quantities[quantity]
            result.agree(sample, quantity, of, ours, theirs, size, truth=truth)
        result.notes += sample.notes
    return result


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_distances  # matplotlib is for the process that draws

    yield partial(draw_distances, result, "random states")
