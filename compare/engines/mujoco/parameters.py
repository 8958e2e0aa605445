"""Parameters: the compiled model in the project's symbols, and what the file states compared with it.

Stated numbers are converted: nested frames, angles, axes of length 1, tensors in the axes of the body. Where the file asks the
compiler to change a number, the option is named.
"""

import warnings
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from ...judge.scale import EPS, FACTOR
from .dynamics import MujocoDynamics
from .engine import FROM_4
from .inventory import contact_pairs
from .names import aligns, element_name, joint_name, kind_of, on
from .source import FROM_GEOMS, editable_again, without_visuals

# of the equations of motion
STATED_FLAGS = {"flag gravity": "GRAVITY", "flag damper": "DAMPER", "flag eulerdamp": "EULERDAMP"}
ABSENT = {  # in the equations, and forces at random states need not show them
    "damping beyond linear": "dof_dampingpoly", "stiffness beyond linear": "jnt_stiffnesspoly",
    "actuator damping": "actuator_damping", "actuator armature": "actuator_armature", "tendon armature": "tendon_armature",
}  # fmt: skip
# relative error of the principal axes of a `fullinertia`: up to 5e-7 was seen before 4.0, 1.4e-14 since
TO_PRINCIPAL_AXES = 0.0 if FROM_4 else 1e-6


def parameters(dynamics: MujocoDynamics) -> dict:
    """Numbers of the compiled model: arrays per hinge, per body, or one number of the file, in world axes.

    Read in the file's own configuration (qpos0): there every frame lies as the file says, for any `ref` of a hinge.
    """
    m, d, bodies = dynamics.model, dynamics.data, dynamics.bodies
    dynamics.forward(m.qpos0[dynamics.qpos])
    joints, turns = dynamics.joints.tolist(), dynamics.turns(d.ximat)
    in_force = on(m, "CONTACT") and on(m, "CONSTRAINT")
    parent = {j: j - 1 if j > m.body_jntadr[body] else last_hinge(m, m.body_parentid[body])
              for j, body in zip(joints, m.jnt_bodyid[joints])}  # fmt: skip
    is_order = all(parent[j] in (-1, *joints[:i]) for i, j in enumerate(joints))
    places = joints if is_order else sorted(joints)  # each after its parent
    origins = dict(zip(joints, d.xanchor[joints])) | {-1: np.zeros(3)}
    return {
        **{name: float(on(m, flag)) for name, flag in STATED_FLAGS.items()},
        **{name: float(np.abs(getattr(m, field, np.zeros(1))).sum()) for name, field in ABSENT.items()},
        **{
            name: getattr(m, f"dof_{name}")[dynamics.dofs] for name in ("damping", "armature", "frictionloss")
        },
        **{name: getattr(m, f"jnt_{name}")[joints].astype(float) for name in ("stiffness", "limited")},
        **{name: getattr(m, f"body_{name}")[bodies] for name in ("mass", "gravcomp")},
        **{name: getattr(m.opt, name) for name in ("gravity", "density", "viscosity")},
        "contact pairs": float(len(contact_pairs(m)) * in_force),
        "parent": [float(places.index(parent[j])) if parent[j] >= 0 else -1.0 for j in places],
        "order": [float(places.index(j)) for j in joints],
        "ref": m.qpos0[dynamics.qpos],
        "axis": d.xaxis[joints],
        "anchor": d.xanchor[joints],
        "com": d.xipos[bodies] - [origins[last_hinge(m, body)] for body in bodies],
        "inertia": np.array([R @ np.diag(i) @ R.T for R, i in zip(turns, m.body_inertia[bodies])]),
        "other mass": np.delete(m.body_mass, bodies).sum(),
    }


