"""The compiled model for other engines: as it is, and as a URDF for those that read MJCF in part."""

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ...robots.actuators import Controller
from .dynamics import Engaged
from .engine import engaged
from .inventory import switch_off, take_away
from .names import INTEGRATORS, bit, joint_name, joint_places, kind_of, matrix, rotors
from .source import Source

KINDS = {"hinge": "continuous", "slide": "prismatic", "free": "floating"}
NO_JOINT = -1
FAR = "1e9"  # limits that nothing reaches: a prismatic joint has to state some


def urdf(compiled: mujoco.MjModel) -> str:
    """A URDF text of a compiled model; ValueError where it cannot be one.

    Free joints are of type floating, of which readers make what they like.

    Numbers have 17 significant digits; positions are those of the file (`ref` included), joints have its
    names. The frame of a link has its origin on the axis of its hinge. Of several joints in one body all but
    the last move a link without mass, and a body without a joint hangs on a fixed one. URDF has no gravity,
    armature or springs; geoms, limits and friction are left out.
    """
    model = mujoco.MjModel.__copy__(compiled)
    take_away(model)  # what a flag of the file disables is zero
    names = [joint_name(model, j) for j in range(model.njnt)]
    for j, name in enumerate(names):
        if (kind := kind_of(model, j)) not in KINDS:
            raise ValueError(f"joint {name!r} is of type {kind}, which a URDF does not have")
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
    joint = Element("joint", name=name, type=KINDS.get(kind, "fixed"))
    if kind in ("hinge", "slide"):
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

    names: of the Tree's joints. rotors_in_joints: the armature of actuators is that of their joints.
    controller: of the actuators that act, with `engaged` controls; None: none does. qpos (nq,), dofs (nv,):
    the indices of the Tree's coordinates and speeds in MuJoCo's.
    """

    engaged = Engaged()

    def __init__(
        self, source: Source, names: Sequence[str], rotors_in_joints: bool, controller: Controller | None
    ):
        m = self.model = source.without({}, bare=controller is None)
        switch_off(m)
        # MuJoCo Warp refuses the first; with the second its implicitfast is explicit in the damping
        m.opt.disableflags &= ~bit("AUTORESET", "ACTUATION")
        m.opt.disableflags |= bit("WARMSTART")  # its solver starts from the unconstrained acceleration
        m.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON  # of constraints, which are off; both refuse PGS
        m.opt.iterations = 0 if controller is None else m.opt.iterations
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
