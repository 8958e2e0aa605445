"""Several numbers at once: the ten inertial numbers of a body, in which Mbar and h are linear; the same number
of all joints or bodies; the three components of an offset or a CoM.
"""

import re
from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy import ndarray

from ..core.cause import Cause
from ..core.words import listed
from ..robots.coordinates import point_inertia
from .edits import angles_of
from .fit import Search
from .model import Equations, Path
from .places import INERTIA, SMALL, XYZ

DIGITS = {5: 1e-9, 3: 1e-5}  # and how exact a number with that count of digits is, a share
RANK = 1e-9  # of the largest singular value
ZERO = 1e-5  # m, or m2: what is no length of a load
LEAST_LOAD = 1e-6  # of the heaviest body
OF_BODY = 10  # mass, its product with the CoM, tensor about the origin of the frame
Number = tuple[str, float, float, str]  # its name, the right and the given value, its unit


def body_columns(equations: Equations) -> Iterator[ndarray]:
    """What a unit of each body's ten numbers adds to the values, (10, states, entries)."""
    stated = equations.stated
    for b in range(len(equations.tree.mass)):
        changes: dict[Path, ndarray] = {}
        m, c, I = float(stated["mass"][b]), stated["com"][b], stated["inertia"][b]
        for k in range(1 + OF_BODY):  # the last is the base: the mass is larger by 1, and the others stay
            first, tensor = m * c, I + point_inertia(c, m)
            if 1 <= k <= 3:
                first = first + np.eye(3)[k - 1]
            elif 4 <= k < OF_BODY:
                _, i, j = INERTIA[k - 4]
                tensor[i, j] += 1.0
                tensor[j, i] = tensor[i, j]
            com = first / (m + 1.0)
            new = {"mass": 1.0, "com": com - c, "inertia": tensor - point_inertia(com, m + 1.0) - I}
            for field, change in new.items():
                for at, x in np.ndenumerate(change):
                    changes.setdefault(Path(field, (b, *at)), np.zeros(1 + OF_BODY))[k] = x
        values = equations.values(changes)
        columns = values[:OF_BODY] - values[OF_BODY]
        columns[0] = values[OF_BODY] - equations.right
        yield columns


def fit(search: Search, columns: ndarray) -> tuple[ndarray, ndarray]:
    """Coefficients of columns (n, states, entries) that explain what is given, and which are determined.

    All zero, and none determined, where they do not explain it.
    """
    A = (columns * search.weight).reshape(len(columns), -1).T
    sizes = np.linalg.norm(A, axis=0)
    active = sizes > 0.0
    x, determined = np.zeros(len(columns)), np.zeros(len(columns), bool)
    if not active.any():
        return x, determined
    U, s, Vt = np.linalg.svd(A[:, active] / sizes[active], full_matrices=False)
    rank = s > RANK * s[0]
    left = search.off.ravel()
    for _ in range(3):  # refined: the columns have sizes far apart
        x[active] += (Vt[rank].T @ ((U[:, rank].T @ left) / s[rank])) / sizes[active]
        left = search.off.ravel() - A @ x
    determined[active] = np.linalg.norm(Vt[rank], axis=0) > 1.0 - 1e-6
    return (x, determined) if np.abs(left).max() <= 1.0 else (0.0 * x, determined & False)


def inertial_numbers(equations: Equations, search: Search) -> Iterator[Cause]:
    """The ten numbers of one body: a load on it, its tensor turned, or those of them that differ."""
    for b, columns in enumerate(body_columns(equations)):
        tensor, is_known = fit(search, columns[4:])  # with the mass and the CoM as stated
        added, determined = np.append(np.zeros(4), tensor), np.ones(OF_BODY, bool)
        if not is_known.all():
            added, determined = fit(search, columns)
        active = np.abs(columns).max(axis=(1, 2)) > 0.0
        if not determined[active].any():
            continue
        load = load_of(equations, b, added, determined)
        turned = turned_of(equations, b, added) if determined[4:].all() else None
        if load or turned:
            yield from filter(None, (load, turned))
        elif determined[active].all():
            yield from as_causes(
                f"of {equations.tree.body_names[b]}", numbers_of(equations, b, added, active)
            )


