"""A URDF text of a compiled model, for engines whose readers of MJCF lose masses or joints."""

from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import mujoco
import numpy as np

from .inventory import take_away
from .names import joint_name, kind_of, matrix
from .source import Source

KINDS = {"hinge": "continuous", "slide": "prismatic"}
FAR = "1e9"  # limits that nothing reaches: a prismatic joint has to state some


def urdf(source: mujoco.MjModel | Path | str, has_free_bodies: bool = False) -> str:
    """A URDF text of a compiled model, an MJCF file (a Path) or MJCF text; ValueError where it cannot be one.

    Its base is fixed; has_free_bodies: with free joints, of type floating, of which readers make what they like.

    Numbers have 17 significant digits; positions are those of the file (`ref` included), joints have its names. The frame of a
    link has its origin on the axis of its hinge. Of several joints in one body all but the last move a link without mass, and a
    body without a joint hangs on a fixed one. URDF has no gravity, armature or springs; geoms, limits and friction are left out.
    """
    model = mujoco.MjModel.__copy__(source if isinstance(source, mujoco.MjModel) else Source(source).model)
    take_away(model)  # what a flag of the file disables is zero
    names = [joint_name(model, j) for j in range(model.njnt)]
    for j, name in enumerate(names):
        if (kind := kind_of(model, j)) not in KINDS and not (has_free_bodies and kind == "free"):
            raise ValueError(
                f"joint {name!r} is of type {kind}; a URDF with a fixed base has only hinges and slides"
            )
    robot = Element("robot", name="robot")
    SubElement(robot, "link", name="link0")
    origins = [np.zeros(3)]  # of the link of each body, in the frame of the body
    for body in range(1, model.nbody):
        parent, first = int(model.body_parentid[body]), int(model.body_jntadr[body])
        link, position, turn = (
            f"link{parent}",
            model.body_pos[body] - origins[parent],
            matrix(model.body_quat[body]),
        )
        joints, origin = list(range(first, first + int(model.body_jntnum[body]))) or [None], np.zeros(3)
        for j in joints:
            is_last, anchor, moved, turned = j == joints[-1], np.zeros(3), np.zeros(3), np.eye(3)
            if j is None:
                joint = Element("joint", name=unused(f"fixed{body}", names), type="fixed")
            elif kind_of(model, j) == "free":
                joint, position, turn = (
                    Element("joint", name=names[j], type="floating"),
                    np.zeros(3),
                    np.eye(3),
                )
            else:
                kind, axis, reference = (
                    kind_of(model, j),
                    model.jnt_axis[j],
                    model.qpos0[model.jnt_qposadr[j]],
                )
                joint = Element("joint", name=names[j], type=KINDS[kind])
                if kind == "hinge":
                    anchor, turned = model.jnt_pos[j].copy(), about(axis, -reference)
                else:
                    moved = -reference * axis
                SubElement(joint, "axis", xyz=text(axis))
                SubElement(
                    joint, "dynamics", damping=text(model.dof_damping[model.jnt_dofadr[j]]), friction="0"
                )
                SubElement(joint, "limit", lower="-" + FAR, upper=FAR, effort=FAR, velocity=FAR)
            child = f"link{body}" if is_last else f"link{body}_{j}"
            SubElement(joint, "origin", frame(position + turn @ (anchor - origin + moved), turn @ turned))
            SubElement(joint, "parent", link=link)
            SubElement(joint, "child", link=child)
            robot.extend([joint, link_of(child, model, body if is_last else 0, anchor)])
            link, origin, position, turn = child, anchor, np.zeros(3), np.eye(3)
        origins.append(origin)
    indent(robot)
    return tostring(robot, encoding="unicode") + "\n"


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


def text(values) -> str:
    return " ".join(f"{value + 0.0:.17g}" for value in np.ravel(values))


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    quat = np.zeros(4)
    mujoco.mju_axisAngle2Quat(quat, axis, angle)
    return matrix(quat)


def unused(name: str, names: list[str]) -> str:
    return unused(f"{name}_", names) if name in names else name
