"""What can be said of one run: how far it went, when it left its start, when it diverged."""

import numpy as np

import tmt

from ..case import Case
from .check import Result
from .scale import gravity_scale

LEFT = 0.1  # rad: a held model that is so far from its posture has left it
MOVES = 0.1  # rad: a run without a torque that holds shows nothing if it moves less
ORDER_MARGIN = 0.15  # of an order that is measured
COARSE_STEP, STABLE_SO_LONG = (
    0.01,
    0.3,
)  # s: with such a step, or a coarser one, only RK4 is sure to be stable any longer


def step_in_words(case: Case, steps: int) -> str:
    """The step of a run of a case in words."""
    return f"dt = {case.duration:g}/{steps} s"


def required_time(case: Case, scheme: str, dt: float) -> float:
    """For how long a run of a case by a scheme must be judged, s."""
    judged = case.duration if case.scene.judged is None else case.scene.judged
    return judged if scheme == "rk4" or dt < COARSE_STEP else min(judged, STABLE_SO_LONG)


def check_movement(result: Result, where: str, moved: float) -> None:
    """A run without a torque that holds moves, rad: one that stays shows nothing."""
    result.check(where, "movement", moved, MOVES, "rad", rule="at least")


def deviation(q: np.ndarray, start: np.ndarray) -> float:
    """The largest deviation of any joint of a run from where it started, rad; inf if the run diverged."""
    away = np.abs(q - start).max()
    return float(away) if np.isfinite(away) else np.inf


def deviation_alive(q: np.ndarray, start: np.ndarray) -> float:
    """The same, rad, of a run as long as it has not diverged."""
    return float(np.nanmax(np.abs(q - start)))


def departure(t: np.ndarray, q: np.ndarray) -> float | None:
    """The time at which a joint is first 0.1 rad from where it started; None: never."""
    away = ~(np.abs(q - q[0]).max(axis=1) <= LEFT)  # a run that is no number has left too
    return float(t[away][0]) if away.any() else None


def diverged_at(case: Case, t: np.ndarray, q: np.ndarray, qd: np.ndarray) -> float | None:
    """The first time at which a run of a case has stopped, is not finite, or is beyond its physical energy; None: never.

    Energy less the work of the constant torque cannot grow, on the stated robot. The bound is a gain of its whole potential
    range, twice the sum of m g reach, and of the kinetic energy at the start.
    """
    finite = np.isfinite(np.concatenate([q, qd], axis=1)).all(axis=1)
    good = np.where(finite[:, None], q, 0.0), np.where(finite[:, None], qd, 0.0)
    kinetic = tmt.energy(q[0], qd[0], case.tree) - tmt.potential_energy(q[0], case.tree)
    with np.errstate(over="ignore", invalid="ignore"):  # of a run that is about to end
        energy = tmt.energy(*good, case.tree) - (good[0] - q[0]) @ case.tau
        bad = ~finite | ~(energy - energy[0] <= 2.0 * gravity_scale(case.robot.tree) + kinetic)
    return float(t[bad][0]) if bad.any() else None


def number_or_none(number: float | None) -> float | None:
    """A number for a table: None if it is not finite."""
    return float(number) if number is not None and np.isfinite(number) else None


def number_or_nan(number: float | None) -> float:
    """A number from a table: NaN, which leaves a gap in a figure and fails a check, where there is none."""
    return np.nan if number is None else number
