"""Parameters: the compiled model in the project's symbols, and what the file states compared with it.

Stated numbers are converted: nested frames, angles, axes of length 1, tensors in the axes of the body. Where the file asks the
compiler to change a number, the option is named.
"""

import warnings
from typing import NamedTuple

import mujoco
import numpy as np

from .dynamics import MujocoDynamics
from .engine import FROM_4, Mujoco
from .inventory import contact_pairs
from .names import aligns, joint_name, kind_of, on, own_name
from .reading import Reading
from .source import editable_again, placed, turned, without_geoms

STATED_FLAGS = {
    "flag gravity": "GRAVITY",
    "flag damper": "DAMPER",
    "flag eulerdamp": "EULERDAMP",
}  # of the equations of motion
TRUE = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
# relative error of the principal axes of a `fullinertia`: up to 5e-7 was seen before 4.0, 1.4e-14 since
TO_PRINCIPAL_AXES = 0.0 if FROM_4 else 1e-6


def parameters(dynamics: MujocoDynamics) -> dict:
    """Numbers of the compiled model: arrays per hinge, per body, or one number of the file, in world axes.

    Read in the file's own configuration (qpos0): there every frame lies as the file says, for any `ref` of a hinge.
    """
    m, d = dynamics.model, dynamics.data
    dynamics.forward(m.qpos0[dynamics.qpos])
    anchors, turns = d.xanchor[dynamics.joints].copy(), dynamics.turns(d.ximat)
    places = sorted_hinges(m, dynamics.joints)
    return {
        **{name: float(on(m, flag)) for name, flag in STATED_FLAGS.items()},
        **absent(m),
        "parent": [float(places.index(hinge)) if hinge >= 0 else -1.0 for hinge in (before(m, j) for j in places)],
        "order": [float(places.index(j)) for j in dynamics.joints],
        "ref": m.qpos0[dynamics.qpos],
        "axis": d.xaxis[dynamics.joints].copy(),
        "anchor": anchors,
        "damping": m.dof_damping[dynamics.dofs],
        "armature": m.dof_armature[dynamics.dofs],
        "frictionloss": m.dof_frictionloss[dynamics.dofs],
        "stiffness": m.jnt_stiffness[dynamics.joints],
        "limited": m.jnt_limited[dynamics.joints].astype(float),
        "mass": m.body_mass[dynamics.bodies],
        "com": d.xipos[dynamics.bodies] - [com_origin(dynamics, anchors, body) for body in dynamics.bodies],
        "inertia": np.array([R @ np.diag(i) @ R.T for R, i in zip(turns, m.body_inertia[dynamics.bodies])]),
        "gravcomp": m.body_gravcomp[dynamics.bodies],
        "gravity": m.opt.gravity.copy(),
        "tendon armature": m.tendon_armature.sum(),
        "other mass": np.delete(m.body_mass, dynamics.bodies).sum(),
        "density": m.opt.density,
        "viscosity": m.opt.viscosity,
    }


def before(m: mujoco.MjModel, joint: int) -> int:
    """The parent hinge of a hinge, -1: the world; both by their numbers in the model."""
    body = m.jnt_bodyid[joint]
    if joint > m.body_jntadr[body]:
        return joint - 1
    body = m.body_parentid[body]
    while body and not m.body_jntnum[body]:
        body = m.body_parentid[body]
    return int(m.body_jntadr[body] + m.body_jntnum[body] - 1) if body else -1


def sorted_hinges(m: mujoco.MjModel, joints: np.ndarray) -> list[int]:
    """The hinges of a model in the order of the coordinates, except that each comes after its parent."""
    order, left = [-1], list(map(int, joints))
    while left:
        order.append(next(j for j in left if before(m, j) in order))
        left.remove(order[-1])
    return order[1:]


def com_origin(dynamics: MujocoDynamics, anchors: np.ndarray, body: int) -> np.ndarray:
    """The origin of the CoM of a body, m: the anchor of the last of the hinges that move it, else the world's."""
    m = dynamics.model
    while body and not m.body_jntnum[body]:
        body = m.body_parentid[body]
    moving = [i for i, j in enumerate(dynamics.joints) if m.jnt_bodyid[j] == body]
    return anchors[max(moving)] if moving else np.zeros(3)


