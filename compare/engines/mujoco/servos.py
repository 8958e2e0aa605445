"""The actuators of a compiled model, set to act under constant controls."""

from typing import NamedTuple

import mujoco
import numpy as np

from ...controller import Controller
from .actuators import control_of
from .flags import bit

UNLIMITED = (
    "actuator_ctrllimited", "actuator_forcelimited", "actuator_actlimited", "jnt_actfrclimited", "tendon_actfrclimited",
)  # fmt: skip
ACTING, IDLE = 0, 1  # groups of actuators


class Driven(NamedTuple):
    """Under what the actuators of a model act."""

    ctrl: np.ndarray  # (nu,)
    act: np.ndarray  # (na,): activations, which these controls leave as they are
    torque: np.ndarray  # (nv,) N m or N: the part of their torque at no position and no speed, by the law in compare


def engaged(model: mujoco.MjModel, controller: Controller) -> Driven:
    """Switch on, in a model, the actuators that take part, without any range; MuJoCo computes their forces itself.

    An activation is held constant: that of a filter by a control that is the same, that of an integrator by none.
    """
    model.opt.disableflags &= ~bit(("ACTUATION",))
    for name in UNLIMITED:
        getattr(model, name)[:] = 0
    ctrl, act = np.zeros(model.nu), np.zeros(model.na)
    for i, u in enumerate(controller.controls):
        model.actuator_group[i] = IDLE if u is None else ACTING
        integrates = model.actuator_dyntype[i] == mujoco.mjtDyn.mjDYN_INTEGRATOR
        if u is not None:
            place, count = control_of(model, i)
            ctrl[place : place + count] = 0.0 if integrates else u
            if model.actuator_dyntype[i] != mujoco.mjtDyn.mjDYN_NONE:
                act[model.actuator_actadr[i]] = u
    model.opt.disableactuator = 1 << IDLE
    return Driven(ctrl, act, controller.torque)
