"""The fields of a Tree, each checked, as it holds them; ValueError in one line."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmt.derivation.coordinates import KINDS, Coordinates
from tmt.derivation.mechanism import Indices, Names, Numbers, Rows

from .values import CLOSE_TO_ONE, listed, numbers_of, require


def kinds(values: Any, n: int) -> Names:
    if isinstance(values, (list, tuple)) and not values:
        return ("hinge",) * n
    kinds = listed(values) or ()
    are_known = len(kinds) == n and all(isinstance(kind, str) and kind in KINDS for kind in kinds)
    free = " (a free joint is three slides and a ball, see Tree.from_joints)"
    require(are_known, "Tree.kind", values, f"{n} of {', '.join(KINDS)}{free} are")
    return tuple(map(str, kinds))


def indices(name: str, values: Iterable[float], ends: Iterable[int]) -> Indices:
    indices = list(values)
    for i, (index, end) in enumerate(zip(indices, ends)):
        is_right = index == int(index) and -1 <= index < end
        require(is_right, f"Tree.{name}[{i}]", index, f"a whole number from -1 to {end - 1} is")
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
    check_axes(f"axes of joint {i}, a ball,", axes)
    require(not reference, f"Tree.reference[{i}]", reference, "0 of a ball is")
    check_quaternion(f"Tree.rest of joint {i}, a ball,", rest)


def check_quaternion(whose: str, quaternion: Numbers) -> None:
    is_close = abs(math.hypot(*quaternion) - 1.0) <= CLOSE_TO_ONE
    require(is_close, whose, quaternion, "a quaternion w, x, y, z of length 1 is")


def check_axes(whose: str, axes: NDArray[np.float64]) -> None:
    is_frame = np.abs(axes @ axes.T - np.eye(3)).max() <= 1e-9 and np.linalg.det(axes) > 0.0
    require(is_frame, whose, axes.tolist(), "a right-handed frame is")


def direction(i: int, axis: Numbers) -> Numbers:
    exponent = math.frexp(max(map(abs, axis)))[1]
    axis = tuple(math.ldexp(a, -exponent) for a in axis)  # exact, and the squares neither overflow nor vanish
    length = float(np.linalg.norm(axis))
    require(length, f"Tree.axis[{i}]", axis, "a direction is")
    return tuple(a / length for a in axis)


def check_inertia(name: str, inertia: NDArray[np.float64]) -> None:
    scale = np.abs(inertia).max()
    is_symmetric = np.abs(inertia - inertia.T).max() <= 1e-12 * scale
    require(is_symmetric, f"inertia of {name!r}", inertia.tolist(), "a symmetric tensor is")
    a, b, c = np.linalg.eigvalsh(inertia)
    if a + b < c - 1e-12 * scale:  # as b is at most c, this finds an a below 0 too
        expected = "each must be at least 0 and none larger than the other two together"
        raise ValueError(f"the inertia of {name!r} has principal values {a:g}, {b:g}, {c:g}; {expected}")
