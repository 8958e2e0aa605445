"""Every number that an assignment prints, from TMT, from MuJoCo and exactly."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tmt.exact.values import distance, exact

from ..core.check import Result
from ..core.finding import Finding
from ..engines import Dynamics
from ..judge.scale import EPS, FACTOR, acceleration_scale, gravity_scale, mass_scale
from ..robots import Printed, Robot
from . import Experiment
from .setup import Setup

EXPERIMENT = Experiment(order=20, serves_own=False)


def skipped(robot: Robot) -> Finding | None:
    return None if robot.printed else Finding("published", "nothing_printed", {"noun": robot.noun})


def claim_values(robot: Robot) -> dict:
    noise = [
        item.item for item in robot.printed if item.is_rounding and any(item.values)
    ]  # printed, but truly zero
    return {"weight": gravity_scale(robot.tree), "rounding": noise}


class Answer(NamedTuple):
    """The computed values of one printed answer, in its shape and unit."""

    exact: np.ndarray  # of mpmath numbers
    tmt: np.ndarray
    mujoco: np.ndarray
    scale: float

    @property
    def nearest(self) -> np.ndarray:
        """The doubles nearest to the exact values."""
        return self.exact.astype(float)

    @property
    def rounding(self) -> float:
        return FACTOR * EPS * self.scale


def answer(item: Printed, robot: Robot, dynamics: Mapping[str, Dynamics]) -> Answer:
    """An item by exact arithmetic, TMT and MuJoCo."""
    tree, q = robot.tree, robot.posture(item.posture)
    rest, tau = np.zeros((2, len(q)))
    if item.torque != "none":
        held = next(other for other in robot.printed if other.item == item.torque)
        tau = dynamics["tmt"].gravity_balance(robot.posture(held.posture))
    function, arguments, scale = {
        "Mbar": ("mass_matrix", (q,), mass_scale(tree, q[None])[0]),
        "qdd": ("acceleration", (q, rest, tau), acceleration_scale(tree, q[None], gravity_scale(tree))[0]),
        "holding torque": ("gravity_balance", (q,), gravity_scale(tree)),
    }[item.quantity]
    engines = (getattr(dynamics[name], function)(*arguments) for name in ("tmt", "mujoco"))
    return Answer(getattr(exact(tree, q, rest, tau), function), *engines, scale)


def rows(setup: Setup) -> Result:
    """One row for each printed component, one check for each item and engine."""
    result = Result(
        "published", shown=["item", "quantity", "component", "published", "exact", "tmt", "mujoco", "unit"]
    )
    robot, dynamics = setup.robot, setup.compared()
    answers = {item.item: answer(item, robot, dynamics) for item in robot.printed}
    for item in robot.printed:
        of, printed = answers[item.item], np.array(item.values)
        check_answer(result, item, of, robot.joints)
        for index in np.ndindex(printed.shape):
            component = " ".join(robot.joints[i] for i in index)
            row = {
                "item": item.item,
                "posture": item.posture,
                "quantity": item.quantity,
                "component": component,
            }
            row |= {
                "unit": item.unit,
                "published": printed[index],
                "exact": of.nearest[index],
                "tmt": of.tmt[index],
            }
            tolerance = of.rounding + (0.0 if item.is_rounding else item.half_digit)
            result.rows.append(row | {"mujoco": of.mujoco[index], "tolerance": tolerance})
    if robot.remarks:
        result.notes += robot.remarks(answers, dynamics)
    return result


def check_answer(result: Result, item: Printed, of: Answer, joints: tuple) -> None:
    """Checks of one item against the printed digits, or, where those are rounding, against the exact value."""
    printed, where = np.array(item.values), f"({item.item}) {item.posture}"
    engines = {"TMT": of.tmt, "MuJoCo": of.mujoco, "exact": of.nearest}
    for label, values in engines.items():
        if not item.is_rounding:
            off, tolerance = np.abs(values - printed).max(), item.half_digit + of.rounding
            result.check(where, f"{label}: {item.quantity} - printed", off, tolerance, item.unit)
        elif label != "exact":
            off = distance(values, of.exact).max()
            result.check(
                where, f"{label}: {item.quantity} - exact", off, of.rounding, item.unit, rounding=True
            )
    for label in [name for name in ("exact", "TMT") if name.lower() in item.to_every_digit]:
        digits, off = f"{label}: {item.quantity} - printed", np.abs(engines[label] - printed).max()
        result.check(where, digits, off, item.half_digit, item.unit)
    for joint in item.sizes:
        k = joints.index(joint)
        off = abs(abs(of.nearest[k]) - abs(printed[k]))
        result.check(where, f"exact: |{item.quantity}_{joint}| - |printed|", off, item.half_digit, item.unit)


def headline(result: Result) -> Finding | None:
    """How many of the printed numbers both engines meet."""
    met = sum(
        all(abs(row[name] - row["published"]) <= row["tolerance"] for name in ("tmt", "mujoco"))
        for row in result.rows
    )
    return result.finding("headline", met=met, numbers=len(result.rows)) if result.rows else None
