"""Parameters: the compiled model in the project's symbols, and what the file states compared with it.

Stated numbers are converted: nested frames, angles, axes of length 1, tensors in the axes of the body. Where
the file asks the compiler to change a number, the option is named. Remarks tell a user of it, and of what is
fixed or switched off.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ...core.finding import Finding
from ...judge.scale import EPS, FACTOR
from .dynamics import MujocoDynamics
from .inventory import LEFT_OUT, OFF, OPEN, contact_pairs
from .locked import FROM_GEOMS
from .names import FROM_4, aligns, element_name, joint_name, kind_of, matrix, moving, on, tensor
from .reading import Reading
from .source import Source, is_urdf

# of the equations of motion
STATED_FLAGS = {"flag gravity": "GRAVITY", "flag damper": "DAMPER", "flag eulerdamp": "EULERDAMP"}
ABSENT = {  # in the equations, and forces at random states need not show them
    "damping beyond linear": "dof_dampingpoly", "stiffness beyond linear": "jnt_stiffnesspoly",
    "actuator damping": "actuator_damping", "actuator armature": "actuator_armature",
    "tendon armature": "tendon_armature",
}  # fmt: skip
# relative error of the principal axes of a `fullinertia`: up to 5e-7 was seen before 4.0, 1.4e-14 since
TO_PRINCIPAL_AXES = 0.0 if FROM_4 else 1e-6


def parameters(dynamics: MujocoDynamics) -> dict[str, Any]:
    """Numbers of the compiled model: arrays per hinge, per body, or one number of the file, in world axes.

    Read in the file's own configuration (qpos0): there every frame lies as the file says, for any `ref` of a
    hinge.
    """
    m, d, bodies = dynamics.model, dynamics.data, dynamics.bodies
    dynamics.forward(m.qpos0[dynamics.qpos])
    joints, dofs, turns = dynamics.joints.tolist(), dynamics.dofs, dynamics.turns(d.ximat)
    in_force = on(m, "CONTACT") and on(m, "CONSTRAINT")
    before = {}
    for j, body in zip(joints, m.jnt_bodyid[joints]):
        before[j] = j - 1 if j > m.body_jntadr[body] else last_hinge(m, m.body_parentid[body])
    is_order = all(before[j] in (-1, *joints[:i]) for i, j in enumerate(joints))
    places = joints if is_order else sorted(joints)  # each after its parent
    origins = dict(zip(joints, d.xanchor[joints])) | {-1: np.zeros(3)}
    numbers = {name: float(on(m, flag)) for name, flag in STATED_FLAGS.items()}
    numbers |= {name: float(np.abs(getattr(m, field, np.zeros(1))).sum()) for name, field in ABSENT.items()}
    return numbers | {
        **{name: getattr(m, f"dof_{name}")[dofs] for name in ("damping", "armature", "frictionloss")},
        **{name: getattr(m, f"jnt_{name}")[joints].astype(float) for name in ("stiffness", "limited")},
        **{name: getattr(m, f"body_{name}")[bodies] for name in ("mass", "gravcomp")},
        **{name: getattr(m.opt, name) for name in ("gravity", "density", "viscosity")},
        "contact pairs": float(len(contact_pairs(m)) * in_force),
        "parent": [float(places.index(before[j])) if before[j] >= 0 else -1.0 for j in places],
        "order": [float(places.index(j)) for j in joints],
        "ref": m.qpos0[dynamics.qpos],
        "axis": d.xaxis[joints],
        "anchor": d.xanchor[joints],
        "com": d.xipos[bodies] - [origins[last_hinge(m, body)] for body in bodies],
        "inertia": np.array([tensor(*of_body) for of_body in zip(turns, m.body_inertia[bodies])]),
        "other mass": np.delete(m.body_mass, bodies).sum(),
    }


def lengths(dynamics: MujocoDynamics) -> dict[str, np.ndarray]:
    """Sums of the lengths that place each anchor, and each centre of mass relative to its anchor, m."""
    m, to_body = dynamics.model, np.zeros(dynamics.model.nbody)
    for body in range(1, m.nbody):
        to_body[body] = to_body[m.body_parentid[body]] + np.linalg.norm(m.body_pos[body])
    to_joint = to_body[m.jnt_bodyid] + np.linalg.norm(m.jnt_pos, axis=1)
    to_joint = np.append(to_joint, 0.0)  # the last: of no joint, -1
    before = to_joint[[last_hinge(m, body) for body in dynamics.bodies]]
    of_bodies = (to_body + np.linalg.norm(m.body_ipos, axis=1))[dynamics.bodies]
    return {"anchor": to_joint[dynamics.joints], "com": before + of_bodies}


def last_hinge(m: mujoco.MjModel, body: int) -> int:
    """The last hinge that moves a body, by its number, -1: none."""
    mover = m.body_weldid[body]
    return int(m.body_jntadr[mover] + m.body_jntnum[mover] - 1) if m.body_jntnum[mover] else -1


Options = Mapping[str, bool]  # of the file, and whether they are in force


class Stated(NamedTuple):
    """One number, or a vector or tensor, of a body, a joint or the world."""

    place: str  # the name of the body or joint
    quantity: str  # mass, pos, com, inertia; anchor, axis, armature, damping, stiffness
    stated: ArrayLike | None  # kg, m, kg m2 ...; None: the file leaves it to the compiler
    compiled: ArrayLike
    why: str = ""  # the options of the file that change it, "": none
    tolerance: float = 0.0  # the largest difference that is rounding


def stated_numbers(source: Source) -> list[Stated]:
    """Every mass, position, tensor, axis, armature, damping and stiffness that a file states."""
    spec, model = source.spec, source.model
    if spec is None:
        return []
    rows = []
    for body, number in zip(spec.bodies[1:], source.bodies[1:]):
        rows += of_body(spec, model, body, number)
    for joint, number in zip(spec.joints, source.joints):
        rows += of_joint(model, joint, number)
    return rows


def row_of(number: Stated, options: Options, size: float | None = None, precision: float = 0.0) -> Stated:
    """A row; the options in force count where they may have changed a number that is not the stated one.

    size: the sum of what is added in the number, None: its largest entry; precision: relative, of the
    compiler.
    """
    stated = np.asarray(number.stated, float)
    tolerance = max(FACTOR * EPS, precision) * (float(np.abs(stated).max()) if size is None else size)
    is_same = np.abs(stated - number.compiled).max() <= tolerance
    why = ", ".join(name for name, is_on in options.items() if is_on and not is_same)
    return number._replace(why=why, tolerance=tolerance)


def of_body(spec: mujoco.MjSpec, model: mujoco.MjModel, body: mujoco.MjsBody, number: int) -> list[Stated]:
    name, compiler = element_name(model, "body", number), body.compiler
    total = {"settotalmass": spec.compiler.settotalmass > 0.0}
    from_geoms = {"inertiafromgeom": bool(body.geoms) and compiler.inertiafromgeom == FROM_GEOMS}
    aligned = {"alignfree": any(map(aligns, body.joints))}
    bounds = {"boundinertia": compiler.boundinertia > 0.0, "balanceinertia": bool(compiler.balanceinertia)}
    mass, com = float(model.body_mass[number]), model.body_ipos[number].copy()
    inertia = tensor(matrix(model.body_iquat[number]), model.body_inertia[number])
    pos, _, length = in_frames(body.pos, body.frame)
    place = row_of(Stated(name, "pos", pos, model.body_pos[number].copy()), aligned, length)
    if body.explicitinertial:
        stated_com, stated_inertia, length = stated_inertial(spec, body, com, inertia)
        of_mass = from_geoms | total | {"boundmass": body.mass < compiler.boundmass}
        precision = TO_PRINCIPAL_AXES if np.isfinite(body.fullinertia[0]) else 0.0
        of_tensor, moments = Stated(name, "inertia", stated_inertia, inertia), float(np.trace(stated_inertia))
        return [
            place,
            row_of(Stated(name, "mass", float(body.mass), mass), of_mass),
            row_of(Stated(name, "com", stated_com, com), from_geoms | aligned, length),
            row_of(of_tensor, from_geoms | aligned | total | bounds, moments, precision),
        ]
    low, high = compiler.inertiagrouprange
    masses = [geom.mass for geom in body.geoms if low <= geom.group <= high]
    numbers = {"mass": mass, "com": com, "inertia": inertia}
    rows = [Stated(name, quantity, None, value, "inertia from geoms") for quantity, value in numbers.items()]
    if masses and np.isfinite(masses).all():
        stated = float(np.sum(masses))
        options = total | {"boundmass": stated < compiler.boundmass}
        rows[0] = row_of(Stated(name, "mass", stated, mass), options)
    return [place, *rows]


def of_joint(model: mujoco.MjModel, joint: mujoco.MjsJoint, number: int) -> list[Stated]:
    name, kind, dof = joint_name(model, number), kind_of(model, number), model.jnt_dofadr[number]
    chosen, rows = {"springdamper": bool(np.any(joint.springdamper))}, []
    pos, turn, length = in_frames(joint.pos, joint.frame)
    if kind in ("hinge", "ball"):
        rows.append(row_of(Stated(name, "anchor", pos, model.jnt_pos[number].copy()), {}, length))
    if kind in ("hinge", "slide"):
        axis = turn @ joint.axis / np.linalg.norm(joint.axis)
        rows.append(row_of(Stated(name, "axis", axis, model.jnt_axis[number].copy()), {}))
    numbers = {"armature": model.dof_armature[dof], "damping": model.dof_damping[dof]}
    for quantity, compiled in (numbers | {"stiffness": model.jnt_stiffness[number]}).items():
        stated = float(np.ravel(getattr(joint, quantity))[0])  # the linear coefficient
        options = {} if quantity == "armature" else chosen
        rows.append(row_of(Stated(name, quantity, stated, float(compiled)), options))
    return rows


def in_frames(pos: ArrayLike, frame: mujoco.MjsFrame | None) -> tuple[np.ndarray, np.ndarray, float]:
    """A position, (3,), through a frame and those around it, their turn, and the sum of lengths."""
    place, turn = np.array(pos, float), np.eye(3)
    length = float(np.linalg.norm(place))
    while frame is not None:
        R = orientation(frame.quat, frame.alt, frame.compiler)
        length += float(np.linalg.norm(frame.pos))
        place, turn, frame = frame.pos + R @ place, R @ turn, frame.frame
    return place, turn, length


def orientation(quat: np.ndarray, other: mujoco.MjsOrientation, options: mujoco.MjsCompiler) -> np.ndarray:
    """The rotation matrix of an orientation in any of the file's notations."""
    if mujoco.mjtOrientation(other.type) == mujoco.mjtOrientation.mjORIENTATION_QUAT:
        return matrix(quat / np.linalg.norm(quat))
    resolve = mujoco.MjSpec.resolve_orientation
    return matrix(resolve(degree=bool(options.degree), sequence=options.eulerseq, orientation=other))


