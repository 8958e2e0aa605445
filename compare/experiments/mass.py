"""The mass matrix."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np
from scipy.optimize import minimize

from tmt import literal

from ..engines import LABELS
from ..judge.check import Result, over
from ..judge.entries import has_own_scales
from ..judge.scale import EPS, FACTOR
from ..robots import Robot
from . import Experiment
from .quantities import Comparison, add_notes
from .setup import Setup

EXPERIMENT = Experiment(
    order=40, asks_of_own=("mass_matrix",), options=("--joints",), diagnosed=True, overview="agreement"
)
SAME_PLACE = np.radians(0.01)  # accuracy of a search for a flat maximum


def claim_values(robot: Robot) -> dict:
    return {
        "own_scales": has_own_scales(robot.tree, robot.is_read),
        "condition": robot.conditioning and largest_condition(robot),
    }


def at_angles(robot: Robot, angles: np.ndarray) -> np.ndarray:
    """Joint angles, rad, (..., n): those of the two joints of `conditioning` as given, (..., 2), the others 0."""
    q = np.zeros((*np.shape(angles)[:-1], len(robot.joints)))
    q[..., [robot.joints.index(name) for name in robot.conditioning.joints]] = angles
    return q


def largest_condition(robot: Robot) -> float:
    """Condition number of the stated Mbar at the stated worst posture."""
    return float(
        np.linalg.cond(literal.mass_matrix(at_angles(robot, np.radians(robot.conditioning.worst)), robot.tree))
    )


def condition_grid(robot: Robot, mass_matrix: Callable, degrees: float) -> tuple:
    """Angles of the two joints, rad, (k,) each, and condition numbers on their grid, (k, k): a row for each second angle."""
    angles = np.radians(np.arange(-180.0, 180.0 + degrees, degrees))
    second, first = np.meshgrid(angles, angles, indexing="ij")
    return angles, angles, np.linalg.cond(mass_matrix(at_angles(robot, np.stack([first, second], axis=-1))))


def worst_condition(robot: Robot, mass_matrix: Callable) -> tuple:
    """Largest condition number and its two angles, rad: the best point of a grid, then a local search."""
    first, second, values = condition_grid(robot, mass_matrix, degrees=20.0)
    row, column = np.unravel_index(values.argmax(), values.shape)
    maximum = minimize(
        lambda x: -np.linalg.cond(mass_matrix(at_angles(robot, x))),
        [first[column], second[row]],
        method="Nelder-Mead",
        options={"xatol": 1e-6, "fatol": 1e-12},
    )
    return -maximum.fun, maximum.x


def rows(setup: Setup) -> Result:
    """Agreement at each named posture and at random states; symmetry, definiteness, conditioning."""
    robot = setup.robot
    result, own_scales = Result("mass", label=LABELS[robot.compared[0]]), has_own_scales(robot.tree, robot.is_read)
    for sample in (*setup.named.each(), setup.random):
        comparison = Comparison(setup, sample)
        comparison.agree(result, "Mbar")
    M = dict(zip(robot.compared, comparison.values("Mbar")))  # at random states
    scale = comparison.scale.mass_matrix if own_scales else None
    check_symmetry(result, M[robot.compared[0]], scale)  # MuJoCo's is one triangle written twice
    for name, dynamics in setup.compared().items():
        check_definiteness(result, LABELS[name], M[name], in_units=own_scales)
        if robot.conditioning:
            value, worst = worst_condition(robot, dynamics.mass_matrix)
            check_conditioning(result, robot, LABELS[name], value, worst)
            result.curves.setdefault("worst", {})[name] = (value, worst)
    if robot.conditioning:
        degrees = setup.of(3.0, 3.0, 15.0)
        result.curves["condition"] = condition_grid(robot, comparison.engines[0].mass_matrix, degrees)
    elif not robot.is_read:
        result.find("conditioning_not_stated", noun=robot.noun)
    add_notes(result, setup)
    return result


def check_symmetry(result: Result, M: np.ndarray, scale: np.ndarray | None = None) -> None:
    """Mbar is symmetric except for rounding. scale: of each entry; None: the largest entry."""
    of = "its largest entry" if scale is None else "the scale of the entry"
    skew = over(np.abs(M - M.transpose(0, 2, 1)), np.abs(M).max(axis=(1, 2), keepdims=True) if scale is None else scale)
    what = f"{result.label}: Mbar - Mbar' over {of}"
    result.check("random states", what, skew.max(), FACTOR * EPS, "", rounding=True)


def check_definiteness(result: Result, label: str, M: np.ndarray, in_units: bool = False) -> None:
    """The smallest eigenvalue of Mbar over its largest, the minimum over all states, is more than rounding.

    in_units: Mbar is in units of its diagonal, where its entries are kg and kg m2.
    """
    named = "Mbar in units of its diagonal" if in_units else "Mbar"
    finite = np.isfinite(M).all(axis=(1, 2))
    values = np.linalg.eigvalsh(scaled_by_diagonal(M) if in_units else M) if finite.all() else np.full((1, 2), np.nan)
    what = f"{label}: least eigenvalue of {named} over the largest"
    result.check("random states", what, (values[:, 0] / values[:, -1]).min(), FACTOR * EPS, "", rule="at least")


def scaled_by_diagonal(M: np.ndarray) -> np.ndarray:
    """M_ij / sqrt(M_ii M_jj), whose diagonal is 1; M itself where a diagonal entry is not positive: that is not definite."""
    diagonal = np.einsum("sii->si", M)
    root = np.sqrt(np.where((diagonal > 0.0).all(axis=1, keepdims=True), diagonal, 1.0))
    return M / (root[:, :, None] * root[:, None, :])


def check_conditioning(result: Result, robot: Robot, label: str, value: float, worst: np.ndarray) -> None:
    """The largest condition number and its two angles, rad, are the stated ones; the first angle has either sign."""
    (first, second), (x, y) = robot.conditioning
    largest = largest_condition(robot)
    at = f"{first} = {np.degrees(worst[0]):.3f}, {second} = {np.degrees(worst[1]):.3f} deg"
    bound = FACTOR * EPS * largest**2
    result.check("worst posture", f"{label}: condition number - {largest:.2f}", abs(value - largest), bound, "", at)
    off = np.abs([abs(worst[0]), worst[1]] - np.radians([x, y])).max()
    result.check("worst posture", f"{label}: distance from (+-{x:g}, {y:g}) deg", off, SAME_PLACE, "rad", at)


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_condition, draw_distances  # matplotlib is for the process that draws

    yield partial(draw_distances, result, "random states")
    if robot.conditioning:
        yield partial(draw_condition, result, robot)


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    from .figures_overview import pictures_of_agreement  # matplotlib is for the process that draws

    yield from pictures_of_agreement(results)
