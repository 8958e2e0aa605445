"""The comparison of two engines' values over states: the one closest to its tolerance."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..core.check import Check, Result
from ..core.rows import Column, Row, column
from ..robots.states import Sample
from .scale import EPS, FACTOR

if TYPE_CHECKING:
    from tmt.exact.many import Pairs

# fields of a row, in eps: the distance of the two engines, and of each from the exact values
DISTANCES = "difference", "from_exact", "mujoco_from_exact"
SHOWN = (  # fields of a comparison in a report; its file has all
    "scene", "quantity", "unit", "states", "largest_difference", "worst_difference", "bar",
    "difference_over_bar", "from_exact", "mujoco_from_exact",
)  # fmt: skip


@dataclass(kw_only=True)
class AgreementRow(Row):
    """One quantity over the states of a sample; the column of `from_exact` is named after the engine."""

    engine: str
    scene: str
    quantity: str
    unit: str
    states: int
    largest_difference: float | None
    worst_difference: float | None
    bar: float
    difference_over_bar: float | None
    scale: float
    difference: float | None = column("eps", default=None)
    from_exact: float | None = column("eps", default=None)
    mujoco_from_exact: float | None = column("eps", default=None)
    exact_states: int | None
    worst_state: str
    worst_q: str
    worst_qd: str
    worst_tau: str
    worst_entry: str  # of the quantity there, from 0
    worst_value: float | None  # of that entry, by the engine and by MuJoCo
    mujoco_value: float | None
    passed: bool

    def columns(self) -> dict[str, tuple[str, Column]]:
        columns = super().columns()
        del columns["engine"]
        named_after_engine = {"from_exact_eps": f"{self.engine.lower()}_from_exact_eps"}
        return {named_after_engine.get(name, name): field for name, field in columns.items()}


def agree(
    result: Result, sample: Sample, quantity: str, unit: str, values: ArrayLike, mujoco_values: ArrayLike,
    scale: ArrayLike, exact: "Pairs | None" = None,
) -> None:  # fmt: skip
    """Add a row and a check: the difference of two engines that is closest to its tolerance, 64 eps x scale.

    values, mujoco_values: (states, ...). scale: a number or (states,), or with as many dimensions as the
    values for a scale of each entry. exact: at the first states; of each engine's distance from them there is
    a check too.
    """
    measured = {quantity: worst_of_each(np.subtract(values, mujoco_values), scale)}
    if exact is not None and len(exact.high):
        for engine, of_engine in ((result.label, values), ("MuJoCo", mujoco_values)):
            measured[f"{quantity}, {engine} to exact"] = distance_from_exact(exact, of_engine, scale)
    checks = [check_closest(result, sample, name, unit, *pair) for name, pair in measured.items()]
    (check, worst), (difference, scales) = checks[0], measured[quantity]
    pair = np.asarray(values)[worst], np.asarray(mujoco_values)[worst]
    is_worst = np.abs(pair[0] - pair[1]) == difference[worst]
    entry = tuple(map(int, np.unravel_index(np.argmax(is_worst), is_worst.shape)))
    numbers = [float(side[entry]) if np.isfinite(side[entry]) else None for side in pair]
    in_eps = (float(np.max(over(sizes, EPS * of_sizes))) for sizes, of_sizes in measured.values())
    row = AgreementRow(
        engine=result.label, scene=sample.name, quantity=quantity, unit=unit, states=len(sample.q),
        largest_difference=float(difference.max()) if np.isfinite(difference).all() else None,
        worst_difference=check.value, bar=check.tolerance, difference_over_bar=check.over_tolerance,
        scale=float(scales[worst]), exact_states=None if exact is None else len(exact.high),
        worst_state=check.note, worst_q=in_full(sample.q[worst]), worst_qd=in_full(sample.qd[worst]),
        worst_tau=in_full(sample.tau[worst]), worst_entry=" ".join(map(str, entry)),
        worst_value=numbers[0], mujoco_value=numbers[1], passed=check.passed, **dict(zip(DISTANCES, in_eps)),
    )  # fmt: skip
    result.rows.append(row)
    result.shown = [name for name, (field, _) in row.columns().items() if field in SHOWN]


def check_closest(
    result: Result, sample: Sample, quantity: str, unit: str, difference: np.ndarray, scale: np.ndarray
) -> tuple[Check, int]:
    """A check of the state that is closest to its tolerance, and its index. difference, scale: (states,)."""
    tolerance = FACTOR * EPS * scale
    (k,) = closest(difference, tolerance)
    note = sample.describe(k)
    return result.check(sample.name, quantity, difference[k], tolerance[k], unit, note, rounding=True), k


def in_full(numbers: np.ndarray) -> str:
    """Numbers in one cell of a table, with all their digits."""
    return " ".join(repr(float(number)) for number in numbers)


def closest(difference: ArrayLike, tolerance: ArrayLike) -> tuple[int, ...]:
    """Index of the difference with the largest share of its tolerance, which broadcasts to the same shape.

    NaN and any difference where the tolerance is 0 come first.
    """
    share = share_of(*np.broadcast_arrays(np.abs(difference), tolerance))
    return tuple(map(int, np.unravel_index(np.argmax(share), share.shape)))


def over(difference: np.ndarray, scale: ArrayLike) -> np.ndarray:
    """A difference over its scale, of the same shape; 0 / 0 is 0."""
    scale = np.asarray(scale)
    return np.divide(difference, scale, out=np.where(difference == 0.0, 0.0, np.inf), where=scale > 0.0)


def share_of(difference: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """The share of its scale that a difference takes; inf where it is not a number."""
    return np.where(np.isfinite(difference), over(difference, scale), np.inf)


def worst_of_each(differences: ArrayLike, scale: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Of each state the difference with the largest share of its scale, and that scale, (states,) each.

    differences: (states, ...). scale: as for `agree`; it may have more states.
    """
    differences, scale = np.abs(differences), np.asarray(scale, dtype=float)
    states = len(differences)
    scale = scale[:states] if scale.ndim and len(scale) > 1 else scale
    if scale.ndim == 1:
        scale = scale.reshape(-1, *[1] * (differences.ndim - 1))
    differences, scale = (a.reshape(states, -1) for a in np.broadcast_arrays(differences, scale))
    entry = np.arange(states), share_of(differences, scale).argmax(axis=1)
    return differences[entry], scale[entry]


def distance_from_exact(exact: "Pairs", values: ArrayLike, scale: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """The distance of an engine's values from the exact ones, of each state that has those."""
    return worst_of_each(exact.distance(np.asarray(values)[: len(exact.high)]), scale)
