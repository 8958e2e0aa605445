"""Several numbers at once, by regression: the ten inertial numbers of a body, in which Mbar and h are linear; the
same number of all joints or bodies; the three components of an offset or a CoM. One number in values with
noise, as of a log, with its uncertainty.
"""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy import ndarray

from tmt import Tree

from ..core.cause import Cause
from ..core.words import listed
from ..robots.coordinates import point_inertia
from .fit import Family, Search, nearest_change
from .given import Given
from .hypothesis import SMALL, Hypothesis, is_round, is_written, of_number
from .kinds.edits import angles_of
from .kinds.numbers import INERTIA, numbers
from .kinds.terms import coefficients, squares_of_velocities, terms
from .layout import Values
from .model import Equations

RANK = 1e-9  # of the largest singular value
ZERO = 1e-5  # m, or m2: what is no length of a load
SEVERAL, TURNED = 0.5, 0.2  # costs
OF_BODY, VECTORS = ("mass", "com", "inertia"), ("com", "offset")  # fields


def several(equations: Equations, family: Family, search: Search) -> Iterator[Cause]:
    """Causes of several numbers; family: the numbers of the model."""
    groups: dict[tuple[str, int], list[int]] = {}
    for k, one in enumerate(family.hypotheses):
        field, at = one.moves[0][0].field, one.moves[0][0].at
        keys = [("body", at[0])] * (field in OF_BODY) + [(field, at[0])] * (field in VECTORS)
        keys += [(field, -1)] * (field in ("mass", "armature"))
        for key in keys if len({(path.field, path.at[:1]) for path, _ in one.moves}) == 1 else ():
            groups.setdefault(key, []).append(k)
    vectors = [chosen for (field, _), chosen in groups.items() if field in VECTORS]
    sets = [tuple(family.hypotheses[k] for k in chosen) for chosen in vectors]
    for fit in search.fitted(sets, np.zeros((len(sets), 3))):
        yield from as_cause(equations, fit.hypotheses, fit.changes) if fit.explains else ()
    for (field, owner), chosen in groups.items():
        those, columns = [family.hypotheses[k] for k in chosen], family.first[chosen]
        added, determined = regressed(search, columns) if field not in VECTORS else (0.0, np.zeros(1, bool))
        if field == "body":  # first with the mass and the CoM as stated
            of_tensor, is_known = regressed(search, columns[4:])
            if is_known.all():
                added, determined = np.append(np.zeros(4), of_tensor), np.ones(len(those), bool)
        added = added * np.array([one.size for one in those])
        active = np.abs(columns).max(axis=(1, 2)) > 0.0
        if field == "body" and determined[active].any():
            yield from of_body(equations, owner, those, added, determined, active)
        elif determined.any():
            yield from as_cause(equations, those, added)


def regressed(search: Search, columns: ndarray) -> tuple[ndarray, ndarray]:
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


