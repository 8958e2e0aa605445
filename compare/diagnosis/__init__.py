"""Why two sets of equations of motion differ, in the words of the derivation.

The right equations are those of a tree, by the TMT method; the others are known by their values alone, at some states. Causes
have ranks: 1 an option or a convention of a joint (order, sense, zero, unit); 2 one number, one term or one coefficient; 3 two
of them. The search ends after the first rank in which something explains the values down to their tolerance, and lists all
that does: they cannot be told apart.
"""

import time
from collections.abc import Callable, Iterable, Sequence
from functools import cache

import numpy as np

import tmt

from ..judge.scale import EPS, FACTOR
from ..robots.coordinates import Coordinates
from .compared import Compared
from .finding import LEAST_STATES, Diagnosis
from .fit import Fitted, OutOfTime, Search, nearest_changes
from .model import Equations, packing
from .places import EVERY_BODY, Place, all_places, entry_name
from .possible import is_possible, is_telling
from .slips import IN_MASS_ALONE, slips
from .variants import Variant, both, conventions, program_options, values_of
from .words import Cause, of_fitted, of_variant

STATES_ASKED = 24
FEW = 2  # states at which many conventions are tried first
NEAR = 0.5  # of the difference: a convention with a number beside it that leaves more is not looked at
KEPT = 12  # explanations that are kept though they do not explain
PROMISING = 6  # states at which it is estimated what a number beside a convention can do
MOST_PAIRS = 6  # of numbers that explain: where more do, two numbers fit whatever differs
OF_NO_BODY = ", though no rigid body has this beside its other two moments of inertia"
BESIDE = 4  # conventions beside which a number is fitted


def packed(mass_matrix: np.ndarray | None, bias: np.ndarray | None, nv: int, states: int) -> np.ndarray:
    """Values as `Equations` has them, (states, entries); NaN where a quantity is not given."""
    i, j = np.tril_indices(nv)
    M = np.full((states, len(i)), np.nan) if mass_matrix is None else np.asarray(mass_matrix)[:, i, j]
    h = np.full((states, nv), np.nan) if bias is None else np.asarray(bias)
    return np.concatenate([M, h], axis=1)


def diagnose(
    tree: tmt.Tree,
    names: Sequence[str],
    q: np.ndarray,
    qd: np.ndarray,
    given: np.ndarray,
    tolerance: np.ndarray,
    seconds: float = np.inf,
    bias: Callable | None = None,
) -> Diagnosis:
    """What explains given values that differ from those of a tree's equations.

    names: of the joints. q: (states, nq), qd: (states, nv). given, tolerance: (states, entries), see `packed`. seconds: for the
    search of numbers, terms and pairs. bias: the given h at the same q and other speeds, (states, nv) -> (states, nv), if it can
    be asked.
    """
    with np.errstate(all="ignore"):  # of values that are no numbers, or beyond the largest
        return explanation(tree, tuple(names), q, qd, given, tolerance, seconds, bias)


