"""What grows in a step at rest: the eigenvalues of its derivative that noise of differences does not explain."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import eig

from ..engines.mujoco.step import NUDGE
from .rest import Rest

OTHER_NUDGE = NUDGE / 3.0  # of the differences that show the noise
NOISE_TIMES = 3.0  # fold, of the observed noise: what does not exceed it may be noise
NOISE_LEAST = 1e-10  # of an entry of the derivative
GROWS = 0.1  # 1/s: a rate below is a drift or a creep, of which a run of 4 s shows nothing


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
    values, left, right = eig(rest.A, left=True, right=True)
    excess = np.abs(values) - 1.0
    if excess.max(initial=0.0) <= GROWS * rest.step.dt:
        return still
    noise = rest.A - rest.step.derivative(rest.state, OTHER_NUDGE)
    overlap = np.maximum(np.abs((left.conj() * right).sum(axis=0)), 1e-300)
    uncertain = NOISE_TIMES * np.abs((left.conj() * (noise @ right)).sum(axis=0)) + NOISE_LEAST
    excess[excess <= uncertain / overlap] = 0.0
    fastest = int(np.argmax(excess))
    factor = 1.0 + float(excess[fastest])
    return Growth(factor, float(np.log(factor)) / rest.step.dt, right[:, fastest]) if factor > 1.0 else still
