"""MuJoCo as an engine: a compiled model, what a case changes in it, actuators at constant controls."""

from collections.abc import Mapping, Sequence
from copy import copy
from typing import Any

import mujoco
import numpy as np

from tmt import Tree
from tmt.methods import lone_speeds

from ...robots.actuators import Controller
from ...robots.case import Case
from .. import Engine, Method
from .actuators import UNLIMITED
from .dynamics import Engaged, MujocoDynamics
from .inventory import set_fields, switch_off
from .names import FROM_4, INTEGRATORS, bit, set_control
from .source import Source

# MuJoCo's integrator: the method of tmt that is the same scheme, where no ball, no spring makes them differ
SCHEMES = dict.fromkeys(("Euler", "implicitfast", "discrete"), "semi_implicit_euler")
SCHEMES |= {"implicit": "implicit", "RK4": "rk4"}


def methods_for(tree: Tree | None = None) -> dict[str, Method]:
    """MuJoCo's integrators for a Tree, by name, each with the same scheme of tmt; None: only hinges.

    Measured step by step: implicitfast and discrete are implicit in the bias of a free body on its own;
    discrete also in springs. Up to 3.17 RK4 turns a ball by the mean of its speeds, and implicitfast uses a
    midpoint rule for a free body on its own, which tmt does not have: it is left out. In the speed gain of
    actuators implicitfast and implicit are implicit where two joints are on one path to the world; discrete
    everywhere, and in the position gain too.
    """
    schemes, order = dict(SCHEMES), 4
    if tree is not None:
        lone = bool(lone_speeds(tree))
        if lone or tree.has_gains:
            schemes["implicitfast"] = schemes["discrete"] = "implicitfast"
        if tree.has_springs or tree.has_gains:
            schemes["discrete"] = "discrete"
        if tree.coordinates.balls and not FROM_4:
            schemes["RK4"], order = "rk4_mean_speed", 2
        if lone and not FROM_4:
            del schemes["implicitfast"]
    known = {name: scheme for name, scheme in schemes.items() if name in INTEGRATORS}
    orders = dict.fromkeys(known, 1) | {"RK4": order}
    return {name: Method("mujoco", name, orders[name], scheme) for name, scheme in known.items()}


METHODS = methods_for()
MODELS = 16  # most models of cases that an engine keeps
SOLVED, MOST_ITERATIONS = 1e-15, 100
ACTING, IDLE = 0, 1  # groups of actuators


class Mujoco(Engine):
    """MuJoCo with one compiled model.

    bodies: their numbers in the model. tree: all that this Tree does not have is switched off, see inventory,
    and the methods are those for it.
    """

    name = "mujoco"
    methods = METHODS

    def __init__(self, source: Source, bodies: Sequence[int], tree: Tree | None = None) -> None:
        self.source, self.bodies, self.methods = source, list(bodies), methods_for(tree)
        self.bare = tree is not None
        self.model = source.without_meshes() if self.bare else source.model
        self.cache: dict[tuple[object, ...], MujocoDynamics] = {}

    def __getstate__(self) -> dict[str, Any]:
        source = copy(self.source)
        source.model = self.model  # without meshes, which another process needs no more than this engine
        return self.__dict__ | {"cache": {}, "source": source}

    def methods_in(self, case: Case) -> Mapping[str, Method]:
        return methods_for(case.tree) if case.controller else self.methods

    def of(self, case: Case) -> MujocoDynamics:
        """The dynamics of a case: the file's own numbers with the changes of the case.

        A model with locked joints is compiled again from the source, without them; ModelError if that is not
        possible.
        """
        controls = case.controller.controls if case.controller else None
        changes = tuple(case.locked.items()), case.scene.gravity, case.scene.damping, case.joints, controls
        dynamics = self.cache.pop(changes, None) or self.dynamics(case)
        self.cache[changes] = dynamics
        if len(self.cache) > MODELS:
            del self.cache[next(iter(self.cache))]
        return dynamics

    def dynamics(self, case: Case) -> MujocoDynamics:
        model = mujoco.MjModel.__copy__(self.model)
        if case.locked:
            model = self.source.without(case.locked, self.bare)
        if self.bare:
            switch_off(model)
        if not case.scene.gravity:
            model.opt.gravity[:] = 0.0
        actuators = engaged(model, case.controller) if case.controller else Engaged()
        dynamics = MujocoDynamics(model, case, self.bodies, self.bare, actuators)
        dynamics.model.dof_damping[dynamics.dofs] += case.added_damping
        return dynamics


def engaged(model: mujoco.MjModel, controller: Controller) -> Engaged:
    """Switch on the actuators of a model that take part, without any range.

    `discrete` solves by iteration where a tendon couples branches: here to rounding and by Newton's method
    (with PGS it is Euler's scheme). Activations are constant, see set_control.
    """
    model.opt.disableflags &= ~bit("ACTUATION")
    set_fields(model, UNLIMITED, 0)
    model.opt.solver, model.opt.tolerance = mujoco.mjtSolver.mjSOL_NEWTON, SOLVED
    model.opt.iterations = max(model.opt.iterations, MOST_ITERATIONS)
    ctrl, act = np.zeros(model.nu), np.zeros(model.na)
    for i, u in enumerate(controller.controls):
        model.actuator_group[i] = IDLE if u is None else ACTING
        if u is not None:
            set_control(model, i, u, ctrl, act)
    model.opt.disableactuator = 1 << IDLE
    return Engaged(ctrl, act, controller.torque)
