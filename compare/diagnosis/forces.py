"""What else acts in accelerations than Mbar and h say: a torque of the other sign, damping, springs, friction.

Of given accelerations the force  r = tau - D qd - k (q - rest) - h - Mbar qdd  is left over, with Mbar and h of the same source:
what this source has besides, and it is zero where it has nothing.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np

import tmt
from tmt import literal

from .words import EXPLAINS, Cause, nice, together

TURNING = ("N m s/rad", "N m/rad", "N m")
UNITS_OF_FORCES = {"hinge": TURNING, "slide": ("N s/m", "N/m", "N"), "ball": TURNING}  # of damping, stiffness, force


class Column(NamedTuple):
    """A force that is one number times a known one."""

    name: str
    unit: str
    stated: float
    force: np.ndarray  # (states, nv), of a change of 1 of the number, in r
    is_never_negative: bool = True  # no damper, spring or friction is


def causes_of_forces(
    tree: tmt.Tree,
    q: np.ndarray,
    qd: np.ndarray,
    tau: np.ndarray,
    h: np.ndarray,
    left_over: np.ndarray,
    tolerance: np.ndarray,
) -> list[Cause]:
    """What explains the forces left over, r (states, nv): all causes of the first rank in which something does; [] if nothing.

    q: (states, nq), qd, tau, h: (states, nv). tolerance: of r, (states, nv) or what broadcasts to it.
    """
    size = float(np.linalg.norm(left_over))

    def left_by(force: np.ndarray) -> float | None:
        """The share of r that a force leaves, if it explains r."""
        rest = left_over - force
        return float(np.linalg.norm(rest)) / size if (np.abs(rest) <= tolerance).all() else None

    causes = []
    tolerance = np.broadcast_to(tolerance, left_over.shape)
    if (
        size == 0.0
        or not np.isfinite(left_over).all()
        or not (tolerance > 0.0).all()
        or not np.isfinite(tolerance).all()
    ):
        return causes
    for place, stated, explains, force in forms(tree, q, qd, tau, h):
        if (left := left_by(force)) is not None:
            causes.append(Cause(1, "option", place, stated, explains, "", left, 0, f"{place}: {explains}"))
    columns = list(numbers_of_forces(tree, q, qd))
    for count in (1, 2):
        if causes:
            break
        for chosen in combinations(columns, count):
            matrix = np.stack([column.force.ravel() for column in chosen], axis=1)
            if np.linalg.matrix_rank(matrix) < count:
                continue
            weight = (1.0 / tolerance).ravel()
            x = np.linalg.lstsq(matrix * weight[:, None], left_over.ravel() * weight, rcond=None)[0]
            if any(one.stated + change < 0.0 and one.is_never_negative for one, change in zip(chosen, x)):
                continue
            if (left := left_by((matrix @ x).reshape(left_over.shape))) is not None:
                causes.append(of_columns(chosen, x, left, 1 + count))
    return [cause._replace(tied=len(causes) - 1) for cause in causes]


def forms(tree: tmt.Tree, q, qd, tau, h) -> Iterator[tuple[str, str, str, np.ndarray]]:
    """Options: place, stated, what explains, and the force that is left over with it."""
    drag = np.array(tree.damping) * qd
    pull = literal.spring_torque(q, tree) if tree.has_springs else np.zeros_like(qd)
    for place, stated, term in (
        ("torque in the acceleration", "tau", -tau),
        ("bias in the acceleration", "- h", h),
        ("damping in the acceleration", "- D qd", drag),
        ("springs in the acceleration", "- k (q - rest)", pull),
    ):
        if term.any():
            yield place, stated, "left out", -term
            yield place, stated, "of the other sign", -2.0 * term
            yield place, stated, "twice", term


def numbers_of_forces(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> Iterator[Column]:
    """Damping, stiffness, friction and a constant force of each joint, and damping of all together."""
    joints = tree.coordinates.joints
    for i, (name, (kind, at, by)) in enumerate(zip(tree.hinge_names, joints)):
        units = UNITS_OF_FORCES[kind]
        for v in range(by.start, by.stop):
            called = name if kind != "ball" else f"{name} {'xyz'[v - by.start]}"
            own = np.eye(qd.shape[1])[v]
            yield Column(f"damping of {called}", units[0], tree.damping[v], qd[:, v : v + 1] * own)
            yield Column(f"friction of {called}", units[2], 0.0, np.sign(qd[:, v : v + 1]) * own)
            yield Column(f"constant force at {called}", units[2], 0.0, np.ones((len(qd), 1)) * own, False)
            if kind != "ball":
                rest = tree.rest[at.start] if tree.stiffness[i] else tree.reference[i]
                stretched = q[:, at.start : at.stop] - rest
                yield Column(f"stiffness of {called}", units[1], tree.stiffness[i], stretched * own)
    if len(joints) > 1 and not any(tree.damping):
        yield Column("damping of every joint", "N m s/rad", 0.0, np.array(qd))


def of_columns(chosen: tuple[Column, ...], x: np.ndarray, left: float, rank: int) -> Cause:
    """One number or two that explain the forces."""
    values = [column.stated + change for column, change in zip(chosen, x)]
    texts = [
        f"{column.name}: {nice(value)} {column.unit} in place of {nice(column.stated)}{EXPLAINS}"
        for column, value in zip(chosen, values)
    ]
    text = texts[0] if len(texts) == 1 else together(texts)
    if len(chosen) == 1:
        (column,), (value,) = chosen, values
        return Cause(rank, "number", column.name, column.stated, float(value), column.unit, left, 0, text)
    joined = (
        " and ".join(parts) for parts in ([c.name for c in chosen], [nice(c.stated) for c in chosen], map(nice, values))
    )
    units = " and ".join(dict.fromkeys(column.unit for column in chosen))
    return Cause(rank, "number and number", *joined, units, left, 0, text)
