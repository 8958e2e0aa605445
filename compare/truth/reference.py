"""Reference runs for errors: Taylor's method in pairs of doubles, for any robot and any scene.

A second run with another form of the equations and another order gives the accuracy. Where a series takes too
long, as for a stiff robot, the reference is a run in doubles of order 8. Halving its steps gives its
accuracy.
"""

import io
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

import tmt
from tmt.compiled import store
from tmt.exact.motion import Path, TooManySteps, truth
from tmt.methods import METHODS, RungeKutta

from ..core.finding import Finding
from ..robots import Robot
from ..robots.case import Case
from ..robots.coordinates import Coordinates, rates_at

State = tuple[float, ...]
RECORDS = 64  # states of a run, without its start
LOST = 1e-30  # error of a run in pairs relative to the growth of a small difference, about
DOUBLES = "dopri8"  # the method of a run in doubles
MOST_DOUBLINGS = 5  # of the number of its steps
OF_ROUNDING, MOST_OF_ROUNDING = "rk4", 2**14  # the method whose run shows the growth of rounding, its steps
DIVERGES = 1.05  # growth in a step that overflows in the thousands of steps of a run


class NoReference(ValueError):
    """A scene whose motion no method follows to its end."""


class Reference(NamedTuple):
    """One run: every number as the sum of two doubles."""

    t: np.ndarray  # (65,) s
    high: np.ndarray  # (65, nq + nv) rad, rad/s
    low: np.ndarray  # (65, nq + nv), 0 in a run in doubles
    apart: float  # largest difference from the second run; of a run in doubles from that with half the steps
    steps: int
    coordinates: Coordinates
    why: str | None = None  # the reason for a run in doubles

    def error(self, q: np.ndarray) -> np.ndarray:
        """The largest error of the positions q (65, nq) at each time, rad or m, (65,)."""
        nq, places = self.coordinates.nq, self.coordinates.places
        high, low = self.high[:, :nq], self.low[:, :nq]
        beyond = np.stack(np.broadcast_arrays(*places.tangent([*high.T], [*low.T])), axis=-1)
        return np.abs(self.coordinates.difference(q, high) - beyond).max(axis=1)


def reference(case: Case) -> Reference:
    """The reference of one case at 65 equal times; ValueError if no run reaches the end of the scene."""
    count = coarsest_steps(case)
    q, v, tau = (tuple(values.tolist()) for values in (*case.start, case.tau))
    try:
        path, apart = in_pairs(case.tree, q, v, tau, case.duration / count, count, count // RECORDS)
    except TooManySteps as error:
        return in_doubles(case)._replace(why=str(error))
    except ValueError as error:
        reason = f"scene {case.name!r}: {error}; expected a slower start or a shorter scene"
        raise NoReference(reason) from error
    return Reference(times(case), path.high, path.low, apart, path.steps, case.coordinates)


@lru_cache(maxsize=64)  # several experiments need the same
def in_pairs(
    tree: tmt.Tree, q: State, v: State, tau: State, dt: float, steps: int, every: int
) -> tuple[Path, float]:
    """`truth` of a motion, computed once and kept in tmt's folder by its rules, see tmt.compiled.store."""

    def computed() -> bytes:
        path, apart = truth(tree, q, v, tau, dt, steps, every)
        file = io.BytesIO()
        np.savez(file, *path, apart)
        return file.getvalue()

    content = store.stored(computed, ".npz", tree, "pairs", (q, v, tau, dt, steps, every))
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        high, low, count, apart = arrays.values()
    return Path(high, low, int(count)), float(apart)


def first_steps(case: Case) -> int:
    """The smallest multiple of 64 that is at least the scene's own number of steps."""
    return -(-case.steps // RECORDS) * RECORDS


def coarsest_steps(case: Case) -> int:
    """The same; 64 where servos act, as such a scene has short steps for methods explicit in the speeds."""
    return RECORDS if case.controller else first_steps(case)


def times(case: Case) -> np.ndarray:
    """The recorded times of a run, s."""
    return np.linspace(0.0, case.duration, RECORDS + 1)


def in_doubles(case: Case) -> Reference:
    """A run in doubles by a method of order 8: the steps are doubled while the difference of two runs falls."""
    count, before, runs = first_steps(case), None, []
    for _ in range(MOST_DOUBLINGS + 1):
        motion = tmt.simulate(case.tree, *case.start, case.tau, case.duration / count, count, DOUBLES)
        q, qd = motion.q[:: count // RECORDS], motion.qd[:: count // RECORDS]
        if before:
            apart = np.abs(np.hstack([case.coordinates.difference(q, before[0]), qd - before[1]])).max()
            runs.append((float(apart), np.hstack([q, qd]), count))
            if len(runs) > 1 and np.isfinite(runs[-2][0]) and not runs[-1][0] < runs[-2][0] / 2.0:
                break
        before, count = (q, qd), 2 * count
    apart, high, steps = min(runs, key=lambda run: np.nan_to_num(run[0], nan=np.inf))
    if not np.isfinite(apart):
        tried = f"scene {case.name!r}: runs with up to {runs[-1][2]} steps of {DOUBLES} diverge"
        raise NoReference(f"{tried}; expected a slower start or a shorter scene")
    return Reference(times(case), high, np.zeros_like(high), apart, steps, case.coordinates)


def has_no_reference(robot: Robot) -> Finding | None:
    """Why a file's robot has no reference: its fastest mode diverges with the finest steps; or None."""
    cases = robot.cases_of_torque if robot.is_read else ()
    for case, name in product(cases, (DOUBLES, OF_ROUNDING)):
        first = first_steps(case)
        steps = first << MOST_DOUBLINGS if name == DOUBLES else max(MOST_OF_ROUNDING, 16 * first)
        decay, swing = rates_at(case.tree, case.q)
        dt = case.duration / steps
        growth = np.abs(growth_of(name, np.array([-decay, 1j * swing]) * dt)).max()
        if not growth <= DIVERGES:
            return Finding("speed", "no_reference", {"noun": robot.noun, "rate": max(decay, swing), "dt": dt})
    return None


def growth_of(name: str, z: np.ndarray) -> np.ndarray:
    """The stability function of an explicit Runge-Kutta method, 1 + z b (1 - z A)^-1 1, at z = lambda dt, of any shape."""
    stepping, stages = METHODS[name], list[np.ndarray]()
    assert type(stepping) is RungeKutta
    for row in stepping.A:
        stages.append(1.0 + z * sum((a * stage for a, stage in zip(row, stages)), 0.0 * z))
    return 1.0 + z * sum(b * stage for b, stage in zip(stepping.b, stages))
