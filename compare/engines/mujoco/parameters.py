"""Parameters: the compiled model in the project's symbols, and what the file states compared with it.

What the file states is compiled again without the options by which it asks the compiler to change numbers;
these are named where they do. Remarks tell a user of them, and of what is fixed or switched off.
"""

import warnings
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ...core.finding import Finding
from ...judge.scale import EPS, FACTOR
from .dynamics import MujocoDynamics
from .inventory import LEFT_OUT, OFF, OPEN, contact_pairs
from .locked import compiled, is_from_geoms, moves
from .names import aligns, element_name, joint_name, kind_of, matrix, moving, on, tensor
from .reading import Reading
from .source import Source, is_urdf

# of the equations of motion
STATED_FLAGS = {"flag gravity": "GRAVITY", "flag damper": "DAMPER", "flag eulerdamp": "EULERDAMP"}
ABSENT = {  # in the equations, and forces at random states need not show them
    "damping beyond linear": "dof_dampingpoly", "stiffness beyond linear": "jnt_stiffnesspoly",
    "actuator damping": "actuator_damping", "actuator armature": "actuator_armature",
    "tendon armature": "tendon_armature",
}  # fmt: skip


def parameters(dynamics: MujocoDynamics) -> dict[str, Any]:
    """Numbers of the compiled model: arrays per hinge, per body, or one number of the file, in world axes.

    Read in the file's own configuration (qpos0): there every frame lies as the file says, for any `ref` of a
    hinge.
    """
    m, d, bodies = dynamics.model, dynamics.data, dynamics.bodies
    dynamics.forward(m.qpos0[dynamics.qpos])
    joints, dofs, turns = dynamics.joints.tolist(), dynamics.dofs, dynamics.turns(d.ximat)
    in_force = on(m, "CONTACT") and on(m, "CONSTRAINT")
    before = {j: joint_before(m, j) for j in joints}
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
        "offset": [origins[j] - origins[before[j]] for j in joints],
        "com": d.xipos[bodies] - [origins[last_hinge(m, body)] for body in bodies],
        "inertia": np.array([tensor(*of_body) for of_body in zip(turns, m.body_inertia[bodies])]),
        "other mass": np.delete(m.body_mass, bodies).sum(),
    }


def lengths(dynamics: MujocoDynamics) -> dict[str, np.ndarray]:
    """Sums of the lengths that place each anchor, it and each centre of mass relative to the anchor before, m."""
    m, to_body = dynamics.model, np.zeros(dynamics.model.nbody)
    for body in range(1, m.nbody):
        to_body[body] = to_body[m.body_parentid[body]] + np.linalg.norm(m.body_pos[body])
    to_joint = to_body[m.jnt_bodyid] + np.linalg.norm(m.jnt_pos, axis=1)
    to_joint = np.append(to_joint, 0.0)  # the last: of no joint, -1
    before = to_joint[[last_hinge(m, body) for body in dynamics.bodies]]
    of_bodies = (to_body + np.linalg.norm(m.body_ipos, axis=1))[dynamics.bodies]
    anchors, carrying = to_joint[dynamics.joints], [joint_before(m, j) for j in dynamics.joints.tolist()]
    return {"anchor": anchors, "offset": anchors + to_joint[carrying], "com": before + of_bodies}


def joint_before(m: mujoco.MjModel, joint: int) -> int:
    """The joint that carries a joint, by its number, -1: none."""
    body = m.jnt_bodyid[joint]
    return joint - 1 if joint > m.body_jntadr[body] else last_hinge(m, m.body_parentid[body])


def last_hinge(m: mujoco.MjModel, body: int) -> int:
    """The last hinge that moves a body, by its number, -1: none."""
    mover = m.body_weldid[body]
    return int(m.body_jntadr[mover] + m.body_jntnum[mover] - 1) if m.body_jntnum[mover] else -1


class Stated(NamedTuple):
    """One number, or a vector or tensor, of a body, a joint or the world."""

    place: str  # the name of the body or joint
    quantity: str  # mass, pos, com, inertia; anchor, axis, armature, damping, stiffness
    stated: ArrayLike | None  # kg, m, kg m2 ...; None: the file leaves it to the compiler
    compiled: ArrayLike
    why: str = ""  # the options of the file that change it, "": none
    tolerance: float = 0.0  # the largest difference that is rounding


# what switches each option of the compiler off that changes numbers
OFF_VALUES: dict[str, float] = {
    "settotalmass": -1.0, "inertiafromgeom": int(mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO),
    "boundmass": 0.0, "boundinertia": 0.0, "balanceinertia": False,
}  # fmt: skip
FROM_INERTIAL = ("mass", "com", "inertia")


def in_force(spec: mujoco.MjSpec) -> list[str]:
    """The options of a file that may change numbers; with springdamper the compiler chooses two of a joint."""
    compilers = [spec.compiler, *(body.compiler for body in spec.bodies)]
    is_on = {name: any(float(getattr(each, name)) > 0.0 for each in compilers) for name in OFF_VALUES}
    is_on["inertiafromgeom"] = is_from_geoms(spec)
    is_on["alignfree"] = any(map(aligns, spec.joints))
    is_on["springdamper"] = any(bool(np.any(joint.springdamper)) for joint in spec.joints)
    return [name for name, is_it in is_on.items() if is_it]


