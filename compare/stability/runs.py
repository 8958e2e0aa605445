"""Runs of a motion after pushes: by any step and integrator, and by the fine steps that are taken for the truth."""

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any, NamedTuple, TypeVar

import mujoco
import numpy as np

from tmt.compiled.cores import cores

from ..engines.mujoco.changes import changed
from ..engines.mujoco.names import bit, matrix
from ..engines.mujoco.stepper import Stepper, distance
from .motion import Motion

T = TypeVar("T")
U = TypeVar("U")
WAYS, MORE_WAYS = 4, 8  # patterns of signs, and further ones for the step that is found
LASTS, MOST_STEPS = 3.0, 20_000  # s and steps of a run
STILL, STILLER = 0.05, 0.01  # rad/s or m/s: what is still after a push, and after a small one
FAST = 100.0  # rad/s or m/s: a faster run diverges
CALM = 0.7  # s: what is still for as long stays so
QUIET, REFINED = 1e-5, 3  # rad/s or m/s, without a push; times that a fine run is refined
JUMP, AT_ONCE = 1.0, 0.01  # rad/s or m/s within s: the start is not one in which the robot can be
BY_CHANCE = 0.1  # rad or m: fine runs that end more apart
LONGEST, FINER, FINEST = 0.2, 8, 5e-4  # s; fold of the step in use, s: fine steps
SAMPLES = 100  # of the way of a run


class Trial(NamedTuple):
    """What is tried: a push of every speed, rad/s or m/s; a step, s; an integrator; the period of a program, s."""

    push: float
    dt: float
    integrator: str
    period: float = 0.0


class Run(NamedTuple):
    """A run of a motion.

    last, most: the largest speed of each degree of freedom in the last quarter and of all, (nv,); inf where
    the run diverges. middle, late: the largest of all speeds in the middle and in the last third. times, q:
    states, (n,) s and (n, nq). speeds: of all steps, (steps, nv); of a fine run after a push none.
    """

    last: np.ndarray
    most: np.ndarray
    middle: float
    late: float
    times: np.ndarray
    q: np.ndarray
    speeds: np.ndarray

    @property
    def is_finite(self) -> bool:
        return bool(np.isfinite(self.most).all())

    @property
    def speed(self) -> float:
        """The largest at the end."""
        return float(self.last.max())


