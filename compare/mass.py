"""The mass matrix."""

import numpy as np
from scipy.optimize import minimize

import tmt

from .agreement import EPS, FACTOR, Result, mass_scale

TITLE = "Mass matrix: is Mbar MuJoCo's M?"
CLAIM = (
    "Mbar = sum T' m T + B' I B equals mj_fullM at every posture; it is symmetric and positive definite; its condition "
    "number, which multiplies every rounding error of an acceleration, has its maximum 126.83 at beta = +-90 deg, "
    "gamma = 90 deg."
)
BAR = "64 eps x the largest entry of Mbar at that state (condition number: half a unit of its last digit)."
WORST_CONDITION, WORST_POSTURE = 126.83, np.radians([90.0, 90.0])


def condition_grid(mass_matrix, degrees) -> tuple:
    """(beta, gamma, condition numbers) on a grid; alpha turns the whole arm and does not count."""
    angles = np.radians(np.arange(-180.0, 180.0 + degrees, degrees))
    gamma, beta = np.meshgrid(angles, angles, indexing="ij")
    return angles, angles, np.linalg.cond(mass_matrix(np.stack([0.0 * beta, beta, gamma], axis=-1)))


def worst_condition(mass_matrix) -> tuple:
    """The largest condition number and its (beta, gamma), rad: the best point of a grid, then a local search."""
    beta, gamma, values = condition_grid(mass_matrix, degrees=20.0)
    row, column = np.unravel_index(values.argmax(), values.shape)
    found = minimize(
        lambda x: -np.linalg.cond(mass_matrix(np.array([0.0, *x]))),
        [beta[column], gamma[row]],
        method="Nelder-Mead",
        options={"xatol": 1e-6},
    )
    return -found.fun, found.x


def rows(setup) -> Result:
    """Agreement at each named posture and at random states; symmetry, definiteness, conditioning."""
    result = Result("mass")
    for sample in (*setup.named.each(), setup.random):
        ours, theirs = tmt.mass_matrix(sample.q), setup.engine.mass_matrix(sample.q)
        result.agree(sample, "Mbar", "kg m2", ours, theirs, mass_scale(sample.q), truth="mass_matrix")

    q = setup.random.q
    M = tmt.mass_matrix(q)  # MuJoCo's is one triangle written twice: symmetric by construction
    skew = np.abs(M - M.transpose(0, 2, 1)).max(axis=(1, 2)) / mass_scale(q)
    result.check(
        "random states", "TMT: Mbar - Mbar' over its largest entry", skew.max(), FACTOR * EPS, "", rounding=True
    )

    parties = (("TMT", tmt.mass_matrix), ("MuJoCo", setup.engine.mass_matrix))
    for party, mass_matrix in parties:
        indefinite = (np.linalg.eigvalsh(mass_matrix(q))[:, 0] <= 0.0).sum()
        result.check("random states", f"{party}: Mbar not positive definite", indefinite, 0.0, "states")

    for party, mass_matrix in parties:
        value, worst = worst_condition(mass_matrix)
        off = abs(value - WORST_CONDITION)
        result.check("worst posture", f"{party}: largest condition number - 126.83", off, 0.005, "")
        note = f"beta = {np.degrees(worst[0]):.3f}, gamma = {np.degrees(worst[1]):.3f} deg"
        off = np.abs(np.abs(worst) - WORST_POSTURE).max()
        result.check("worst posture", f"{party}: distance from (90, 90) deg", off, np.radians(0.01), "rad", note)
        result.curves.setdefault("worst", {})[party] = (value, worst)
    result.curves["condition"] = condition_grid(tmt.mass_matrix, degrees=3.0)
    return result


def figures(result):
    from . import draw  # matplotlib is for the process that draws

    yield draw.distances(result, "random states")
    yield draw.condition_map(result)
