"""The mass matrix."""

import numpy as np
from scipy.optimize import minimize

import tmt

from .agreement import EPS, FACTOR, Result, condition, mass_scale

TITLE = "Mass matrix: is Mbar MuJoCo's M?"
CLAIM = (
    "Mbar = sum T' m T + B' I B equals mj_fullM at every posture; it is symmetric and positive definite; its condition "
    "number, which multiplies every rounding error of an acceleration, has its maximum 126.83 at beta = +-90 deg, "
    "gamma = 90 deg."
)
BAR = "64 eps x the largest entry of Mbar at that state (condition number: half a unit of its last digit)."
WORST_CONDITION, WORST_BETA, WORST_GAMMA = 126.83, np.radians(90.0), np.radians(90.0)


def rows(setup) -> Result:
    """Agreement at each named posture and at random states; symmetry, definiteness, conditioning."""
    result = Result("mass")
    for sample in (*setup.named.each(), setup.random):
        ours, theirs = tmt.mass_matrix(sample.q), setup.engine.mass_matrix(sample.q)
        result.agree(sample, "Mbar", "kg m2", ours, theirs, mass_scale(sample.q), truth="mass_matrix")

    q = setup.random.q
    for party, M in (("TMT", tmt.mass_matrix(q)), ("MuJoCo", setup.engine.mass_matrix(q))):
        skew = np.abs(M - M.transpose(0, 2, 1)).max(axis=(1, 2)) / mass_scale(q)
        result.check(
            "random states",
            f"{party}: Mbar - Mbar' over its largest entry",
            skew.max(),
            FACTOR * EPS,
            "-",
            rounding=True,
        )
        indefinite = (np.linalg.eigvalsh(M)[:, 0] <= 0.0).sum()
        result.check("random states", f"{party}: Mbar not positive definite", indefinite, 0.0, "states")

    # the condition number depends on beta and gamma alone: the first hinge turns the whole arm
    beta, gamma = np.radians(np.linspace(-180.0, 180.0, 91)), np.radians(np.linspace(-180.0, 180.0, 91))
    grid = np.stack(np.broadcast_arrays(0.0, *np.meshgrid(beta, gamma)), axis=-1)
    values = condition(grid.reshape(-1, 3)).reshape(grid.shape[:2])
    start = grid[np.unravel_index(values.argmax(), values.shape)][1:]
    best = minimize(
        lambda x: -condition(np.array([[0.0, *x]]))[0], start, method="Nelder-Mead", options={"xatol": 1e-9}
    )
    top = np.array([0.0, *best.x])
    found = {"TMT": condition(top[None])[0], "MuJoCo": np.linalg.cond(setup.engine.mass_matrix(top))}
    for party, value in found.items():
        result.check(
            "worst posture", f"{party}: largest condition number - 126.83", abs(value - WORST_CONDITION), 0.005, "-"
        )
    off = np.abs(np.abs(best.x) - [WORST_BETA, WORST_GAMMA]).max()
    note = f"beta = {np.degrees(best.x[0]):.3f}, gamma = {np.degrees(best.x[1]):.3f} deg"
    result.check("worst posture", "distance from (90, 90) deg", off, np.radians(0.01), "rad", note)
    result.curves["condition"] = {"beta": beta, "gamma": gamma, "values": values, "worst": best.x, **found}
    return result


def figures(result):
    from . import draw  # matplotlib is for the process that draws

    yield draw.distances(result, "random states")
    yield draw.condition_map(result)
