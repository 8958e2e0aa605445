"""heyoka's Taylor method on the same equations of motion; only where heyoka is installed (the extra `taylor`)."""

from functools import lru_cache
from importlib.util import find_spec

import numpy as np

from tmt import composite
from tmt.method import acceleration
from tmt.space import cos, sin

from . import GRID, Method, Motion, Setting
from .scipy import each
from .tmt import TmtDynamics

TOLERANCE = 1e-15


class Heyoka:
    """The engine of heyoka's Taylor method, which chooses its own steps."""

    name = "heyoka"
    methods = {"Taylor": Method("heyoka", "Taylor", None, "Taylor", adaptive=True)}

    def unavailable(self) -> str | None:
        if find_spec("heyoka") is None:
            return "heyoka is not installed; the extra `taylor` brings it, on Linux"
        return None

    def of(self, case) -> "HeyokaDynamics":
        return HeyokaDynamics(case)


class HeyokaDynamics(TmtDynamics):
    """The equations of a case as heyoka's expressions."""

    def run(self, q, v, tau, dt, steps, method, tolerance=None) -> Motion:
        return each(self.solved, q, v, tau, np.linspace(0.0, dt * steps, steps + 1), tolerance or TOLERANCE)

    def solved(self, q, v, tau, t, tolerance) -> Motion:
        run, read = self.prepared(q, v, tau, t, tolerance)
        return read(run())

    def prepare(self, q, v, tau, setting: Setting, method):
        return self.prepared(q, v, tau, np.linspace(0.0, setting.duration, GRID + 1), setting.tolerance)

    def prepared(self, q, v, tau, t, tolerance):
        stepper = integrator(self.tree, tuple(np.asarray(tau, float).tolist()), tolerance)
        start = np.concatenate([q, v])

        def run():
            stepper.time, stepper.state[:] = 0.0, start
            return stepper.propagate_grid(t)

        def read(outcome):
            path = np.full((len(t), start.size), np.nan)
            path[: len(outcome[-1])] = outcome[-1]
            ended = None if np.isfinite(path).all() else f"heyoka stops: {outcome[0]}"
            return Motion(t, *np.split(path, 2, axis=1), None, ended, int(outcome[3]))

        return run, read


@lru_cache(maxsize=32)
def integrator(tree, tau, tolerance):
    """heyoka's integrator of a Tree: the composite form traced on its expressions, compiled for this tolerance."""
    import heyoka

    sin.register(heyoka.expression, heyoka.sin)
    cos.register(heyoka.expression, heyoka.cos)
    n = len(tree.parent)
    q, qd = (heyoka.make_vars(*(f"{name}{i}" for i in range(n))) for name in ("q", "qd"))
    qdd = acceleration(tree, q, qd, list(tau), composite.mass_matrix_and_bias)
    return heyoka.taylor_adaptive([*zip(q, qd), *zip(qd, qdd)], [0.0] * (2 * n), tol=tolerance)
