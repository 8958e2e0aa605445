"""Runs of a method along a scene: the path of an engine, single steps, and differences of two runs."""

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core import timing
from ..core.check import Check, Result
from ..engines import Dynamics, Method, Motion, Setting
from ..judge.agree import closest
from ..judge.run import departure, diverged_at
from ..robots.case import Case
from ..robots.coordinates import Coordinates
from ..truth.reference import Reference

States = Sequence[np.ndarray]  # q and v
EARLY = 1.0  # s: until then chaos has not grown, and errors fall regularly
REGULAR = 3e-2  # rad: a smaller error up to EARLY falls with the order of the method


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


class Followed(NamedTuple):
    """A run at the start and at 64 equal times."""

    motion: Motion
    seconds: float  # the least of its times
    error: np.ndarray  # (65,) rad or m: the largest of all joints
    early: float  # rad or m: the largest error up to EARLY
    scatter: float  # of its times, see timing.scatter


def follow(
    dynamics: Dynamics, case: Case, method: Method, setting: Setting, reference: Reference, rounds: int = 1
) -> Followed:
    """The run of a method with a setting, timed up to `rounds` times, until it is_timed."""
    run, read = dynamics.prepare(*case.start, case.tau, setting, method.name)
    times: list[float] = []
    with np.errstate(all="ignore"):  # in a run that diverges
        while len(times) < rounds and not timing.is_timed(times):
            begin = time.perf_counter()
            outcome = run()
            seconds = time.perf_counter() - begin
            motion = read(outcome)
            times.append(seconds if motion.seconds is None else motion.seconds)
        error = reference.error(motion.q)
    early = float(error[reference.t <= EARLY].max())
    return Followed(motion, min(times), error, early, timing.scatter(times))


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