def absent(m: mujoco.MjModel) -> dict:
    """Sums of parameters that the equations do not have, and that forces at random states need not show."""
    names = {"damping beyond linear": "dof_dampingpoly", "stiffness beyond linear": "jnt_stiffnesspoly",
             "actuator damping": "actuator_damping", "actuator armature": "actuator_armature"}  # fmt: skip
    sums = {name: float(np.abs(getattr(m, field, np.zeros(1))).sum()) for name, field in names.items()}
    in_force = on(m, "CONTACT") and on(m, "CONSTRAINT")
    return sums | {"contact pairs": float(contact_pairs(m)) if in_force else 0.0}


def options(engine: Mujoco, dynamics: MujocoDynamics) -> dict:
    """Other flags, integrator and counts of the file."""
    m = dynamics.model
    flags = {
        f"flag {name}": "enable" if on(m, name.upper()) else "disable"
        for name in ("contact", "constraint", "autoreset")
    }
    counts = ("ngeom", "nu", "nsensor", "neq", "ntendon")
    integrator = mujoco.mjtIntegrator(engine.integrator).name.removeprefix("mjINT_")
    return flags | {"integrator": integrator} | {name: str(getattr(m, name)) for name in counts}


class Stated(NamedTuple):
    """One number of a file, or a vector or tensor."""

    place: str  # the name of the body or joint
    quantity: str  # mass, pos, com, inertia; anchor, axis, armature, damping, stiffness
    stated: np.ndarray | float | None  # kg, m, kg m2 ...; None: the file leaves it to the compiler
    compiled: np.ndarray | float
    why: str  # the option of the file that changes it, "": none
    precision: float = 0.0  # relative, of the compiler; 0.0: rounding


def stated_numbers(reading: Reading) -> list[Stated]:
    """Every mass, position, tensor, axis, armature, damping and stiffness that the file states."""
    spec, numbered, model = editable_again(reading.source), editable_again(reading.source), reading.model
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the reading has them
        without_geoms(numbered).compile()  # elements have their numbers in the model only once compiled
    rows = []
    for body, copy in zip(spec.bodies, numbered.bodies):
        if copy.id:
            rows += of_body(spec, model, body, copy.id)
    for joint, copy in zip(spec.joints, numbered.joints):
        rows += of_joint(model, joint, copy.id)
    return rows


def of_body(spec: mujoco.MjSpec, model: mujoco.MjModel, body, number: int) -> list[Stated]:
    """Position, mass, centre of mass and tensor of a body."""
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
        low, high = options.inertiagrouprange
        geoms = [geom for geom in body.geoms if low <= geom.group <= high]
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
    """Anchor, axis, armature, damping and stiffness of a joint."""
    kind = kind_of(model, number)
    name, rows, dof = joint_name(model, number), [], int(model.jnt_dofadr[number])
    if kind != "free":
        pos, turn = in_frames(joint.pos, joint.axis, joint.frame)
        if kind != "slide":
            rows.append(Stated(name, "anchor", pos, model.jnt_pos[number].copy(), ""))
        if kind != "ball":
            rows.append(Stated(name, "axis", turn / np.linalg.norm(turn), model.jnt_axis[number].copy(), ""))
    source = "springdamper" if np.any(joint.springdamper) else ""
    return [
        *rows,
        Stated(name, "armature", float(joint.armature), float(model.dof_armature[dof]), ""),
        Stated(name, "damping", first(joint.damping), float(model.dof_damping[dof]), source),
        Stated(name, "stiffness", first(joint.stiffness), float(model.jnt_stiffness[number]), source),
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

    A spec does not say in which of the body's frames the inertial is: in the one that comes closest to the compiled model.
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
    """The option that changes the stated mass, or ""."""
    if spec.compiler.settotalmass > 0.0:
        return "settotalmass"
    return "boundmass" if mass is not None and mass < options.boundmass else ""


def changed_inertia(spec: mujoco.MjSpec, options, inertia: np.ndarray) -> str:
    """The option that changes the stated tensor, or ""."""
    if spec.compiler.settotalmass > 0.0:
        return "settotalmass"
    moments = np.linalg.eigvalsh(inertia)
    if moments[0] < options.boundinertia:
        return "boundinertia"
    return "balanceinertia" if options.balanceinertia and moments[0] + moments[1] < moments[2] else ""
