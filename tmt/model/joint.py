"""A tree written joint by joint, each with the body that it moves."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .values import require, shown

THE_ONE_BEFORE = "the joint before"
AXES = np.eye(3)
OF_JOINT = "joint_names", "parent", "offset", "kind", "stiffness"
OF_BODY = "body_names", "body_joint", "mass", "com", "inertia"


@dataclass(eq=False, match_args=False)
class Joint:
    """A joint of `Tree.from_joints`, and the body that it moves.

    Parameters
    ----------
    name : str
        Of the joint and of its body. A free joint b is three slides b x, b y, b z and a ball b turn.
    kind : {"hinge", "slide", "ball", "free"}
    parent : str or None
        The joint whose frame carries this one; None: the world. By default the joint before it in the list.
    offset : (3,), m, from the origin of the parent's frame, in its axes
    axis : (3,), of a hinge or slide, in the same axes
    mass : float, kg; None: the joint has no body of its own, as of several joints in one body all but the last
    com : (3,), m, in the frame of the joint
    inertia : (3,), the diagonal, (6,), xx yy zz xy xz yz, or (3, 3), kg m2, about the centre of mass, in these axes
    damping, armature : float or one for each speed, N m s/rad and kg m2, of slides N s/m and kg
    stiffness : float, N m/rad, of slides N/m
    rest : float, rad or m, where its spring is without force; of balls and free joints at zero
    """

    name: str
    kind: str = "hinge"
    parent: str | None = THE_ONE_BEFORE
    offset: ArrayLike = (0.0, 0.0, 0.0)
    axis: ArrayLike = (0.0, 0.0, 1.0)
    mass: float | None = None
    com: ArrayLike = (0.0, 0.0, 0.0)
    inertia: ArrayLike = (0.0, 0.0, 0.0)
    damping: ArrayLike = 0.0
    armature: ArrayLike = 0.0
    stiffness: float = 0.0
    rest: float = 0.0


def fields_of(joints: Iterable[Joint]) -> dict[str, Any]:
    """The fields of a Tree, all but the gravity; ValueError for what is no joint."""
    rows: list[tuple[Any, ...]] = []  # as OF_JOINT
    bodies: list[tuple[Any, ...]] = []  # as OF_BODY
    speeds: dict[str, list[Any]] = {"axis": [], "damping": [], "armature": []}
    rest: list[float] = []
    last: dict[str | None, int] = {
        None: -1
    }  # by its name the number of the joint whose frame is that of its body
    for joint in joints:
        require(isinstance(joint, Joint), "a joint", joint, "a tmt.Joint is")
        parent = len(rows) - 1 if joint.parent == THE_ONE_BEFORE else last.get(joint.parent)
        if parent is None:
            known = ", ".join(name for name in last if name) or "no joint"
            raise ValueError(f"parent of {joint.name!r} is {shown(joint.parent)}; before it stand {known}")
        parts = [(joint.name, joint.kind)]
        axes = AXES if joint.kind == "ball" else np.reshape(joint.axis, (1, -1))
        if joint.kind == "free":
            parts = [(f"{joint.name} {axis}", "slide") for axis in "xyz"] + [(f"{joint.name} turn", "ball")]
            axes = np.concatenate([AXES, AXES])
        speeds["axis"] += list(axes)
        for name in ("damping", "armature"):
            speeds[name] += list(np.broadcast_to(getattr(joint, name), len(axes)))
        for name, kind in parts:
            is_first = name == parts[0][0]
            rows.append((name, parent, joint.offset if is_first else (0.0, 0.0, 0.0), kind, joint.stiffness))
            rest += [1.0, 0.0, 0.0, 0.0] if kind == "ball" else [joint.rest]
            parent = len(rows) - 1
        last[joint.name] = parent
        if joint.mass is not None:
            bodies.append((joint.name, parent, joint.mass, joint.com, tensor(joint)))
    by_joint = {name: [row[k] for row in rows] for k, name in enumerate(OF_JOINT)}
    by_body = {name: [row[k] for row in bodies] for k, name in enumerate(OF_BODY)}
    return by_joint | by_body | speeds | {"rest": rest}


def tensor(joint: Joint) -> np.ndarray:
    given = np.asarray(joint.inertia, dtype=float)
    if given.shape == (3, 3):
        return given
    of = f"shape of the inertia of {joint.name!r}"
    require(given.shape in ((3,), (6,)), of, given.shape, "(3,), (6,) or (3, 3) is")
    xx, yy, zz, xy, xz, yz = [*given, 0.0, 0.0, 0.0][:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
