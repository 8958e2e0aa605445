"""Convective terms of MuJoCo by another way than its rates of Jacobians."""

import mujoco
import numpy as np

from .dynamics import MujocoDynamics


def convective_accelerations(dynamics: MujocoDynamics, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """v_conv, world, and w_conv, body axes, (states, m, 3): accelerations of the bodies at qacc = 0 without gravity.

    By mj_objectAcceleration, where MujocoDynamics.convective_terms has mj_jacDot. q (states, nq), v (states, nv).
    """
    model, weight = dynamics.model, dynamics.model.opt.gravity.copy()
    found = np.zeros((2, len(q), len(dynamics.bodies), 3))
    both = np.zeros(6)
    model.opt.gravity[:] = 0.0
    try:
        for state, (position, speed) in enumerate(zip(q, v)):
            d = dynamics.forward(position, speed)
            d.qacc[:] = 0.0
            mujoco.mj_rnePostConstraint(model, d)
            turns = dynamics.turns(d.xmat) @ dynamics.zero_axes.transpose(0, 2, 1)
            for k, body in enumerate(dynamics.bodies):
                mujoco.mj_objectAcceleration(model, d, mujoco.mjtObj.mjOBJ_BODY, body, both, 0)
                found[0, state, k], found[1, state, k] = both[3:], turns[k].T @ both[:3]
    finally:
        model.opt.gravity[:] = weight
    return found[0], found[1]
