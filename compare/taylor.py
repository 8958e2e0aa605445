"""heyoka's Taylor method on the same equations of motion; only where heyoka is installed (the extra `taylor`)."""

from functools import lru_cache

import heyoka
import numpy as np

from tmt import composite
from tmt.method import acceleration
from tmt.space import cos, sin

from .competitors import GRID, Outcome

sin.register(heyoka.expression, heyoka.sin)
cos.register(heyoka.expression, heyoka.cos)


@lru_cache(maxsize=32)
def integrator(model, tau, tolerance):
    """heyoka's integrator of a model: the composite form traced on its expressions, compiled for this tolerance."""
    n = len(model.parent)
    q, qd = (heyoka.make_vars(*(f"{name}{i}" for i in range(n))) for name in ("q", "qd"))
    qdd = acceleration(model, q, qd, list(tau), composite.mass_matrix_and_bias)
    return heyoka.taylor_adaptive([*zip(q, qd), *zip(qd, qdd)], [0.0] * (2 * n), tol=tolerance)


def taylor_run(scene, setting):
    """Its run on the grid, with its dense output."""
    method = integrator(scene.model, tuple(scene.tau.tolist()), setting.tolerance)
    grid = np.linspace(0.0, scene.duration, GRID + 1)
    start = np.concatenate(scene.start)

    def run():
        method.time, method.state[:] = 0.0, start
        return method.propagate_grid(grid)

    def read(outcome):
        path = outcome[-1]
        return Outcome(*np.split(path, 2, axis=1), int(outcome[3]), None)

    return run, read