def load_of(equations: Equations, b: int, added: ndarray, determined: ndarray) -> Cause | None:
    """A further body that moves with one of the bodies: its mass, CoM and tensor."""
    mass, body = float(added[0]), equations.tree.body_names[b]
    if not determined[:4].all() or mass <= LEAST_LOAD * max(equations.tree.mass):
        return None
    frame, com = equations.frame_of(b), added[1:4] / mass
    tensor = frame.axes.T @ (symmetric(added[4:]) - point_inertia(com, mass)) @ frame.axes
    com = frame.axes.T @ (com - frame.origin)
    where = ", ".join(f"{x:.5g}" for x in np.where(np.abs(com) < ZERO, 0.0, com))
    explains, is_known = f"{mass:.5g} kg, CoM ({where}) m", determined[4:].all()
    shown = [f", {name} {tensor[i, j]:.4g}" for name, i, j in INERTIA if abs(tensor[i, j]) > ZERO * mass]
    if is_known and shown:
        explains += "".join(shown) + " kg m2"
    is_possible = not is_known or np.linalg.eigvalsh(tensor)[0] >= -ZERO * mass
    if is_possible and all(map(is_round, (mass, *com))):
        return Cause(rank=3, kind="load", place=f"a load on {body}", stated="", explains=explains)
    return None


def symmetric(components: ndarray) -> ndarray:
    """A tensor of its components in the order of INERTIA."""
    tensor = np.zeros((3, 3))
    for (_, i, j), x in zip(INERTIA, components):
        tensor[i, j] = tensor[j, i] = x
    return tensor


def turned_of(equations: Equations, b: int, added: ndarray) -> Cause | None:
    """The tensor of a body about other axes, with the same principal moments: an inertial frame turned."""
    axes, stated = equations.frame_of(b).axes, equations.stated["inertia"][b]
    right, before = principal(axes.T @ stated @ axes)
    moments, after = principal(axes.T @ (stated + symmetric(added[4:])) @ axes)
    is_same = np.abs(added[:4]).max() < ZERO and np.abs(moments - right).max() <= SMALL * right[-1]
    if not (is_same and np.diff(right).min() > ZERO * right[-1]):
        return None
    signs = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    near = sorted(((after * sign) @ before.T for sign in signs), key=np.trace, reverse=True)
    for turn, how in product(near, ("turned", "turned back")):
        angles = angles_of(turn if how == "turned" else turn.T)
        angles, unit = np.where(np.abs(angles) < ZERO, 0.0, angles), "rad"
        if all(map(is_round, np.degrees(angles))):
            angles, unit = np.degrees(angles), "deg"
        if all(map(is_round, angles)):
            explains = f"{how} by rpy = ({', '.join(f'{angle:.5g}' for angle in angles)}) {unit}"
            place = f"inertia of {equations.tree.body_names[b]}"
            return Cause(rank=2, kind="numbers", place=place, stated="", explains=explains)
    return None


def principal(tensor: ndarray) -> tuple[ndarray, ndarray]:
    """Principal moments, and their axes as the columns of a turn."""
    moments, axes = np.linalg.eigh(tensor)
    return moments, axes * [np.linalg.det(axes), 1.0, 1.0]


def numbers_of(equations: Equations, b: int, added: ndarray, active: ndarray) -> list[Number]:
    """The mass, CoM and tensor of a body that differ, in the axes of the file."""
    (origin, axes), stated = equations.frame_of(b), equations.stated
    m, c, I = float(stated["mass"][b]), stated["com"][b], stated["inertia"][b]
    mass = m + float(added[0])
    if mass <= 0.0:
        return []
    com = (m * c + added[1:4]) / mass
    com = np.where(active[1:4], com, c)
    tensor = I + point_inertia(c, m) + symmetric(added[4:]) - point_inertia(com, mass)
    tensor = np.where(symmetric(active[4:].astype(float)) > 0.0, tensor, I)
    right, given = axes.T @ (c - origin), axes.T @ (com - origin)
    before, after = axes.T @ I @ axes, axes.T @ tensor @ axes
    numbers = [("mass", m, mass, "kg")]
    numbers += [(f"CoM {axis}", float(x), float(y), "m") for axis, x, y in zip(XYZ, right, given)]
    numbers += [
        (f"inertia {name}", float(before[i, j]), float(after[i, j]), "kg m2") for name, i, j in INERTIA
    ]
    length = max(np.abs(right).max(), np.abs(given).max())
    sizes = [max(m, mass), *[length] * 3, *[max(np.abs(before).max(), np.abs(after).max())] * 6]
    return [number for number, size in zip(numbers, sizes) if abs(number[2] - number[1]) > SMALL * size]