def explanation(
    tree: tmt.Tree,
    names: tuple[str, ...],
    q: np.ndarray,
    qd: np.ndarray,
    given: np.ndarray,
    tolerance: np.ndarray,
    seconds: float,
    bias: Callable | None,
) -> Diagnosis:
    """What `diagnose` says."""
    equations, end = Equations(tree, q, qd), time.monotonic() + seconds
    rounded = np.fmax(tolerance, FACTOR * EPS * np.abs(given))  # large values are rounded too
    tolerance = np.where(tolerance > 0.0, rounded, 0.0)
    places = all_places(equations)
    if not np.isfinite(given).any(axis=0).all():  # M or h alone
        places = [place for place in places if place.entry != slice(None)]
    search = Search(equations, places, given, tolerance, end)
    if not search.differs:
        return Diagnosis(False)
    differing = np.abs(search.off).max(axis=0) > 1.0
    about = {
        "entries": tuple(entry_name(entry, equations.names) for entry, off in zip(equations.entries, differing) if off),
        "compared": int(search.known.any(axis=0).sum()),
        "states": (int((np.abs(search.off).max(axis=1) > 1.0).sum()), len(q)),
    }
    if len(np.unique(q, axis=0)) < LEAST_STATES:
        return Diagnosis(True, too_few=len(q), **about)
    singles, searched = [], ""
    try:
        singles = search.singles()
    except OutOfTime:
        searched = f"in {seconds:g} s options and conventions of joints, no numbers"
    fitted = [one for one in singles if one.ratio <= 1.0 and is_possible(one, search, of_body=False)]
    compared = cache(lambda: Compared(equations, given, tolerance, bias))
    if sum(differing) == 1:  # the entry itself is the plainest
        fitted.sort(key=lambda one: one.places[0].kind != "coefficient")
    nearest = sorted(singles, key=lambda one: one.left)[:KEPT]
    about["nearest"] = tuple((one.places[0].name, one.left) for one in nearest)
    try:
        for found in ranks(search, names, fitted, not searched, compared):
            causes = list(found)
            if causes:
                causes = tuple(cause._replace(tied=len(causes) - 1) for cause in causes)
                return Diagnosis(True, causes, is_small=compared().is_small, **about)
    except OutOfTime:
        searched = searched or f"in {seconds:g} s not everything was tried"
    left = min([one.left for one in (*singles, *search.pair_fits)], default=1.0)
    apart = np.abs(search.off[search.known]).max() * EPS * FACTOR
    about |= {"is_small": compared().is_small, "details": compared().in_words, "searched": searched}
    return Diagnosis(True, (), left, float(-np.log10(apart)), **about)


def ranks(
    search: Search, names: tuple[str, ...], singles: Sequence[Fitted], pairs: bool, compared: Callable[[], Compared]
) -> Iterable[Iterable[Cause]]:
    """The explanations of each rank, found when they are asked for; pairs: whether there is time for the last.

    Where the joints may be otherwise all that explains as much beside them is listed too: who states the joints so, and has a
    wrong number, agrees with a wrong model.
    """
    equations = search.equations
    coordinates = Coordinates(names, equations.tree.kind)
    of_joints = list(conventions(equations, names))
    explaining = explained(search, program_options(equations)) + explained_by_joints(search, of_joints)
    first = [of_variant(variant, left) for variant, left in explaining]
    first += [of_fitted(one, 1, coordinates) for one in singles if one.places[0].rank == 1]
    if not all(cause.joints for cause in first):
        yield first
    numbers = [one for one in singles if one.places[0].rank == 2]
    possible = [one for one in numbers if is_possible(one, search)]
    second = [of_fitted(one, 2, coordinates) for one in possible]
    of_derivation = plainest(explained(search, slips(equations), bounded=not first))
    second += [of_variant(variant, left) for variant, left in of_derivation]
    if not second and (cause := compared().cause(1)):
        second = [cause]
    if not first and not second:  # a slip in a number need not leave a rigid body
        second = [of_fitted(one, 2, coordinates) for one in numbers]
        second = [cause._replace(what=cause.what + OF_NO_BODY) for cause in second]
    yield first + second
    if not pairs:
        return
    both_ways = both(equations, names, search.given, search.weight)
    found = [of_variant(variant, left) for variant, left in explained(search, both_ways)]
    of_numbers = [one for one in search.pairs() if one.ratio <= 1.0 and is_telling(one) and is_possible(one, search)]
    if len(of_numbers) <= MOST_PAIRS:
        found += [of_fitted(one, 3, coordinates) for one in of_numbers]
    if cause := compared().cause(2):
        found.append(cause)
    simple = [variant for variant in (*program_options(equations), *of_joints) if variant.is_simple]
    try:
        found += beside(search, simple, coordinates)
    except OutOfTime:
        if not found:
            raise
    yield found


def explained(search: Search, variants: Iterable[Variant], bounded: bool = False) -> list[tuple[Variant, float]]:
    """The variants that leave nothing, and the share that they leave. bounded: within the time of the search."""
    found = []
    for variant in variants:
        if bounded and time.monotonic() > search.end:
            raise OutOfTime
        left = search.weighted(variant.equations().values()[0])
        if np.abs(left).max() <= 1.0:
            found.append((variant, float(np.linalg.norm(left)) / search.size))
    return found


