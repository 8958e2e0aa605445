"""Several inertial numbers at once, in which Mbar and h are linear: one regression for each group of them."""

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
from .places import INERTIA, SMALL

DIGITS = {5: 1e-9, 3: 1e-5}  # and how exact a number with that count of digits is, a share
RANK = 1e-9  # of the largest singular value
ZERO = 1e-5  # m, or m2: what is no length of a load
LEAST_LOAD = 1e-6  # of the heaviest body
OF_BODY = 10  # mass, its product with the CoM, tensor about the origin of the frame


def body_columns(equations: Equations) -> ndarray:
    """What a unit of each body's ten numbers adds to the values, (bodies, 10, states, entries)."""
    changes: dict[Path, ndarray] = {}
    stated, shape = equations.stated, (len(equations.tree.mass), 1 + OF_BODY)
    for b, k in np.ndindex(shape):  # the last is the base: the mass is larger by 1, and the others stay
        m, c, I = float(stated["mass"][b]), stated["com"][b], stated["inertia"][b]
        first, tensor = m * c, I + point_inertia(c, m)
        if 1 <= k <= 3:
            first = first + np.eye(3)[k - 1]
        elif 4 <= k < OF_BODY:
            _, i, j = INERTIA[k - 4]
            tensor[i, j] += 1.0
            tensor[j, i] = tensor[i, j]
        mass = m + 1.0
        com = first / mass
        new = {"mass": 1.0, "com": com - c, "inertia": tensor - point_inertia(com, mass) - I}
        for field, change in new.items():
            for at, x in np.ndenumerate(change):
                changes.setdefault(Path(field, (b, *at)), np.zeros(shape))[b, k] = x
    flat = {path: rows.ravel() for path, rows in changes.items()}
    values = equations.values(flat).reshape(*shape, *equations.right.shape)
    columns = values[:, :OF_BODY] - values[:, OF_BODY:]
    columns[:, 0] = values[:, OF_BODY] - equations.right
    return columns


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


def loads(equations: Equations, search: Search) -> Iterator[Cause]:
    """A further body that moves with one of the bodies: its mass, CoM and tensor."""
    for body, columns in zip(equations.tree.body_names, body_columns(equations)):
        numbers, determined = fit(search, columns)
        mass = float(numbers[0])
        if not determined[:4].all() or mass <= LEAST_LOAD * max(equations.tree.mass):
            continue
        com, tensor = numbers[1:4] / mass, np.zeros((3, 3))
        for (_, i, j), x in zip(INERTIA, numbers[4:]):
            tensor[i, j] = tensor[j, i] = x
        frame = equations.frame_of(equations.tree.body_names.index(body))
        tensor = frame.axes.T @ (tensor - point_inertia(com, mass)) @ frame.axes
        com = frame.axes.T @ (com - frame.origin)
        where = ", ".join(f"{x:.5g}" for x in np.where(np.abs(com) < ZERO, 0.0, com))
        explains, is_known = f"{mass:.5g} kg, CoM ({where}) m", determined[4:].all()
        shown = [f", {name} {tensor[i, j]:.4g}" for name, i, j in INERTIA if abs(tensor[i, j]) > ZERO * mass]
        if is_known and shown:
            explains += "".join(shown) + " kg m2"
        is_possible = not is_known or np.linalg.eigvalsh(tensor)[0] >= -ZERO * mass
        if is_possible and all(map(is_round, (mass, *com))):
            yield Cause(rank=3, kind="load", place=f"a load on {body}", stated="", explains=explains)


def turned(equations: Equations, search: Search) -> Iterator[Cause]:
    """The tensor of a body about other axes, with the same principal moments: an inertial frame turned."""
    for b, columns in enumerate(body_columns(equations)[:, -6:]):
        added, determined = fit(search, columns)
        axes, stated = equations.frame_of(b).axes, equations.stated["inertia"][b]
        tensor = stated.copy()
        for (_, i, j), x in zip(INERTIA, added):
            tensor[[i, j], [j, i]] = stated[i, j] + x
        right, before = principal(axes.T @ stated @ axes)
        moments, after = principal(axes.T @ tensor @ axes)
        is_same = np.abs(moments - right).max() <= SMALL * right[-1]
        if not (determined.all() and is_same and np.diff(right).min() > ZERO * right[-1]):
            continue
        signs = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
        near = sorted(((after * sign) @ before.T for sign in signs), key=np.trace, reverse=True)
        for turn, how in product(near, ("turned", "turned back")):
            angles, unit = of_angles(turn if how == "turned" else turn.T)
            if all(map(is_round, angles)):
                explains = f"{how} by rpy = ({', '.join(f'{angle:.5g}' for angle in angles)}) {unit}"
                place = f"inertia of {equations.tree.body_names[b]}"
                yield Cause(rank=2, kind="numbers", place=place, stated="", explains=explains)
                break


def of_angles(turn: ndarray) -> tuple[ndarray, str]:
    """Its roll, pitch and yaw, with their unit: deg, if they are round in it."""
    angles = angles_of(turn)
    angles = np.where(np.abs(angles) < ZERO, 0.0, angles)
    degrees = np.degrees(angles)
    return (degrees, "deg") if all(map(is_round, degrees)) else (angles, "rad")


def principal(tensor: ndarray) -> tuple[ndarray, ndarray]:
    """Principal moments, and their axes as the columns of a turn."""
    moments, axes = np.linalg.eigh(tensor)
    return moments, axes * [np.linalg.det(axes), 1.0, 1.0]


def several(search: Search) -> Iterator[Cause]:
    """The same number of all joints or bodies: armatures, masses, moments of inertia."""
    groups: dict[tuple[str, int], list[int]] = {}
    columns = search.coefficients[0]
    for k, place in enumerate(search.places):
        owners = {(path.field, path.at[0]) for path, _ in place.moves}
        if len(owners) == 1 and place.kind == "number" and columns[k].any():
            ((field, owner),) = owners
            groups.setdefault((field, owner if field == "inertia" else 0), []).append(k)
    for (field, _), chosen in groups.items():
        if field not in ("armature", "mass", "inertia") or len(chosen) < 2:
            continue
        places = [search.places[k] for k in chosen]
        fitted = zip(places, fit(search, columns[chosen])[0])
        pairs = [(place, place.value(x * place.size)) for place, x in fitted]
        pairs = [(place, x) for place, x in pairs if not np.isclose(x, place.stated, rtol=SMALL, atol=0.0)]
        if len(pairs) < 2 or not all(x >= place.least and is_round(x) for place, x in pairs):
            continue
        stated = ", ".join(f"{place.stated:.6g}" for place, _ in pairs)
        explains = ", ".join(f"{x:.6g}" for _, x in pairs)
        names = [place.name.removeprefix(field).partition(" of ") for place, _ in pairs]
        components = listed([before.strip() for before, *_ in names if before])
        where = (
            f"{field} {components}".strip() + f" of {listed(list(dict.fromkeys(name for *_, name in names)))}"
        )
        unit = places[0].unit
        yield Cause(rank=3, kind="several", place=where, stated=stated, explains=explains, unit=unit)


def is_round(x: float) -> bool:
    """Whether a number has few digits, as people write them, the fewer the less exact it is."""
    rounded = {float(f"{x:.{digits}g}"): exact for digits, exact in DIGITS.items()}
    return any(abs(x - near) <= exact * abs(x) or abs(x) < exact for near, exact in rounded.items())
