"""Small deviations in runs: a push from rest, beside the run without it."""

from collections.abc import Iterable

import mujoco
import numpy as np

from ..engines.mujoco.step import Step
from ..robots.case import SEED
from .rest import Rest

SMALL_PUSH = 1e-7  # rad/s or m/s: deviations whose growth is judged
LASTS, LEAST_STEPS, MOST_STEPS = 4.0, 800, 20_000  # s: of a run, and between which numbers of steps
LITTLE = 1e-6  # of an activation
GROWN, GROWING = 1e3, 3.0  # fold: of the speed at the start; from the second to the last quarter


def grows(rest: Rest, rate: float = 0.0) -> bool:
    """Whether a small push from a rest grows in a run.

    rate: of the growth that is expected, 1/s; the run lasts until it would show.
    """
    if not rest.is_found:
        return True
    lasts = max(LASTS, np.log(GROWN) / rate if rate > 0.0 else 0.0)
    steps = steps_in(lasts, rest.step.dt)
    plain = speeds_of(rest.step.run(rest.state, steps))
    return has_grown(apart(rest.step.run(pushed(rest, SMALL_PUSH), steps), plain), steps)


def steps_in(lasts: float, dt: float) -> int:
    return int(np.clip(lasts / dt, LEAST_STEPS, MOST_STEPS))


def pushed(rest: Rest, push: float) -> np.ndarray:
    """The state at rest with a push, rad/s or m/s, of every speed, this way or that by chance, and a little of activations."""
    return rest.step.moved(rest.state, push_of(rest.step, rest.state, push))


def push_of(step: Step, state: np.ndarray, push: float) -> np.ndarray:
    """The deviation of a push, (n,); activations, which may have any unit, stay within their ranges."""
    nv, by = step.model.nv, np.zeros(step.size)
    signs = np.random.default_rng(SEED).choice([-1.0, 1.0], step.size)
    by[nv : 2 * nv] = push * signs[nv : 2 * nv]
    little = min(push, LITTLE)
    for place, (ahead, behind) in enumerate(step.sides(state, little)):
        if place >= 2 * nv:
            by += ahead if signs[place] > 0.0 or not behind.any() else behind
    return by


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
