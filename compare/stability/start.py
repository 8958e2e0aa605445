"""The file's run from a posture itself, everything on: whether it comes to rest, and whether where the posture rests."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..engines.mujoco.reading import Reading
from ..engines.mujoco.step import Step, WholeRun, distance, start_of, whole_run
from ..engines.mujoco.variants import of_base
from ..robots.case import SEED
from .limits import COARSER, LONGEST, bisected
from .place import Place, Posture, standing_at
from .rest import RELAXED_STEPS, rest_near
from .runs import BELOW, FAR, WITHIN

LASTS, LEAST_STEPS, MOST_STEPS = 2.0, 1000, 20_000  # s, and between which numbers of steps it lasts
LONGER = 3.0  # fold: where it has not come to rest it is run so long
PARTS = 4  # of a run: the speeds of each are averaged
PUSH = 1e-6  # rad/s or m/s at the start, by chance: what rests exactly would stay, however unstable
CALM = 1e-3  # rad/s or m/s, root of the mean square
FINEST = 16  # fold: finer than the step in use, no step is tried


class Moved(NamedTuple):
    """How far a run ends from the rest of its posture, rad or m, and the joint that is farthest.

    has_fallen: elsewhere, and a free body is farthest.
    """

    by: float
    joint: str
    is_elsewhere: bool
    has_fallen: bool


@dataclass(frozen=True)
class StartRuns:
    """Runs of a file from a posture itself. stands: where it rests, if that is known; else it is found when it is asked."""

    reading: Reading
    posture: Posture
    integrator: str
    stands: Place | None = None

    @cached_property
    def place(self) -> Place:
        return self.stands or standing_at(self.reading, self.posture)

    @cached_property
    def start(self) -> np.ndarray:
        """The state of the posture, pushed a little."""
        reading, posture = self.reading, self.posture
        push = PUSH * np.random.default_rng(SEED).normal(size=reading.model.nv)
        q = np.array(posture.q) if posture.q else None
        return start_of(reading.model, reading.drive, posture.key, push, q)

    @cached_property
    def is_held(self) -> np.ndarray:
        """At which positions forces depend on the movement, (nv,); nowhere, if the posture has no rest.

        At a fine step, as the rest was found: a coarse one softens contacts, and has another.
        """
        model = self.place.model
        step = Step(model, min(model.opt.timestep, RELAXED_STEPS[0]), self.place.reading.integrator)
        rest = rest_near(step, self.place.rest)
        return rest.is_held if rest.is_found else np.zeros(model.nv, bool)

    def run(self, dt: float, lasts: float) -> WholeRun:
        with np.errstate(over="ignore", invalid="ignore"):
            return whole_run(self.reading.model, self.start, dt, self.integrator, lasts, PARTS)

    def until_rest(self, dt: float) -> tuple[WholeRun, float]:
        """A run at a step, and how long it lasts, s: longer, where it has not come to rest, if that takes few steps."""
        lasts = float(np.clip(LASTS, LEAST_STEPS * dt, MOST_STEPS * dt))
        run = self.run(dt, lasts)
        if not (is_calm(run) or run.failed_at) and LONGER * lasts <= MOST_STEPS * dt:
            lasts *= LONGER
            run = self.run(dt, lasts)
        return run, lasts

    def moved(self, run: WholeRun, lasts: float) -> Moved:
        """How far the end of a run is from the rest; elsewhere is where it is another rest."""
        place = self.place
        by = np.abs(distance(place.reading.model, place.rest, run.end)) * self.is_held
        most = float(by.max(initial=0.0))
        if not most:
            return Moved(0.0, "", False, False)
        farthest = int(np.argmax(by))
        is_elsewhere = most > FAR + place.creep * lasts
        has_fallen = is_elsewhere and bool(of_base(place.reading.model)[farthest])
        return Moved(most, place.speed_names[farthest], is_elsewhere, has_fallen)

    def rests(self, dt: float) -> bool:
        """Whether the run from the posture comes to rest at a step, and where the posture rests."""
        run, lasts = self.until_rest(dt)
        return is_calm(run) and not self.moved(run, lasts).is_elsewhere

    def longest(self, first: float, limit: float) -> float | None:
        """The longest step up to which it comes to rest, s, where that is below a limit; None: not below it, or at no step.

        Sought from `first` upwards to what fails, or downwards to what holds, then between them.
        """
        low, high, most = first, None, BELOW * min(limit, LONGEST)
        if self.rests(first):
            while high is None and low < most:
                step = min(low * COARSER, most)
                low, high = (step, None) if self.rests(step) else (low, step)
        else:
            while low == first or not self.rests(low):
                low, high = low / COARSER**2, low
                if low * FINEST < first:
                    return None
        return bisected(self.rests, low, high, WITHIN)[0] if high else None


def is_calm(run: WholeRun) -> bool:
    return bool(run.speeds[-1] < CALM)
