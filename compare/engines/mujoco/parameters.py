"""The compiled model read back in the project's symbols: what the compiler made of the file."""

from collections.abc import Sequence

import mujoco
import numpy as np

from .dynamics import FLAGS, MujocoDynamics
from .engine import Mujoco

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
    anchors = d.xanchor[dynamics.joints].copy()
    carrier = [int(m.jnt_bodyid[j]) for j in dynamics.joints]
    last = [max(i for i, owner in enumerate(carrier) if owner == body) for body in dynamics.bodies]
    turns = dynamics.turns(d.ximat)
    return {
        **{name: float(not m.opt.disableflags & bit(members)) for name, members in STATED_FLAGS.items()},
        **absent(m),
        "parent": parents(m),
        "order": np.argsort(np.argsort(dynamics.joints)).astype(float),
        "ref": m.qpos0[dynamics.qpos],
        "axis": d.xaxis[dynamics.joints].copy(),
        "anchor": anchors,
        "damping": m.dof_damping[dynamics.dofs],
        "armature": m.dof_armature[dynamics.dofs],
        "frictionloss": m.dof_frictionloss[dynamics.dofs],
        "stiffness": m.jnt_stiffness[dynamics.joints],
        "limited": m.jnt_limited[dynamics.joints].astype(float),
        "mass": m.body_mass[dynamics.bodies],
        "com": d.xipos[dynamics.bodies] - anchors[last],
        "inertia": np.array([R @ np.diag(i) @ R.T for R, i in zip(turns, m.body_inertia[dynamics.bodies])]),
        "gravcomp": m.body_gravcomp[dynamics.bodies],
        "gravity": m.opt.gravity.copy(),
        "tendon armature": m.tendon_armature.sum(),
        "other mass": m.body_subtreemass[0] - m.body_mass[sorted(set(dynamics.bodies))].sum(),
        "density": m.opt.density,
        "viscosity": m.opt.viscosity,
    }


def parents(m: mujoco.MjModel) -> np.ndarray:
    """For each hinge, in the order of the file, the place of the hinge that it hangs on, -1: the world; (njnt,)."""
    found = []
    for j, body in enumerate(m.jnt_bodyid):
        place = j - 1 if j and m.jnt_bodyid[j - 1] == body else -1
        while place < 0 and body:
            body = m.body_parentid[body]
            if body and m.body_jntnum[body]:
                place = m.body_jntadr[body] + m.body_jntnum[body] - 1
        found.append(float(place))
    return np.array(found)


def absent(m: mujoco.MjModel) -> dict:
    """What the method does not have, and no force at random states need show: sums of what there is of it."""
    names = {"damping beyond linear": "dof_dampingpoly", "stiffness beyond linear": "jnt_stiffnesspoly",
             "actuator damping": "actuator_damping", "actuator armature": "actuator_armature"}  # fmt: skip
    sums = {name: float(np.abs(getattr(m, field, np.zeros(1))).sum()) for name, field in names.items()}
    stages = int(FLAGS["contact"]) | int(FLAGS["constraint"])
    return sums | {"contact pairs": 0.0 if m.opt.disableflags & stages else float(contact_pairs(m))}


def contact_pairs(m: mujoco.MjModel) -> int:
    """How many pairs of geoms may touch, as MuJoCo chooses them: of two bodies that move against each other."""
    count, weld = m.npair, m.body_weldid
    parent_filter = not m.opt.disableflags & bit(("FILTERPARENT",))
    excluded = {int(signature) for signature in m.exclude_signature}
    for i in range(m.ngeom):
        for j in range(i + 1, m.ngeom):
            one, other = sorted((int(m.geom_bodyid[i]), int(m.geom_bodyid[j])))
            a, b = weld[one], weld[other]
            over = [weld[m.body_parentid[w]] for w in (a, b)]
            related = parent_filter and a and b and (a == over[1] or b == over[0])
            wanted = m.geom_contype[i] & m.geom_conaffinity[j] or m.geom_contype[j] & m.geom_conaffinity[i]
            count += bool(a != b and wanted and not related and (one << 16) + other not in excluded)
    return count


def bit(members: Sequence[str]) -> int:
    """The bit of the first of these disable flags that the installed MuJoCo has; 0 if it has none of them."""
    for member in members:
        if hasattr(mujoco.mjtDisableBit, f"mjDSBL_{member}"):
            return int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{member}"))
    return 0


def options(engine: Mujoco, dynamics: MujocoDynamics) -> dict:
    """Flags, integrator and counts that say what else the file asks of MuJoCo."""
    m = dynamics.model
    flags = {f"flag {name}": "enable" if dynamics.enabled(name) else "disable" for name in FLAGS if name != "gravity"}
    counts = ("ngeom", "nu", "nsensor", "neq", "ntendon")
    integrator = mujoco.mjtIntegrator(engine.integrator).name.removeprefix("mjINT_")
    return flags | {"integrator": integrator} | {name: str(getattr(m, name)) for name in counts}
