"""What runs show: where small deviations from rest grow, the file's own run, and the largest push that is survived."""

import mujoco
import numpy as np

from ..engines.mujoco.step import Step, distance
from .growth import GROWN, LASTS, SMALL_PUSH, apart, grows, push_of, pushed, speeds_of, steps_in
from .limits import COARSER, LONGEST, SHORTEST, Limit, bisected
from .rest import Rest, rest_near

BELOW, ABOVE = 0.97, 1.03  # of a limit: the steps at which runs are to differ
WITHIN, OWN_WITHIN = 1.07, 1.03  # fold: how near they are then; and those of a file's own run
OWN_PUSH = 1e-6  # rad/s or m/s: at the start of a file's own run
CURVE_STEPS, LEAST_SIZES = (
    400,
    16,
)  # of a run that shows how fast a push grows, and of those in which it is small
PUSHES = (1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # rad/s or m/s, of all speeds
USUAL_PUSH = 0.1  # rad/s or m/s: what a robot in use meets
CALM, CALMER = 1e-3, 0.05  # rad/s or m/s, and of the push: a speed at the end that is rest
FAR = 0.5  # rad or m: from a rest to what is another one
AS_FAST, AS_FAST_ALONE, WILD = 2.0, 4.0, 1e3  # fold: of the creep, after a push and without; more has failed
THROWN = 10.0  # fold, of the push: a speed at the end that no push leaves
FINER = 8  # the step over the one that shows whether the robot itself bears a push


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


def speed_after(model: mujoco.MjModel, rest: Rest, push: float, dt: float) -> float:
    """The largest speed, beside the creep, in the last eighth of a run after a push, by the file's own solver.

    inf: the run fails, or ends elsewhere, as that of a robot which falls over and lies still.
    """
    step = Step(model, dt, rest.step.integrator, exact=False)
    steps = steps_in(LASTS, dt)
    speeds = speeds_of(step.run(pushed(rest, push), steps))
    moved = distance(model, rest.state, step.state())[rest.is_held]
    if len(speeds) < steps or np.abs(moved).max(initial=0.0) > FAR:
        return np.inf
    return float(np.abs(speeds[-steps // 8 :] - rest.speeds).max())


def largest_push(model: mujoco.MjModel, rest: Rest, creep: float) -> tuple[float, bool]:
    """The largest push that is survived, rad/s or m/s, 0.0: none; and whether a finer step survives no larger one either.

    The robot calms down near its rest, or moves on no faster than at a finer step, as what nothing brakes, or little, does.
    creep: of the robot, rad/s or m/s.
    """
    dt = rest.step.dt

    def is_survived(push: float) -> bool:
        speed = speed_after(model, rest, push, dt)
        if speed <= max(CALM, CALMER * push, AS_FAST * creep):
            return True
        return np.isfinite(speed) and speed <= AS_FAST * speed_after(model, rest, push, dt / FINER)

    survived = next((push for push in PUSHES if is_survived(push)), 0.0)
    if survived == PUSHES[0]:
        return survived, False
    finer = rest_near(Step(model, dt / FINER, rest.step.integrator), rest.state)
    next_larger = min(push for push in PUSHES if push > survived)
    return survived, speed_after(model, finer, next_larger, dt / FINER) > THROWN * next_larger


def own_limit(
    model: mujoco.MjModel, state: np.ndarray, integrator: str, longest: float, creep: float
) -> float:
    """The longest step up to `longest`, s, at which the file's own run from a state stays still, or as slow as its creep.

    By the file's own solver, without searching a rest for each step; within 3 %. 0.0: at none.
    """

    def holds(step: float) -> bool:
        return stays_still(model, state, step, integrator, creep)

    low = high = longest
    while not holds(low):
        low, high = low / COARSER, low
        if low < SHORTEST:
            return 0.0
    while low * OWN_WITHIN < high and holds(low * OWN_WITHIN):  # upwards: a longer one may hold beyond a gap
        low *= OWN_WITHIN
    return low


def stays_still(model: mujoco.MjModel, state: np.ndarray, dt: float, integrator: str, creep: float) -> bool:
    """Whether the file's own run from where it sank to stays there, still."""
    step = Step(model, dt, integrator, exact=False)
    speed = speed_at_end(step, state, WILD * max(CALM, creep))
    moved = float(np.abs(distance(model, state, step.state())).max(initial=0.0))
    return speed <= max(CALM, AS_FAST_ALONE * creep) and moved <= FAR + creep * LASTS


def speed_at_end(step: Step, state: np.ndarray, most: float = np.inf) -> float:
    """The largest speed in the last eighth of a run from a state after a small push; inf: it fails, or exceeds `most`."""
    steps, speeds = steps_in(LASTS, step.dt), []
    for data in step.run(step.moved(state, push_of(step, state, OWN_PUSH)), steps):
        speeds.append(float(np.abs(data.qvel).max()))
        if not speeds[-1] <= most:
            return np.inf
    return max(speeds[-steps // 8 :]) if len(speeds) == steps else np.inf


def observed(model: mujoco.MjModel, limit: Limit, integrator: str) -> tuple[float | None, float | None]:
    """The longest step at which runs hold and the shortest at which they fail, s, 3 % to either side of a limit.

    Where they do not differ there, from the limit up or down to where they do. None: none that holds, or that fails.
    """
    assert limit.dt is not None
    state, rate = limit.rest.state, limit.growth.rate

    def fails(dt: float) -> bool:
        return grows(rest_near(Step(model, dt, integrator), state), rate)

    low, high = BELOW * limit.dt, ABOVE * limit.dt
    while fails(low):
        low, high = low / COARSER, low
        if low < SHORTEST:
            return None, high
    while not fails(high):
        low, high = high, high * COARSER
        if high > LONGEST:
            return low, None
    return bisected(lambda dt: not fails(dt), low, high, WITHIN)