class Runs:
    """A motion after pushes. dt, s, integrator: those in use. period, delay: s, of a program."""

    def __init__(
        self, motion: Motion, dt: float, integrator: str, period: float = 0.0, delay: float = 0.0
    ) -> None:
        self.motion, self.ideal = without_sensors(motion), without_sensors(motion.ideal or motion)
        self.model, self.dt, self.integrator = self.motion.model, dt, integrator
        self.period, self.delay, self.longest = period, delay, max(LONGEST, dt)
        self.fine_dt = min(max(dt / FINER, LASTS / MOST_STEPS), dt / 2.0, FINEST)
        self.lasts = min(motion.times[-1] if len(motion.times) else LASTS, MOST_STEPS * self.fine_dt)
        rng, nv = np.random.default_rng(0), motion.model.nv
        self.signs = [np.sign(rng.normal(size=nv)) for _ in range(WAYS + MORE_WAYS)]
        self.stepper, self.of_thread = Stepper(self.model, dt, integrator), threading.local()
        speeds = motion.state[self.stepper.places["qvel"]]
        self.is_in_motion = bool(speeds.any() or len(motion.times))
        self.truth = integrator  # of fine runs
        self.fine, self.by_twice = dict[tuple[float, int, float], Run](), dict[tuple[float, int], float]()

    def start(self, push: float, way: int, motion: Motion) -> np.ndarray:
        """The state of a motion with a push, in one of the patterns of signs."""
        state = motion.state.copy()
        state[self.stepper.places["qvel"]] += push * self.signs[way]
        return state

    def stepper_of(self, *what: Any) -> Stepper:
        """That of a model, a step and an integrator in this thread, which keeps the last one."""
        if getattr(self.of_thread, "what", None) != what:
            self.of_thread.what, self.of_thread.stepper = what, Stepper(*what)
        return self.of_thread.stepper

    def run(
        self, trial: Trial, way: int, fast: float = FAST, lasts: float = 0.0, is_fine: bool = False
    ) -> Run:
        """A run. It ends early where it diverges, is faster than `fast`, or is still and stays so. lasts: s, 0.0: as usual."""
        (push, dt, integrator, period), motion = trial, self.ideal if is_fine else self.motion
        stepper = self.stepper_of(motion.model, dt, integrator)
        nv, state = self.model.nv, self.start(push, way, motion)
        stepper.put(state)
        count, calm, done = max(4, round((lasts or self.lasts) / dt)), round(CALM / dt), 0
        quiet = min(STILL, push / 2.0) / 5.0 if push else QUIET
        q, speeds, failed = np.zeros((count, self.model.nq)), np.zeros((count, nv)), False
        for steps, controls in motion.parts(stepper, count, period, self.delay):
            rolled, part = stepper.roll(state, steps, controls), slice(done, done + steps)
            q[part], speeds[part], state = rolled.q[0], np.abs(rolled.v[0]), rolled.states[0]
            bad = ~(speeds[part].max(axis=1) < fast)
            failed = bool(bad.any())
            done += int(bad.argmax()) if failed else steps
            is_calm = done > calm and speeds[done - calm : done].max() < quiet
            if failed or (is_calm and not len(motion.times)):
                break
        last, most, middle, late = np.full(nv, np.inf), np.full(nv, np.inf), 0.0, np.inf
        if not failed:
            last = speeds[done - max(1, count // 4 if done == count else calm) : done].max(axis=0)
            most = speeds[:done].max(axis=0)
            middle, late = (speeds[k * count // 3 : (k + 1) * count // 3].max() for k in (1, 2))
        every = 1 if is_fine else max(1, done // SAMPLES)
        at = np.unique(np.r_[np.arange(0, done, every), max(0, done - 1)])
        return Run(last, most, float(middle), float(late), dt * (at + 1), q[at], speeds[: done + failed])

    def fine_run(self, push: float, way: int, lasts: float = 0.0) -> Run:
        """The run of fine steps, refined where it is not finite."""
        key = push, way, lasts
        if key not in self.fine:
            for refined in range(1 + REFINED):
                trial = Trial(push, self.fine_dt / 2.0**refined, self.truth)
                run = self.run(trial, way, 100.0 * FAST, lasts, is_fine=True)
                if run.is_finite:
                    break
            self.fine[key] = run._replace(speeds=run.speeds[:0]) if push else run  # they take memory
        return self.fine[key]

    def fine_runs(self, push: float) -> list[Run]:
        return in_threads(lambda way: self.fine_run(push, way), range(WAYS))

    @property
    def unpushed(self) -> Run:
        return self.fine_run(0.0, 0)

    def twice(self, push: float, way: int) -> float:
        """How far a run of twice the fine step ends from that, rad or m."""
        if (push, way) not in self.by_twice:
            run = self.run(Trial(push, 2.0 * self.fine_dt, self.truth), way, 100.0 * FAST, is_fine=True)
            self.by_twice[push, way] = self.apart(run, self.fine_run(push, way)) if run.is_finite else np.inf
        return self.by_twice[push, way]

    def fine_apart(self, push: float) -> float:
        """How far runs of two fine steps end from each other at most, rad or m."""
        return max(in_threads(lambda way: self.twice(push, way), range(WAYS)))

    def place_is_chance(self, push: float) -> bool:
        """Whether fine runs of other signs, or of twice the step, end elsewhere."""
        first, *others = self.fine_runs(push)
        spread = max(self.apart(first, other) for other in others)
        return spread > BY_CHANCE or self.fine_apart(push) > BY_CHANCE

    def still(self, push: float) -> float:
        """The largest speed that is rest after a push, rad/s or m/s."""
        return self.unpushed.speed + float(np.clip(push / 2.0, STILLER, STILL))

    @property
    def by_itself(self) -> str:
        """What the fine run does without a push."""
        if self.is_in_motion:
            return "in motion"
        return "rests" if self.unpushed.speed <= STILL else "moves on"

    @property
    def starts(self) -> str:
        """How fast an equality or a mocap body makes something at once, without a push, if it does."""
        if not (self.model.neq or self.model.nmocap):
            return ""
        first = self.unpushed.speeds[: max(1, round(AT_ONCE / self.fine_dt))]
        grown = float(first.max(initial=0.0)) - float(first[:1].max(initial=0.0)) * self.is_in_motion
        return f"with a jump to {grown:.2g}" if grown > JUMP else ""

    def creep(self, of: int | None = None) -> tuple[float, int]:
        """The mean speed in the last quarter of what rests without a push, rad/s or m/s, and its degree of freedom.

        of: a degree of freedom; None: the fastest.
        """
        q, run = self.unpushed.q, self.unpushed
        if not run.speed <= STILL or run.times[-1] < 0.99 * self.lasts:
            return 0.0, 0
        ends = pairwise(round((len(q) - 1) * share) for share in (0.5, 0.75, 1.0))
        before, last = (4.0 * np.abs(distance(self.model, q[a], q[b])) / self.lasts for a, b in ends)
        dof = int(last.argmax()) if of is None else of
        return (float(last[dof]), dof) if last[dof] > 0.5 * before[dof] else (0.0, 0)

    # distances, rad or m

    def apart(self, run: Run, other: Run) -> float:
        """How far runs end from each other."""
        return float(np.abs(distance(self.model, other.q[-1], run.q[-1])).max())

    def elsewhere(self, run: Run, other: Run) -> float:
        """How far runs end from each other: of what is free its height and its tilt, as it may slide on a floor."""
        m, start, end = self.model, other.q[-1], run.q[-1]
        moved, gravity = np.abs(distance(m, start, end)), np.linalg.norm(m.opt.gravity)
        for joint in np.flatnonzero(m.jnt_type == mujoco.mjtJoint.mjJNT_FREE) if gravity else ():
            place, dof, down = m.jnt_qposadr[joint], m.jnt_dofadr[joint], m.opt.gravity / gravity
            before, after = (matrix(q[place + 3 : place + 7]).T @ down for q in (start, end))
            fall = abs((end - start)[place : place + 3] @ down)
            tilt = np.arctan2(np.linalg.norm(np.cross(before, after)), before @ after)
            moved[dof : dof + 6] = max(fall, tilt)
        return float(moved.max())

    def along(self, run: Run, fine: Run, until: float) -> float:
        """The largest distance of a run from a fine one along its way, s; inf where it is not finite."""
        if not run.is_finite:
            return np.inf
        upto = run.times <= max(until, run.times[0])
        at = np.array([np.interp(run.times[upto], fine.times, column) for column in fine.q.T]).T
        return float(np.abs(distance(self.model, at, run.q[upto])).max())


def without_sensors(motion: Motion) -> Motion:
    """The motion of a model without its sensors, which take time and move nothing."""
    model = motion.model
    return motion._replace(model=changed(model, disableflags=model.opt.disableflags | bit("SENSOR")))


def in_threads(function: Callable[[T], U], items: Iterable[T]) -> list[U]:
    """The values of a function, in threads: MuJoCo steps without Python's lock."""
    with ThreadPoolExecutor(cores()) as threads:
        return [*threads.map(function, items)]