def several(search: Search) -> Iterator[Cause]:
    """The armatures of all joints, the masses of all bodies."""
    groups: dict[str, list[int]] = {}
    columns = search.coefficients[0]
    for k, place in enumerate(search.places):
        owners = {(path.field, path.at[0]) for path, _ in place.moves}
        if len(owners) == 1 and place.kind == "number" and columns[k].any():
            ((field, _),) = owners
            if field in ("armature", "mass"):
                groups.setdefault(field, []).append(k)
    for field, chosen in groups.items():
        places = [search.places[k] for k in chosen]
        fitted = zip(places, fit(search, columns[chosen])[0])
        numbers = [(place, place.value(x * place.size)) for place, x in fitted]
        if all(x >= place.least for place, x in numbers):
            each = [
                (place.name.removeprefix(f"{field} of "), place.stated, x, place.unit) for place, x in numbers
            ]
            changed = [
                number for number in each if not np.isclose(number[2], number[1], rtol=SMALL, atol=0.0)
            ]
            yield from as_causes("", changed, field)


def vectors(search: Search) -> Iterator[Cause]:
    """The three components of the offset of a joint, or of the CoM of a body."""
    of_joints: dict[str, list[int]] = {}
    for k, place in enumerate(search.places):
        if place.name.startswith(("offset ", "CoM ")) and place.kind == "number":
            of_joints.setdefault(place.name[:4] + place.name.partition(" of ")[2], []).append(k)
    chosen = [those for those in of_joints.values() if len(those) == 3]
    for found in search.outcome(np.array(chosen), np.zeros((len(chosen), 3))) if chosen else ():
        if found.explains:
            pairs = zip(found.places, found.changes)
            numbers = [
                (place.name.partition(" of ")[0], place.stated, place.value(x), "m") for place, x in pairs
            ]
            changed = [number for number in numbers if abs(number[2] - number[1]) > SMALL]
            yield from as_causes(f"of {found.places[0].name.partition(' of ')[2]}", changed)


def as_causes(owner: str, numbers: list[Number], field: str = "") -> Iterator[Cause]:
    """Several numbers as one cause, if there are several and each is one that people write."""
    if len(numbers) < 2 or not all(is_written(x, right) for _, right, x, _ in numbers):
        return
    names = listed(merged([name for name, *_ in numbers]))
    place = f"{field} of {names}" if field else f"{names} {owner}"
    units = {unit for *_, unit in numbers}
    each = [unit if len(units) > 1 else "" for *_, unit in numbers]
    explains = ", ".join(f"{x:.6g} {unit}".strip() for (_, _, x, _), unit in zip(numbers, each))
    stated = ", ".join(f"{right:.6g} {unit}".strip() for (_, right, _, _), unit in zip(numbers, each))
    unit = units.pop() if len(units) == 1 else ""
    yield Cause(rank=3, kind="several", place=place, stated=stated, explains=explains, unit=unit)


def merged(names: list[str]) -> list[str]:
    """Names that begin alike as one: "CoM x", "CoM z" as "CoM x", "z"."""
    short, before = [], ""
    for name in names:
        first, _, last = name.rpartition(" ")
        short.append(last if first and first == before else name)
        before = first
    return short


def is_written(x: float, right: float) -> bool:
    """Whether a number, or its ratio to the right one, has few digits."""
    ratios = [x / right, right / x] if x and right else []
    return any(map(is_round, [x, *ratios]))


def is_round(x: float) -> bool:
    """Whether a number has few digits, as people write them, the fewer the less exact it is."""
    rounded = {float(f"{x:.{digits}g}"): exact for digits, exact in DIGITS.items()}
    return any(abs(x - near) <= exact * abs(x) or abs(x) < exact for near, exact in rounded.items())


def numbers_in(text: str) -> list[float]:
    """The numbers in the text of several."""
    return [float(number.split()[0]) for number in re.split(", ", text)]
