"""The runs that errors are measured against: Taylor's method in pairs of doubles, for any robot and any scene.

How many digits are right is seen from a second run in another form of the equations and of another order. Where a series would
take too long, as with a stiff robot, a run in doubles of order 8 serves, whose digits are seen by halving its steps.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

import tmt
from tmt.exact.motion import TooManySteps, truth
from tmt.methods import METHODS

from ..robots.case import Case, Coordinates, rates_at
from .steps import growth_of

RECORDS = 64  # of a run, and its start
LOST = 1e-30  # of a run in pairs: its error about, over the growth of a small difference
DOUBLES, MOST_DOUBLINGS = "dopri8", 5  # the method of a run in doubles; how often its steps are doubled at most
DIVERGES = 1.05  # growth in a step: in the thousands of steps of a run a number overflows


class Reference(NamedTuple):
    """One run: every number as the sum of two doubles."""

    t: np.ndarray  # (65,) s
    high: np.ndarray  # (65, nq + nv) rad, rad/s
    low: np.ndarray  # (65, nq + nv), 0 of a run in doubles
    apart: float  # largest difference from the second run; of a run in doubles from that with half the steps
    steps: int
    coordinates: Coordinates
    why: str | None = None  # it is in doubles

    def error(self, q: np.ndarray, joints: Sequence[int]) -> np.ndarray:
        """The largest error of the positions q (65, ...) of some joints by their places at each time, rad or m, (65,)."""
        whole = self.coordinates
        part = Coordinates(*(tuple(names[i] for i in joints) for names in (whole.names, whole.all_kinds)))
        places = [whole.places.joints[i].q for i in joints]
        columns = [k for place in places for k in range(place.start, place.stop)]
        high, low = self.high[:, columns], self.low[:, columns]
        beyond = np.stack(np.broadcast_arrays(*part.places.tangent([*high.T], [*low.T])), axis=-1)
        return np.abs(part.difference(q, high) - beyond).max(axis=1)


def references(cases: Sequence[Case]) -> dict[str, Reference]:
    """Each case's reference by its name."""
    return {case.name: reference(case) for case in cases}


def reference(case: Case) -> Reference:
    """That of one case, at the times at which every run of it is read; ValueError if none reaches the end of the scene."""
    count = RECORDS if case.controller else first_steps(case)  # as the coarsest runs of `speed`
    start = (tuple(values.tolist()) for values in (*case.start, case.tau))
    try:
        path, apart = in_pairs(case.tree, *start, case.duration / count, count, count // RECORDS)
    except TooManySteps as error:
        return in_doubles(case)._replace(why=str(error))
    except ValueError as error:
        raise ValueError(f"scene {case.name!r}: {error}; a slower start or a shorter scene is expected") from error
    return Reference(times(case), path.high, path.low, apart, path.steps, case.coordinates)


in_pairs = lru_cache(maxsize=64)(truth)  # several experiments ask for the same


def first_steps(case: Case) -> int:
    """The least multiple of 64 that is no less than the scene's own number of steps."""
    return -(-case.steps // RECORDS) * RECORDS


def times(case: Case) -> np.ndarray:
    """At which a run is read, s."""
    return np.linspace(0.0, case.duration, RECORDS + 1)


def in_doubles(case: Case) -> Reference:
    """A run in doubles by tmt's method of order 8: twice the steps as long as two runs come nearer to each other.

    ValueError if none reaches the end of the scene.
    """
    count, found = first_steps(case), []
    before = after = None
    for _ in range(MOST_DOUBLINGS + 1):
        after = tmt.simulate(*case.start, case.tau, case.duration / count, count, DOUBLES, case.tree)
        every = count // RECORDS
        after = after.q[::every], after.qd[::every]
        if before is not None:
            apart = case.coordinates.difference(after[0], before[0]), after[1] - before[1]
            found.append((np.abs(np.concatenate(apart, axis=1)).max(), after, count))
            if len(found) > 1 and np.isfinite(found[-2][0]) and not found[-1][0] < found[-2][0] / 2.0:
                break
        before, count = after, 2 * count
    apart, path, count = min(found, key=lambda run: np.nan_to_num(run[0], nan=np.inf))
    if not np.isfinite(apart):
        raise ValueError(
            f"scene {case.name!r}: runs with up to {found[-1][2]} steps of {DOUBLES} do not reach its end; a slower start or a "
            "shorter scene is expected"
        )
    high = np.concatenate(path, axis=1)
    return Reference(times(case), high, np.zeros_like(high), float(apart), count, case.coordinates)


def has_no_reference(robot: object) -> str | None:
    """Why neither a series nor a run in doubles can follow a file's robot: with its finest steps too the fastest mode
    diverges; or None.
    """
    for case in robot.cases_of_torque if robot.is_read else ():
        count = first_steps(case) << MOST_DOUBLINGS
        decay, swing = rates_at(case.tree, case.q)
        grown = np.abs(growth_of(METHODS[DOUBLES], np.array([-decay, 1j * swing]) * case.duration / count)).max()
        if not grown <= DIVERGES:
            return (
                f"the {robot.noun}'s fastest rate, {max(decay, swing):.1e} per second, is too fast for the reference's finest "
                f"step, {case.duration / count:.1e} s"
            )
    return None
