"""The compiled model for other engines: as it is, and as a URDF text where a reader of MJCF loses masses or joints."""

from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ...robots.actuators import Controller
from ..outside.model import combined
from .dynamics import Engaged
from .engine import engaged
from .inventory import switch_off, take_away
from .names import INTEGRATORS, bit, joint_name, joint_places, kind_of, matrix, rotors, tensor
from .reading import carriers
from .source import Source

HELD = (
    "body_parentid", "body_pos", "body_quat", "body_mass", "body_inertia", "body_ipos", "body_iquat", "jnt_bodyid",
    "jnt_stiffness", "dof_jntid", "dof_armature", "dof_damping",
)  # fmt: skip
KINDS = {"hinge": "continuous", "slide": "prismatic"}
NO_JOINT = -1
FAR = "1e9"  # limits that nothing reaches: a prismatic joint has to state some


def urdf(compiled: mujoco.MjModel, has_free_bodies: bool = False) -> str:
    """A URDF text of a compiled model; ValueError where it cannot be one.

    Its base is fixed; has_free_bodies: with free joints, of type floating, of which readers make what they like.

    Numbers have 17 significant digits; positions are those of the file (`ref` included), joints have its names. The
    frame of a link has its origin on the axis of its hinge. Of several joints in one body all but the last move a link
    without mass, and a body without a joint hangs on a fixed one. URDF has no gravity, armature or springs; geoms, limits
    and friction are left out.
    """
    model = mujoco.MjModel.__copy__(compiled)
    take_away(model)  # what a flag of the file disables is zero
    names = [joint_name(model, j) for j in range(model.njnt)]
    for j, name in enumerate(names):
        if (kind := kind_of(model, j)) not in KINDS and not (has_free_bodies and kind == "free"):
            only = "a URDF with a fixed base has only hinges and slides"
            raise ValueError(f"joint {name!r} is of type {kind}; {only}")
    robot = Element("robot", name="robot")
    SubElement(robot, "link", name="link0")
    origins = [np.zeros(3)]  # of the link of each body, in the frame of the body
    for body in range(1, model.nbody):
        parent, first = int(model.body_parentid[body]), int(model.body_jntadr[body])
        position, turn = model.body_pos[body] - origins[parent], matrix(model.body_quat[body])
        link, origin = f"link{parent}", np.zeros(3)
        for j in range(first, first + int(model.body_jntnum[body])) or [NO_JOINT]:
            anchor, moved, turned = np.zeros(3), np.zeros(3), np.eye(3)
            kind = kind_of(model, j) if j != NO_JOINT else ""
            if kind == "free":
                position, turn = np.zeros(3), np.eye(3)
            elif kind:
                axis, reference = model.jnt_axis[j], model.qpos0[model.jnt_qposadr[j]]
                if kind == "hinge":
                    anchor, turned = model.jnt_pos[j].copy(), about(axis, -reference)
                else:
                    moved = -reference * axis
            is_last = j in (NO_JOINT, first + int(model.body_jntnum[body]) - 1)
            child = f"link{body}" if is_last else f"link{body}_{j}"
            joint = joint_of(model, j, kind, names[j] if kind else unused(f"fixed{body}", names))
            SubElement(joint, "origin", frame(position + turn @ (anchor - origin + moved), turn @ turned))
            SubElement(joint, "parent", link=link)
            SubElement(joint, "child", link=child)
            robot.extend([joint, link_of(child, model, body if is_last else 0, anchor)])
            link, origin, position, turn = child, anchor, np.zeros(3), np.eye(3)
        origins.append(origin)
    indent(robot)
    return tostring(robot, encoding="unicode") + "\n"


def joint_of(model: mujoco.MjModel, j: int, kind: str, name: str) -> Element:
    """A joint without its place; kind: of MuJoCo's joint j, "" for a fixed one."""
    joint = Element("joint", name=name, type=KINDS.get(kind, "floating" if kind else "fixed"))
    if kind in KINDS:
        SubElement(joint, "axis", xyz=text(model.jnt_axis[j]))
        damping = text(model.dof_damping[model.jnt_dofadr[j]])
        SubElement(joint, "dynamics", damping=damping, friction="0")
        SubElement(joint, "limit", lower="-" + FAR, upper=FAR, effort=FAR, velocity=FAR)
    return joint


def link_of(name: str, model: mujoco.MjModel, body: int, origin: np.ndarray) -> Element:
    """A link with the mass of a body, of which body 0 has none, and moments about its principal axes."""
    link = Element("link", name=name)
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", frame(model.body_ipos[body] - origin, matrix(model.body_iquat[body])))
    SubElement(inertial, "mass", value=text(model.body_mass[body]))
    moments = dict(zip(("ixx", "iyy", "izz"), map(text, model.body_inertia[body])))
    SubElement(inertial, "inertia", moments | dict.fromkeys(("ixy", "ixz", "iyz"), "0"))
    return link


