"""One cause for numbers that are wrong together: a common factor, exchanged, the same at several places, a vector."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ...core.cause import Cause
from ...core.text import block
from ...engines.mujoco.parameters import Stated
from ...robots.coordinates import point_inertia
from .numbers import COMPONENTS

SAME = 1e-9  # relative: a factor, or a number, that is the same at several places
ALIKE = (("mass", "inertia"), ("mass",), ("inertia",), ("anchor", "com"))  # quantities with a common factor
OF_INERTIAL = ("mass", "com", "inertia")


class Numbers(NamedTuple):
    """A quantity of a body or a joint, and its causes, one for each component that differs."""

    number: Stated
    unit: str
    causes: list[Cause]

    @property
    def stated(self) -> np.ndarray:
        return np.array(self.number.stated, float).ravel()

    @property
    def compiled(self) -> np.ndarray:
        return np.array(self.number.compiled, float).ravel()


def causes_in_common(numbers: Sequence[Numbers], from_geoms: Sequence[str]) -> list[Cause]:
    """The causes of all numbers, of one error one. from_geoms: bodies for which the file has no inertial."""
    left, causes = [each for each in numbers if each.causes], list[Cause]()

    def explain(together: Sequence[Numbers], *cause: Cause) -> None:
        nonlocal left
        causes.extend(cause)
        left = without(left, together)

    for quantities in ALIKE:
        together = [each for each in numbers if each.number.quantity in quantities and each.stated.any()]
        factor = common_factor(together)
        if factor and len(without(left, together)) == len(left) - len(together):
            values = {"quantities": quantities, "factor": factor}
            explain(together, as_one(together, "factor", values, 1.0, factor))
    order = [each for each in left if each.number.quantity == "order"]
    if len(order) > 1:
        every = [each for each in numbers if each.number.quantity == "order"]
        right = [each.number.place for each in every]
        file = [each.number.place for each in sorted(every, key=lambda each: each.compiled[0])]
        names = ", ".join(right), ", ".join(file)
        explain(order, as_one(order, "order", {"file": file, "stated": right}, *names))
    for body in dict.fromkeys(each.number.place for each in left):
        of_body = [each for each in left if each.number.place == body and each.number.quantity in OF_INERTIAL]
        if body in from_geoms and len(of_body) > 1:
            explain(of_body, as_one(of_body, "from_geoms", {"body": body, "numbers": of_body}))
        elif load := load_of(of_body):
            explain(of_body, as_one(of_body, "load", {"body": body, **load}))
    while left:
        together = alike(left)
        explain(together, *of_group(together))
    return causes


def without(numbers: Sequence[Numbers], others: Sequence[Numbers]) -> list[Numbers]:
    names = [(each.number.place, each.number.quantity) for each in others]
    return [each for each in numbers if (each.number.place, each.number.quantity) not in names]


def load_of(numbers: Sequence[Numbers]) -> dict[str, Any] | None:
    """The mass, kg, and the place, m from the joint, of a body that is added or missing, if one is."""
    if len(numbers) < len(OF_INERTIAL):
        return None
    by_name = {each.number.quantity: each for each in numbers}
    (stated_mass,), (mass,) = by_name["mass"].stated, by_name["mass"].compiled
    stated_com, com = by_name["com"].stated, by_name["com"].compiled
    added = mass - stated_mass
    place = (mass * com - stated_mass * stated_com) / added
    about_joint = (by_name["inertia"].compiled - by_name["inertia"].stated).reshape(3, 3)
    about_joint = about_joint + point_inertia(com, mass) - point_inertia(stated_com, stated_mass)
    low, middle, high = np.linalg.eigvalsh((about_joint - point_inertia(place, added)) * np.sign(added))
    is_body = low >= -SAME * high and high <= (low + middle) * (1.0 + SAME)
    return {"mass": abs(added), "place": place.tolist(), "is_added": added > 0.0} if is_body else None


def common_factor(numbers: Sequence[Numbers]) -> float | None:
    """The factor, not 1, between all stated and compiled numbers of at least two places, if there is one."""
    if len(numbers) < 2:
        return None
    stated, compiled = (np.concatenate(values) for values in zip(*((n.stated, n.compiled) for n in numbers)))
    factor = float(stated @ compiled / (stated @ stated))
    sizes = np.concatenate([np.full(len(n.stated), np.abs(n.stated).max()) for n in numbers])
    is_common = (np.abs(compiled - factor * stated) <= SAME * abs(factor) * sizes).all()
    return factor if is_common and abs(factor - 1.0) > SAME else None


def alike(numbers: Sequence[Numbers]) -> list[Numbers]:
    """The first of some numbers, and those that are wrong with it: exchanged, or changed in the same way."""
    first, *others = numbers
    same = [each for each in others if each.number.quantity == first.number.quantity]
    exchanged = [
        each for each in same if is_near(each.stated, first.compiled) and is_near(each.compiled, first.stated)
    ]
    if len(same) == len(exchanged) == 1:
        return [first, *exchanged]
    if first.number.quantity == "anchor":  # those that hang on it move with it
        change = first.compiled - first.stated
        return [first, *(each for each in same if is_near(each.compiled - each.stated, change))]
    equal = [
        each for each in same if is_near(each.stated, first.stated) and is_near(each.compiled, first.compiled)
    ]
    return [first, *equal]


def is_near(values: np.ndarray, others: np.ndarray) -> bool:
    return bool(np.abs(values - others).max() <= SAME * np.abs(others).max())


def of_group(numbers: Sequence[Numbers]) -> list[Cause]:
    """The cause of numbers of one quantity that are wrong together."""
    first, *others = numbers
    values: dict[str, Any] = {"numbers": numbers, "quantity": first.number.quantity, "unit": first.unit}
    values["places"] = [each.number.place for each in numbers]
    if others and not is_near(first.stated, others[0].stated) and is_near(others[0].stated, first.compiled):
        return [as_one(numbers, "exchanged", values)]
    if others and first.number.quantity == "anchor":
        values["change"] = (first.compiled - first.stated).tolist()
        return [as_one(numbers, "moved", values)]
    if others:
        return [as_one(numbers, "several", values | values_of(first))]
    if len(first.causes) == 1:
        return first.causes
    is_axis_turned = first.number.quantity == "axis" and is_near(first.compiled, -first.stated)
    if is_axis_turned:
        return [as_one(numbers, "opposite", values)]
    return [as_one(numbers, "vector", values | values_of(first))]


def values_of(number: Numbers) -> dict[str, Any]:
    """What is said of a vector or a tensor: components that differ, and whether two of a diagonal are exchanged."""
    names = COMPONENTS[len(number.stated)]
    differs = np.abs(number.compiled - number.stated) > number.number.tolerance
    is_upper = np.array([name == "".join(sorted(name)) for name in names])
    shown = np.flatnonzero((differs & is_upper) if len(names) == 9 else np.ones(len(names), bool))
    stated, compiled = number.stated[shown], number.compiled[shown]
    is_exchanged = len(names) == 9 and len(shown) == 2 and is_near(stated, compiled[::-1])
    components = [names[k] for k in shown]
    return {"components": components if len(names) == 9 else [], "stated": stated.tolist(),
            "compiled": compiled.tolist(), "is_exchanged": is_exchanged}  # fmt: skip


def as_one(
    numbers: Sequence[Numbers], kind: str, values: Mapping[str, Any], stated: Any = None, compiled: Any = None
) -> Cause:
    """A cause instead of those of some numbers. stated, compiled: None: those of the first cause."""
    causes = [cause for each in numbers for cause in each.causes]
    first, text = causes[0], block("parameters", kind, **values)
    place = text.partition(":")[0]
    if stated is None:
        stated, compiled = first.stated, first.explains
    size, rank = max(cause.size for cause in causes), min(cause.rank for cause in causes)
    return replace(first, place=place, stated=stated, explains=compiled, text=text, size=size, rank=rank)