def of_body(
    equations: Equations, b: int, those: Sequence[Hypothesis], added: ndarray, determined: ndarray,
    active: ndarray,
) -> Iterator[Cause]:  # fmt: skip
    """The numbers of a body that differ, or a load on it: a further body that moves with it.

    added: to first order, from which the moments of the mass follow: m, m c and I + m (c'c 1 - c c').
    """
    stated, moved = equations.stated, {"mass": np.zeros(()), "com": np.zeros(3), "inertia": np.zeros((3, 3))}
    for one, change in zip(those, added):
        for path, coefficient in one.moves:
            moved[path.field][path.at[1:]] += coefficient * change
    m, c, I = float(stated["mass"][b]), stated["com"][b], stated["inertia"][b]
    mass, first, dc = float(moved["mass"]), float(moved["mass"]) * c + m * moved["com"], moved["com"]
    second = point_inertia(c, mass) + moved["inertia"]  # as of a load about the origin
    second = second + point_inertia(c + dc, m) - point_inertia(c, m) - point_inertia(dc, m)
    if m + mass <= 0.0:
        return
    (origin, axes), is_known = equations.frame_of(b), bool(determined[4:].all())
    is_tensor = is_known and abs(mass) < ZERO and np.abs(first).max() < ZERO
    if is_tensor and (turned := turned_of(equations, b, I + second)):
        yield turned
        return
    if determined[:4].all() and mass > SMALL * max(equations.tree.mass):
        place = axes.T @ (first / mass - origin)
        tensor = axes.T @ (second - point_inertia(first / mass, mass)) @ axes
        is_body = not is_known or np.linalg.eigvalsh(tensor)[0] >= -ZERO * mass
        if is_body and all(map(is_round, (mass, *place))):
            where = ", ".join(f"{x:.5g}" for x in np.where(np.abs(place) < ZERO, 0.0, place))
            moments = [(name, tensor[i, j]) for name, i, j in INERTIA if abs(tensor[i, j]) > ZERO * mass]
            shown = [f", {name} {x:.4g}" for name, x in moments if is_known]
            explains = f"{mass:.5g} kg, CoM ({where}) m{''.join(shown)}{' kg m2' * bool(shown)}"
            on = f"a load on {equations.tree.body_names[b]}"
            yield Cause(rank=3, kind="numbers", place=on, stated="", explains=explains, cost=SEVERAL)
            return
    if determined[active].all():
        com = (m * c + first) / (m + mass)
        tensor = axes.T @ (I + point_inertia(c, m) + second - point_inertia(com, m + mass)) @ axes
        values = [m + mass, *(axes.T @ (com - origin)), *(tensor[i, j] for _, i, j in INERTIA)]
        changes = [x - float(one.cause.stated) for one, x in zip(those, values)]
        yield from as_cause(equations, those, np.where(active, changes, 0.0))


def turned_of(equations: Equations, b: int, tensor: ndarray) -> Cause | None:
    """The tensor of a body about other axes, with the same principal moments: an inertial frame turned."""
    axes, stated = equations.frame_of(b).axes, equations.stated["inertia"][b]
    (right, before), (moments, after) = (np.linalg.eigh(axes.T @ I @ axes) for I in (stated, tensor))
    if np.abs(moments - right).max() > SMALL * right[-1] or np.diff(right).min() <= ZERO * right[-1]:
        return None
    before, after = (vectors * [np.linalg.det(vectors), 1.0, 1.0] for vectors in (before, after))
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
            return Cause(rank=2, kind="numbers", place=place, stated="", explains=explains, cost=TURNED)
    return None


def as_cause(
    equations: Equations, those: Sequence[Hypothesis], changes: Sequence[float] | ndarray
) -> Iterator[Cause]:
    """Several numbers as one cause, if there are several and each is one that people write."""
    sizes: dict[str, float] = {}  # of the numbers with one unit
    for one, x in zip(those, changes):
        size, unit = max(abs(float(one.cause.stated)), abs(one.value(x))), one.cause.unit
        sizes[unit] = max(sizes.get(unit, 0.0), size)
    acting = [(one, x) for one, x in zip(those, changes) if abs(x) > SMALL * sizes[one.cause.unit]]
    causes, values = [one.cause for one, _ in acting], [one.value(x) for one, x in acting]
    right = [float(cause.stated) for cause in causes]
    are_possible = all(one.is_possible(x) for one, x in zip(those, changes))
    if len(acting) < 2 or not (are_possible and all(map(is_written, values, right))):
        return
    names = [cause.place.partition(" of ") for cause in causes]
    place = f"{names[0][0]} of {listed([owner for *_, owner in names])}"
    if len({owner for *_, owner in names}) == 1:
        place = f"{listed(merged([name for name, *_ in names]))} of {names[0][2]}"
    units = [cause.unit for cause in causes]
    common = units[0] if len({*units}) == 1 else ""
    stated, explains = (
        ", ".join(f"{x:.6g} {'' if common else unit}".strip() for x, unit in zip(numbers, units))
        for numbers in (right, values)
    )
    cost = SEVERAL + float(np.mean([of_number(*pair, equations) for pair in zip(values, right)]))
    about: dict[str, Any] = {"stated": stated, "explains": explains, "unit": common, "cost": cost}
    yield Cause(rank=3, kind="several", place=place, **about)