def frame(position: np.ndarray, R: np.ndarray) -> dict[str, str]:
    """An origin. R = Rz(yaw) Ry(pitch) Rx(roll); the angles are found to all digits for every pitch."""
    yaw = np.arctan2(R[1, 0], R[0, 0])
    c, s = np.cos(yaw), np.sin(yaw)
    pitch = np.arctan2(-R[2, 0], c * R[0, 0] + s * R[1, 0])
    roll = np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return {"xyz": text(position), "rpy": text([roll, pitch, yaw])}


def text(values: ArrayLike) -> str:
    return " ".join(f"{value + 0.0:.17g}" for value in np.ravel(values))


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    quat = np.zeros(4)
    mujoco.mju_axisAngle2Quat(quat, axis, angle)
    return matrix(quat)


def unused(name: str, names: list[str]) -> str:
    return unused(f"{name}_", names) if name in names else name


class Bare:
    """The compiled model of a file with all that a Tree does not have taken away or switched off.

    names: of the Tree's joints. rotors_in_joints: the armature of actuators is that of their joints. controller: of the
    actuators that act, with `engaged` controls; None: none does. qpos (nq,), dofs (nv,): the indices of the Tree's
    coordinates and speeds in MuJoCo's.
    """

    engaged = Engaged()

    def __init__(
        self, path: Path, names: Sequence[str], rotors_in_joints: bool = False, controller: Controller | None = None
    ):  # fmt: skip
        m = self.model = Source(path).without({}, bare=controller is None)
        switch_off(m)
        # MuJoCo Warp refuses the first; with the second its implicitfast is explicit in the damping
        m.opt.disableflags &= ~bit("AUTORESET", "ACTUATION")
        m.opt.disableflags |= bit("WARMSTART")  # its solver starts from the unconstrained acceleration
        m.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON  # of constraints, which are off; both refuse PGS
        if rotors_in_joints and hasattr(m, "actuator_armature"):
            m.dof_armature += rotors(m)
            m.actuator_armature[:] = 0.0
        idle = np.ones(m.nu, bool)  # actuators with armature are still there
        if controller:
            self.engaged = engaged(m, controller)
            m.opt.disableactuator = 0  # not every engine has groups
            idle = np.array([control is None for control in controller.controls])
        m.actuator_gainprm[idle] = m.actuator_biasprm[idle] = 0.0
        m.geom_contype[:] = m.geom_conaffinity[:] = 0  # MJX refuses pairs even if there are no contacts
        places = joint_places(m)
        self.places = {name: places[name] for name in names}
        self.qpos = np.array([i for place in self.places.values() for i in place.qpos])
        self.dofs = np.array([i for place in self.places.values() for i in place.dofs])

    def with_integrator(self, name: str) -> mujoco.MjModel:
        """The model, which has this integrator now."""
        self.model.opt.integrator = INTEGRATORS[name]
        return self.model

    def numbers(self, held: Callable[[str], np.ndarray]) -> dict[str, np.ndarray]:
        """ReadModel.numbers, except gravity, of what an engine holds by MuJoCo's names, see HELD."""
        m = SimpleNamespace(nbody=self.model.nbody, **{name: held(name) for name in HELD})
        carrier, has_joint = carriers(m, list(self.places.values())), set(m.jnt_bodyid.tolist())
        frames = [(np.zeros(3), np.eye(3))]  # of each body in the axes of the last one that a joint moves
        carried: list[list[tuple[float, np.ndarray, np.ndarray]]] = [[] for _ in self.places]
        for body in range(1, m.nbody):
            at, turn = frames[0]
            if body not in has_joint:
                at, turn = frames[m.body_parentid[body]]
                at, turn = at + turn @ m.body_pos[body], turn @ matrix(m.body_quat[body])
            frames.append((at, turn))
            if carrier[body] >= 0:
                inertia = turn @ tensor(matrix(m.body_iquat[body]), m.body_inertia[body]) @ turn.T
                carried[carrier[body]].append((m.body_mass[body], at + turn @ m.body_ipos[body], inertia))
        mass, _, inertias = map(np.array, zip(*map(combined, carried)))
        numbers = {"mass": mass, "moments": np.linalg.eigvalsh(inertias)}
        numbers |= {"armature": m.dof_armature[self.dofs], "damping": m.dof_damping[self.dofs]}
        return numbers | {"stiffness": m.jnt_stiffness[m.dof_jntid][self.dofs]}
