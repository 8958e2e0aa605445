"""Positions, angular velocities, Jacobians and convective terms."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from ..judge.check import Result
from ..judge.entries import has_own_scales, scales, unit
from ..judge.scale import reaches
from ..robots import Robot
from ..setup import Setup

TITLE = "Kinematics: do the bodies move alike?"


def claim(robot: Robot) -> str:
    """What is claimed of any robot."""
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
    """Six quantities at the named postures and at random states."""
    result, tree = Result("kinematics"), setup.robot.tree
    engines = tuple(setup.compared().values())
    per_speed = unit(tree, "m/rad", "m/m")
    for sample in (setup.named, setup.random):
        q, qd = sample.q, sample.qd
        scale = scales(tree, setup.robot.is_read, q, qd)
        T, B = zip(*(dynamics.jacobians(q) for dynamics in engines))
        v_conv, w_conv = zip(*(dynamics.convective_terms(q, qd) for dynamics in engines))
        x = [dynamics.com_positions(q) for dynamics in engines]
        omega = [dynamics.angular_velocities(q, qd) for dynamics in engines]
        for quantity, of, (ours, theirs), size, truth in (
            ("x_b", "m", x, scale.positions, "com_positions"),
            ("omega_b", "rad/s", omega, scale.angular_velocities, "angular_velocities"),
            ("T_b", per_speed, T, scale.T, "T"),
            ("B_b", "", B, scale.B, "B"),
            ("v_conv", "m/s2", v_conv, scale.v_conv, "v_conv"),
            ("w_conv", "rad/s2", w_conv, scale.w_conv, "w_conv"),
        ):
            result.agree(sample, quantity, of, ours, theirs, size, truth=truth)
        result.notes += sample.notes
    return result


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_distances  # matplotlib is for the process that draws

    yield partial(draw_distances, result, "random states")
