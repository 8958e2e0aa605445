"""What a file states, beside what MuJoCo's compiler made of it: the spec before compilation and the model after.

Numbers are those of the file, in its own words turned into the compiled model's: nested frames followed, angles resolved, axes
of length 1, tensors in the axes of the body. Where the file asks the compiler for another number, the option is named.
"""

import warnings
from typing import NamedTuple

import mujoco
import numpy as np

from .engine import FROM_4
from .joints import aligns, joint_name, kind_of, own_name
from .light import without_geoms
from .lock import editable_again, placed, turned
from .reading import Reading

TRUE = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
# how exactly a `fullinertia` is turned to its principal axes: up to 5e-7 off was seen before 4.0, 1.4e-14 from there on
TO_PRINCIPAL_AXES = 0.0 if FROM_4 else 1e-6


class Stated(NamedTuple):
    """One number of a file, or a vector or tensor."""

    place: str  # the name of the body or joint
    quantity: str  # mass, pos, com, inertia; anchor, axis, armature, damping, stiffness
    stated: np.ndarray | float | None  # kg, m, kg m2 ...; None: the file leaves it to the compiler
    compiled: np.ndarray | float
    why: str  # the option of the file that asks for a change of it, "": none does
    precision: float = 0.0  # how exactly the compiler itself takes it over, relative; 0.0: except for rounding


def stated_numbers(reading: Reading) -> list[Stated]:
    """A row for every mass, place, tensor, axis, armature, damping and stiffness that the file states."""
    spec, numbered, model = editable_again(reading.source), editable_again(reading.source), reading.model
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the reading has them
        without_geoms(numbered).compile()  # elements have their numbers in the model only once compiled
    rows = []
    for body, known in zip(spec.bodies, numbered.bodies):
        if known.id:
            rows += of_body(spec, model, body, known.id)
    for joint, known in zip(spec.joints, numbered.joints):
        rows += of_joint(model, joint, known.id)
    return rows


def of_body(spec: mujoco.MjSpec, model: mujoco.MjModel, body, number: int) -> list[Stated]:
    """The rows of one body: where it is, and its mass, centre of mass and tensor."""
    place, options = own_name(body.name, "body", number), body.compiler
    aligned = "alignfree" if any(aligns(joint) for joint in body.joints) else ""
    pos, _ = in_frames(body.pos, None, body.frame)
    rows = [Stated(place, "pos", pos, model.body_pos[number].copy(), aligned)]
    compiled = {
        "mass": float(model.body_mass[number]),
        "com": model.body_ipos[number].copy(),
        "inertia": tensor(model.body_iquat[number], model.body_inertia[number]),
    }
    if not body.explicitinertial:
        geoms = [geom for geom in body.geoms if in_inertia(geom, options)]
        masses = [geom.mass for geom in geoms]
        of_geoms = float(np.sum(masses)) if geoms and np.isfinite(masses).all() else None
        why = changed_mass(spec, options, of_geoms)
        rows.append(
            Stated(place, "mass", of_geoms, compiled["mass"], why or ("" if of_geoms else "inertia from geoms"))
        )
        more = "inertia from geoms"
        return rows + [Stated(place, name, None, compiled[name], more) for name in ("com", "inertia")]
    from_geoms = "inertiafromgeom" if mujoco.mjtInertiaFromGeom(options.inertiafromgeom) == TRUE and body.geoms else ""
    com, inertia = stated_inertial(spec, body, compiled["com"], compiled["inertia"])
    rows.append(
        Stated(place, "mass", float(body.mass), compiled["mass"], from_geoms or changed_mass(spec, options, body.mass))
    )
    rows.append(Stated(place, "com", com, compiled["com"], from_geoms or aligned))
    why = from_geoms or aligned or changed_inertia(spec, options, inertia)
    precision = TO_PRINCIPAL_AXES if np.isfinite(body.fullinertia[0]) else 0.0
    return [*rows, Stated(place, "inertia", inertia, compiled["inertia"], why, precision)]


