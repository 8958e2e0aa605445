"""Why two sets of equations of motion differ, in the terms of the derivation.

The right equations are those of a tree, by the TMT method; of the others only values at some states are known. Causes have
ranks: 1 an option or a convention of a joint (order, sense, zero, unit); 2 one number, one term or one coefficient; 3 two of
them. The search ends after the first rank in which something explains the values down to their tolerance, and lists all that
does: M and h cannot distinguish them.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import tmt

from ..robots.coordinates import Coordinates
from ..robots.joint_map import JointMap, joint_map
from .cause import Cause, Change, Diagnosis, cause_of, joints_stated, tied
from .search import diagnose

__all__ = ["STATES_ASKED", "Diagnosis", "Values", "diagnose", "diagnose_stated", "packed"]

STATES_ASKED = 24
WITHOUT = "the joints are the model's"


class Values(NamedTuple):
    """Mbar and h with their tolerances, at states in the model's joints."""

    q: np.ndarray  # (states, nq)
    qd: np.ndarray  # (states, nv)
    mass_matrix: np.ndarray | None  # (states, nv, nv)
    bias: np.ndarray | None  # (states, nv)
    tolerances: tuple[np.ndarray, np.ndarray]  # of both

    def diagnosis(self, tree: tmt.Tree, seconds: float, bias: Callable | None = None) -> Diagnosis:
        """What explains the difference from a tree's equations, see `diagnose`."""
        nv, states = tree.coordinates.nv, len(self.q)
        given, allowed = packed(self.mass_matrix, self.bias, nv, states), packed(*self.tolerances, nv, states)
        return diagnose(tree, self.q, self.qd, given, allowed, seconds, bias)

    def in_joints(self, joints: JointMap) -> "Values":
        """The same in the user's joints."""
        of_M, of_h = joints.own_mass_matrix, joints.own_forces
        M = None if self.mass_matrix is None else of_M(self.mass_matrix)
        h = None if self.bias is None else of_h(self.bias)
        allowed = np.abs(of_M(self.tolerances[0])), np.abs(of_h(self.tolerances[1]))
        return Values(joints.own_positions(self.q), joints.own_speeds(self.qd), M, h, allowed)


def packed(mass_matrix: np.ndarray | None, bias: np.ndarray | None, nv: int, states: int) -> np.ndarray:
    """Values as `Equations` has them, (states, entries); NaN where a quantity is not given."""
    i, j = np.tril_indices(nv)
    M = np.full((states, len(i)), np.nan) if mass_matrix is None else np.asarray(mass_matrix)[:, i, j]
    h = np.full((states, nv), np.nan) if bias is None else np.asarray(bias)
    return np.concatenate([M, h], axis=1)


def diagnose_stated(
    tree: tmt.Tree, joints: JointMap, values: Values, seconds: float, bias: Callable | None = None
) -> Diagnosis:
    """The diagnosis of equations whose joints are stated: what is wrong with the statement comes first, as it is to be stated.

    joints: as they were stated. bias: see `diagnose`.
    """
    first, coordinates = values.diagnosis(tree, seconds, bias), Coordinates(tree.hinge_names, tree.kind)
    if joints.is_same or not first.differs:
        return first
    of_joints = [again for cause in first.causes if cause.joints and (again := restated(cause, joints, coordinates))]
    if of_joints:
        return first._replace(causes=tied([*of_joints, *(cause for cause in first.causes if not cause.joints)]))
    if first.causes and not any(cause.joints for cause in first.causes):
        return first
    anew = values.in_joints(joints).diagnosis(tree, seconds)
    if not anew.differs:
        cause = cause_of(1, [not_stated(joints)], 0.0, joint_map(coordinates, None))
        return first._replace(causes=tied([cause]))
    causes = [cause for cause in anew.causes if cause.joints]
    return first._replace(causes=tied(causes)) if causes else first


def restated(cause: Cause, joints: JointMap, coordinates: Coordinates) -> Cause | None:
    """A convention that was found with what was stated; None where both together cannot be stated."""
    both = joints.after(cause.joints, coordinates)
    if both is None:
        return None
    return cause._replace(joints=both, changes=(not_stated(joints),) if both.is_same else cause.changes)


def not_stated(joints: JointMap) -> Change:
    """The statement of the joints is what is wrong."""
    names = joints_stated(joints)
    return Change("order", WITHOUT, str(names), "", form="statement", values={"joints": names})
