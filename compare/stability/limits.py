"""The largest stable step of an integrator at the rest of a model, by the derivative of MuJoCo's own step."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from ..engines.mujoco.step import Step, distance
from .growth import GROWS, Growth, growth
from .rest import Rest, rest_near

LONGEST, SHORTEST = 0.2, 1e-6  # s: steps that are tried
COARSER = 1.5  # fold, from one tried step to the next
REFINED = 2e-3  # of a limit
SLOW = 1.2  # a factor below: of what grows little in a step
BY_ITSELF = 0.7, 1.4  # of its rate at a coarser step: a slow growth whose rate stays is none of the step
SADDLE = 0.1  # 1/s: what grows by itself and slower is a drift
GIVES_WAY = 0.3  # rad or m: a rest so far from where the search began is another one
BESIDE_DRIFT = 2.0  # fold: what grows faster than a drift
Curve = list[tuple[float, float]]  # steps, s, and the factors by which deviations grow in them


@dataclass(frozen=True)
class Tried:
    """A step that was tried: its rest, and what grows there. drift: the rate of what grows by itself, 1/s."""

    dt: float
    rest: Rest
    growth: Growth
    drift: float
    moved: float  # rad or m, of the rest from the state from which it was sought

    @property
    def is_stable(self) -> bool:
        stays = self.rest.is_found and self.moved <= GIVES_WAY
        return stays and self.growth.rate <= max(GROWS, BESIDE_DRIFT * self.drift)


@dataclass(frozen=True)
class Limit:
    """The largest stable step of an integrator.

    kind: finite; none, stable up to LONGEST; below, not stable at SHORTEST; saddle, something grows at any step, at the rate
    of `growth`; no_rest, none was found.
    dt: s, of a finite one. growth: of what grows just beyond. rest: the one just below the limit, else at the last step tried.
    tries: all steps of the search, in its order.
    """

    kind: str
    dt: float | None
    growth: Growth
    rest: Rest
    tries: list[Tried]

    @property
    def first(self) -> Tried:
        return self.tries[0]

    @property
    def curve(self) -> Curve:
        """The growth at the steps of the search."""
        return sorted((at.dt, at.growth.factor) for at in self.tries if at.rest.is_found)


def tried(model: mujoco.MjModel, state: np.ndarray, dt: float, integrator: str, drift: float = 0.0) -> Tried:
    """The rest near a state at a step, and its growth. drift: the rate of what grows by itself, 1/s."""
    rest = rest_near(Step(model, dt, integrator), state)
    moved = float(np.abs(distance(model, state, rest.state)).max(initial=0.0))
    return Tried(dt, rest, growth(rest), drift, moved)


def limit(
    model: mujoco.MjModel, state: np.ndarray, integrator: str, first: float, drift: float = 0.0
) -> Limit:
    """The limit near a step `first`, s: from there upwards to what fails, or downwards to what holds, then by bisection."""
    tries = list[Tried]()

    def attempt(near: np.ndarray, dt: float) -> Tried:
        tries.append(tried(model, near, dt, integrator, drift))
        return tries[-1]

    at = attempt(state, first)
    stable, failing = (at, None) if at.is_stable else (None, at)
    while failing is None and at.dt < LONGEST:
        at = attempt(at.rest.state, min(at.dt * COARSER, LONGEST))
        stable, failing = (at, None) if at.is_stable else (stable, at)
    while stable is None and at.dt > SHORTEST:
        finer = attempt(state, at.dt / COARSER**2)
        if finer.is_stable:
            stable = finer
        elif is_saddle(at, finer):
            return Limit("saddle", None, finer.growth, finer.rest, tries)
        elif grows_by_itself(at, finer):
            return limit(model, state, integrator, first, finer.growth.rate)
        elif not (at.rest.is_found or finer.rest.is_found):
            return Limit("no_rest", None, finer.growth, finer.rest, tries)
        else:
            failing = finer
        at = finer
    if stable is None:
        return Limit("below", None, at.growth, at.rest, tries)
    if failing is None:
        return Limit("none", None, stable.growth, stable.rest, tries)
    while failing.dt > stable.dt * (1.0 + REFINED):
        middle = attempt(stable.rest.state, float(np.sqrt(stable.dt * failing.dt)))
        stable, failing = (middle, failing) if middle.is_stable else (stable, middle)
    return Limit("finite", stable.dt, failing.growth, stable.rest, tries)


def is_saddle(coarse: Tried, fine: Tried) -> bool:
    """Whether something grows by itself, faster than a drift."""
    return grows_by_itself(coarse, fine) and fine.growth.rate > SADDLE


def grows_by_itself(coarse: Tried, fine: Tried) -> bool:
    """Whether something grows slowly, and as fast at a finer step."""
    low, high = BY_ITSELF
    kept = low * coarse.growth.rate < fine.growth.rate < high * coarse.growth.rate
    return kept and fine.rest.is_found and coarse.growth.factor < SLOW


def bisected(holds: Callable[[float], bool], low: float, high: float, within: float) -> tuple[float, float]:
    """The largest step that holds and the smallest that fails, s, a factor `within` apart; at first low and high."""
    while high > low * within:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low, high
