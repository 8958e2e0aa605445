"""Accelerations of a user's own as an affine function of the torques: the mass matrix and the bias that they have."""

from typing import NamedTuple

import numpy as np
from numpy import ndarray

from tmt import Tree, literal

from ..diagnosis import Values
from ..engines.own import OwnEquations
from ..judge.entries import Entries

LARGER = 8.0  # times the scale: a slope is a difference of two accelerations
CONSTANT = 1e-8  # of a factor at all states
SINGULAR = 1e8  # the condition of a matrix that is not inverted


class Affine(NamedTuple):
    """A user's function qdd = A tau + a, in the model's joints: accelerations are affine in the torques."""

    tree: Tree
    equations: OwnEquations

    def slopes(self, q: ndarray) -> ndarray:
        """A, (states, nv, nv): of accelerations at rest."""
        zero, size = np.zeros((len(q), self.equations.coordinates.nv)), 1.0 + Entries(self.tree, q).force()
        still = self.equations.acceleration(q, zero, zero)
        pushed = [self.equations.acceleration(q, zero, size * unit) for unit in np.eye(zero.shape[1])]
        return np.stack(pushed, axis=2) / size[:, None, :] - still[:, :, None] / size[:, None, :]

    def mass_matrix(self, q: ndarray) -> ndarray:
        return np.linalg.inv(self.slopes(q))

    def bias(self, q: ndarray, M: ndarray, qd: ndarray) -> ndarray:
        """h of Mbar qdd = tau - D qd - k (q - rest) - h, with the damping and springs of the model."""
        qdd = self.equations.acceleration(q, qd, 0.0 * qd)
        passive = np.array(self.tree.damping) * qd + literal.spring_torque(self.tree, q)
        return -np.einsum("sij,sj->si", M, qdd) - passive

    def inputs(self, q: ndarray) -> ndarray:
        """What each torque (column) does at each joint (row), (nv, nv), if the mass matrix is right; else 1."""
        acting = literal.mass_matrix(self.tree, q) @ self.slopes(q)
        factors = acting.mean(axis=0)
        off = np.abs(acting - factors).max()
        return factors if off <= CONSTANT * (1.0 + np.abs(acting).max()) else np.eye(len(factors))

    def values(self, q: ndarray, qd: ndarray, rounding: float) -> Values | None:
        """The mass matrix and the bias; None where there is no such matrix."""
        slopes = self.slopes(q)
        if not np.isfinite(slopes).all() or (np.linalg.cond(slopes) > SINGULAR).any():
            return None
        M, scale = np.linalg.inv(slopes), Entries(self.tree, q, qd)
        force = scale.force()
        qdd = self.equations.acceleration(q, qd, 0.0 * qd)
        still = scale.acceleration(force, qdd)
        of_slopes = still[:, :, None] / (1.0 + force)[:, None, :] + np.abs(slopes)
        allowed = LARGER * rounding * np.abs(M) @ of_slopes @ np.abs(M)
        of_h = np.einsum("sij,sj->si", np.abs(M), still) + force
        of_h = np.einsum("sij,sj->si", allowed, np.abs(qdd)) + LARGER * rounding * of_h
        return Values(q, qd, M, self.bias(q, M, qd), (allowed, of_h))
