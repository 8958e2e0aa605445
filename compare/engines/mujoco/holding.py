"""The rows of MuJoCo's constraint solver at a posture at rest: equalities, and limits beyond which joints are."""

import mujoco
import numpy as np

from ...robots.actuators import Rows
from .flags import on

DISCRETE = getattr(mujoco.mjtIntegrator, "mjINT_DISCRETE", None)  # it has the constraints' springs and dampers implicit


def constraint_rows(model: mujoco.MjModel, data: mujoco.MjData, q: np.ndarray, dt: float, integrator: int) -> Rows:
    """The constraints of a model at q (nq,) at a step size, s, as they are solved for an integrator of mjtIntegrator."""
    stated = model.opt.timestep, model.opt.integrator
    model.opt.timestep, model.opt.integrator = dt, integrator
    data.qpos[:], data.qvel[:] = q, 0.0
    mujoco.mj_forward(model, data)
    model.opt.timestep, model.opt.integrator = stated
    k, damping, impedance, slope = data.efc_KBIP.reshape(data.nefc, 4).T
    violation, stiffness, R = data.efc_pos - data.efc_margin, k * impedance, data.efc_R.copy()
    less = 1.0 + (dt * damping + dt * dt * stiffness) * (integrator == DISCRETE)
    at_limit = data.efc_type == mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT
    return Rows(
        jacobian(model, data),
        forces=-stiffness * violation / (less * R),
        damping=(damping + dt * stiffness * (integrator == DISCRETE)) / less,
        # the impedance grows with the violation: aref does, and R falls
        stiffness=(stiffness + k * violation * slope * (1.0 + 1.0 / (1.0 - impedance))) / less,
        softness=R,
        limits=tuple(map(int, data.efc_id[at_limit])),
    )


def jacobian(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Of the rows, (nefc, nv)."""
    if not mujoco.mj_isSparse(model):
        return data.efc_J.reshape(data.nefc, model.nv).copy()
    found = np.zeros((data.nefc, model.nv))
    mujoco.mju_sparse2dense(found, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
    return found


def limits_in_force(model: mujoco.MjModel) -> tuple[int, ...]:
    """The joints whose limits a file has in force, by number."""
    return tuple(np.flatnonzero(model.jnt_limited).tolist()) if on(model, "CONSTRAINT") and on(model, "LIMIT") else ()