def lengths(dynamics: MujocoDynamics) -> dict[str, np.ndarray]:
    """Sums of the lengths that MuJoCo adds to place each anchor, and each centre of mass relative to its anchor, m."""
    m, to_body = dynamics.model, np.zeros(dynamics.model.nbody)
    for body in range(1, m.nbody):
        to_body[body] = to_body[m.body_parentid[body]] + np.linalg.norm(m.body_pos[body])
    to_joint = np.append(
        to_body[m.jnt_bodyid] + np.linalg.norm(m.jnt_pos, axis=1), 0.0
    )  # the last: of no joint, -1
    before = to_joint[[last_hinge(m, body) for body in dynamics.bodies]]
    of_bodies = (to_body + np.linalg.norm(m.body_ipos, axis=1))[dynamics.bodies]
    return {"anchor": to_joint[dynamics.joints], "com": before + of_bodies}


def last_hinge(m: mujoco.MjModel, body: int) -> int:
    """The last hinge that moves a body, by its number, -1: none."""
    while body and not m.body_jntnum[body]:
        body = m.body_parentid[body]
    return int(m.body_jntadr[body] + m.body_jntnum[body] - 1) if body else -1


class Stated(NamedTuple):
    """One number of a file, or a vector or tensor."""

    place: str  # the name of the body or joint
    quantity: str  # mass, pos, com, inertia; anchor, axis, armature, damping, stiffness
    stated: np.ndarray | float | None  # kg, m, kg m2 ...; None: the file leaves it to the compiler
    compiled: np.ndarray | float
    why: str  # the options of the file that change it, "": none
    tolerance: float = 0.0  # the largest difference that is rounding


def stated_numbers(source: Path | str, model: mujoco.MjModel) -> list[Stated]:
    """Every mass, position, tensor, axis, armature, damping and stiffness that a file, or MJCF text, states for a model."""
    spec, numbered = editable_again(source), editable_again(source)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the reading has them
        without_visuals(numbered).compile()  # elements have their numbers in the model only once compiled
    bodies, joints = zip(spec.bodies[1:], numbered.bodies[1:]), zip(spec.joints, numbered.joints)
    rows = [row for body, copy in bodies for row in of_body(spec, model, body, copy.id)]
    return rows + [row for joint, copy in joints for row in of_joint(model, joint, copy.id)]


def row_of(
    place: str,
    quantity: str,
    stated,
    compiled,
    options: dict[str, bool],
    size: float | None = None,
    precision=0.0,
) -> Stated:
    """A row; of the options that are in force those count that may have changed a number that is not the stated one.

    size: the sum of what is added in the number, None: its largest entry; precision: relative, of the compiler.
    """
    size = float(np.abs(stated).max()) if size is None else size
    tolerance = max(FACTOR * EPS, precision) * size
    is_same = np.abs(np.subtract(stated, compiled)).max() <= tolerance
    why = ", ".join(name for name, is_on in options.items() if is_on and not is_same)
    return Stated(place, quantity, stated, compiled, why, tolerance)


def of_body(spec: mujoco.MjSpec, model: mujoco.MjModel, body, number: int) -> list[Stated]:
    place, options = element_name(model, "body", number), body.compiler
    total = {"settotalmass": spec.compiler.settotalmass > 0.0}
    from_geoms = {"inertiafromgeom": bool(body.geoms) and options.inertiafromgeom == FROM_GEOMS}
    aligned = {"alignfree": any(map(aligns, body.joints))}
    bounds = {"boundinertia": options.boundinertia > 0.0, "balanceinertia": bool(options.balanceinertia)}
    mass, com = float(model.body_mass[number]), model.body_ipos[number].copy()
    inertia = tensor(model.body_iquat[number], model.body_inertia[number])
    pos, _, length = in_frames(body.pos, body.frame)
    rows = [row_of(place, "pos", pos, model.body_pos[number].copy(), aligned, length)]
    if not body.explicitinertial:
        low, high = options.inertiagrouprange
        masses = [geom.mass for geom in body.geoms if low <= geom.group <= high]
        numbers = {"mass": mass, "com": com, "inertia": inertia}
        unknown = [
            Stated(place, name, None, compiled, "inertia from geoms") for name, compiled in numbers.items()
        ]
        if masses and np.isfinite(masses).all():
            stated = float(np.sum(masses))
            unknown[0] = row_of(
                place, "mass", stated, mass, total | {"boundmass": stated < options.boundmass}
            )
        return rows + unknown
    stated_com, stated_inertia, length = stated_inertial(spec, body, com, inertia)
    moments, precision = (
        float(np.trace(stated_inertia)),
        TO_PRINCIPAL_AXES if np.isfinite(body.fullinertia[0]) else 0.0,
    )
    bounded = {"boundmass": body.mass < options.boundmass}
    return [
        *rows,
        row_of(place, "mass", float(body.mass), mass, from_geoms | total | bounded),
        row_of(place, "com", stated_com, com, from_geoms | aligned, length),
        row_of(
            place,
            "inertia",
            stated_inertia,
            inertia,
            from_geoms | aligned | total | bounds,
            moments,
            precision,
        ),
    ]


