"""Runs of a method along a scene: the path of an engine, single steps, and differences of two runs."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core.check import Check, Result
from ...engines import Dynamics
from ...judge.agree import closest
from ...judge.run import departure, diverged_at
from ...robots.case import Case
from ...robots.coordinates import Coordinates

States = Sequence[np.ndarray]  # q and v


class Path(NamedTuple):
    """The run of one engine at each of its steps."""

    q: np.ndarray  # (steps + 1, nq) rad
    v: np.ndarray  # (steps + 1, nv)
    ended: float | None = None  # s: when it diverged
    left: float | None = None  # s: when it left its start


def path_of(case: Case, dynamics: Dynamics, dt: float, steps: int, method: str) -> tuple[np.ndarray, Path]:
    """The times, (steps + 1,) s, and the path of an engine in a case."""
    motion = dynamics.run(*case.start, case.tau, dt, steps, method)
    ended = diverged_at(case, motion.t, motion.q, motion.v)
    return motion.t, Path(motion.q, motion.v, ended, departure(motion.t, motion.q, case.coordinates))


def one_step(dynamics: Dynamics, states: States, tau: np.ndarray, dt: float, method: str) -> list[np.ndarray]:
    """q and v one step after each of the states."""
    q, v = states
    motion = dynamics.run(q, v, tau, dt, 1, method)
    return [motion.q[:, 1], motion.v[:, 1]]


class Deviation(NamedTuple):
    """The difference of two runs at some times, movements first and then speeds, and how large it may be."""

    coordinates: Coordinates
    times: np.ndarray  # (times,) s
    difference: np.ndarray  # (times, 2 nv) rad or m, then per s
    tolerance: np.ndarray  # (times, 2 nv)


def differences(coordinates: Coordinates, states: States, others: States) -> np.ndarray:
    """Absolute differences of q (times, nq) and v (times, nv) of two runs: (times, 2 nv), movements first."""
    movements = coordinates.difference(states[0], others[0])
    return np.abs(np.concatenate([movements, states[1] - others[1]], axis=-1))


def check_closest(result: Result, where: str, quantity: str, deviation: Deviation) -> Check:
    """A check of the component and the time that come closest to their tolerance, which its note names."""
    coordinates, times, difference, tolerance = deviation
    k, i = closest(difference, tolerance)
    unit, joint = coordinates.units[i % coordinates.nv], coordinates.speeds[i % coordinates.nv]
    if i >= coordinates.nv:
        unit = f"{unit}/s"
    place = f"{joint} at t = {times[k]:.3f} s"
    return result.check(where, quantity, difference[k, i], tolerance[k, i], unit, place, True)
