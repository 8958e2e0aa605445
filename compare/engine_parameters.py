"""The compiled model read back in the project's symbols: what the compiler made of the file."""

import mujoco
import numpy as np

from .engine import FLAGS


def parameters(engine) -> dict:
    """What the compiler made of the file: arrays per hinge and per body, at q = 0, in world axes."""
    m, d = engine.model, engine.data
    engine._at(np.zeros(len(engine.hinges)))
    anchors = d.xanchor[engine.joints].copy()
    carrier = [int(m.jnt_bodyid[j]) for j in engine.joints]
    last = [max(i for i, owner in enumerate(carrier) if owner == body) for body in engine.bodies]
    turns = engine._turns(d.ximat)
    return {
        "axis": d.xaxis[engine.joints].copy(),
        "anchor": anchors,
        "damping": m.dof_damping[engine.dofs],
        "armature": m.dof_armature[engine.dofs],
        "frictionloss": m.dof_frictionloss[engine.dofs],
        "stiffness": m.jnt_stiffness[engine.joints],
        "limited": m.jnt_limited[engine.joints].astype(float),
        "order": np.argsort(np.argsort(engine.joints)).astype(float),
        "mass": m.body_mass[engine.bodies],
        "com": d.xipos[engine.bodies] - anchors[last],
        "inertia": np.array([R @ np.diag(i) @ R.T for R, i in zip(turns, m.body_inertia[engine.bodies])]),
        "gravcomp": m.body_gravcomp[engine.bodies],
        "gravity": m.opt.gravity * engine.enabled("gravity"),
        "tendon armature": m.tendon_armature.sum(),
        "other mass": m.body_subtreemass[0] - m.body_mass[engine.bodies].sum(),
    }


def options(engine) -> dict:
    """Flags, integrator and counts that say what else the file asks of MuJoCo."""
    m = engine.model
    flags = {f"flag {name}": "enable" if engine.enabled(name) else "disable" for name in FLAGS}
    counts = ("ngeom", "nu", "nsensor", "neq", "ntendon")
    integrator = mujoco.mjtIntegrator(m.opt.integrator).name.removeprefix("mjINT_")
    refs = {f"ref {name}": f"{m.qpos0[i]:g}" for name, i in zip(engine.hinges, engine.qpos)}
    return flags | refs | {"integrator": integrator} | {name: str(getattr(m, name)) for name in counts}