def of_joint(model: mujoco.MjModel, joint, number: int) -> list[Stated]:
    """The rows of one joint: where it is, along which axis, and what is linear in its position, speed and acceleration."""
    kind = kind_of(model, number)
    name, rows, dof = joint_name(model, number), [], int(model.jnt_dofadr[number])
    if kind != "free":
        pos, turn = in_frames(joint.pos, joint.axis, joint.frame)
        if kind != "slide":
            rows.append(Stated(name, "anchor", pos, model.jnt_pos[number].copy(), ""))
        if kind != "ball":
            rows.append(Stated(name, "axis", turn / np.linalg.norm(turn), model.jnt_axis[number].copy(), ""))
    asked = "springdamper" if np.any(joint.springdamper) else ""
    return [
        *rows,
        Stated(name, "armature", float(joint.armature), float(model.dof_armature[dof]), ""),
        Stated(name, "damping", first(joint.damping), float(model.dof_damping[dof]), asked),
        Stated(name, "stiffness", first(joint.stiffness), float(model.jnt_stiffness[number]), asked),
    ]


def first(values) -> float:
    """The linear coefficient, of one number or of those of a polynomial."""
    return float(np.atleast_1d(values)[0])


def in_frames(pos, axis, frame) -> tuple[np.ndarray, np.ndarray | None]:
    """A position and a direction, (3,), through a frame of the file and those around it."""
    pos, axis = np.array(pos, float), None if axis is None else np.array(axis, float)
    while frame is not None:
        turn = orientation(frame.quat, frame.alt, frame.compiler)
        pos, axis = placed(np.array(frame.pos), turn, pos), None if axis is None else turned(axis, turn)
        frame = frame.frame
    return pos, axis


def orientation(quat, other, options) -> np.ndarray:
    """A quaternion of length 1 of an orientation in any of the file's notations."""
    if mujoco.mjtOrientation(other.type) != mujoco.mjtOrientation.mjORIENTATION_QUAT:
        resolve = mujoco.MjSpec.resolve_orientation
        return np.array(resolve(degree=bool(options.degree), sequence=options.eulerseq, orientation=other))
    quat = np.array(quat, float)
    return quat / np.linalg.norm(quat)


def stated_inertial(spec, body, com: np.ndarray, inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centre of mass, (3,) m, and tensor, (3, 3) kg m2, that a body's inertial states, in the axes of the body.

    In which of the body's frames the inertial stands, a spec does not tell: in the one that comes closest to what was compiled.
    """
    a, b, c, d, e, f = body.fullinertia
    turn = orientation(body.iquat, body.ialt, body.compiler)
    own = np.array([[a, d, e], [d, b, f], [e, f, c]]) if np.isfinite(a) else tensor(turn, np.array(body.inertia))
    candidates = []
    for frame in (None, *(frame for frame in spec.frames if frame.parent == body)):
        R = np.array([in_frames(np.zeros(3), axis, frame)[1] for axis in np.eye(3)]).T
        candidates.append((in_frames(body.ipos, None, frame)[0], R @ own @ R.T))
    scale = np.abs(inertia).max() or 1.0
    return min(candidates, key=lambda one: np.abs(one[0] - com).max() + np.abs(one[1] - inertia).max() / scale)


def tensor(quat: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """The tensor of principal moments in axes that a quaternion turns, (3, 3)."""
    R = np.array([turned(axis, quat) for axis in np.eye(3)]).T
    return R @ np.diag(moments) @ R.T


def changed_mass(spec: mujoco.MjSpec, options, mass: float | None) -> str:
    """The option that asks for another mass than the stated one, or ""."""
    if spec.compiler.settotalmass > 0.0:
        return "settotalmass"
    return "boundmass" if mass is not None and mass < options.boundmass else ""


def changed_inertia(spec: mujoco.MjSpec, options, inertia: np.ndarray) -> str:
    """The option that asks for another tensor than the stated one, or ""."""
    if spec.compiler.settotalmass > 0.0:
        return "settotalmass"
    moments = np.linalg.eigvalsh(inertia)
    if moments[0] < options.boundinertia:
        return "boundinertia"
    return "balanceinertia" if options.balanceinertia and moments[0] + moments[1] < moments[2] else ""


def in_inertia(geom, options) -> bool:
    """Whether the compiler takes a geom into the inertia of its body."""
    low, high = options.inertiagrouprange
    return low <= geom.group <= high
