"""MuJoCo's names and numbers: integrators, flags, rotations, the joints of a model as those of a Tree.

A free joint is four joints of a Tree: slides along the world's x, y and z axes, read at the origin, and a
ball.
"""

from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ...robots.coordinates import FREE, Coordinates

Integer = int | np.integer[Any]
FROM_4 = mujoco.mj_version() >= 4_000_000
# those that the installed version has; discrete came with 3.13
NAMES = "Euler", "implicitfast", "discrete", "implicit", "RK4"
MEMBERS = {name: getattr(mujoco.mjtIntegrator, f"mjINT_{name.upper()}", None) for name in NAMES}
INTEGRATORS = {name: member for name, member in MEMBERS.items() if member is not None}
EVALUATIONS = dict.fromkeys(INTEGRATORS, 1) | {"RK4": 4}  # of the dynamics, in a step
OF_A_JOINT = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)  # transmissions
# dynamics of an activation that settles where its control leads, or stays
SETTLING = [int(getattr(mujoco.mjtDyn, f"mjDYN_{name}")) for name in ("INTEGRATOR", "FILTER", "FILTEREXACT")]
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


def element_name(m: mujoco.MjModel, kind: str, number: Integer) -> str:
    """The name of an element; `joint 3`, never another's name, where it has none that can be printed."""
    stated, type_of = getattr(m, kind)(int(number)).name, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
    name = stated if stated.strip() and stated.isprintable() else f"{kind} {int(number)}"
    while name != stated and mujoco.mj_name2id(m, type_of, name) >= 0:
        name = f"unnamed {name}"
    return name


def joint_name(m: mujoco.MjModel, number: Integer) -> str:
    return element_name(m, "joint", number)


def geom_name(m: mujoco.MjModel, geom: Integer) -> str:
    """The name of a geom, else that of its body."""
    body = int(m.geom_bodyid[geom])
    bearer = element_name(m, "body", body) if body else "the world"
    return m.geom(int(geom)).name or f"a geom of {bearer}"


def names_where(m: mujoco.MjModel, field: str, holds: np.ndarray) -> list[str]:
    """The names of the elements (of speeds: the joints) for which something holds in their row of a field."""
    prefix, rows = field.partition("_")[0], np.flatnonzero([row.any() for row in holds])
    if prefix == "dof":
        rows = np.unique(m.dof_jntid[rows])
    kind = {"dof": "joint", "jnt": "joint"}.get(prefix, prefix)
    return [element_name(m, kind, row) for row in rows]


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
    joints: list[tuple[str, str, int]] = []
    for number in range(m.njnt):
        name, kind = joint_name(m, number), kind_of(m, number)
        is_free = kind == "free"
        joints += zip(parts_of(name), FREE, [number] * 4) if is_free else [(name, kind, number)]
    coordinates = Coordinates(tuple(name for name, _, _ in joints), tuple(kind for _, kind, _ in joints))
    for columns in (coordinates.names, coordinates.positions, coordinates.speeds):
        if twice := sorted({name for name in columns if columns.count(name) > 1}):
            parts = "a ball w has the speeds w x, w y, w z, and a free joint the parts w x, w y, w z, w turn"
            raise ValueError(f"two of its joints are called {twice[0]!r}; {parts}")
    places = {}  # MuJoCo's vectors have the same order
    for (name, kind, number), joint in zip(joints, coordinates.places.joints):
        places[name] = Place(kind, number, range(joint.q.start, joint.q.stop), joint.speeds)
    return places


def moving(m: mujoco.MjModel) -> np.ndarray:
    """Of each body whether a joint moves it, (nbody,)."""
    return m.body_dofnum[m.body_weldid] > 0


def aligns(joint: mujoco.MjsJoint) -> bool:
    """Whether the compiler turns the frame of a free joint's body into its inertial frame."""
    options = mujoco.mjtAlignFree
    is_left = joint.align == options.mjALIGNFREE_AUTO and bool(joint.compiler.alignfree)
    is_free = joint.type == mujoco.mjtJoint.mjJNT_FREE
    return bool(is_free and (is_left or joint.align == options.mjALIGNFREE_TRUE))


def number_of_actuators(m: mujoco.MjModel) -> int:
    """From 3.10 to 4.0 the number of controls; since then an actuator may have several of them."""
    return int(getattr(m, "nactuator", m.nu))


def control_of(m: mujoco.MjModel, actuator: int) -> tuple[int, int]:
    """The index of the first control of an actuator, and the number of its controls."""
    if hasattr(m, "actuator_ctrlnum"):
        return int(m.actuator_ctrladr[actuator]), int(m.actuator_ctrlnum[actuator])
    return actuator, 1


def output_of(m: mujoco.MjModel, actuator: int) -> int:
    """The index of the length, gear and moment of an actuator: since 4.0 it may have several outputs."""
    return int(m.actuator_outadr[actuator]) if hasattr(m, "actuator_outadr") else actuator


def set_control(m: mujoco.MjModel, actuator: int, u: float, ctrl: np.ndarray, act: np.ndarray) -> None:
    """Put u of an actuator with one control where it belongs: (nu,) controls and (na,) activations.

    u of an integrator is its activation, at control 0; a filter's activation is where its control leads.
    """
    place, inputs = control_of(m, actuator)
    kind = mujoco.mjtDyn(m.actuator_dyntype[actuator])
    if inputs == 1:
        ctrl[place] = 0.0 if kind == mujoco.mjtDyn.mjDYN_INTEGRATOR else u
    if int(kind) in SETTLING:
        act[m.actuator_actadr[actuator]] = u


def rotors(m: mujoco.MjModel) -> np.ndarray:
    """Armature of actuators at joints, times gear squared, at the speeds of their joints, (nv,), kg m2 or kg.

    MuJoCo takes the first number of the gear for every speed of the joint.
    """
    diagonal = np.zeros(m.nv)
    for i in map(int, np.flatnonzero(getattr(m, "actuator_armature", np.zeros(0)))):
        if mujoco.mjtTrn(m.actuator_trntype[i]) in OF_A_JOINT:
            added = m.actuator_armature[i] * m.actuator_gear[output_of(m, i), 0] ** 2
            diagonal[m.dof_jntid == m.actuator_trnid[i, 0]] += added
    return diagonal


def matrix(quat: ArrayLike) -> np.ndarray:
    """The rotation matrix of a quaternion, (3, 3)."""
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, np.array(quat, float))
    return R.reshape(3, 3)


def tensor(R: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """The tensor of principal moments (3,) about the columns of R, (3, 3)."""
    return R @ np.diag(moments) @ R.T
