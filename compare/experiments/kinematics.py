"""Positions, angular velocities, Jacobians and convective terms."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from ..judge.check import Result
from ..judge.scale import reaches
from ..robots import Robot
from ..setup import Setup

TITLE = "Kinematics: do the bodies move alike?"


def claim(robot: Robot) -> str:
    """What is claimed of any robot."""
    return (
        "Every quantity between the hinge angles and the equations of motion has a counterpart in MuJoCo, so that a wrong "
        "one can be named: x_b and omega_b (xipos, cvel), T_b and B_b (mj_jacBodyCom, its rotation turned into body axes), "
        "and both convective terms (mj_jacDot times the rates)."
    )


def tolerance(robot: Robot) -> str:
    """By what the claim is judged, with the robot's own scale."""
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
    result = Result("kinematics")
    engines = tuple(setup.compared().values())
    reach = reaches(setup.robot.tree).max()
    for sample in (setup.named, setup.random):
        q, qd = sample.q, sample.qd
        speed = abs(qd).sum(axis=1)
        T, B = zip(*(dynamics.jacobians(q) for dynamics in engines))
        v_conv, w_conv = zip(*(dynamics.convective_terms(q, qd) for dynamics in engines))
        x = [dynamics.com_positions(q) for dynamics in engines]
        omega = [dynamics.angular_velocities(q, qd) for dynamics in engines]
        for quantity, unit, (ours, theirs), scale, truth in (
            ("x_b", "m", x, reach, "com_positions"),
            ("omega_b", "rad/s", omega, speed, "angular_velocities"),
            ("T_b", "m/rad", T, reach, "T"),
            ("B_b", "", B, 1.0, "B"),
            ("v_conv", "m/s2", v_conv, reach * speed**2, "v_conv"),
            ("w_conv", "rad/s2", w_conv, speed**2, "w_conv"),
        ):
            result.agree(sample, quantity, unit, ours, theirs, scale, truth=truth)
    return result


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_distances  # matplotlib is for the process that draws

    yield partial(draw_distances, result, "random states")
