"""What else acts in accelerations than Mbar and h: a torque of the opposite sign, damping, springs, friction.

For given accelerations the force  r = tau - D qd - k (q - rest) - h - Mbar qdd  is left over, with Mbar and h of the same source:
zero if nothing else acts.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np

import tmt
from tmt import literal

from .cause import Cause, Change, cause_of, number_changed, tied

TURNING = ("N m s/rad", "N m/rad", "N m")
UNITS_OF_FORCES = {"hinge": TURNING, "slide": ("N s/m", "N/m", "N"), "ball": TURNING}  # of damping, stiffness, force


class Column(NamedTuple):
    """A force that is one number times a known one."""

    name: str
    unit: str
    stated: float
    force: np.ndarray  # (states, nv), of a change of 1 of the number, in r
    is_never_negative: bool = True  # no damper, spring or friction is


def force_left_over(tree: tmt.Tree, q, qd, tau, M, h, qdd) -> np.ndarray:
    """r, (states, nv)."""
    pull = literal.spring_torque(q, tree) if tree.has_springs else 0.0
    return tau - np.array(tree.damping) * qd - pull - h - np.einsum("sij,sj->si", M, qdd)


def causes_of_forces(
    tree: tmt.Tree,
    q: np.ndarray,
    qd: np.ndarray,
    tau: np.ndarray,
    h: np.ndarray,
    left_over: np.ndarray,
    tolerance: np.ndarray,
) -> tuple[Cause, ...]:
    """What explains the forces left over, r (states, nv): all causes of the first rank that has one.

    q: (states, nq), qd, tau, h: (states, nv). tolerance: of r, (states, nv) or what broadcasts to it.
    """
    size, tolerance = float(np.linalg.norm(left_over)), np.broadcast_to(tolerance, left_over.shape)
    if not (0.0 < size < np.inf and (tolerance > 0.0).all() and np.isfinite(tolerance).all()):
        return ()
    causes = []

    def explains(changes: list[Change], force: np.ndarray) -> None:
        rest = left_over - force
        if (np.abs(rest) <= tolerance).all():
            rank = 1 if changes[0].kind == "option" else 1 + len(changes)
            causes.append(cause_of(rank, changes, float(np.linalg.norm(rest)) / size))

    for change, force in options_of_forces(tree, q, qd, tau, h):
        explains([change], force)
    columns, weight = list(numbers_of_forces(tree, q, qd)), (1.0 / tolerance).ravel()
    for count in (1, 2):
        for chosen in combinations(columns, count) if not causes else ():
            matrix = np.stack([column.force.ravel() for column in chosen], axis=1)
            if np.linalg.matrix_rank(matrix) < count:
                continue
            x = np.linalg.lstsq(matrix * weight[:, None], left_over.ravel() * weight, rcond=None)[0]
            if any(one.stated + change < 0.0 and one.is_never_negative for one, change in zip(chosen, x)):
                continue
            changes = [number_changed(one.name, one.stated, one.stated + dx, one.unit) for one, dx in zip(chosen, x)]
            explains(changes, (matrix @ x).reshape(left_over.shape))
    return tied(causes)


def options_of_forces(tree: tmt.Tree, q, qd, tau, h) -> Iterator[tuple[Change, np.ndarray]]:
    """Each option and the force that is left over with it."""
    drag = np.array(tree.damping) * qd
    pull = literal.spring_torque(q, tree) if tree.has_springs else np.zeros_like(qd)
    for place, stated, term in (
        ("torque in the acceleration", "tau", -tau),
        ("bias in the acceleration", "- h", h),
        ("damping in the acceleration", "- D qd", drag),
        ("springs in the acceleration", "- k (q - rest)", pull),
    ):
        for explains, factor in (("left out", -1.0), ("of the other sign", -2.0), ("twice", 1.0)):
            if term.any():
                yield Change("option", place, stated, explains), factor * term


def numbers_of_forces(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> Iterator[Column]:
    """Damping, stiffness, friction and a constant force of each joint, and damping of all together."""
    joints = tree.coordinates.joints
    for i, (name, (kind, at, by)) in enumerate(zip(tree.hinge_names, joints)):
        of_damping, of_stiffness, of_force = UNITS_OF_FORCES[kind]
        for v in range(by.start, by.stop):
            axis = name if kind != "ball" else f"{name} {'xyz'[v - by.start]}"
            own, speed = np.eye(qd.shape[1])[v], qd[:, v : v + 1]
            yield Column(f"damping of {axis}", of_damping, tree.damping[v], speed * own)
            yield Column(f"friction of {axis}", of_force, 0.0, np.sign(speed) * own)
            yield Column(f"constant force at {axis}", of_force, 0.0, np.ones((len(qd), 1)) * own, False)
            if kind != "ball":
                rest = tree.rest[at.start] if tree.stiffness[i] else tree.reference[i]
                yield Column(f"stiffness of {axis}", of_stiffness, tree.stiffness[i], (q[:, at] - rest) * own)
    if len(joints) > 1 and not any(tree.damping):
        yield Column("damping of every joint", "N m s/rad", 0.0, np.array(qd))