def without_options(source: Source, names: Sequence[str]) -> mujoco.MjSpec:
    """The spec of a file, without meshes that have no mass, with some options off."""
    spec = source.bare.copy()
    for name in names:
        for compiler in (spec.compiler, *(body.compiler for body in spec.bodies)):
            if name in OFF_VALUES:
                setattr(compiler, name, OFF_VALUES[name])
        for joint in spec.joints:
            if name == "springdamper":
                joint.springdamper = np.zeros(2)
            elif name == "alignfree":
                joint.align = mujoco.mjtAlignFree.mjALIGNFREE_FALSE
    return spec


def compiled_numbers(spec: mujoco.MjSpec) -> dict[tuple[str, str], np.ndarray]:
    """The numbers of a spec. ValueError where MuJoCo makes no model of it."""
    with warnings.catch_warnings(action="ignore"):  # the first reading has them
        return numbers_of(compiled(spec))


def numbers_of(m: mujoco.MjModel) -> dict[tuple[str, str], np.ndarray]:
    """Numbers of each body and joint by their names and quantities; tensors in the axes of the body."""
    numbers: dict[tuple[str, str], Any] = {}
    for body in range(1, m.nbody):
        inertia = tensor(matrix(m.body_iquat[body]), m.body_inertia[body])
        values = {"pos": m.body_pos[body], "mass": m.body_mass[body], "com": m.body_ipos[body]}
        values["inertia"] = inertia
        numbers |= {(element_name(m, "body", body), name): value for name, value in values.items()}
    for joint in range(m.njnt):
        kind, dof = kind_of(m, joint), m.jnt_dofadr[joint]
        values = {"anchor": m.jnt_pos[joint]} if kind in ("hinge", "ball") else {}
        values |= {"axis": m.jnt_axis[joint]} if kind in ("hinge", "slide") else {}
        values |= {"armature": m.dof_armature[dof], "damping": m.dof_damping[dof]}
        values["stiffness"] = m.jnt_stiffness[joint]
        numbers |= {(joint_name(m, joint), name): value for name, value in values.items()}
    return {key: np.array(value, float) for key, value in numbers.items()}


def stated_numbers(source: Source) -> list[Stated]:
    """Every mass, position, tensor, axis, armature, damping and stiffness that a file states.

    They are those of the file compiled without the options that change numbers. One that changes a number is
    found by compiling without it alone. balanceinertia lets tensors pass that are none of a body: without it
    they are compiled with their trace added to each moment.
    """
    if source.spec is None:
        return []
    options = in_force(source.spec)
    spec, traces = without_options(source, options), dict[tuple[str, str], float]()
    for body, number in zip(spec.bodies, source.bodies) if "balanceinertia" in options else ():
        moments = body.fullinertia[:3] if np.isfinite(body.fullinertia[0]) else body.inertia
        if body.explicitinertial:
            traces[element_name(source.model, "body", number), "inertia"] = trace = float(np.sum(moments))
            moments += trace
    stated = compiled_numbers(spec)
    for key, trace in traces.items():
        stated[key] -= trace * np.eye(3)
    others: dict[str, dict[tuple[str, str], np.ndarray] | None] = dict.fromkeys(options)
    for name in options:
        with suppress(ValueError):  # of a tensor
            others[name] = compiled_numbers(without_options(source, [name]))
    left = left_to_compiler(source)
    rows = []
    for key, number in numbers_of(source.model).items():
        if key in left:
            rows.append(Stated(*key, None, number[()], "inertia from geoms"))
            continue
        size = float(np.trace(stated[key]) if key[1] == "inertia" else np.abs(stated[key]).max())
        tolerance, why = FACTOR * EPS * size, list[str]()
        if np.abs(stated[key] - number).max() > tolerance:
            for name, numbers in others.items():
                change = np.abs(numbers[key] - number).max() if numbers else np.inf * (key[1] == "inertia")
                why += [name] * bool(change > tolerance)
        rows.append(Stated(*key, stated[key][()], number[()], ", ".join(why), tolerance))
    return rows


def left_to_compiler(source: Source) -> set[tuple[str, str]]:
    """The numbers of bodies without an inertial; not the mass of what moves, if all of its geoms state theirs."""
    left = set()
    for body, number in zip(source.spec.bodies[1:], source.bodies[1:]) if source.spec else ():
        low, high = body.compiler.inertiagrouprange
        masses = [geom.mass for geom in body.geoms if low <= geom.group <= high]
        has_mass = bool(masses) and bool(np.isfinite(masses).all()) and moves(body)
        quantities = FROM_INERTIAL[has_mass:]
        if not body.explicitinertial:
            left |= {(element_name(source.model, "body", number), quantity) for quantity in quantities}
    return left


def remarks(reading: Reading, has_scenes: bool) -> list[Finding]:
    """Findings, a line each. has_scenes: servos act in some of them."""
    findings = of_source(reading.source)
    if off := [feature for feature in reading.features if feature.treatment in (OFF, OPEN, LEFT_OUT)]:
        driven = has_scenes and bool(reading.drive and reading.drive.names)
        findings.append(Finding("remarks", "switched_off", {"features": off, "driven": driven}))
    return findings


def closed_loop(reading: Reading, name: str) -> Finding | None:
    """That constraints of a file are not in the equations of its joints; None: it has none. name: of the file."""
    names = [feature.names for feature in reading.features if feature.feature == "equality"]
    return Finding("remarks", "closed_loop", {"model": name, "names": names[0]}) if names else None


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
    has_options = source.spec is not None and bool(in_force(source.spec))
    for number in stated_numbers(source) if has_options else ():
        if number.why and number.stated is not None:
            changed.setdefault(number.why, {}).setdefault(number.quantity, []).append(number.place)
    for why, places in changed.items():
        findings.append(Finding("remarks", "changed", {"why": why, "places": places}))
    return findings
