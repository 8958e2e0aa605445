"""Several inertial numbers at once, in which Mbar and h are linear: one regression for each group of them."""

from collections.abc import Iterator

import numpy as np
from numpy import ndarray

from ..core.cause import Cause
from ..core.words import listed
from ..robots.coordinates import point_inertia
from .fit import Search
from .model import Equations, Path
from .places import INERTIA, SMALL

DIGITS = {5: 1e-9, 3: 1e-5}  # and how exact a number with that count of digits is, a share
RANK = 1e-9  # of the largest singular value
ZERO = 1e-5  # m, or m2: what is no length of a load
LEAST_LOAD = 1e-6  # of the heaviest body
OF_BODY = 10  # mass, its product with the CoM, tensor about the origin of the frame


def body_columns(equations: Equations) -> ndarray:
    """What a unit of each of the ten numbers of each body adds to the values, (bodies, 10, states, entries)."""
    changes: dict[Path, ndarray] = {}
    stated, bodies = equations.stated, len(equations.tree.mass)
    for b in range(bodies):
        m, c, I = stated["mass"][b], stated["com"][b], stated["inertia"][b]
        about_origin = I + point_inertia(c, m)
        for k in range(1 + OF_BODY):  # first the base: the mass is larger by 1, and the others stay
            first, tensor = m * c, about_origin.copy()
            if 1 <= k <= 3:
                first = first + np.eye(3)[k - 1]
            elif k >= 4 and k < 10:
                _, i, j = INERTIA[k - 4]
                tensor[i, j] += 1.0
                tensor[j, i] = tensor[i, j]
            mass = m + (k < OF_BODY)
            com = first / mass if mass else 0.0 * c
            new = {"mass": mass - m, "com": com - c, "inertia": tensor - point_inertia(com, mass) - I}
            for field, change in new.items():
                for at, x in np.ndenumerate(change):
                    path = Path(field, (b, *at))
                    changes.setdefault(path, np.zeros(bodies * (1 + OF_BODY)))[b * (1 + OF_BODY) + k] = x
    values = equations.values(changes).reshape(bodies, 1 + OF_BODY, *equations.right.shape)
    columns = values[:, :OF_BODY] - values[:, :1]
    columns[:, 0] = values[:, 0] - equations.right
    return columns


def fit(search: Search, columns: ndarray) -> tuple[ndarray, ndarray] | None:
    """Coefficients of columns (n, states, entries) that explain what is given, and which are determined; None: none do."""
    A = (columns * search.weight).reshape(len(columns), -1).T
    sizes = np.linalg.norm(A, axis=0)
    active = sizes > 0.0
    if not active.any():
        return None
    U, s, Vt = np.linalg.svd(A[:, active] / sizes[active], full_matrices=False)
    rank = s > RANK * s[0]
    x = np.zeros(len(columns))
    x[active] = (Vt[rank].T @ ((U[:, rank].T @ search.off.ravel()) / s[rank])) / sizes[active]
    left = search.off.ravel() - A @ x
    for _ in range(2):  # refined: the columns have sizes far apart
        x[active] += (Vt[rank].T @ ((U[:, rank].T @ left) / s[rank])) / sizes[active]
        left = search.off.ravel() - A @ x
    determined = np.zeros(len(columns), bool)
    determined[active] = np.linalg.norm(Vt[rank], axis=0) > 1.0 - 1e-6
    return (x, determined) if np.abs(left).max() <= 1.0 else None


def loads(equations: Equations, search: Search) -> Iterator[Cause]:
    """A further body that moves with one of the bodies: its mass, CoM and tensor."""
    for body, columns in zip(equations.tree.body_names, body_columns(equations)):
        found = fit(search, columns)
        if found is None or not found[1][:4].all() or found[0][0] <= LEAST_LOAD * max(equations.tree.mass):
            continue
        (mass, *rest), (_, *determined) = found
        com = np.array(rest[:3]) / mass
        tensor = np.zeros((3, 3))
        for (_, i, j), x in zip(INERTIA, rest[3:]):
            tensor[i, j] = tensor[j, i] = x
        tensor = tensor - point_inertia(com, mass)
        where = ", ".join(f"{x:.5g}" for x in np.where(np.abs(com) < ZERO, 0.0, com))
        explains = f"{mass:.5g} kg, CoM ({where}) m"
        if all(determined[3:]):
            of_tensor = {name: tensor[i, j] for name, i, j in INERTIA if abs(tensor[i, j]) > ZERO * mass}
            if np.linalg.eigvalsh(tensor)[0] < -ZERO * mass:
                continue
            explains += "".join(f", {name} {x:.4g}" for name, x in of_tensor.items()) + " kg m2" * bool(
                of_tensor
            )
        if not all(map(is_round, (mass, *com))):
            continue
        yield Cause(rank=3, kind="load", place=f"a load on {body}", stated="", explains=explains)


def several(equations: Equations, search: Search) -> Iterator[Cause]:
    """The same number of all joints or bodies: armatures, masses, moments of inertia."""
    groups = ["armature of ", "mass of ", *(f"inertia of {body}" for body in equations.tree.body_names)]
    first = search.coefficients[0]
    for prefix in groups:
        chosen = [
            k for k, place in enumerate(search.places) if of_group(place.name, prefix) and first[k].any()
        ]
        if len(chosen) < 2:
            continue
        found = fit(search, first[chosen])
        if found is None:
            continue
        places = [search.places[k] for k in chosen]
        changes = [x * place.size for x, place in zip(found[0], places)]
        if all(place.is_possible(change) for place, change in zip(places, changes)):
            pairs = [(place.stated, place.value(change)) for place, change in zip(places, changes)]
            differing = [pair for pair in pairs if abs(pair[1] - pair[0]) > SMALL * max(map(abs, pair))]
            if len(differing) < 2 or not all(is_round(value) for _, value in differing):
                continue
            texts = [", ".join(f"{pair[k]:.6g}" for pair in differing) for k in (0, 1)]
            names = [
                place.name.removeprefix(prefix) for place, pair in zip(places, pairs) if pair in differing
            ]
            if prefix.startswith("inertia"):
                names = [name.removesuffix(prefix.removeprefix("inertia")) for name in names]
                called = f"inertia {listed([name.removeprefix('inertia ') for name in names])}{prefix.removeprefix('inertia')}"
            else:
                called = prefix + listed(names)
            yield Cause(
                rank=3, kind="several", place=called, stated=texts[0], explains=texts[1], unit=places[0].unit
            )


def is_round(x: float) -> bool:
    """Whether a number has few digits, as people write them, the fewer the less exact it is."""
    return any(
        abs(x - float(f"{x:.{digits}g}")) <= exact * abs(x) or abs(x) < exact
        for digits, exact in DIGITS.items()
    )


def of_group(name: str, prefix: str) -> bool:
    """Whether the name of a place is that of a single number of a group."""
    if prefix.startswith("inertia"):
        return name.startswith("inertia ") and name.endswith(prefix.removeprefix("inertia"))
    return name.startswith(prefix) and " and " not in name and " in " not in name and "*" not in name
