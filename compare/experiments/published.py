"""Every number that an assignment prints, from TMT, from MuJoCo and exactly."""

from collections.abc import Iterator, Mapping
from fractions import Fraction
from functools import partial
from typing import NamedTuple

import numpy as np

from tmt.exact.values import distance, exact

from ..engines import Dynamics
from ..judge.check import Result
from ..judge.finding import Finding
from ..judge.scale import EPS, FACTOR, acceleration_scale, gravity_scale, mass_scale
from ..judge.words import capital, listed
from ..robots import Printed, Robot
from . import Experiment
from .setup import Setup

EXPERIMENT = Experiment(order=20, serves_own=False)


def skipped(robot: Robot) -> str | None:
    """Why the experiment cannot serve a robot, or None."""
    return None if robot.printed else f"no printed numbers of the {robot.noun} are known"


def claim(robot: Robot) -> str:
    """What is claimed of what is printed: numbers are met; those that are rounding alone are zero except for rounding."""
    noise, turns = [item.item for item in robot.printed if is_noise(item)], angles(robot)
    apart = f", {listed(noise)} apart," if noise else ""
    text = f"Every number that the assignment prints{apart} is met by TMT, by MuJoCo and by exact arithmetic."
    if noise:
        text += (
            f" {listed(noise)} {'are' if len(noise) > 1 else 'is'} zero except for rounding, and both engines are within "
            f"rounding of what is exact{f' at the doubles nearest to {listed(turns)}' if turns else ''}."
        )
    every, sizes = shared(robot)
    parts = [f"that is {item} to every printed digit{', for TMT too' if by_tmt else ''}" for item, by_tmt in every]
    parts += [f"of {item} it shares the size of {entries}" for item, entries in sizes]
    more = "; ".join(parts)
    return f"{text} {capital(more)}." if more else text


def tolerance(robot: Robot) -> str:
    """By what the claim is judged, with the robot's own scale."""
    scale = gravity_scale(robot.tree)
    text = (
        f"Half a unit of the last printed digit plus 64 eps x scale ({scale:.2f} N m; the largest entry of Mbar; for "
        f"accelerations (cond(Mbar) + 1) x |Mbar^-1| x {scale:.2f} N m)."
    )
    rounding = [item.item for item in robot.printed if item.is_rounding]
    every, sizes = shared(robot)
    digits = listed([item for item, _ in every] + [f"{entries} of {item}" for item, entries in sizes])
    by_tmt = listed([item for item, by_tmt in every if by_tmt])
    too = f" ({by_tmt} for TMT too)" if by_tmt else ""
    last = f"; {digits}, for exact arithmetic{too}, half a unit of the last printed digit" if digits else ""
    return f"{text} {', '.join(rounding)}: the rounding alone, from the exact value{last}." if rounding else text


def is_noise(item: Printed) -> bool:
    """Whether it is printed as a number and is zero except for rounding."""
    return item.is_rounding and bool(np.any(item.values))


def shared(robot: Robot) -> tuple[list, list]:
    """What exact arithmetic shares of numbers that are rounding alone: every digit, or the size of entries.

    Items and whether TMT has the digits too; items and their entries in words.
    """
    ordinals = ("first", "second", "third", *(f"{k}th" for k in range(4, len(robot.joints) + 1)))
    every = [(item.item, "tmt" in item.to_every_digit) for item in robot.printed if item.to_every_digit]
    entries = [[f"the {ordinals[robot.joints.index(joint)]} entry" for joint in item.sizes] for item in robot.printed]
    return every, [(item.item, listed(words)) for item, words in zip(robot.printed, entries) if words]


def angles(robot: Robot) -> list[str]:
    """The angles, as parts of pi, of the postures at which accelerations are rounding alone."""
    degrees = {abs(angle) for item in robot.printed if is_noise(item) for angle in robot.postures[item.posture]} - {0}
    turns = [Fraction(angle).limit_denominator(1000) / 180 for angle in sorted(degrees, reverse=True)]
    return [
        f"{'' if turn.numerator == 1 else f'{turn.numerator} '}pi{'' if turn.denominator == 1 else f'/{turn.denominator}'}"
        for turn in turns
    ]


class Answer(NamedTuple):
    """What is found beside one printed answer, in its shape and unit."""

    exact: np.ndarray  # of mpmath numbers
    tmt: np.ndarray
    mujoco: np.ndarray
    scale: float  # of its rounding

    @property
    def nearest(self) -> np.ndarray:
        """The doubles nearest to the exact values."""
        return self.exact.astype(float)

    @property
    def rounding(self) -> float:
        """The tolerance of rounding."""
        return FACTOR * EPS * self.scale


