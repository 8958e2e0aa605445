"""What rounding leaves of a motion: the size of the errors below which no method of integration comes."""

import numpy as np

from tmt.methods import METHODS, amplification

from ...engines import GRID, Dynamics
from ...judge.rounding import growth
from ...judge.scale import EPS
from ...robots.case import Case
from .settings import coarsest_steps

EVERY = 16  # steps of the run along which the growth is taken, for each time at which a run is read
EACH_STEP = 12  # up to which the Jacobian of every step is taken, else that of one in 16 for all of these


def floor(case: Case, dynamics: Dynamics) -> float:
    """What rounding leaves of the angles: eps times the largest growth of a small difference up to each time, rad.

    dynamics: tmt's, whose RK4 is run with 1024 steps, or as many as the scene needs to be followed at all; ValueError if it
    cannot be.
    """
    first = EVERY * GRID * max(1, round(case.duration / 5.0), -(-coarsest_steps(case) // (EVERY * GRID)))
    for steps in (first, 4 * first, 16 * first):
        dt = case.duration / steps
        motion = dynamics.run(*case.start, case.tau, dt, steps, "rk4")
        if np.isfinite(motion.q).all():
            taken = growth if case.coordinates.nv <= EACH_STEP else sampled_growth
            growths = taken(METHODS["rk4"], case.tree, motion.q, motion.v, case.tau, dt, EVERY)
            return float(EPS * 10.0 ** growths.max() * max(1.0, np.abs(motion.q).max()))
    raise ValueError(f"scene {case.name!r}: RK4 with {steps} steps does not reach its end; a shorter one is expected")


def sampled_growth(stepping, tree, q, qd, tau, dt, every) -> np.ndarray:
    """What `growth` is, from the Jacobian of one step in `every`, taken for all of these."""
    product, scale, result = np.eye(2 * qd.shape[1]), 0.0, [0.0]
    jacobians = amplification(stepping, tree, q[:-1:every], qd[:-1:every], tau, dt)
    for J in np.linalg.matrix_power(jacobians, every):
        product = J @ product
        size = np.linalg.norm(product, 2)
        product, scale = product / size, scale + np.log10(size)
        result.append(scale)
    return np.array(result)
