"""Robots of files that are too stiff to be followed: by their fastest rate at the start of their scenes."""

import numpy as np

from tmt.composite import mass_matrix_and_bias
from tmt.methods import METHODS

from ..case import Case
from ..judge.rounding import NARROW
from ..judge.scale import EPS, FACTOR
from ..robots import Robot
from ..robots.file import fastest_rates
from ..truth.reference import DOUBLES, MOST_DOUBLINGS, RECORDS
from ..truth.steps import growth_of

DIVERGES = 1.05  # growth in a step: in the thousands of steps of a run a number overflows


def rates_of(case: Case) -> tuple[float, float]:
    """The fastest rates of decay and of a swing by springs of a case at its start, 1/s."""
    inertia, _ = mass_matrix_and_bias(case.tree, case.q.tolist(), [0.0] * case.coordinates.nv)
    return fastest_rates(case.tree, np.linalg.pinv(np.array(inertia), hermitian=True))


def leaves_no_digits(robot: Robot) -> str | None:
    """Why no run of a file's robot can be compared: rounding grows beyond what is judged in two steps; or None.

    A force that moves a joint at the rate r is rounded by 64 eps of itself, and a step multiplies what is off by (r dt)^2, where
    that is far more than 1: after two of them it is 64 eps (r dt)^4 of 1 rad or 1 m.
    """
    if not robot.is_read or not robot.scenes:
        return None
    case = min(robot.cases, key=lambda case: case.scene.dt)
    rate, dt = max(rates_of(case)), case.scene.dt
    if not FACTOR * EPS * (rate * dt) ** 4 > NARROW:
        return None
    return (
        f"the {robot.name}'s fastest rate, {rate:.1e} per second, is {rate * dt:.1e} over a step of {dt:.1e} s, the finest of "
        "its scenes: rounding alone leaves no digits after two steps"
    )


def has_no_reference(robot: Robot) -> str | None:
    """Why a run in doubles cannot follow a file's robot: with its finest steps too the fastest mode diverges; or None."""
    for case in robot.cases if robot.is_read else ():
        count = -(-case.steps // RECORDS) * RECORDS << MOST_DOUBLINGS
        decay, swing = rates_of(case)
        grown = np.abs(growth_of(METHODS[DOUBLES], np.array([-decay, 1j * swing]) * case.duration / count)).max()
        if not grown <= DIVERGES:
            return (
                f"the {robot.name}'s fastest rate, {max(decay, swing):.1e} per second, is too fast for the reference's finest "
                f"step, {case.duration / count:.1e} s"
            )
    return None
