"""A case in which the actuators of the model act, under constant controls: MuJoCo computes their forces itself."""

from typing import NamedTuple

import mujoco
import numpy as np

from ...robots.actuators import Controller
from .actuators import control_of
from .dynamics import MujocoDynamics
from .flags import bit

UNLIMITED = (
    "actuator_ctrllimited", "actuator_forcelimited", "actuator_actlimited", "jnt_actfrclimited", "tendon_actfrclimited",
)  # fmt: skip
SOLVED, MOST_ITERATIONS = 1e-15, 100
ACTING, IDLE = 0, 1  # groups of actuators


class Driven(NamedTuple):
    """Under what the actuators of a model act."""

    ctrl: np.ndarray  # (nu,)
    act: np.ndarray  # (na,): activations, which these controls leave as they are
    torque: np.ndarray  # (nv,) N m or N: the part of their torque at no position and no speed, by the law in compare


def engaged(model: mujoco.MjModel, controller: Controller) -> Driven:
    """Switch on, in a model, the actuators that take part, without any range.

    `discrete` has their gains in a system that is solved by iteration where a tendon couples branches: here to rounding, and by
    Newton's method, as with PGS it is Euler's scheme. An activation is held constant: that of a filter by a control that is the
    same, that of an integrator by none.
    """
    model.opt.disableflags &= ~bit(("ACTUATION",))
    for name in UNLIMITED:
        if hasattr(model, name):
            getattr(model, name)[:] = 0
    model.opt.solver, model.opt.tolerance = mujoco.mjtSolver.mjSOL_NEWTON, SOLVED
    model.opt.iterations = max(model.opt.iterations, MOST_ITERATIONS)
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


class DrivenDynamics(MujocoDynamics):
    """A model whose actuators act: of the torque that is given only what goes beyond the constant part of theirs is applied."""

    def __init__(self, model, coordinates, bodies, zero, bare, controller):
        self.driven = engaged(model, controller)
        super().__init__(model, coordinates, bodies, zero, bare)
        self.data.ctrl[:], self.data.act[:] = self.driven.ctrl, self.driven.act

    def own_copy(self, dt, integrator, q=0.0, v=0.0, tau=0.0):
        model, data = super().own_copy(dt, integrator, q, v, tau)
        data.ctrl[:], data.act[:] = self.driven.ctrl, self.driven.act
        return model, data

    def applied(self, tau):
        return tau - self.driven.torque

    def control(self):
        torque, _ = super().control()
        return torque | int(mujoco.mjtState.mjSTATE_CTRL), self.driven.ctrl  # which comes first
