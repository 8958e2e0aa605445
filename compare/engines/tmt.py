"""tmt's own equations, integrated by its compiled loops."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np

import tmt
from tmt import literal
from tmt.compiled import runner_of
from tmt.derivation.quantities import QUANTITIES
from tmt.methods import method_named
from tmt.model.singular import mass_matrices
from tmt.simulation import reasons

from ..robots.case import Case
from ..robots.states import MOST_SPEEDS
from . import Array, Engine, Method, Motion, Prepared, Setting, Tolerance, rows_of_states

# schemes of MuJoCo that differ from others only for robots with balls, springs or a free body on its own
FOR_SOME = ("rk4_mean_speed", "implicitfast", "discrete")


class Tmt(Engine):
    """The engine of the stated equations. schemes: those of MuJoCo's integrators for this robot."""

    name = "tmt"

    def __init__(self, schemes: Iterable[str] = ()):
        self.left_out = tuple(name for name in FOR_SOME if name not in set(schemes))

    @property
    def methods(self) -> Mapping[str, Method]:
        methods = {}
        for name in [name for name in tmt.METHODS if name not in self.left_out]:
            order, is_adaptive = tmt.METHODS[name].order, tmt.METHODS[name].adaptive
            methods[name] = Method(self.name, name, None if is_adaptive else order, name, is_adaptive)
        return methods

    def methods_in(self, case: Case) -> Mapping[str, Method]:
        return Tmt({*FOR_SOME[1:], *self.methods}).methods if case.controller else self.methods

    def of(self, case: Case) -> "TmtDynamics":
        return TmtDynamics(case)


engine = Tmt


class TmtQuantities:
    """A case's Tree; each quantity by the literal method, its sums as products of matrices where there are many speeds."""

    def __init__(self, case: Case):
        self.tree, self.coordinates = case.tree, case.coordinates
        self.is_large = case.coordinates.nv > MOST_SPEEDS

    def mass_matrix(self, q: Array) -> Array:
        if not self.is_large:
            return literal.mass_matrix(self.tree, q)
        batch, (states,) = rows_of_states(q)
        nv = self.coordinates.nv
        return mass_matrices(self.tree, states).reshape(*batch, nv, nv)

    def bias(self, q: Array, v: Array) -> Array:
        return literal.bias(self.tree, q, v)

    def acceleration(self, q: Array, v: Array, tau: Array) -> Array:
        if not self.is_large:
            return literal.acceleration(self.tree, q, v, tau)
        forces = tau - np.array(self.tree.damping) * v - literal.spring_torque(self.tree, q)
        forces = forces - self.bias(q, v)
        return np.linalg.solve(self.mass_matrix(q), forces[..., None])[..., 0]

    def __getattr__(self, quantity: str) -> Callable[..., Any]:
        if quantity not in QUANTITIES:
            raise AttributeError(quantity)
        return partial(getattr(literal, quantity), self.tree)


class TmtDynamics(TmtQuantities):
    """With tmt's compiled runs."""

    def run(
        self, q: Array, v: Array, tau: Array, dt: float, steps: int, method: str, tolerance: Tolerance = None
    ) -> Motion:
        t, q, v = motion = tmt.simulate(self.tree, q, v, tau, dt, steps, method, tolerance)
        taken = None if method_named(method).adaptive else steps
        return Motion(t, q, v, motion.evaluations, motion.ended, taken)

    def prepare(self, q: Array, v: Array, tau: Array, setting: Setting, method: str) -> Prepared:
        stepping, tolerance = method_named(method), setting.tolerance or 0.0
        if setting.tolerance is not None and not stepping.adaptive:
            raise ValueError(f"method {method!r} has a fixed step and takes no tolerance")
        if stepping.adaptive and not setting.steps:
            setting = setting._replace(steps=setting.intervals)  # between which it takes its own
        every, steps = setting.every, setting.every * setting.intervals
        dt = setting.duration / steps
        positions, speeds = paths = [np.full((1, steps + 1, len(start)), np.nan) for start in (q, v)]
        positions[0, 0], speeds[0, 0] = q, v
        runner, info = runner_of(self.tree, method), np.zeros((1, 3), np.int64)
        arrays = positions, speeds, np.array(tau, float)[None], info
        call = runner.call(1, arrays, dt, tolerance)

        def read(_: Any) -> Motion:
            codes, evaluations = runner.outcome(positions, speeds, info)
            (ended,) = reasons(self.tree, positions, speeds, codes, dt, tolerance)
            taken = evaluations // stepping.stages if stepping.adaptive else steps
            q, v = (path[0, ::every].copy() for path in paths)
            return Motion(setting.times, q, v, evaluations, ended, taken)

        return lambda _=arrays: call(), read  # the arrays live as long as it


class Compiled:
    """A Tree's quantities by tmt's compiled code."""

    def __init__(self, tree: tmt.Tree):
        self.tree = tree

    def __getattr__(self, quantity: str) -> Callable[..., Any]:
        tmt.prepare(self.tree, quantity)
        return partial(getattr(tmt, quantity), self.tree)
