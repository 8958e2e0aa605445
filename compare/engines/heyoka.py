"""heyoka's Taylor method on the same equations of motion; only where heyoka is installed (the extra `taylor`)."""

from collections.abc import Mapping
from functools import lru_cache
from importlib.util import find_spec
from typing import ClassVar

import numpy as np

from tmt import Tree, composite
from tmt.method import acceleration
from tmt.space import cos, sin

from ..case import Case
from . import GRID, Method, Motion, Prepared, Setting, rows_of_states
from .scipy import as_far_as_it_goes, each
from .tmt import TmtDynamics

MOST_JOINTS = 3  # it compiles anew for each tolerance and torque: one of seven hinges took 50 s each time
FULL = 1e-15  # tolerance: all digits of a double


class Heyoka:
    """The engine of heyoka's Taylor method, which chooses its own steps."""

    name = "heyoka"
    methods: ClassVar[Mapping[str, Method]] = {"Taylor": Method("heyoka", "Taylor", None, "Taylor", adaptive=True)}

    def __init__(self, tree: Tree | None = None):
        self.tree = tree  # of the robot, None: one that it can take

    def unavailable(self) -> str | None:
        if find_spec("heyoka") is None:
            return "heyoka is not installed; the extra `taylor` brings it, on Linux"
        if self.tree and self.tree.coordinates.balls:
            return "its expressions are written for hinges and slides, and there are balls"
        if self.tree and len(self.tree.hinge_names) > MOST_JOINTS:
            return f"it compiles anew for each tolerance, which would take minutes for more than {MOST_JOINTS} joints"
        return None

    def of(self, case: Case) -> "HeyokaDynamics":
        return HeyokaDynamics(case)


class HeyokaDynamics(TmtDynamics):
    """The equations of a case as heyoka's expressions."""

    def mass_matrix(self, q) -> np.ndarray:
        n = self.coordinates.nv
        return self.evaluated(q)[..., : n * n].reshape(*np.shape(q)[:-1], n, n)

    def bias(self, q, v) -> np.ndarray:
        n = self.coordinates.nv
        return self.evaluated(q, v)[..., n * n : n * n + n]

    def acceleration(self, q, v, tau) -> np.ndarray:
        return self.evaluated(q, v, tau)[..., -self.coordinates.nv :]

    def evaluated(self, q, v=None, tau=None) -> np.ndarray:
        """Mbar by rows, h and the acceleration at each state, (..., n (n + 2))."""
        none = np.zeros(self.coordinates.nv)
        batch, states = rows_of_states(q, none if v is None else v, none if tau is None else tau)
        return dynamics(self.tree)(np.concatenate(states, axis=1).T.copy()).T.reshape(*batch, -1)

    def run(self, q, v, tau, dt, steps, method, tolerance=None) -> Motion:
        return each(self.solved, q, v, tau, np.linspace(0.0, dt * steps, steps + 1), tolerance)

    def solved(self, q, v, tau, t, tolerance) -> Motion:
        run, read = self.prepared(q, v, tau, t, tolerance)
        return read(run())

    def prepare(self, q, v, tau, setting: Setting, method) -> Prepared:
        return self.prepared(q, v, tau, np.linspace(0.0, setting.duration, GRID + 1), setting.tolerance)

    def prepared(self, q, v, tau, t, tolerance) -> Prepared:
        stepper = integrator(
            self.tree, tuple(np.asarray(tau, float).tolist()), FULL if tolerance is None else tolerance
        )
        start = np.concatenate([q, v])

        def run():
            stepper.time, stepper.state[:] = 0.0, start
            return stepper.propagate_grid(t)

        def read(outcome):
            why, *_, steps, _, path = outcome
            q, v, ended = as_far_as_it_goes(t, path, start, f"heyoka stops: {why}", len(start) // 2)
            return Motion(t, q, v, None, ended, int(steps))

        return run, read


@lru_cache(maxsize=32)
def integrator(tree: Tree, tau: tuple[float, ...], tolerance: float):
    """heyoka's integrator of a Tree: the composite form traced on its expressions, compiled for this tolerance."""
    import heyoka

    q, qd = variables(tree, "q", "qd")
    qdd = acceleration(tree, q, qd, list(tau), composite.mass_matrix_and_bias)
    return heyoka.taylor_adaptive([*zip(q, qd), *zip(qd, qdd)], [0.0] * (2 * len(q)), tol=tolerance)


@lru_cache(maxsize=32)
def dynamics(tree: Tree):
    """Mbar by rows, h and the acceleration as one function that heyoka compiles, of q, qd and tau one after the other."""
    import heyoka

    q, qd, tau = variables(tree, "q", "qd", "tau")
    M, h = composite.mass_matrix_and_bias(tree, q, qd)
    n = len(q)
    rows = [M[min(i, j)][max(i, j)] for i in range(n) for j in range(n)]
    qdd = acceleration(tree, q, qd, tau, composite.mass_matrix_and_bias)
    values = [heyoka.expression(value) if isinstance(value, float) else value for value in (*rows, *h, *qdd)]
    return heyoka.cfunc(values, vars=[*q, *qd, *tau])


def variables(tree: Tree, *names: str) -> list:
    """heyoka's variables for each hinge: one list for each name."""
    import heyoka

    sin.register(heyoka.expression, heyoka.sin)
    cos.register(heyoka.expression, heyoka.cos)
    return [[heyoka.make_vars(f"{name}{i}") for i in range(len(tree.parent))] for name in names]