def plainest(found: list[tuple[Variant, float]]) -> list[tuple[Variant, float]]:
    """Without those of every body, or of M alone, where the same slip of one body, or everywhere, does the same."""
    named = {variant.name for variant, _ in found}

    def is_said(name: str) -> bool:
        before, of_all, after = name.partition(EVERY_BODY)
        alone = any(other.startswith(before) and other.endswith(after) for other in named - {name}) if of_all else False
        return alone or name.removesuffix(IN_MASS_ALONE) in named - {name}

    return [(variant, left) for variant, left in found if not is_said(variant.name)]


def explained_by_joints(search: Search, variants: Sequence[Variant]) -> list[tuple[Variant, float]]:
    """The same of conventions of the joints, which may be many: at a few states first."""
    few = min(FEW, len(search.given))
    if not variants:
        return []
    known, weight = search.known[:few], search.weight[:few]
    given = np.where(known, search.given[:few], 0.0)
    all_values = values_of(search.equations, [variant.joints for variant in variants], few)
    near = [
        variant
        for variant, values in zip(variants, all_values)
        if np.abs(np.where(known, given - values, 0.0) * weight).max() <= 1.0
    ]
    return explained(search, near)


def beside(search: Search, variants: Sequence[Variant], coordinates: Coordinates) -> list[Cause]:
    """One option or convention together with one number or term, of the few that promise most."""
    here = [place for place in search.places if place.column is None]
    found = []
    for left, _, variant in sorted(promises(search, variants, here), key=lambda one: one[:2])[:BESIDE]:
        if left < NEAR:
            other = Search(variant.equations(), here, search.given, search.tolerance, search.end)
            explaining = [
                one for one in other.singles() if one.ratio <= 1.0 and is_telling(one) and is_possible(one, search)
            ]
            found += [of_fitted(one, 3, coordinates, variant) for one in explaining]
    return found


def promises(search: Search, variants: Sequence[Variant], here: Sequence[Place]) -> list[tuple[float, int, Variant]]:
    """The share that a variant with one of these places beside it leaves at few states, about, and its number.

    Variants of the joints are evaluated together, as states.
    """
    of_joints, of_options = ([v for v in variants if bool(v.joints) is joined] for joined in (True, False))
    equations, few = search.equations, min(PROMISING, len(search.given))
    size = np.array([[place.size] for place in here])
    which = np.arange(len(here))[:, None]
    known, weight = search.known[:few], search.weight[:few]
    given = np.where(known, search.given[:few], 0.0)

    def promise(up, right, down, given, weight) -> float:
        off = (given - right) * weight
        near = nearest_changes((up - down) / 2.0 * weight, ((up + down) / 2.0 - right) * weight, off)
        total = np.linalg.norm(search.off[: len(given)])
        return min((left for left, _ in near), default=0.0) / total if total else 0.0

    found = []
    for variant in of_options:  # which may change more than the values at states
        other = Search(variant.equations(), here, search.given, search.tolerance, search.end)
        up, down = (other.values(which, sign * size) for sign in (1.0, -1.0))
        whole = np.where(search.known, search.given, 0.0), search.weight
        found.append((promise(up, other.right, down, *whole), len(found), variant))
    if not of_joints:
        return found
    q, qd = equations.q[:few], equations.qd[:few]
    states = [
        np.concatenate(part) for part in zip(*((m.positions(q), m.speeds(qd)) for m in (v.joints for v in of_joints)))
    ]
    together = Equations(equations.tree, *states)
    blank = np.zeros((len(states[0]), len(equations.entries)))
    inner = Search(together, here, blank, blank + 1.0, search.end)
    up, down = (inner.values(which, sign * size) for sign in (1.0, -1.0))
    for k, variant in enumerate(of_joints):
        part, (index, sense) = slice(k * few, (k + 1) * few), packing(variant.joints, equations)
        values = [one[..., part, :][..., index] * sense for one in (up, inner.right, down)]
        found.append((promise(*values, given, weight), len(found), variant))
    return found
