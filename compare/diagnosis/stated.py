"""A diagnosis of equations whose joints are stated: what is wrong with the statement comes first, as it is to be stated."""

from collections.abc import Callable

import numpy as np

import tmt

from ..robots.coordinates import Coordinates
from ..robots.joint_map import JointMap, joint_map
from . import Diagnosis, diagnose, packed
from .words import Cause, joints_stated

WITHOUT = "the joints are the model's"


def diagnose_stated(
    tree: tmt.Tree,
    joints: JointMap,
    q: np.ndarray,
    qd: np.ndarray,
    values: tuple[np.ndarray | None, np.ndarray | None],
    tolerances: tuple[np.ndarray, np.ndarray],
    seconds: float,
    bias: Callable | None = None,
) -> Diagnosis:
    """What explains Mbar and h, `values`, at states in the model's joints; tolerances: of both. joints: as they were stated.

    A convention that is found is of joints that are taken for the model's: it is told together with what was stated, and first.
    bias: see `diagnose`.
    """
    nv, coordinates = tree.coordinates.nv, Coordinates(tree.hinge_names, tree.kind)

    def found(q, qd, values, tolerances, bias) -> Diagnosis:
        given, allowed = (packed(*both, nv, len(q)) for both in (values, tolerances))
        return diagnose(tree, coordinates.names, q, qd, given, allowed, seconds, bias)

    first = found(q, qd, values, tolerances, bias)
    if joints.is_same or not first.differs:
        return first
    of_joints = [again for cause in first.causes if cause.joints and (again := restated(cause, joints, coordinates))]
    if of_joints:
        return with_causes(first, [*of_joints, *(cause for cause in first.causes if not cause.joints)])
    if first.causes and not any(cause.joints for cause in first.causes):
        return first
    M, h = values
    own = None if M is None else joints.own_mass_matrix(M), None if h is None else joints.own_forces(h)
    of_own = np.abs(joints.own_mass_matrix(tolerances[0])), np.abs(joints.own_forces(tolerances[1]))
    anew = found(joints.own_positions(q), joints.own_speeds(qd), own, of_own, None)
    if not anew.differs:
        as_they_are = joint_map(coordinates, None)
        cause = Cause(1, "order", WITHOUT, str(joints_stated(joints)), "", "", 0.0, 0, not_stated(joints), as_they_are)
        return with_causes(first, [cause])
    causes = [cause for cause in anew.causes if cause.joints]
    return with_causes(first, causes) if causes else first


def with_causes(first: Diagnosis, causes: list[Cause]) -> Diagnosis:
    """A diagnosis with other causes."""
    return first._replace(causes=tuple(cause._replace(tied=len(causes) - 1) for cause in causes))


def restated(cause: Cause, joints: JointMap, coordinates: Coordinates) -> Cause | None:
    """A convention that was found with what was stated; None where both together cannot be stated."""
    both = joints.after(cause.joints, coordinates)
    if both is None:
        return None
    return cause._replace(joints=both, what=not_stated(joints) if both.is_same else cause.what)


def not_stated(joints: JointMap) -> str:
    """That what is stated of the joints is what is wrong."""
    return f"joints={joints_stated(joints)} explains it: without it they agree"
