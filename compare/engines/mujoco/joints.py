"""The joints of a compiled model as those of a Tree: their names, and where they stand in MuJoCo's vectors.

A free joint is four joints of a Tree: slides along the world's three axes, read at the origin, and a ball.
"""

from collections.abc import Iterable
from typing import NamedTuple

import mujoco
import numpy as np

from tmt.model.coordinates import KINDS as NUMBERS  # of a joint in qpos and in qvel: MuJoCo has the same

from ...robots.case import Coordinates

KINDS = {
    mujoco.mjtJoint.mjJNT_HINGE: "hinge",
    mujoco.mjtJoint.mjJNT_SLIDE: "slide",
    mujoco.mjtJoint.mjJNT_BALL: "ball",
    mujoco.mjtJoint.mjJNT_FREE: "free",
}
FREE_PARTS = ("x", "y", "z", "turn")  # of a free joint


class Place(NamedTuple):
    """Where a joint of a Tree stands in MuJoCo's vectors."""

    kind: str  # hinge, slide, ball
    joint: int  # its number in the model, the same for the four of a free joint
    qpos: range
    dofs: range


def own_name(name: str, what: str, number: int) -> str:
    """What an element is called: by its name if that can stand in a line, else `joint 3`."""
    return name if name.strip() and name.isprintable() else f"{what} {number}"


def joint_name(model: mujoco.MjModel, number: int) -> str:
    """What a joint is called; one without a name as no other."""
    return others_apart(model.joint(number).name, "joint", number, (model.joint(j).name for j in range(model.njnt)))


def others_apart(name: str, what: str, number: int, names: Iterable[str]) -> str:
    """own_name, and of one that is made up none of the names of the others."""
    found = own_name(name, what, number)
    if found != name:
        taken = set(names)
        while found in taken:
            found = f"unnamed {found}"
    return found


def kind_of(model: mujoco.MjModel, number: int) -> str:
    """hinge, slide, ball or free."""
    return KINDS[mujoco.mjtJoint(model.jnt_type[number])]


def parts_of(name: str) -> list[str]:
    """The four joints of a free one of this name."""
    return [f"{name} {part}" for part in FREE_PARTS]


def joint_places(model: mujoco.MjModel) -> dict[str, Place]:
    """The joints of a Tree by their names, in the order of the file."""
    found = []
    for number in range(model.njnt):
        name, kind = joint_name(model, number), kind_of(model, number)
        free = kind == "free"
        names, kinds = (parts_of(name), ["slide"] * 3 + ["ball"]) if free else ([name], [kind])
        q, v = int(model.jnt_qposadr[number]), int(model.jnt_dofadr[number])
        for name, kind in zip(names, kinds):
            nq, nv = NUMBERS[kind]
            found.append((name, Place(kind, number, range(q, q + nq), range(v, v + nv))))
            q, v = q + nq, v + nv
    coordinates = Coordinates(tuple(name for name, _ in found), tuple(place.kind for _, place in found))
    for columns in (coordinates.names, coordinates.positions, coordinates.speeds):
        if len(set(columns)) < len(columns):
            twice = next(name for name in columns if columns.count(name) > 1)
            parts = "a ball w has the speeds w x, w y, w z, and a free joint the parts w x, w y, w z, w turn"
            raise ValueError(f"two of its joints are called {twice!r}; {parts}")
    return dict(found)


def reference_qpos(model: mujoco.MjModel) -> np.ndarray:
    """qpos where every frame of the Tree is parallel to the world's: qpos0, free bodies at the origin and not turned."""
    qpos = model.qpos0.copy()
    for number in range(model.njnt):
        if kind_of(model, number) == "free":
            start = model.jnt_qposadr[number]
            qpos[start : start + 7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    return qpos


def moved(model: mujoco.MjModel) -> np.ndarray:
    """Of each body whether a joint moves it, (nbody,)."""
    found = np.zeros(model.nbody, bool)
    for body in range(1, model.nbody):
        found[body] = found[model.body_parentid[body]] or model.body_jntnum[body] > 0
    return found


def resting(model: mujoco.MjModel) -> np.ndarray:
    """The numbers of the bodies that no joint moves."""
    return np.flatnonzero(~moved(model))


def aligns(joint) -> bool:
    """Whether the compiler turns the frame of a free joint's body into its inertial frame."""
    if mujoco.mjtJoint(joint.type) != mujoco.mjtJoint.mjJNT_FREE:
        return False
    align = mujoco.mjtAlignFree(joint.align)
    by_compiler = align == mujoco.mjtAlignFree.mjALIGNFREE_AUTO and bool(joint.compiler.alignfree)
    return by_compiler or align == mujoco.mjtAlignFree.mjALIGNFREE_TRUE
