"""A run of a case by a method of an engine, at equal times: for `speed` and `trajectory`."""

import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..engines import Dynamics, Setting
from ..judge.run import departure, diverged_at
from ..robots.case import Case


@dataclass(frozen=True)
class Run:
    """States at the times of a setting, NaN from where the run ends early."""

    case: Case
    t: np.ndarray  # (times,) s
    q: np.ndarray  # (times, nq) rad or m
    v: np.ndarray  # (times, nv) per s
    seconds: float  # of the engine's own steps
    preparation: float  # s, until the run could begin: compilation, where the engine compiles
    evaluations: int | None  # of the dynamics; None: not known
    steps: int | None  # that the method took; None: not known
    why: str | None  # the engine's own words where it ends early

    @cached_property
    def ended(self) -> float:
        """When it is not finite, or has more energy than is possible, s; infinite: never."""
        with np.errstate(all="ignore"):
            at = diverged_at(self.case, self.t, self.q, self.v)
        return np.inf if at is None else at

    @cached_property
    def left(self) -> float | None:
        """When a joint is 0.1 rad, or m, from the start, s; None: never."""
        return departure(self.t, self.q, self.case.coordinates)


def follow(case: Case, dynamics: Dynamics, setting: Setting, method: str) -> Run:
    """A case from its start under its torque, timed once. EngineError where the engine has no such run."""
    with np.errstate(all="ignore"):  # it may diverge
        begin = time.perf_counter()
        run, read = dynamics.prepare(*case.start, case.tau, setting, method)
        prepared = time.perf_counter()
        outcome = run()
        seconds = time.perf_counter() - prepared
        motion = read(outcome)
    preparation = getattr(dynamics, "seconds_prepared", None) or prepared - begin
    seconds = seconds if motion.seconds is None else motion.seconds
    why = None if motion.ended is None else str(motion.ended)
    steps = setting.steps or motion.steps
    return Run(case, motion.t, motion.q, motion.v, seconds, preparation, motion.evaluations, steps, why)
