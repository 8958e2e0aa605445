"""The comparison of two engines' values over states: the one closest to its tolerance."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..core.check import Result
from .scale import EPS, FACTOR

if TYPE_CHECKING:
    from tmt.exact.many import Pairs

SHOWN = 8  # columns of a comparison, the first ones; the others are in its file


def agree(
    result: Result, sample, quantity, unit, values, mujoco_values, scale, exact: "Pairs | None" = None
) -> None:
    """Add a row and a check: of the differences between two engines over the states, the one closest to its tolerance.

    values, mujoco_values: (states, ...). scale: a number or (states,), or with as many dimensions as the values for a
    scale of each entry; the tolerance is 64 eps x scale. exact: at the first states; one more check for each engine of its
    distance from them.
    """
    between, exact_states = f"{result.label} to MuJoCo", None if exact is None else len(exact.high)
    differences = {between: np.abs(np.subtract(values, mujoco_values))}
    for engine, computed in ((result.label, values), ("MuJoCo", mujoco_values)) if exact_states else ():
        differences[f"{engine} to exact"] = exact.distance(computed[:exact_states])
    worst_of_states = {name: worst_of_each(values, scale) for name, values in differences.items()}
    in_eps = {name: over(d, EPS * s) for name, (d, s) in worst_of_states.items()}
    difference, scale = worst_of_states[between]

    def check_closest(quantity, difference, scale):
        """A check of the state that is closest to its tolerance, and its index."""
        tolerance = FACTOR * EPS * scale
        (k,) = closest(difference, tolerance)
        return result.check(
            sample.name, quantity, difference[k], tolerance[k], unit, sample.describe(k), True
        ), k

    check, worst = check_closest(quantity, difference, scale)
    for name in list(worst_of_states)[1:]:
        check_closest(f"{quantity}, {name}", *worst_of_states[name])
    row = {
        "scene": sample.name,
        "quantity": quantity,
        "unit": unit,
        "states": len(sample.q),
        "largest_difference": float(difference.max()) if np.isfinite(difference).all() else None,
        "worst_difference": check.value,
        "bar": check.tolerance,
        "difference_over_bar": check.over_tolerance,
        "scale": scale[worst],
        "difference_eps": in_eps[between].max(),
        f"{result.label.lower()}_from_exact_eps": in_eps[f"{result.label} to exact"].max()
        if exact_states
        else None,
        "mujoco_from_exact_eps": in_eps["MuJoCo to exact"].max() if exact_states else None,
        "exact_states": exact_states,
        "worst_state": check.note,
    }
    for name in ("q", "qd", "tau"):
        row[f"worst_{name}"] = " ".join(repr(float(number)) for number in getattr(sample, name)[worst])
    result.rows.append(row | {"passed": check.passed})
    result.curves.setdefault(sample.name, {})[quantity] = {
        name: np.sort(values) for name, values in in_eps.items()
    }
    result.shown = [
        *list(row)[:SHOWN],
        *(f"{engine.lower()}_from_exact_eps" for engine in (result.label, "MuJoCo")),
    ]


def closest(difference: np.ndarray, tolerance: np.ndarray) -> tuple[int, ...]:
    """Index of the difference with the largest share of its tolerance, which broadcasts to the same shape.

    NaN and any difference where the tolerance is 0 come first.
    """
    difference, tolerance = np.broadcast_arrays(np.abs(difference), tolerance)
    share = np.where(np.isfinite(difference), over(difference, tolerance), np.inf)
    return tuple(map(int, np.unravel_index(np.argmax(share), share.shape)))


def over(difference: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """A difference over its scale, of the same shape; 0 / 0 is 0."""
    return np.divide(difference, scale, out=np.where(difference == 0.0, 0.0, np.inf), where=scale > 0.0)


def worst_of_each(differences: np.ndarray, scale: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """For each state the difference with the largest share of its scale, and that scale, (states,) each.

    differences: (states, ...). scale: a number or (states,), or with as many dimensions as the differences; it may have more
    states.
    """
    states, scale = len(differences), np.asarray(scale, dtype=float)
    scale = scale[:states] if scale.ndim and len(scale) > 1 else scale
    if scale.ndim == 1:
        scale = scale.reshape(-1, *[1] * (np.ndim(differences) - 1))
    differences, scale = (a.reshape(states, -1) for a in np.broadcast_arrays(np.abs(differences), scale))
    share = np.where(np.isfinite(differences), over(differences, scale), np.inf)
    entry = np.arange(states), share.argmax(axis=1)
    return differences[entry], scale[entry]
