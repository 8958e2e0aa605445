"""Why two sets of equations of motion differ, in the terms of the derivation.

The right equations are those of a tree, by the TMT method; of the others only values at some states are known. Causes have
ranks: 1 an option or a convention of a joint (order, sense, zero, unit); 2 one number, one term or one coefficient; 3 two
of them. The search ends after the first rank in which something explains the values down to their tolerance, and lists all that
does: M and h cannot distinguish them.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import tmt

from ..judge.entries import Entries
from ..judge.scale import EPS, FACTOR
from ..robots.coordinates import Coordinates
from ..robots.joint_map import JointMap
from .cause import Change, Diagnosis, tied
from .model import packed
from .search import diagnose

__all__ = ["STATES_ASKED", "Diagnosis", "Values", "diagnose", "diagnose_stated", "packed"]

STATES_ASKED = 24


class Values(NamedTuple):
    """Mbar and h with their tolerances, at states in the model's joints; NaN where a quantity is not given."""

    q: np.ndarray  # (states, nq)
    qd: np.ndarray  # (states, nv)
    mass_matrix: np.ndarray  # (states, nv, nv)
    bias: np.ndarray  # (states, nv)
    tolerances: tuple[np.ndarray, np.ndarray]  # of both

    @classmethod
    def of(cls, tree: tmt.Tree, q, qd, mass_matrix, bias, rounding: float = FACTOR * EPS) -> "Values":
        """With the tolerances of judge.entries. rounding: of the scale of an entry."""
        scale = Entries(tree, q, qd)
        sizes = np.broadcast_to(scale.mass_matrix, mass_matrix.shape), scale.bias
        return cls(q, qd, mass_matrix, bias, tuple(rounding * size for size in sizes))

    @property
    def are_finite(self) -> bool:
        return bool(np.isfinite(self.mass_matrix).all() and np.isfinite(self.bias).all())


def diagnose_stated(
    tree: tmt.Tree, joints: JointMap | None, values: Values, seconds: float, bias: Callable | None = None
) -> Diagnosis:
    """The diagnosis of equations whose joints are stated: what is wrong with the statement comes first, as it is to be stated.

    joints: as they were stated; None: not at all. bias: see `diagnose`.
    """
    given, allowed = packed(values.mass_matrix, values.bias), packed(*values.tolerances)
    found = diagnose(tree, values.q, values.qd, given, allowed, seconds, bias)
    if joints is None or joints.is_same:
        return found
    coordinates, causes = Coordinates(tree.joint_names, tree.kind), []
    change = Change("order", "joints", ", ".join(map(str, joints.joints)), "those of the model")
    for cause in found.causes:
        both = cause.joints and joints.after(cause.joints, coordinates)
        if both:
            cause = cause._replace(joints=both, changes=(change,) if both.is_same else cause.changes)
        if both or not cause.joints:  # else both together cannot be stated
            causes.append(cause)
    return found._replace(causes=tied(causes))