def merged(names: list[str]) -> list[str]:
    """Names that begin alike as one: "CoM x", "CoM z" as "CoM x", "z"."""
    firsts = [name.rpartition(" ")[0] for name in names]
    alike = [first and first == before for first, before in zip(firsts, ["", *firsts])]
    return [name.rpartition(" ")[2] if is_alike else name for name, is_alike in zip(names, alike)]


# one number beside noise


MOST_NOISE = 0.02  # of the values: what is larger is no noise
MOST_OFF = 0.8  # of the states, at which each entry has noise
LEAST_NUMBERS = 50
WHITE = 6.0  # standard deviations: what of a place the noise may have
LARGE = 20.0  # standard deviations: a change that is told


class Noisy(NamedTuple):
    """What least squares find: noise, and the cause if one number is wrong."""

    noise: float  # of the values, a share
    cause: Cause | None = None  # without its number
    value: float = 0.0
    deviation: float = 0.0  # its standard deviation

    @property
    def digits(self) -> int:
        """Of the value, as many as its deviation leaves."""
        digits = np.ceil(np.log10(abs(self.value / self.deviation))) + 1 if self.value else 1
        return int(np.clip(digits, 1 + bool(self.value), 12))


def through_noise(tree: Tree, values: Values, qdd: ndarray | None = None) -> Noisy | None:
    """The number that is wrong beside noise, or noise alone; None where something else is left over."""
    given = Given(tree, values, None, qdd=qdd)
    equations = given.equations
    search = Search(equations.values, given.packed, given.tolerance)
    kinds = numbers, terms, coefficients, squares_of_velocities
    family = search.expanded([one for kind in kinds for one in kind(equations)])
    first, second = family.first * search.weight, family.second * search.weight
    count, off = int(search.known.sum()), search.off
    of_values = given.packed if qdd is None else np.einsum("sij,sj->si", equations.parts[0], qdd)
    entries = search.known.any(axis=0) & search.right.any(axis=0)
    size = np.linalg.norm(of_values[search.known])
    if count < LEAST_NUMBERS or not np.isfinite(off).all():
        return None

    def noise_of(left: ndarray) -> float | None:
        """The share of noise in the values, if all that is left is that: no place explains a part of it."""
        lengths = np.linalg.norm(first.reshape(len(first), -1), axis=1)
        part = np.abs(np.einsum("kse,se->k", first, left)) / np.where(lengths > 0.0, lengths, 1.0)
        share = float(np.linalg.norm(left * search.tolerance) / size)
        is_everywhere = (np.abs(left)[:, entries] > 1.0).mean(axis=0).min(initial=1.0) > MOST_OFF
        is_white = (part <= WHITE * np.linalg.norm(left) / np.sqrt(count)).all()
        return share if is_everywhere and is_white and share <= MOST_NOISE else None

    alone = noise_of(off)
    if alone is not None:
        return Noisy(alone)
    chosen = [k for k, one in enumerate(family.hypotheses) if one.cause.kind == "number" and one.is_quadratic]
    left_over, x, k = min((*nearest_change(first[k], second[k], off), k) for k in chosen)
    slope, place = first[k] + 2.0 * x * second[k], family.hypotheses[k]
    noise = noise_of(off - x * first[k] - x * x * second[k])
    deviation = left_over / np.sqrt(count - 1) / np.linalg.norm(slope)
    if noise is None or abs(x) <= LARGE * deviation or not place.is_possible(x * place.size):
        return None
    return Noisy(noise, place.cause, place.value(x * place.size), float(deviation * place.size))
