"""What grows at a rest: eigenvalues of a step that noise of differences does not explain, and small pushes in runs."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import eig

from ..engines.mujoco.step import LITTLE, NUDGE, Step
from ..robots.case import SEED
from .rest import Rest

OTHER_NUDGE = NUDGE / 3.0  # of the differences that show the noise
NOISE_TIMES = 3.0  # fold, of the observed noise: what does not exceed it may be noise
NOISE_LEAST = 1e-10  # of an entry of the derivative
GROWS = 0.1  # 1/s: a rate below is a drift or a creep, of which a run of 4 s shows nothing
LASTS, MOST_STEPS = 4.0, 20_000  # duration of a run, s; its most steps


class Growth(NamedTuple):
    """The mode of a step that grows fastest, beyond noise.

    factor: by which it is multiplied in a step, 1.0: none grows. rate: its logarithm over dt, 1/s. shape: its movement, speeds
    and activations, (n,) complex.
    """

    factor: float
    rate: float
    shape: np.ndarray


def growth(rest: Rest) -> Growth:
    """The growth of small deviations from a rest.

    Sliding along a floor, turning about the vertical, the creep and what nothing holds have the eigenvalue 1, often twice: then
    noise splits it by its root. An eigenvalue is uncertain by y* dA x / (y* x), with its left and right vectors, which grows
    without bound where two meet.
    """
    still = Growth(1.0, 0.0, np.zeros(len(rest.A)))
    if not np.isfinite(rest.A).all():
        return Growth(np.inf, np.inf, still.shape)
    if np.abs(np.linalg.eigvals(rest.A)).max(initial=0.0) <= 1.0 + GROWS * rest.step.dt:
        return still
    values, left, right = eig(rest.A, left=True, right=True)
    excess = np.abs(values) - 1.0
    noise = rest.A - rest.step.derivative(rest.state, OTHER_NUDGE)
    overlap = np.maximum(np.abs((left.conj() * right).sum(axis=0)), 1e-300)
    uncertain = NOISE_TIMES * np.abs((left.conj() * (noise @ right)).sum(axis=0)) + NOISE_LEAST
    excess[excess <= uncertain / overlap] = 0.0
    fastest = int(np.argmax(excess))
    factor = 1.0 + float(excess[fastest])
    if factor == 1.0:
        return still
    return Growth(factor, float(np.log(factor)) / rest.step.dt, right[:, fastest])


# runs


def push_of(step: Step, state: np.ndarray, push: float, way: int = 0) -> np.ndarray:
    """The deviation of a push, (n,); activations, which may have any unit, stay within their ranges. way: of its signs."""
    nv, by = step.model.nv, np.zeros(step.size)
    signs = np.random.default_rng(SEED + way).choice([-1.0, 1.0], step.size)
    by[nv : 2 * nv] = push * signs[nv : 2 * nv]
    little = min(push, LITTLE)
    for place, (ahead, behind) in enumerate(step.sides(state, little)):
        if place >= 2 * nv:
            by += ahead if signs[place] > 0.0 or not behind.any() else behind
    return by
