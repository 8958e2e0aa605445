"""The posture at which a robot rests without torque: where gravity and springs have the least potential."""

import numpy as np
from scipy.linalg import eigh

import tmt
from tmt import literal

from ..robots.case import Coordinates
from .derivative import stiffness

BALANCED = 1e-13  # of the largest torque of gravity and springs on the way: less is rounding
MOST_TRIED = 100  # postures on the way down
FARTHEST = 0.5  # rad or m of one joint at a time: what is far is not known from here
ASIDE = 0.1  # rad or m, along the mode by which a posture that does not stay is left
FLAT = 1e-6  # of the largest stiffness over inertia: less is none


def at_rest(tree: tmt.Tree, q: np.ndarray) -> np.ndarray | None:
    """The posture (nq,), rad or m, at which it rests without torque and stays; found downhill from q. None: there is none.

    Newton's method in the modes of the mass matrix at q, with the size of each stiffness: what would climb goes down.
    """
    coordinates = Coordinates(tree.hinge_names, tree.kind)
    largest, height, inertia = 0.0, potential(tree, q), literal.mass_matrix(q, tree)
    for _ in range(MOST_TRIED):
        force = -literal.gravity_balance(q, tree) - literal.spring_torque(q, tree)
        K = stiffness(tree, q)
        squares, shapes = eigh(0.5 * (K + K.T), inertia)
        flat = FLAT * np.abs(squares).max()
        largest = max(largest, np.abs(force).max())
        if np.abs(force).max() <= BALANCED * largest:
            if squares[0] >= -flat:
                return q
            down = ASIDE * shapes[:, 0] / np.abs(shapes[:, 0]).max()
        else:
            down = shapes @ (shapes.T @ force / np.maximum(np.abs(squares), max(flat, 1e-300)))
            down *= min(1.0, FARTHEST / np.abs(down).max())
        for _ in range(40):
            lower = coordinates.move(q, down)
            if potential(tree, lower) < height:
                break
            down = 0.5 * down
        else:
            # no lower posture is told from this one in doubles
            return q if squares[0] >= -flat and np.abs(force).max() <= 1e6 * BALANCED * largest else None
        q, height = lower, potential(tree, lower)
    return None


def potential(tree: tmt.Tree, q: np.ndarray) -> float:
    """Of gravity and springs, J."""
    return float(literal.potential_energy(q, tree))
