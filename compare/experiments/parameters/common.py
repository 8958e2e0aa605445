"""One cause for numbers that are wrong together: a factor, exchanged, alike at several places, a vector."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.cause import Cause
from ...core.finding import Finding
from ...core.text import say
from ...robots.coordinates import point_inertia
from .numbers import COMPONENTS, Compared

SAME = 1e-9  # relative: a factor, or a number, that is the same at several places
ALIKE = (("mass", "inertia"), ("mass",), ("inertia",), ("anchor", "com"))  # quantities with a common factor
OF_INERTIAL = ("mass", "com", "inertia")


def causes_in_common(numbers: Sequence[Compared], from_geoms: Sequence[str]) -> list[Cause]:
    """The causes of all numbers, of one error one. from_geoms: bodies for which the file has no inertial."""
    left, causes = [each for each in numbers if each.causes], list[Cause]()

    def explain(together: Sequence[Compared], cause: Cause) -> None:
        nonlocal left
        causes.append(cause)
        left = without(left, together)

    for quantities in ALIKE:
        together = [each for each in numbers if each.quantity in quantities and each.stated.any()]
        factor = common_factor(together)
        if factor and len(without(left, together)) == len(left) - len(together):
            cause = as_one("factor", together, quantities=quantities, factor=factor)
            explain(together, replace(cause, stated=1.0, explains=factor))
    order = [each for each in left if each.quantity == "order"]
    if len(order) > 1:
        every = [each for each in numbers if each.quantity == "order"]
        right, file = ([each.place for each in those] for those in (every, sorted(every, key=number_in_file)))
        cause = as_one("order", order, file=file, stated=right)
        explain(order, replace(cause, stated=", ".join(right), explains=", ".join(file)))
    for body in dict.fromkeys(each.place for each in left):
        of_body = [each for each in left if each.place == body and each.quantity in OF_INERTIAL]
        if body in from_geoms and len(of_body) > 1:
            explain(of_body, as_one("from_geoms", of_body))
        elif load := load_of(of_body):
            explain(of_body, as_one("load", of_body, **load))
    while left:
        explain(*of_first(left))
    return causes


def without(numbers: Sequence[Compared], others: Sequence[Compared]) -> list[Compared]:
    names = [(each.place, each.quantity) for each in others]
    return [each for each in numbers if (each.place, each.quantity) not in names]


def number_in_file(order: Compared) -> float:
    return float(order.compiled[0])


def load_of(numbers: Sequence[Compared]) -> dict[str, Any] | None:
    """The mass, kg, and the place, m from the joint, of a body that is added or missing, if one is."""
    if len(numbers) < len(OF_INERTIAL):
        return None
    stated, compiled = (
        {each.quantity: getattr(each, side) for each in numbers} for side in ("stated", "compiled")
    )
    (stated_mass,), (mass,) = stated["mass"], compiled["mass"]
    added = mass - stated_mass
    place = (mass * compiled["com"] - stated_mass * stated["com"]) / added
    about_joint = (compiled["inertia"] - stated["inertia"]).reshape(3, 3)
    about_joint = (
        about_joint + point_inertia(compiled["com"], mass) - point_inertia(stated["com"], stated_mass)
    )
    low, middle, high = np.linalg.eigvalsh((about_joint - point_inertia(place, added)) * np.sign(added))
    is_body = low >= -SAME * high and high <= (low + middle) * (1.0 + SAME)
    return {"mass": abs(added), "place": place.tolist(), "is_added": added > 0.0} if is_body else None


def common_factor(numbers: Sequence[Compared]) -> float | None:
    """The factor, not 1, between all stated and compiled numbers of at least two places, if there is one."""
    if len(numbers) < 2:
        return None
    stated, compiled = (np.concatenate(values) for values in zip(*((n.stated, n.compiled) for n in numbers)))
    factor = float(stated @ compiled / (stated @ stated))
    sizes = np.concatenate([np.full(len(n.stated), np.abs(n.stated).max()) for n in numbers])
    is_common = (np.abs(compiled - factor * stated) <= SAME * abs(factor) * sizes).all()
    return factor if is_common and abs(factor - 1.0) > SAME else None


def of_first(numbers: Sequence[Compared]) -> tuple[list[Compared], Cause]:
    """The first of some numbers with those that are exchanged, or wrong in the same way, and their cause."""
    first, *others = numbers
    same = [each for each in others if each.quantity == first.quantity]
    exchanged = [each for each in same if is_near(each.stated, first.compiled)]
    exchanged = [each for each in exchanged if is_near(each.compiled, first.stated)]
    if len(same) == len(exchanged) == 1:
        return [first, *exchanged], as_one("exchanged", [first, *exchanged])
    hanging = [each for each in same if is_near(each.compiled - each.stated, first.compiled - first.stated)]
    if hanging and first.quantity == "anchor":  # they move with it
        change = (first.compiled - first.stated).tolist()
        return [first, *hanging], as_one("moved", [first, *hanging], change=change)
    alike = [each for each in same if is_near(each.stated, first.stated)]
    together = [first, *(each for each in alike if is_near(each.compiled, first.compiled))]
    if len(together) == len(first.causes) == 1:
        return together, first.causes[0]
    if first.quantity == "axis" and is_near(first.compiled, -first.stated) and len(together) == 1:
        return together, as_one("opposite", together)
    return together, as_one("vector", together, **values_of(first))


def is_near(values: np.ndarray, others: np.ndarray) -> bool:
    return bool(np.abs(values - others).max() <= SAME * np.abs(others).max())


def values_of(number: Compared) -> dict[str, Any]:
    """What is said of a vector or tensor: components that differ, whether two of a diagonal are exchanged."""
    names, shown = COMPONENTS[len(number.stated)], np.arange(len(number.stated))
    is_tensor = len(names) == 9
    if is_tensor:
        is_upper = np.array([name == "".join(sorted(name)) for name in names])
        shown = np.flatnonzero(is_upper & (np.abs(number.compiled - number.stated) > number.tolerance))
    stated, compiled = number.stated[shown], number.compiled[shown]
    return {"components": [names[k] for k in shown] if is_tensor else [], "stated": stated.tolist(),
            "compiled": compiled.tolist(),
            "is_exchanged": is_tensor and len(shown) == 2 and is_near(stated, compiled[::-1])}  # fmt: skip


def as_one(kind: str, numbers: Sequence[Compared], **values: Any) -> Cause:
    """A cause in place of those of some numbers; the first of these has its numbers."""
    causes = [cause for each in numbers for cause in each.causes]
    text = say(Finding("parameters", kind, {"numbers": numbers, **values}))
    size, rank = max(cause.size for cause in causes), min(cause.rank for cause in causes)
    return replace(causes[0], place=text.partition(":")[0], text=text, size=size, rank=rank)
