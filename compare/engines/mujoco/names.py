"""MuJoCo's names and numbers: integrators, flags, and the joints of a compiled model as those of a Tree.

A free joint is four joints of a Tree: slides along the world's x, y and z axes, read at the origin, and a ball.
"""

from typing import NamedTuple

import mujoco
import numpy as np

from tmt.model.coordinates import KINDS as NUMBERS  # of a joint in qpos and in qvel: MuJoCo has the same

from ...robots.case import Coordinates

# those that the installed version has; discrete came with 3.13
NAMES = {
    "Euler": "EULER",
    "implicitfast": "IMPLICITFAST",
    "discrete": "DISCRETE",
    "implicit": "IMPLICIT",
    "RK4": "RK4",
}
MEMBERS = {name: getattr(mujoco.mjtIntegrator, f"mjINT_{member}", None) for name, member in NAMES.items()}
INTEGRATORS = {name: member for name, member in MEMBERS.items() if member is not None}
EVALUATIONS = dict.fromkeys(INTEGRATORS, 1) | {"RK4": 4}  # of the dynamics, in a step
OF_A_JOINT = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)  # transmissions
FREE_PARTS = ("x", "y", "z", "turn")


def integrator_by_name(name: str) -> str:
    """An integrator of the installed MuJoCo by its name; ValueError, in one line, for another name."""
    if name not in INTEGRATORS:
        expected = f"expected one of {', '.join(INTEGRATORS)}"
        raise ValueError(f"MuJoCo {mujoco.__version__} has no integrator {name!r}; {expected}")
    return name


def bit(*flags: str) -> int:
    """The bits of disable flags; 0 for one that the installed MuJoCo does not have."""
    return sum(int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}", 0)) for flag in flags)


def on(m: mujoco.MjModel, flag: str) -> bool:
    """Whether the stage is on that this disable flag would switch off."""
    return not m.opt.disableflags & bit(flag)


def own_name(name: str, what: str, number: int) -> str:
    """The name of an element if it can be printed in a line, else `joint 3`."""
    return name if name.strip() and name.isprintable() else f"{what} {number}"


def element_name(m: mujoco.MjModel, kind: str, number: int) -> str:
    """own_name of an element of a kind, by mujoco.MjModel's names of kinds; not the name of another element."""
    stated, known = getattr(m, kind)(int(number)).name, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
    name = own_name(stated, kind, int(number))
    while name != stated and mujoco.mj_name2id(m, known, name) >= 0:
        name = f"unnamed {name}"
    return name


def joint_name(m: mujoco.MjModel, number: int) -> str:
    return element_name(m, "joint", number)


def kind_of(m: mujoco.MjModel, number: int) -> str:
    """The type of a joint: hinge, slide, ball or free."""
    return mujoco.mjtJoint(m.jnt_type[number]).name.removeprefix("mjJNT_").lower()


class Place(NamedTuple):
    """Where a joint of a Tree is in MuJoCo's vectors."""

    kind: str  # hinge, slide, ball
    joint: int  # its number in the model, the same for the four of a free joint
    qpos: range
    dofs: range


def parts_of(name: str) -> list[str]:
    """The names of the four joints of a free joint."""
    return [f"{name} {part}" for part in FREE_PARTS]


def joint_places(m: mujoco.MjModel) -> dict[str, Place]:
    """The joints of a Tree by name, in the order of the file."""
    places = []
    for number in range(m.njnt):
        name, kind = joint_name(m, number), kind_of(m, number)
        parts = zip(parts_of(name), ["slide"] * 3 + ["ball"]) if kind == "free" else [(name, kind)]
        q, v = int(m.jnt_qposadr[number]), int(m.jnt_dofadr[number])
        for name, kind in parts:
            nq, nv = NUMBERS[kind]
            places.append((name, Place(kind, number, range(q, q + nq), range(v, v + nv))))
            q, v = q + nq, v + nv
    coordinates = Coordinates(tuple(name for name, _ in places), tuple(place.kind for _, place in places))
    for columns in (coordinates.names, coordinates.positions, coordinates.speeds):
        if twice := sorted({name for name in columns if columns.count(name) > 1}):
            parts = "a ball w has the speeds w x, w y, w z, and a free joint the parts w x, w y, w z, w turn"
            raise ValueError(f"two of its joints are called {twice[0]!r}; {parts}")
    return dict(places)


def moving(m: mujoco.MjModel) -> np.ndarray:
    """Of each body whether a joint moves it, (nbody,)."""
    return m.body_dofnum[m.body_weldid] > 0


def aligns(joint: mujoco.MjsJoint) -> bool:
    """Whether the compiler turns the frame of a free joint's body into its inertial frame."""
    asked = mujoco.mjtAlignFree.mjALIGNFREE_TRUE
    if joint.compiler.alignfree and joint.align == mujoco.mjtAlignFree.mjALIGNFREE_AUTO:
        asked = mujoco.mjtAlignFree.mjALIGNFREE_AUTO
    return bool(joint.type == mujoco.mjtJoint.mjJNT_FREE and joint.align == asked)


def number_of_actuators(m: mujoco.MjModel) -> int:
    """From 3.10 to 4.0 the number of controls; since then an actuator may have several of them."""
    return getattr(m, "nactuator", m.nu)


def output_of(m: mujoco.MjModel, actuator: int) -> int:
    """The index of the length, gear and moment of an actuator: since 4.0 an actuator may have several outputs."""
    return int(m.actuator_outadr[actuator]) if hasattr(m, "actuator_outadr") else actuator


def rotors(m: mujoco.MjModel) -> np.ndarray:
    """Armature of actuators times gear squared, (nv,), kg m2 or kg; ValueError for an actuator that acts on no joint.

    MuJoCo takes the first number of the gear for every speed of the joint.
    """
    diagonal = np.zeros(m.nv)
    for i in map(int, np.flatnonzero(getattr(m, "actuator_armature", np.zeros(0)))):
        if mujoco.mjtTrn(m.actuator_trntype[i]) not in OF_A_JOINT:
            name = element_name(m, "actuator", i)
            raise ValueError(
                f"actuator {name!r} has armature and acts on no joint; only that of joints is compared"
            )
        added = m.actuator_armature[i] * m.actuator_gear[output_of(m, i), 0] ** 2
        diagonal[m.dof_jntid == m.actuator_trnid[i, 0]] += added
    return diagonal