def of_joint(model: mujoco.MjModel, joint, number: int) -> list[Stated]:
    name, kind, dof = joint_name(model, number), kind_of(model, number), model.jnt_dofadr[number]
    chosen = {"springdamper": bool(np.any(joint.springdamper))}
    pos, turn, length = in_frames(joint.pos, joint.frame)
    axis = turn @ joint.axis / np.linalg.norm(joint.axis)
    rows = (
        [row_of(name, "anchor", pos, model.jnt_pos[number].copy(), {}, length)]
        if kind in ("hinge", "ball")
        else []
    )
    rows += (
        [row_of(name, "axis", axis, model.jnt_axis[number].copy(), {})] if kind in ("hinge", "slide") else []
    )
    fields = {"armature": model.dof_armature[dof], "damping": model.dof_damping[dof]}
    for quantity, compiled in (fields | {"stiffness": model.jnt_stiffness[number]}).items():
        stated = float(np.ravel(getattr(joint, quantity))[0])  # the linear coefficient
        rows.append(row_of(name, quantity, stated, float(compiled), chosen if quantity != "armature" else {}))
    return rows


def in_frames(pos, frame) -> tuple[np.ndarray, np.ndarray, float]:
    """A position, (3,), through a frame of the file and those around it, the turn of all, (3, 3), and the sum of lengths."""
    pos, turn, length = np.array(pos, float), np.eye(3), float(np.linalg.norm(pos))
    while frame is not None:
        R, length = (
            matrix(orientation(frame.quat, frame.alt, frame.compiler)),
            length + np.linalg.norm(frame.pos),
        )
        pos, turn, frame = frame.pos + R @ pos, R @ turn, frame.frame
    return pos, turn, float(length)


def orientation(quat, other, options) -> np.ndarray:
    """A quaternion of an orientation in any of the file's notations."""
    if mujoco.mjtOrientation(other.type) != mujoco.mjtOrientation.mjORIENTATION_QUAT:
        resolve = mujoco.MjSpec.resolve_orientation
        return np.array(resolve(degree=bool(options.degree), sequence=options.eulerseq, orientation=other))
    return quat / np.linalg.norm(quat)


def stated_inertial(spec, body, com: np.ndarray, inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """CoM, (3,) m, and tensor, (3, 3) kg m2, that a body's inertial states, in the axes of the body; the sum of lengths, m.

    A spec does not say in which of the body's frames the inertial is: in the one that comes closest to the compiled model.
    """
    a, b, c, d, e, f = body.fullinertia
    turn = matrix(orientation(body.iquat, body.ialt, body.compiler))  # beside a fullinertia only in a URDF
    own = np.array([[a, d, e], [d, b, f], [e, f, c]]) if np.isfinite(a) else np.diag(body.inertia)
    own = turn @ own @ turn.T
    frames = (None, *(frame for frame in spec.frames if frame.parent == body))
    placed = [in_frames(body.ipos, frame) for frame in frames]
    candidates = [(pos, R @ own @ R.T, length) for pos, R, length in placed]
    scale = np.abs(inertia).max() or 1.0
    return min(
        candidates, key=lambda one: np.abs(one[0] - com).max() + np.abs(one[1] - inertia).max() / scale
    )


def tensor(quat: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """The tensor of principal moments in axes that a quaternion turns, (3, 3)."""
    R = matrix(quat)
    return R @ np.diag(moments) @ R.T


def matrix(quat: np.ndarray) -> np.ndarray:
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, np.array(quat, float))
    return R.reshape(3, 3)
