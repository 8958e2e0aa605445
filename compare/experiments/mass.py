"""The mass matrix."""

from functools import partial

import numpy as np
from scipy.optimize import minimize

import tmt

from .agreement import EPS, FACTOR, Result, mass_scale

WORST = np.radians([90.0, 90.0])  # (beta, gamma) of the largest condition number; so is (-beta, gamma)
LARGEST = float(np.linalg.cond(tmt.mass_matrix(np.array([0.0, *WORST]))))
NEAR = np.radians(0.01)  # of WORST: what a search finds of a flat maximum

TITLE = "Mass matrix: is Mbar MuJoCo's M?"
CLAIM = (
    "Mbar = sum T' m T + B' I B equals mj_fullM at every posture; it is symmetric and positive definite; its condition "
    f"number, which multiplies every rounding error of an acceleration, has its maximum {LARGEST:.2f} at beta = +-90 deg, "
    "gamma = 90 deg."
)
BAR = (
    "64 eps x the largest entry of Mbar at that state. Definite: the smallest eigenvalue is at least 64 eps of the largest. "
    "Condition number: 64 eps x its square; its place, found by search: 0.01 deg."
)


def condition_grid(mass_matrix, degrees) -> tuple:
    """(beta, gamma, condition numbers) on a grid, alpha = 0."""
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
        options={"xatol": 1e-6, "fatol": 1e-12},
    )
    return -found.fun, found.x


def rows(setup) -> Result:
    """Agreement at each named posture and at random states; symmetry, definiteness, conditioning."""
    result = Result("mass")
    for sample in (*setup.named.each(), setup.random):
        ours, theirs = tmt.mass_matrix(sample.q), setup.engine.mass_matrix(sample.q)
        result.agree(sample, "Mbar", "kg m2", ours, theirs, mass_scale(sample.q), truth="mass_matrix")
    symmetric(
        result, tmt.mass_matrix(setup.random.q)
    )  # MuJoCo's is one triangle written twice: symmetric by construction
    for engine, mass_matrix in (("TMT", tmt.mass_matrix), ("MuJoCo", setup.engine.mass_matrix)):
        definite(result, engine, mass_matrix(setup.random.q))
        value, worst = worst_condition(mass_matrix)
        mirrored = float(np.linalg.cond(mass_matrix(np.array([0.0, -worst[0], worst[1]]))))
        conditioned(result, engine, value, worst)
        result.curves.setdefault("worst", {})[engine] = (value, worst, mirrored)
    result.curves["condition"] = condition_grid(tmt.mass_matrix, degrees=setup.of(3.0, 3.0, 15.0))
    return result


def symmetric(result, M) -> None:
    """TMT computes both triangles: they must be the same but for rounding."""
    skew = np.abs(M - M.transpose(0, 2, 1)).max(axis=(1, 2)) / np.abs(M).max(axis=(1, 2))
    what = "TMT: Mbar - Mbar' over its largest entry"
    result.check("random states", what, skew.max(), FACTOR * EPS, "", rounding=True)


def definite(result, engine, M) -> None:
    """Mbar is positive definite beyond doubt: its least eigenvalue over its largest, the least of all states."""
    values = np.linalg.eigvalsh(M)
    what = f"{engine}: least eigenvalue of Mbar over the largest"
    result.check("random states", what, (values[:, 0] / values[:, -1]).min(), FACTOR * EPS, "", rule="at least")


def conditioned(result, engine, value, worst) -> None:
    """The largest condition number and its (beta, gamma), rad, are those of the stated arm; beta of either sign."""
    at = f"beta = {np.degrees(worst[0]):.3f}, gamma = {np.degrees(worst[1]):.3f} deg"
    bar = FACTOR * EPS * LARGEST**2
    result.check("worst posture", f"{engine}: condition number - {LARGEST:.2f}", abs(value - LARGEST), bar, "", at)
    off = np.abs([abs(worst[0]), worst[1]] - WORST).max()
    result.check("worst posture", f"{engine}: distance from (+-90, 90) deg", off, NEAR, "rad", at)


def figures(result):
    from . import draw  # matplotlib is for the process that draws

    yield partial(draw.distances, result, "random states")
    yield partial(draw.condition_map, result)
