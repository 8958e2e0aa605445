"""Every number that an assignment prints, from TMT, from MuJoCo and exactly."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

import tmt
from tmt import literal
from tmt.exact.many import Pairs, exact_of_many

from ..core.check import Result
from ..core.finding import Finding
from ..core.rows import Row, column
from ..judge.scale import EPS, FACTOR, gravity_scale
from ..robots import Printed, Robot
from .setup import Setup

SHOWN = ["item", "quantity", "component", "published", "exact", "tmt", "mujoco", "unit"]
FUNCTIONS = {"Mbar": "mass_matrix", "qdd": "acceleration", "holding torque": "gravity_balance"}


@dataclass(kw_only=True)
class PrintedRow(Row):
    """One component of a printed answer."""

    item: str
    posture: str
    quantity: str
    component: str
    unit: str
    published: float = column(digits=7)
    exact: float = column(digits=7)
    tmt: float = column(digits=7)
    mujoco: float = column(digits=7)
    tolerance: float

    @property
    def is_met(self) -> bool:
        """Whether both engines meet the printed number."""
        return max(abs(self.tmt - self.published), abs(self.mujoco - self.published)) <= self.tolerance


class Answer(NamedTuple):
    """The computed values of one printed answer, in its shape and unit."""

    exact: Pairs  # of one state
    tmt: np.ndarray
    mujoco: np.ndarray
    scale: float

    @property
    def nearest(self) -> np.ndarray:
        """The exact values as doubles."""
        return self.exact.high[0]

    @property
    def rounding(self) -> float:
        return FACTOR * EPS * self.scale


def skipped(robot: Robot) -> Finding | None:
    return None if robot.printed else Finding("published", "nothing_printed", {"noun": robot.noun})


def claim_values(robot: Robot) -> dict[str, object]:
    """The scale of a holding torque, and the items whose printed digits are rounding errors."""
    noise = [item.item for item in robot.printed if item.is_rounding and np.any(item.values)]
    return {"weight": gravity_scale(robot.tree), "rounding": noise}


def scales(tree: tmt.Tree, q: np.ndarray) -> dict[str, float]:
    """The scale of all components of each quantity at q (nq,), by its function; of accelerations at rest."""
    M, weight = literal.mass_matrix(tree, q), gravity_scale(tree)
    least, *_, largest = np.linalg.eigvalsh(M)
    of_accelerations = (largest / least + 1.0) * weight / least
    return {"mass_matrix": np.abs(M).max(), "acceleration": of_accelerations, "gravity_balance": weight}


def answer(item: Printed, robot: Robot, dynamics: Mapping[str, Any]) -> Answer:
    """An item by exact arithmetic, TMT and MuJoCo."""
    function, q = FUNCTIONS[item.quantity], robot.posture(item.posture)
    rest, tau = np.zeros((2, len(q)))
    if item.torque != "none":
        held = next(other for other in robot.printed if other.item == item.torque)
        tau = dynamics["tmt"].gravity_balance(robot.posture(held.posture))
    arguments = (q, rest, tau) if function == "acceleration" else (q,)
    of_tmt, of_mujoco = (getattr(dynamics[engine], function)(*arguments) for engine in ("tmt", "mujoco"))
    values = exact_of_many(robot.tree, function, *np.array([q, rest, tau])[:, None])
    return Answer(values, of_tmt, of_mujoco, scales(robot.tree, q)[function])


def rows(setup: Setup) -> Result:
    """One row for each printed component, one check for each item and engine."""
    result, robot, dynamics = Result("published", shown=SHOWN), setup.robot, setup.compared()
    answers = {item.item: answer(item, robot, dynamics) for item in robot.printed}
    for item in robot.printed:
        computed, printed = answers[item.item], np.array(item.values)
        check_answer(result, item, computed, robot.joints)
        tolerance = computed.rounding + (0.0 if item.is_rounding else item.half_digit)
        for index in np.ndindex(printed.shape):
            result.rows.append(PrintedRow(
                item=item.item, posture=item.posture, quantity=item.quantity, unit=item.unit,
                component=" ".join(robot.joints[i] for i in index), published=float(printed[index]),
                exact=float(computed.nearest[index]), tmt=float(computed.tmt[index]),
                mujoco=float(computed.mujoco[index]), tolerance=tolerance,
            ))  # fmt: skip
    if robot.remarks:
        result.notes += robot.remarks(answers, dynamics)
    return result


def check_answer(result: Result, item: Printed, computed: Answer, joints: tuple[str, ...]) -> None:
    """Checks of one item: the printed digits, or, where those are rounding, the exact value."""
    printed, where, rounding = np.array(item.values), f"({item.item}) {item.posture}", computed.rounding
    quantity, unit, nearest = item.quantity, item.unit, computed.nearest
    by_label = {"TMT": computed.tmt, "MuJoCo": computed.mujoco, "exact": nearest}
    off = {label: np.abs(values - printed).max() for label, values in by_label.items()}
    for label, values in by_label.items():
        from_exact, printed_digits = f"{label}: {quantity} - exact", f"{label}: {quantity} - printed"
        if not item.is_rounding:
            result.check(where, printed_digits, off[label], item.half_digit + rounding, unit)
        elif label != "exact":
            difference = computed.exact.distance(values).max()
            result.check(where, from_exact, difference, rounding, unit, rounding=True)
    for label in ("exact", "TMT"):
        if label.lower() in item.to_every_digit:
            every_digit = f"{label}: {quantity} - printed"
            result.check(where, every_digit, off[label], item.half_digit, unit)
    for joint in item.sizes:
        k, size = joints.index(joint), f"exact: |{quantity}_{joint}| - |printed|"
        result.check(where, size, abs(abs(nearest[k]) - abs(printed[k])), item.half_digit, unit)


def headline(result: Result) -> Finding | None:
    """How many of the printed numbers both engines meet."""
    met, numbers = sum(row.is_met for row in result.rows), len(result.rows)
    return result.finding("headline", met=met, numbers=numbers) if numbers else None
