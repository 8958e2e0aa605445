"""What runs show: whether small deviations from rest grow, and the largest push that is survived."""

from collections.abc import Iterable
from typing import NamedTuple

import mujoco
import numpy as np

from ..engines.mujoco.step import Step, distance
from ..robots.case import SEED
from .limits import COARSER, LONGEST, SHORTEST, Limit
from .rest import Rest, rest_near

SMALL_PUSH, OWN_PUSH = (
    1e-7,
    1e-6,
)  # rad/s or m/s: deviations whose growth is judged; at the start of a file's own run
LASTS, LEAST_STEPS, MOST_STEPS = 4.0, 800, 20_000  # s: of a run, and between which numbers of steps
GROWN, GROWING = 1e3, 3.0  # fold: of the speed at the start; from the second to the last quarter
BELOW, ABOVE = 0.97, 1.03  # of a limit: the steps at which runs are to differ
WITHIN = 1.07  # fold: how near they are then
CURVE_STEPS, LEAST_SIZES = (
    2000,
    16,
)  # of a run that shows how fast a push grows, and of those in which it is small
PUSHES = (1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)  # rad/s or m/s, of all speeds
USUAL_PUSH = 0.1  # rad/s or m/s: what a robot in use meets
CALM, CALMER = 1e-3, 0.01  # rad/s or m/s, and of the push: a speed at the end that is rest
FAR = 0.5  # rad or m: from a rest to what is another one
THROWN, AS_FAST = 10.0, 2.0  # fold: of the push; of the speed at a finer step
FINER = 8  # the step over the one that shows whether the robot itself bears a push


def grows(model: mujoco.MjModel, state: np.ndarray, dt: float, integrator: str, rate: float = 0.0) -> bool:
    """Whether a small push from the rest near a state grows in a run.

    rate: of the growth that is expected, 1/s; the run lasts until it would show.
    """
    rest = rest_near(Step(model, dt, integrator), state)
    if not rest.is_found:
        return True
    lasts = max(LASTS, np.log(GROWN) / rate if rate > 0.0 else 0.0)
    steps = int(np.clip(lasts / dt, LEAST_STEPS, MOST_STEPS))
    plain = speeds_of(rest.step.run(rest.state, steps))
    return has_grown(apart(rest.step.run(pushed(rest, SMALL_PUSH), steps), plain), steps)


def pushed(rest: Rest, push: float) -> np.ndarray:
    """The state at rest with a push, rad/s or m/s, of every speed, this way or that by chance."""
    nv, by = rest.step.model.nv, np.zeros(rest.step.size)
    by[nv : 2 * nv] = push * np.random.default_rng(SEED).choice([-1.0, 1.0], nv)
    return rest.step.moved(rest.state, by)


def speeds_of(run: Iterable[mujoco.MjData]) -> np.ndarray:
    """The speeds after each step of a run, (steps, nv)."""
    return np.array([data.qvel.copy() for data in run])


def apart(run: Iterable[mujoco.MjData], plain: np.ndarray, most: float = GROWN * SMALL_PUSH) -> np.ndarray:
    """The largest difference of a speed after each step from that of the run without a push, until it exceeds `most`."""
    sizes = []
    for data, speeds in zip(run, plain):
        sizes.append(np.abs(data.qvel - speeds).max())
        if not sizes[-1] <= most:
            break
    return np.array(sizes)


