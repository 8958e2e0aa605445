"""Inertia about another point."""

import numpy as np


def point_inertia(place: np.ndarray, mass: float = 1.0) -> np.ndarray:
    """The inertia of a point mass, kg, at a place (3,), m, about the origin, (3, 3) kg m2: m (c'c 1 - c c')."""
    return mass * (place @ place * np.eye(3) - np.outer(place, place))
