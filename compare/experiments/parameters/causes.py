"""The causes of numbers that differ: one for a body or joint, and one for numbers that differ alike."""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from ...core.cause import Cause
from ...core.finding import Finding
from ...core.text import say
from .numbers import OF_BODIES, Compared

SAME = 1e-9  # relative: a factor, or a change, that is the same at several places
# of the largest of a vector: mj_saveLastXML writes six digits, which moves a number by half a unit of its
# sixth digit, 5e-6 at most, and one that is turned by a quaternion twice as much
SIX_DIGITS = 1e-5
ALIKE = (("mass", "inertia"), ("mass",), ("inertia",), ("offset", "com"))  # quantities with a common factor
OF_JOINTS = "anchor", "offset", "axis", "ref"


def causes_of(numbers: Sequence[Compared], sides: Sequence[str]) -> list[Cause]:
    """The causes of all numbers that differ. sides: the names of here and there."""
    left, causes = [number for number in numbers if number.differs.any()], list[Cause]()

    def explain(kind: str, together: Sequence[Compared], place: str = "", **values: Any) -> None:
        first, about = together[0], {"numbers": together, "sides": sides, **values}
        text = say(Finding("parameters", kind, about))
        k = first.shown[0]
        here, there = float(first.here[k]), float(first.there[k])
        known: dict[str, Any] = {"stated": there, "explains": here if np.isfinite(here) else None}
        size, rank = max(number.size for number in together), min(number.rank for number in together)
        rank = 3 if kind == "six_digits" else rank  # beneath what no printing explains
        known |= {name: values[name] for name in known if name in values}
        causes.append(Cause(place=place or text.partition(":")[0], text=text, rank=rank, size=size,
                            quantity=first.quantity, owners=len(together) if kind == "differ" else 1, **known))  # fmt: skip
        left[:] = [number for number in left if not any(number is other for other in together)]

    for quantities in ALIKE:
        of_kind = [number for number in numbers if number.quantity in quantities and number.there.any()]
        together = [number for number in of_kind if any(number is other for other in left)]
        if len(together) == len(of_kind) and (factor := common_factor(of_kind)):
            explain("factor", together, quantities=quantities, factor=factor, stated=1.0, explains=factor)
    if order := [number for number in left if number.quantity == "order"]:
        every = [number for number in numbers if number.quantity == "order"]
        there = ", ".join(number.place for number in every)
        here = ", ".join(number.place for number in sorted(every, key=lambda number: float(number.here[0])))
        explain("order", order, stated=there, explains=here)
    written = [number for number in left if relative(number) <= SIX_DIGITS]
    if sum(np.count_nonzero(number.differs) for number in written) > 1:
        explain("six_digits", written, most=max(map(relative, written)))
    for number in [number for number in left if number.quantity == "inertia"]:
        if SIX_DIGITS < relative(number) < np.inf and (turn := rotation_of(number)) is not None:
            angle = float(np.linalg.norm(turn))
            explain(
                "rotated", [number], rotation=(turn / angle).tolist(), stated=0.0, explains=np.rad2deg(angle)
            )
    while left:
        first = left[0]
        same = [number for number in left if number.quantity == first.quantity]
        alike = [number for number in same if is_near(number.here - number.there, first.here - first.there)]
        if len(alike) > 1 and first.rank == alike[-1].rank:
            explain("alike", alike, is_moved=not all(is_near(number.there, first.there) for number in alike))
            continue
        kinds = OF_BODIES if first.quantity in OF_BODIES else OF_JOINTS
        together = [number for number in left if number.place == first.place and number.quantity in kinds]
        explain("differ", together if first in together else [first])
    return causes


def rotation_of(number: Compared) -> np.ndarray | None:
    """The least rotation vector, rad, that turns the tensor there to the one here; None: none does.

    Principal moments are compared to six digits. Two numbers, or products of inertia alone, that differ are no
    rotation. Of a body of revolution the axis is turned, no further about itself.
    """
    from scipy.spatial.transform import Rotation  # slow import

    (sizes, axes), (others, turned) = (np.linalg.eigh(x.reshape(3, 3)) for x in (number.there, number.here))
    least = SIX_DIGITS * np.abs(sizes).max()
    if np.abs(others - sizes).max() > least or len(number.shown) < 3 or not number.differs[[0, 4, 8]].any():
        return None
    if (gaps := np.diff(sizes)).min() <= least:
        k = 0 if gaps[1] <= least else 2
        sense = -1.0 if axes[:, k] @ turned[:, k] < 0.0 else 1.0
        normal = np.cross(axes[:, k], sense * turned[:, k])
        size = np.linalg.norm(normal)
        return np.asarray(normal / size * np.arctan2(size, sense * axes[:, k] @ turned[:, k]))
    matrices = [turned * signs @ axes.T for signs in product((1.0, -1.0), repeat=3)]
    proper = [matrix for matrix in matrices if np.linalg.det(matrix) > 0.0]
    return np.asarray(min(Rotation.from_matrix(proper).as_rotvec(), key=np.linalg.norm))


def relative(number: Compared) -> float:
    """The largest difference over the largest component there; inf: all are 0 there."""
    largest = float(np.abs(number.there).max())
    return float(np.abs(number.here - number.there).max()) / largest if largest else np.inf


def common_factor(numbers: Sequence[Compared]) -> float | None:
    """The factor, not 1, between all numbers here and there of at least two places, if there is one."""
    if len(numbers) < 2:
        return None
    there, here = (
        np.concatenate([getattr(number, side) for number in numbers]) for side in ("there", "here")
    )
    factor = float(there @ here / (there @ there))
    sizes = np.concatenate([np.full(len(number.there), np.abs(number.there).max()) for number in numbers])
    is_common = (np.abs(here - factor * there) <= SAME * abs(factor) * sizes).all()
    return factor if is_common and abs(factor - 1.0) > SAME else None


def is_near(values: np.ndarray, others: np.ndarray) -> bool:
    return bool(np.abs(values - others).max() <= SAME * np.abs(others).max())
