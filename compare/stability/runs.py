"""What the file's own runs show: up to which step the robot stays at rest, and the largest push that it survives."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import mujoco
import numpy as np

from ..engines.mujoco.names import on
from ..engines.mujoco.step import Step, distance
from .growth import LASTS, MOST_STEPS, push_of
from .limits import COARSER, LONGEST, SHORTEST, bisected
from .rest import WILD, rest_near

BELOW, ABOVE = 0.97, 1.03  # of a limit: the steps at which runs are to differ
WITHIN = 1.065  # fold: how near they are where they differ elsewhere
LIMIT_PUSHES = 1e-3, 1e-6  # rad/s or m/s: at the start of runs that show a limit
WAYS = range(4)  # the signs of such a push, which decide where dry friction holds
PUSHES = (1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # rad/s or m/s, of all speeds
USUAL_PUSH = 0.1  # rad/s or m/s: what a robot in use meets
CALM, CALMER = 1e-3, 0.05  # rad/s or m/s, and of the push: a speed at the end that is rest
DECAYS = 0.8  # of the quarter before: a speed that calms down, if it has become no larger than a usual push
LONGER = 3.0  # fold: the run that shows whether what is slow calms down
FAR = 0.5  # rad or m: from a rest to what is another one
AS_FAST = 4.0  # fold: of the creep, and of a run of fine steps
THROWN = 10.0  # fold, of the push: a speed at the end that no push leaves
FINER, FINEST = 8, 2e-4  # fold, and s: of the steps that show what the robot does by itself


def lasting(dt: float) -> float:
    """How long a run lasts, s."""
    return min(LASTS, MOST_STEPS * dt)


def upwards(first: float, predicted: float) -> Iterator[float]:
    """Steps above the first, s: those to either side of a predicted limit, the longest, and others between them."""
    for mark in (BELOW * predicted, ABOVE * predicted, LONGEST):
        if first < mark <= LONGEST:
            while first * COARSER < mark:
                first *= COARSER
                yield first
            first = mark
            yield mark


class Shown(NamedTuple):
    """What a run shows: the largest speed in each eighth of it, (8,) rad/s or m/s."""

    eighths: np.ndarray

    @property
    def speed(self) -> float:
        """At its end; inf: it fails, or ends elsewhere."""
        return float(self.eighths[-1])

    @property
    def decays(self) -> bool:
        """Whether each quarter after the second is slower than that before."""
        quarters = self.eighths.reshape(4, 2).max(axis=1)
        return self.speed <= USUAL_PUSH and bool((quarters[2:] <= DECAYS * quarters[1:3]).all())


FAILED = Shown(np.full(8, np.inf))


@dataclass(frozen=True)
class Runs:
    """Runs of a file, by its own solver, from where it rests.

    fine: a step at which the robot shows what it does by itself, s. is_held: at which positions forces depend on the movement,
    (nv,). creep: the largest speed at rest at a fine step, that of a coarse one may be a growth.
    """

    model: mujoco.MjModel
    state: np.ndarray
    integrator: str
    fine: float
    is_held: np.ndarray
    creep: float

    @cached_property
    def shown(self) -> Callable[..., Shown]:
        return lru_cache(self.run)

    def fine_speed(self, push: float, times: int = 1, way: int = 0) -> float:
        """The speed at the end of a run of fine steps, or of a multiple; inf: it fails, or ends elsewhere."""
        return self.shown(max(push, LIMIT_PUSHES[0]), times * self.fine, lasting(self.fine), way).speed

    def run(self, push: float, dt: float, lasts: float, way: int) -> Shown:
        """A run after a push of all speeds. Elsewhere is also where a robot lies still that has fallen over."""
        step = Step(self.model, dt, self.integrator, exact=False)
        count, eighths = round(lasts / dt), np.zeros(8)
        start = step.moved(self.state, push_of(step, self.state, push, way))
        number = 0
        for number, data in enumerate(step.run(start, count), 1):
            speed = float(np.abs(data.qvel).max(initial=0.0))
            if not speed < WILD:
                return FAILED
            part = (8 * number - 1) // count
            eighths[part] = max(eighths[part], speed)
        is_there = number == count and self.is_at_rest(dt, step.state(), FAR + self.creep * lasts)
        return Shown(eighths) if is_there else FAILED

    def is_at_rest(self, dt: float, end: np.ndarray, within: float) -> bool:
        """Whether a state is near the rest, or near that of a step, where coarse steps soften what holds the robot."""

        def is_near(state: np.ndarray) -> bool:
            return bool((np.abs(distance(self.model, state, end))[self.is_held] <= within).all())

        if is_near(self.state):
            return True
        there = rest_near(Step(self.model, dt, self.integrator), self.state)
        return there.is_found and is_near(there.state)

    def is_calm(self, push: float, dt: float, way: int = 0) -> bool:
        """Whether the robot calms down after a push; where that is open, in a longer run."""
        lasts = lasting(dt)
        longer = min(LONGER * lasts, max(lasts, MOST_STEPS * dt))
        is_open = self.shown(push, dt, lasts, way).speed <= USUAL_PUSH
        return self.calms(push, dt, lasts, way) or (is_open and self.calms(push, dt, longer, way))

    def calms(self, push: float, dt: float, lasts: float, way: int) -> bool:
        """Whether a run after a push calms down."""
        shown = self.shown(push, dt, lasts, way)
        return shown.speed <= max(CALM, CALMER * push, AS_FAST * self.creep) or shown.decays

    def survives(self, push: float, dt: float, way: int = 0) -> bool:
        """Whether the robot calms down after a push, or moves on no faster than runs of fine steps let expect.

        So does what nothing brakes. That is not asked after a push larger than usual.
        """
        speed = self.shown(push, dt, lasting(dt), way).speed
        if push > USUAL_PUSH or not np.isfinite(speed) or self.calms(push, dt, lasting(dt), way):
            return self.is_calm(push, dt, way)
        return speed <= AS_FAST * self.expected(push, dt) or self.is_calm(push, dt, way)

    def expected(self, push: float, dt: float) -> float:
        """The speed at the end of a run by what it is at fine steps, rad/s or m/s.

        Contacts that open and close chatter the faster the coarser the step: by the power of it that fine steps show, at most
        the first. What slides creeps as fast as contacts are soft, and MuJoCo softens them to twice the step (refsafe).
        """
        fine, twice = (self.fine_speed(push, times) for times in (1, 2))
        power = np.clip(np.log2(twice / fine), 0.0, 1.0) if 0.0 < fine < twice < np.inf else 0.0
        return fine * float((dt / self.fine) ** power) * max(1.0, 2.0 * dt / self.timeconst)

    @cached_property
    def timeconst(self) -> float:
        """The least time constant of contacts that a coarse step lengthens, s; inf: none."""
        model = self.model
        times = model.geom_solref[(model.geom_contype | model.geom_conaffinity) != 0, 0]
        return float(times[times > 0.0].min(initial=np.inf)) if on(model, "REFSAFE") else np.inf

    def holds(self, push: float, dt: float, way: int = 0) -> bool:
        """Whether the robot stays at rest after a small push, or leaves it in runs of fine steps, too, as a drone does."""
        return self.survives(push, dt, way) or self.fine_speed(push) == np.inf

    def hold(self, dt: float) -> bool:
        """Whether the robot stays at rest after small pushes of one way."""
        return all(self.holds(push, dt) for push in LIMIT_PUSHES)

    def all_hold(self, dt: float) -> bool:
        """Whether the robot stays at rest whichever way it is pushed, and how little."""
        return all(self.holds(push, dt, way) for way in WAYS for push in LIMIT_PUSHES)

    def limit(self, dt: float, predicted: float) -> tuple[float | None, float | None]:
        """The longest step at which runs hold and the shortest at which they fail, s.

        They are sought upwards from a step in use, dt, to the first that fails after a push of one way, then downwards to what
        holds after all: 3 % to either side of a predicted limit if runs agree with it. None: none that holds, or that fails.
        """
        low, high = min(dt, BELOW * predicted), None
        if self.hold(low):
            for longer in upwards(low, predicted):
                if not self.hold(longer):
                    low, high = bisected(self.hold, low, longer, WITHIN)
                    break
                low = longer
        while not self.all_hold(low):
            low, high = low / COARSER, low
            if low < SHORTEST:
                return None, high
        return bisected(self.all_hold, low, high, WITHIN) if high else (low, None)

    def largest_push(self, dt: float) -> tuple[float, bool | None]:
        """The largest push that is survived whichever way, rad/s or m/s, 0.0: none; whether fine steps bear no larger one.

        What fine steps bear is not asked beyond a usual push.
        """
        survived = next((push for push in PUSHES if all(self.survives(push, dt, way) for way in WAYS)), 0.0)
        if survived >= USUAL_PUSH:
            return survived, None
        larger = min(push for push in PUSHES if push > survived)
        return survived, any(self.fine_speed(larger, way=way) > THROWN * larger for way in WAYS)
