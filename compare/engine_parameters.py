"""The compiled model read back in the project's symbols: what the compiler made of the file."""

import mujoco
import numpy as np

from .engine import FLAGS

STATED_FLAGS = {  # flags that the equations of motion depend on, by the names that MuJoCo's versions give them
    "flag gravity": ("GRAVITY",),
    "flag damper": ("DAMPER", "PASSIVE"),
    "flag eulerdamp": ("EULERDAMP",),
}


def parameters(engine) -> dict:
    """What the compiler made of the file: arrays per hinge, per body, or one number of the file, in world axes.

    Read in the file's own configuration (qpos0): there every frame lies as the file says, whatever a hinge's `ref` is.
    """
    m, d = engine.model, engine.data
    engine._at(m.qpos0[engine.qpos])
    anchors = d.xanchor[engine.joints].copy()
    carrier = [int(m.jnt_bodyid[j]) for j in engine.joints]
    last = [max(i for i, owner in enumerate(carrier) if owner == body) for body in engine.bodies]
    turns = engine._turns(d.ximat)
    return {
        **{name: float(not m.opt.disableflags & bit(members)) for name, members in STATED_FLAGS.items()},
        **absent(m),
        "parent": parents(m),
        "order": np.argsort(np.argsort(engine.joints)).astype(float),
        "ref": m.qpos0[engine.qpos],
        "axis": d.xaxis[engine.joints].copy(),
        "anchor": anchors,
        "damping": m.dof_damping[engine.dofs],
        "armature": m.dof_armature[engine.dofs],
        "frictionloss": m.dof_frictionloss[engine.dofs],
        "stiffness": m.jnt_stiffness[engine.joints],
        "limited": m.jnt_limited[engine.joints].astype(float),
        "mass": m.body_mass[engine.bodies],
        "com": d.xipos[engine.bodies] - anchors[last],
        "inertia": np.array([R @ np.diag(i) @ R.T for R, i in zip(turns, m.body_inertia[engine.bodies])]),
        "gravcomp": m.body_gravcomp[engine.bodies],
        "gravity": m.opt.gravity.copy(),
        "tendon armature": m.tendon_armature.sum(),
        "other mass": m.body_subtreemass[0] - m.body_mass[sorted(set(engine.bodies))].sum(),
        "density": m.opt.density,
        "viscosity": m.opt.viscosity,
    }


def parents(m) -> np.ndarray:
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


def absent(m) -> dict:
    """What the method does not have, and no force at random states need show: sums of what there is of it."""
    names = {"damping beyond linear": "dof_dampingpoly", "stiffness beyond linear": "jnt_stiffnesspoly",
             "actuator damping": "actuator_damping", "actuator armature": "actuator_armature"}  # fmt: skip
    sums = {name: float(np.abs(getattr(m, field, np.zeros(1))).sum()) for name, field in names.items()}
    stages = int(FLAGS["contact"]) | int(FLAGS["constraint"])
    return sums | {"contact pairs": 0.0 if m.opt.disableflags & stages else float(contact_pairs(m))}


def contact_pairs(m) -> int:
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


def bit(members) -> int:
    """The bit of the first of these disable flags that the installed MuJoCo has; 0 if it has none of them."""
    for member in members:
        if hasattr(mujoco.mjtDisableBit, f"mjDSBL_{member}"):
            return int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{member}"))
    return 0


def options(engine) -> dict:
    """Flags, integrator and counts that say what else the file asks of MuJoCo."""
    m = engine.model
    flags = {f"flag {name}": "enable" if engine.enabled(name) else "disable" for name in FLAGS if name != "gravity"}
    counts = ("ngeom", "nu", "nsensor", "neq", "ntendon")
    integrator = mujoco.mjtIntegrator(engine.integrator).name.removeprefix("mjINT_")
    return flags | {"integrator": integrator} | {name: str(getattr(m, name)) for name in counts}
