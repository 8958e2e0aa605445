"""The fields of a Tree, each checked, as it holds them; ValueError in one line."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmt.derivation.coordinates import KINDS, Coordinates
from tmt.derivation.mechanism import Indices, Names, Numbers, Rows

from .values import CLOSE_TO_ONE, listed, numbers_of, shown


def kinds(values: Any, n: int) -> Names:
    if isinstance(values, (list, tuple)) and not values:
        return ("hinge",) * n
    kinds = listed(values) or ()
    if len(kinds) != n or not all(isinstance(kind, str) and kind in KINDS for kind in kinds):
        free = "; a free joint is three slides and a ball, see Tree.from_joints" * any(
            isinstance(kind, str) and kind == "free" for kind in kinds
        )
        raise ValueError(f"Tree.kind is {shown(values)}; {n} of {', '.join(KINDS)} are expected{free}")
    return tuple(map(str, kinds))


def indices(name: str, values: Iterable[float], ends: Iterable[int]) -> Indices:
    indices = list(values)
    for i, (index, end) in enumerate(zip(indices, ends)):
        if index != int(index) or not -1 <= index < end:
            expected = f"a whole number from -1 to {end - 1} is expected"
            raise ValueError(f"Tree.{name}[{i}] is {index:g}; {expected}")
    return tuple(map(int, indices))


def gain(name: str, values: Any, coordinates: Coordinates) -> Rows:
    if isinstance(values, tuple | list) and not values:
        return ()
    rows = numbers_of(name, values, (coordinates.nv, coordinates.nv))
    fed = np.array(rows) != 0.0
    for i, joint in enumerate(coordinates.joints):
        if joint.kind == "ball" and (fed[joint.qd].any() or fed[:, joint.qd].any()):
            expected = "entries of hinges and slides alone are accepted"
            raise ValueError(f"Tree.{name} has an entry of joint {i}, a ball; {expected}")
    return rows if fed.any() else ()


def check_ball(i: int, axes: NDArray[np.float64], reference: float, rest: Numbers) -> None:
    check_axes(f"the axes of joint {i}, a ball,", axes)
    if reference:
        raise ValueError(f"Tree.reference[{i}] is {reference:g}; 0 is expected of a ball")
    if abs(math.hypot(*rest) - 1.0) > CLOSE_TO_ONE:
        raise ValueError(f"Tree.rest of joint {i}, a ball, is {rest}; a quaternion of length 1 is expected")


def check_axes(whose: str, axes: NDArray[np.float64]) -> None:
    if np.abs(axes @ axes.T - np.eye(3)).max() > 1e-9 or np.linalg.det(axes) < 0.0:
        raise ValueError(f"{whose} are {axes.tolist()}; a right-handed frame is expected")


def direction(i: int, axis: Numbers) -> Numbers:
    exponent = math.frexp(max(map(abs, axis)))[1]
    axis = tuple(math.ldexp(a, -exponent) for a in axis)  # exact, and the squares neither overflow nor vanish
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        raise ValueError(f"Tree.axis[{i}] is zero; a direction is expected")
    return tuple(a / length for a in axis)


def check_inertia(name: str, inertia: NDArray[np.float64]) -> None:
    scale = np.abs(inertia).max()
    if np.abs(inertia - inertia.T).max() > 1e-12 * scale:
        raise ValueError(f"the inertia of {name!r} is not symmetric: {inertia.tolist()}")
    a, b, c = np.linalg.eigvalsh(inertia)
    if a + b < c - 1e-12 * scale:  # as b is at most c, this finds an a below 0 too
        expected = "each must be at least 0 and none larger than the other two together"
        raise ValueError(f"the inertia of {name!r} has principal values {a:g}, {b:g}, {c:g}; {expected}")
