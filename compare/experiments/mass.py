"""The mass matrix."""

import numpy as np

from ..core.check import Result
from ..judge.agree import over
from ..judge.scale import EPS, FACTOR
from . import Experiment
from .quantities import compared, headline, overview
from .setup import Setup

__all__ = ["EXPERIMENT", "headline", "overview", "rows"]
EXPERIMENT = Experiment(order=40, asks_of_own=("mass_matrix",), overview="agreement")


def rows(setup: Setup) -> Result:
    """Agreement at named postures and random states; symmetry and definiteness at random states."""
    result, (_, at_random) = compared(setup, "mass", "Mbar")
    M, mujoco_M, *_ = at_random.values("Mbar")
    check_symmetry(result, M, at_random.scale.mass_matrix)  # MuJoCo's is one triangle written twice
    check_definiteness(result, result.label, M)
    check_definiteness(result, "MuJoCo", mujoco_M)
    return result


def check_symmetry(result: Result, M: np.ndarray, scale: np.ndarray) -> None:
    """Mbar (states, nv, nv) is symmetric except for rounding of each entry."""
    what, skew = f"{result.label}: Mbar - Mbar' over the scale of the entry", np.abs(M - M.transpose(0, 2, 1))
    result.check("random states", what, over(skew, scale).max(), FACTOR * EPS, "", rounding=True)


def check_definiteness(result: Result, label: str, M: np.ndarray) -> None:
    """The smallest eigenvalue of Mbar over the largest, in units of its diagonal, is more than rounding."""
    diagonal = np.einsum("sii->si", M)
    is_positive = (diagonal > 0.0).all(axis=1, keepdims=True)  # else it is not definite
    root = np.sqrt(np.where(is_positive, diagonal, 1.0))
    scaled = M / (root[:, :, None] * root[:, None, :])
    values = np.linalg.eigvalsh(scaled) if np.isfinite(scaled).all() else np.full((1, 2), np.nan)
    what = f"{label}: least eigenvalue of Mbar in units of its diagonal over the largest"
    least = (values[:, 0] / np.abs(values).max(axis=1)).min()
    result.check("random states", what, least, FACTOR * EPS, "", rule="at least")
