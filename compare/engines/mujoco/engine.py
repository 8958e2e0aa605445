"""MuJoCo as an engine: a compiled model, what a case changes in it, actuators at constant controls."""

from collections.abc import Mapping, Sequence
from copy import copy
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from tmt import Tree
from tmt.methods import isolated_speeds

from ...robots.case import Case
from .. import Engine, Method
from .dynamics import MujocoDynamics
from .inventory import NOT_HAD_FIELDS, switch_off
from .locked import LEAST
from .names import FROM_4, INTEGRATORS, bit, rotors
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
        lone = bool(isolated_speeds(tree))
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

    def plain(self, case: Case | None) -> dict[str, Any]:
        """How MuJoCo alone reads the file as it is, and evaluates the states of a case, if there is one; as JSON has it.

        why: why it does not read this file. least: a mass for links without one, which it refuses; None:
        there are none. qpos: positions, with the places of the case's joints in them; dofs: those of their
        speeds. zero: fields of the model to be set to zero, where all that a Tree does not have is switched
        off, else None.
        """
        m, source = self.source.model, self.source
        is_packed = "package://" in source.text
        why = "--floating" if source.floating else "its meshes" if source.missing or is_packed else ""
        least = LEAST if (m.body_mass[m.jnt_bodyid] == 0.0).any() else None
        of_file = {"why": why if isinstance(source.origin, Path) else "no file", "least": least}
        if case is None:
            return of_file
        dynamics = self.of(case)
        zero = [name for name in (*NOT_HAD_FIELDS, "tendon_armature") if np.any(getattr(m, name, 0.0))]
        return of_file | {
            "first": dynamics.data.qpos.tolist(), "qpos": dynamics.qpos.tolist(), "dofs": dynamics.dofs.tolist(),
            "zero": zero if self.bare else None,
        }  # fmt: skip

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
        dynamics = MujocoDynamics(model, case, self.bodies, self.bare)
        dynamics.model.dof_damping[dynamics.dofs] += case.added_damping
        return dynamics


def bare_model(source: Source, rotors_in_joints: bool) -> mujoco.MjModel:
    """A compiled model of a file for other engines, without forces, contacts and actuators that a Tree does not have.

    rotors_in_joints: the armature of actuators is that of their joints.
    """
    m = source.without({}, bare=True)
    switch_off(m)
    # MuJoCo Warp refuses the first; with the second its implicitfast is explicit in the damping
    m.opt.disableflags &= ~bit("AUTORESET", "ACTUATION")
    m.opt.disableflags |= bit("WARMSTART")  # its solver starts from the unconstrained acceleration
    m.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON  # of constraints, which are off; both refuse PGS
    m.opt.iterations = m.opt.noslip_iterations = 0
    if rotors_in_joints and hasattr(m, "actuator_armature"):
        m.dof_armature += rotors(m)
        m.actuator_armature[:] = 0.0
    m.actuator_gainprm[:] = m.actuator_biasprm[:] = 0.0  # those with armature are still there
    m.geom_contype[:] = m.geom_conaffinity[:] = 0  # MJX refuses pairs even if there are no contacts
    return m