def stated_inertial(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, com: np.ndarray, inertia: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """CoM, (3,) m, and tensor, (3, 3) kg m2, of an inertial in the axes of its body; the sum of lengths, m.

    A spec does not say in which of the body's frames it is: in the one that comes closest to the compiled
    model.
    """
    stated = np.diag(body.inertia)
    if np.isfinite(body.fullinertia[0]):
        xx, yy, zz, xy, xz, yz = body.fullinertia
        stated = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    turn = orientation(body.iquat, body.ialt, body.compiler)  # beside a fullinertia only in a URDF
    stated, scale = turn @ stated @ turn.T, np.abs(inertia).max() or 1.0
    candidates = []
    for frame in (None, *(frame for frame in spec.frames if frame.parent == body)):
        pos, R, length = in_frames(body.ipos, frame)
        candidates.append((pos, R @ stated @ R.T, length))

    def distance(candidate: tuple[np.ndarray, np.ndarray, float]) -> float:
        return float(np.abs(candidate[0] - com).max() + np.abs(candidate[1] - inertia).max() / scale)

    return min(candidates, key=distance)


def remarks(reading: Reading, has_scenes: bool) -> list[Finding]:
    """Findings, a line each. has_scenes: servos act in some of them."""
    findings = of_source(reading.source)
    if off := [feature for feature in reading.features if feature.treatment in (OFF, OPEN, LEFT_OUT)]:
        driven = has_scenes and bool(reading.drive and reading.drive.names)
        findings.append(Finding("remarks", "switched_off", {"features": off, "driven": driven}))
    return findings


def of_welded(source: Source) -> list[Finding]:
    """Which bodies of a joined Source are one with another; links without mass, or with a negligible one."""
    model, findings = source.model, []
    names = {body: element_name(model, "body", body) for body in range(model.nbody)}
    if pairs := [f"{names[body]} on {names[base]}" for body, base in source.welded.items() if base]:
        findings.append(Finding("remarks", "welded", {"pairs": pairs}))
    still = [body for body, base in source.welded.items() if not base]
    light = [body for body in sorted({*model.jnt_bodyid.tolist()} - {*still}) if not model.body_mass[body]]
    is_moving = moving(model)
    kinds = {"fixed": [body for body in still if not is_moving[body]],
             "negligible": [body for body in still if is_moving[body]], "massless": light}  # fmt: skip
    for kind, bodies in kinds.items():
        if bodies:
            findings.append(Finding("remarks", kind, {"links": [names[body] for body in bodies]}))
    return findings


def of_source(source: Source) -> list[Finding]:
    """What is fixed of a URDF; where each option has changed stated numbers, by quantity."""
    model, findings = source.model, []
    if source.missing:
        findings.append(Finding("remarks", "missing", {"files": source.missing}))
    fixed = [body for body in range(1, model.nbody) if model.body_mass[body] and not moving(model)[body]]
    if is_urdf(source.text) and '"world"' not in source.text and fixed:
        values = {"link": element_name(model, "body", fixed[0]), "mass": float(model.body_mass[fixed].sum())}
        findings.append(Finding("remarks", "fixed_base", values))
    changed: dict[str, dict[str, list[str]]] = {}
    for number in stated_numbers(source):
        if number.why and number.stated is not None:
            changed.setdefault(number.why, {}).setdefault(number.quantity, []).append(number.place)
    for why, places in changed.items():
        findings.append(Finding("remarks", "changed", {"why": why, "places": places}))
    return findings