def has_grown(sizes: np.ndarray, steps: int) -> bool:
    """Whether a small push has grown: the run was broken off, or its last quarter is faster than its second."""
    if len(sizes) < steps or not sizes[-1] <= GROWN * SMALL_PUSH:
        return True
    early, late = sizes[steps // 4 : steps // 2].max(), sizes[3 * steps // 4 :].max()
    return bool(late > GROWING * max(early, SMALL_PUSH))


def growth_in_run(model: mujoco.MjModel, state: np.ndarray, dt: float, integrator: str) -> float | None:
    """The factor by which a small push grows in a step of a run, after its first quarter; None: no rest, or no growth."""
    rest = rest_near(Step(model, dt, integrator), state)
    if not rest.is_found:
        return None
    plain = speeds_of(rest.step.run(rest.state, CURVE_STEPS))
    sizes = apart(rest.step.run(pushed(rest, SMALL_PUSH), len(plain)), plain, GROWN**2 * SMALL_PUSH)
    if len(sizes) < LEAST_SIZES or not sizes.min() > 0.0:
        return None
    first = len(sizes) // 4
    return float(np.exp(np.polyfit(np.arange(first, len(sizes)), np.log(sizes[first:]), 1)[0]))


class Pushes(NamedTuple):
    """The largest push that is survived, rad/s or m/s, 0.0: none; whether a finer step survives no larger one either."""

    largest: float
    finer_too: bool


def speed_after(model: mujoco.MjModel, rest: Rest, push: float, dt: float) -> float:
    """The largest speed, beside the creep, in the last eighth of a run after a push, by the file's own solver.

    inf: the run fails, or ends elsewhere, as one of a robot that falls over and lies still.
    """
    step = Step(model, dt, rest.step.integrator, exact=False)
    steps = int(np.clip(LASTS / dt, LEAST_STEPS, MOST_STEPS))
    speeds = speeds_of(step.run(pushed(rest, push), steps))
    if (
        len(speeds) < steps
        or np.abs(distance(model, rest.state, step.state())[rest.is_held]).max(initial=0.0) > FAR
    ):
        return np.inf
    return float(np.abs(speeds[-steps // 8 :] - rest.speeds).max())


def survives(model: mujoco.MjModel, rest: Rest, push: float) -> bool:
    """Whether the robot calms down near its rest after a push, or moves on no faster than at a finer step.

    So does what nothing brakes.
    """
    dt, speed = rest.step.dt, speed_after(model, rest, push, rest.step.dt)
    if speed <= max(CALM, CALMER * push):
        return True
    if speed > THROWN * push:
        return False
    return speed <= AS_FAST * speed_after(model, rest, push, dt / FINER)


def own_limit(model: mujoco.MjModel, state: np.ndarray, integrator: str, longest: float, dt: float) -> float:
    """The longest step up to `longest` at which the file's own run from a state comes to rest, or moves on as at a fine step.

    By the file's own solver, without searching a rest for each step; within 3 %. dt: the step in use, s. 0.0: none does down to
    a quarter of both.
    """
    fine = min(dt, longest) / FINER
    usual = AS_FAST * own_speed(model, state, fine, integrator)

    def holds(step: float) -> bool:
        return own_speed(model, state, step, integrator) <= max(CALM, usual)

    low = high = longest
    while not holds(low):
        low, high = low / COARSER, low
        if low < min(dt, longest) / 4.0:
            return 0.0
    while high > low * WITHIN:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def own_speed(model: mujoco.MjModel, state: np.ndarray, dt: float, integrator: str) -> float:
    """The largest speed in the last eighth of a run from a state with a small push; inf: it fails."""
    step = Step(model, dt, integrator, exact=False)
    steps = int(np.clip(LASTS / dt, LEAST_STEPS, MOST_STEPS))
    by = np.zeros(step.size)
    by[model.nv : 2 * model.nv] = OWN_PUSH * np.random.default_rng(SEED).choice([-1.0, 1.0], model.nv)
    speeds = speeds_of(step.run(step.moved(state, by), steps))
    return float(np.abs(speeds[-steps // 8 :]).max()) if len(speeds) == steps else np.inf


def largest_push(model: mujoco.MjModel, rest: Rest) -> Pushes:
    """The largest push that is survived at a rest's step, with the file's own solver."""
    survived = next((push for push in PUSHES if survives(model, rest, push)), 0.0)
    if survived == PUSHES[0]:
        return Pushes(survived, False)
    next_larger = min(push for push in PUSHES if push > survived)
    finer = rest_near(Step(model, rest.step.dt / FINER, rest.step.integrator), rest.state)
    return Pushes(survived, not survives(model, finer, next_larger))


def observed(model: mujoco.MjModel, limit: Limit, integrator: str) -> tuple[float | None, float | None]:
    """The longest step at which runs hold and the shortest at which they fail, s, 3 % to either side of a limit.

    Where they do not differ there, from the limit up or down to where they do. None: none that holds, or that fails.
    """
    assert limit.dt is not None
    state, rate = limit.rest.state, limit.growth.rate

    def fails(dt: float) -> bool:
        return grows(model, state, dt, integrator, rate)

    low, high = BELOW * limit.dt, ABOVE * limit.dt
    while fails(low):
        low, high = low / COARSER, low
        if low < SHORTEST:
            return None, high
    while not fails(high):
        low, high = high, high * COARSER
        if high > LONGEST:
            return low, None
    while high > low * WITHIN:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if fails(middle) else (middle, high)
    return low, high
