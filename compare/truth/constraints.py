"""What constraints do to a robot at rest, and where Newton's method goes for a rest."""

from collections.abc import Callable

import numpy as np

from ..robots.case import Coordinates
from .deviations import SYMMETRIC

TURNED_BY = 1e-6  # rad or m, of central differences where a moment turns with the posture
SINGULAR = 1e-9  # of the largest stiffness: less is none


def constraint_forces(ask: Callable | None, coordinates: Coordinates, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """J' f of constraints at rest, (nv,), and the stiffness that they have as springs, (nv, nv). ask: the Rows at q."""
    n = coordinates.nv
    if ask is None:
        return np.zeros(n), np.zeros((n, n))
    rows = ask(q)
    return rows.jacobian.T @ rows.forces, rows.springs


def turning(ask: Callable | None, coordinates: Coordinates, q: np.ndarray) -> np.ndarray:
    """-d(J' f)/dq of constraints whose f stays, (nv, nv): what they do by turning with the posture."""
    n = coordinates.nv
    found, rows = np.zeros((n, n)), ask and ask(q)
    if rows and rows.forces.any():
        for j, step in enumerate(TURNED_BY * np.eye(n)):
            ahead, behind = (ask(coordinates.move(q, sign * step)).jacobian for sign in (1.0, -1.0))
            if ahead.shape == behind.shape == rows.jacobian.shape:
                found[:, j] = (behind - ahead).T @ rows.forces / (2.0 * TURNED_BY)
    return found


def downhill(K: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Where Newton's method goes, rad or m, with the sizes of the stiffnesses if K is symmetric: away from a saddle."""
    if np.abs(K - K.T).max(initial=0.0) > SYMMETRIC * np.abs(K).max(initial=0.0):
        return np.linalg.lstsq(K, force, rcond=SINGULAR)[0]
    sizes, modes = np.linalg.eigh(0.5 * (K + K.T))
    sizes = np.abs(sizes)
    held = sizes > SINGULAR * sizes.max(initial=0.0)
    return modes[:, held] @ (modes[:, held].T @ force / sizes[held])
