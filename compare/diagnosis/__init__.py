"""Why two sets of equations of motion differ, in the words of the derivation.

The right equations are those of a tree, by the TMT method; the others are known by their values alone, at some states. Causes
have ranks: 1 an option or a convention of a joint (order, sense, zero, unit); 2 one number, one term or one coefficient; 3 two
of them. The search ends after the first rank in which something explains the values down to their tolerance, and lists all
that does: they cannot be told apart.
"""

import time
from collections.abc import Iterable, Sequence

import numpy as np

import tmt

from ..judge.scale import EPS, FACTOR
from .finding import LEAST_STATES, Diagnosis
from .fit import Fitted, OutOfTime, Search, nearest_changes
from .model import Equations, packing
from .places import Place, all_places
from .slips import slips
from .variants import Variant, both, conventions, program_options, values_of
from .words import Cause, is_possible, of_fitted, of_variant

STATES_ASKED = 24
FEW = 2  # states at which many conventions are tried first
NEAR = 0.5  # of the difference: a convention with a number beside it that leaves more is not looked at
KEPT = 12  # explanations that are kept though they do not explain
PROMISING = 6  # states at which it is estimated what a number beside a convention can do
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
) -> Diagnosis:
    """What explains given values that differ from those of a tree's equations.

    names: of the joints. q: (states, nq), qd: (states, nv). given, tolerance: (states, entries), see `packed`. seconds: for the
    search of numbers, terms and pairs.
    """
    with np.errstate(all="ignore"):  # of values that are no numbers, or beyond the largest
        return explanation(tree, tuple(names), q, qd, given, tolerance, seconds)


def explanation(
    tree: tmt.Tree,
    names: tuple[str, ...],
    q: np.ndarray,
    qd: np.ndarray,
    given: np.ndarray,
    tolerance: np.ndarray,
    seconds: float,
) -> Diagnosis:
    """What `diagnose` says."""
    equations, end = Equations(tree, q, qd), time.monotonic() + seconds
    rounded = np.fmax(tolerance, FACTOR * EPS * np.abs(given))  # large values are rounded too
    tolerance = np.where(tolerance > 0.0, rounded, 0.0)
    search = Search(equations, all_places(equations), given, tolerance, end)
    if not search.differs:
        return Diagnosis(False)
    differing = np.abs(search.off).max(axis=0) > 1.0
    about = {
        "entries": tuple(entry_name(entry) for entry, off in zip(equations.entries, differing) if off),
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
    fitted = [one for one in singles if one.ratio <= 1.0]
    fitted = [one for one in fitted if is_possible(one)] or fitted
    if sum(differing) == 1:  # the entry itself is the plainest
        fitted.sort(key=lambda one: one.places[0].kind != "coefficient")
    nearest = sorted(singles, key=lambda one: one.left)[:KEPT]
    about["nearest"] = tuple((one.places[0].name, one.left) for one in nearest)
    try:
        for found in ranks(search, names, fitted, not searched):
            causes = list(found)
            if causes:
                return Diagnosis(True, tuple(cause._replace(tied=len(causes) - 1) for cause in causes), **about)
    except OutOfTime:
        searched = searched or f"in {seconds:g} s not everything was tried"
    left = min([one.left for one in (*singles, *search.pair_fits)], default=1.0)
    apart = np.abs(search.off[search.known]).max() * EPS * FACTOR
    return Diagnosis(True, (), left, float(-np.log10(apart)), searched=searched, **about)


def entry_name(entry: tuple) -> str:
    """An entry of Mbar or h, "M[0][1]": of Mbar the one above the diagonal stands for both."""
    kind, *indices = entry
    return kind + "".join(f"[{i}]" for i in sorted(indices))


def ranks(search: Search, names: tuple[str, ...], singles: Sequence[Fitted], pairs: bool) -> Iterable[Iterable[Cause]]:
    """The explanations of each rank, found when they are asked for; pairs: whether there is time for the last."""
    equations = search.equations
    of_joints = list(conventions(equations, names))
    explaining = explained(search, program_options(equations)) + explained_by_joints(search, of_joints)
    yield [
        *(of_variant(variant, left) for variant, left in explaining),
        *(of_fitted(one, 1) for one in singles if one.places[0].rank == 1),
    ]
    yield [
        *(of_fitted(one, 2) for one in singles if one.places[0].rank == 2),
        *(of_variant(variant, left) for variant, left in explained(search, slips(equations), bounded=True)),
    ]
    if not pairs:
        return
    both_ways = both(equations, names, search.given, search.weight)
    found = [of_variant(variant, left) for variant, left in explained(search, both_ways)]
    found += [of_fitted(one, 3) for one in search.pairs() if one.ratio <= 1.0]
    simple = [variant for variant in (*program_options(equations), *of_joints) if variant.is_simple]
    try:
        found += beside(search, simple)
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


def beside(search: Search, variants: Sequence[Variant]) -> list[Cause]:
    """One option or convention together with one number or term, of the few that promise most."""
    here = [place for place in search.places if place.column is None]
    found = []
    for left, _, variant in sorted(promises(search, variants, here), key=lambda one: one[:2])[:BESIDE]:
        if left < NEAR:
            other = Search(variant.equations(), here, search.given, search.tolerance, search.end)
            found += [of_fitted(one, 3, variant) for one in other.singles() if one.ratio <= 1.0]
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