def answer(item: Printed, robot: Robot, dynamics: Mapping[str, Dynamics]) -> Answer:
    """What exact arithmetic, TMT and MuJoCo give for an item."""
    tree, q = robot.tree, robot.posture(item.posture)
    rest, tau = np.zeros((2, len(q)))
    if item.torque != "none":
        held = next(other for other in robot.printed if other.item == item.torque)
        tau = dynamics["tmt"].gravity_balance(robot.posture(held.posture))
    truth = exact(tree, q, rest, tau)
    engines = dynamics["tmt"], dynamics["mujoco"]
    if item.quantity == "Mbar":
        return Answer(truth.mass_matrix, *(d.mass_matrix(q) for d in engines), mass_scale(tree, q[None])[0])
    if item.quantity == "qdd":
        scale = acceleration_scale(tree, q[None], gravity_scale(tree))[0]
        return Answer(truth.acceleration, *(d.acceleration(q, rest, tau) for d in engines), scale)
    return Answer(truth.gravity_balance, *(d.gravity_balance(q) for d in engines), gravity_scale(tree))


def rows(setup: Setup) -> Result:
    """One row for each printed component, one check for each item and engine."""
    result = Result("published", shown=["item", "quantity", "component", "published", "exact", "tmt", "mujoco", "unit"])
    robot, dynamics = setup.robot, setup.compared()
    found = {}
    for item in robot.printed:
        of = found[item.item] = answer(item, robot, dynamics)
        check_answer(result, item, of, robot.joints)
        printed = np.array(item.values)
        for index in np.ndindex(printed.shape):
            result.rows.append(
                {
                    "item": item.item,
                    "posture": item.posture,
                    "quantity": item.quantity,
                    "component": " ".join(robot.joints[i] for i in index),
                    "unit": item.unit,
                    "published": printed[index],
                    "exact": of.nearest[index],
                    "tmt": of.tmt[index],
                    "mujoco": of.mujoco[index],
                    "tolerance": of.rounding + (0.0 if item.is_rounding else item.half_digit),
                }
            )
    result.notes = [digits_in_words(item, found[item.item], robot) for item in robot.printed if is_noise(item)]
    if robot.remarks:
        result.notes += robot.remarks(found, dynamics)
    return result


def check_answer(result: Result, item: Printed, of: Answer, joints: tuple) -> None:
    """The checks of one item: against the printed digits, or, where those are rounding, against the exact value."""
    printed, where = np.array(item.values), f"({item.item}) {item.posture}"
    finders = {"TMT": of.tmt, "MuJoCo": of.mujoco, "exact": of.nearest}
    for label, values in finders.items():
        if not item.is_rounding:
            off, tolerance = np.abs(values - printed).max(), item.half_digit + of.rounding
            result.check(where, f"{label}: {item.quantity} - printed", off, tolerance, item.unit)
        elif label != "exact":
            off = distance(values, of.exact).max()
            result.check(where, f"{label}: {item.quantity} - exact", off, of.rounding, item.unit, rounding=True)
    for label in [name for name in ("exact", "TMT") if name.lower() in item.to_every_digit]:
        digits, off = f"{label}: {item.quantity} - printed", np.abs(finders[label] - printed).max()
        result.check(where, digits, off, item.half_digit, item.unit)
    for joint in item.sizes:
        k = joints.index(joint)
        off = abs(abs(of.nearest[k]) - abs(printed[k]))
        result.check(where, f"exact: |{item.quantity}_{joint}| - |printed|", off, item.half_digit, item.unit)


def digits_in_words(item: Printed, of: Answer, robot: Robot) -> str:
    """Which printed components of an item that is zero except for rounding are met to every digit, and by whom."""
    met_by = []
    for finder, values in (("exact arithmetic", of.nearest), ("TMT", of.tmt), ("MuJoCo", of.mujoco)):
        of_joints = [(name, v, p) for name, v, p in zip(robot.joints, values, item.values) if p]
        met = [name for name, v, p in of_joints if abs(v - p) <= item.half_digit]
        turned = [name for name, v, p in of_joints if abs(v + p) <= item.half_digit]
        which = "none" if not met else " and ".join(met) if len(met) < len(of_joints) else "all"
        met_by.append(f"{finder} {which}" + (f", and {' and '.join(turned)} with the other sign" if turned else ""))
    printed, exactly = (", ".join(f"{float(v):.4g}" for v in values) for values in (item.values, of.exact))
    turns = angles(robot)
    no = "are no doubles" if len(turns) > 1 else "is no double"
    doubles = f"{listed(turns)} {no}, and at the doubles nearest to them " if turns else ""
    return (
        f"{item.item}, printed ({printed}) {item.unit}, is met to every digit by: {'; '.join(met_by)}. Rounding of the torque "
        f"allows {of.rounding:.1e} {item.unit}; {doubles}exact arithmetic gives ({exactly}) {item.unit}."
    )


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    yield from ()


def headline(result: Result) -> Finding | None:
    """How many of the printed numbers both engines meet."""
    met = sum(
        all(abs(row[name] - row["published"]) <= row["tolerance"] for name in ("tmt", "mujoco")) for row in result.rows
    )
    return result.finding("headline", met=met, numbers=len(result.rows)) if result.rows else None
