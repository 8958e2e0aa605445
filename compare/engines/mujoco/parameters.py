"""The compiled model read back in the project's symbols: what the compiler made of the file."""

import mujoco
import numpy as np

from .dynamics import MujocoDynamics
from .engine import Mujoco
from .flags import FLAGS, bit
from .pairs import contact_pairs

STATED_FLAGS = {  # flags that the equations of motion depend on, by the names that MuJoCo's versions give them
    "flag gravity": ("GRAVITY",),
    "flag damper": ("DAMPER", "PASSIVE"),
    "flag eulerdamp": ("EULERDAMP",),
}


def parameters(dynamics: MujocoDynamics) -> dict:
    """What the compiler made of the file: arrays per hinge, per body, or one number of the file, in world axes.

    Read in the file's own configuration (qpos0): there every frame lies as the file says, whatever a hinge's `ref` is.
    """
    m, d = dynamics.model, dynamics.data
    dynamics.forward(m.qpos0[dynamics.qpos])
    anchors, turns = d.xanchor[dynamics.joints].copy(), dynamics.turns(d.ximat)
    places = sorted_hinges(m, dynamics.joints)
    return {
        **{name: float(not m.opt.disableflags & bit(members)) for name, members in STATED_FLAGS.items()},
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
    """The hinge on which a hinge hangs, -1: the world; both by their numbers in the model."""
    body = m.jnt_bodyid[joint]
    if joint > m.body_jntadr[body]:
        return joint - 1
    body = m.body_parentid[body]
    while body and not m.body_jntnum[body]:
        body = m.body_parentid[body]
    return int(m.body_jntadr[body] + m.body_jntnum[body] - 1) if body else -1


def sorted_hinges(m: mujoco.MjModel, joints: np.ndarray) -> list[int]:
    """The hinges of a model in the order of the coordinates, as far as each comes after the one on which it hangs.

    In which order the file has hinges that do not hang on each other means nothing.
    """
    found, left = [-1], list(map(int, joints))
    while left:
        found.append(next(j for j in left if before(m, j) in found))
        left.remove(found[-1])
    return found[1:]


def com_origin(dynamics: MujocoDynamics, anchors: np.ndarray, body: int) -> np.ndarray:
    """From where the centre of mass of a body is counted, m: the anchor of the last of the hinges that move it; the world's."""
    m = dynamics.model
    while body and not m.body_jntnum[body]:
        body = m.body_parentid[body]
    moving = [i for i, j in enumerate(dynamics.joints) if m.jnt_bodyid[j] == body]
    return anchors[max(moving)] if moving else np.zeros(3)


def absent(m: mujoco.MjModel) -> dict:
    """What the method does not have, and no force at random states need show: sums of what there is of it."""
    names = {"damping beyond linear": "dof_dampingpoly", "stiffness beyond linear": "jnt_stiffnesspoly",
             "actuator damping": "actuator_damping", "actuator armature": "actuator_armature"}  # fmt: skip
    sums = {name: float(np.abs(getattr(m, field, np.zeros(1))).sum()) for name, field in names.items()}
    stages = int(FLAGS["contact"]) | int(FLAGS["constraint"])
    return sums | {"contact pairs": 0.0 if m.opt.disableflags & stages else float(contact_pairs(m))}


def options(engine: Mujoco, dynamics: MujocoDynamics) -> dict:
    """Flags, integrator and counts that say what else the file asks of MuJoCo."""
    m = dynamics.model
    flags = {f"flag {name}": "enable" if dynamics.enabled(name) else "disable" for name in FLAGS if name != "gravity"}
    counts = ("ngeom", "nu", "nsensor", "neq", "ntendon")
    integrator = mujoco.mjtIntegrator(engine.integrator).name.removeprefix("mjINT_")
    return flags | {"integrator": integrator} | {name: str(getattr(m, name)) for name in counts}
