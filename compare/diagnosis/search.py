"""The search for causes, rank by rank, of given values of Mbar and h."""

import time
from collections.abc import Callable, Iterable, Sequence
from functools import cache

import numpy as np

import tmt

from ..judge.scale import EPS, FACTOR
from ..robots.coordinates import Coordinates
from .cause import (
    CLOSE,
    FACTORS,
    LEAST_STATES,
    Cause,
    Change,
    Diagnosis,
    cause_of,
    place_changed,
    tied,
    value_of,
    with_zeros,
)
from .coefficients import Compared
from .fit import Fitted, OutOfTime, Search, nearest_changes
from .model import BODY_TERMS, Equations, Path, packing
from .places import EVERY_BODY, Place, all_places, entry_name
from .slips import IN_MASS_ALONE, slips
from .variants import Variant, both, conventions, program_options, values_of

FEW = 2  # states at which many conventions are tried first
NEAR = 0.5  # of the difference: a convention that leaves more together with a number is not searched
KEPT = 12  # explanations that are kept though they do not explain
ROUNDED_INERTIA = 1e-9  # of an inertia, that the digits of a fit may take from it
PROMISING = 6  # states at which it is estimated what a number together with a convention can do
MOST_PAIRS = 6  # of numbers that explain: where more do, two numbers fit whatever differs
MOST_VARIANTS = 4  # with which a number is fitted


def diagnose(
    tree: tmt.Tree,
    q: np.ndarray,
    qd: np.ndarray,
    given: np.ndarray,
    tolerance: np.ndarray,
    seconds: float = np.inf,
    bias: Callable | None = None,
) -> Diagnosis:
    """What explains given values that differ from those of a tree's equations.

    q: (states, nq), qd: (states, nv). given, tolerance: (states, entries), see `packed`; NaN where nothing is given. seconds: for
    the search of numbers, terms and pairs. bias: the given h at the same q and other speeds, (states, nv) -> (states, nv), if
    there is a function.
    """
    with np.errstate(all="ignore"):  # values may be no numbers, or beyond the largest
        return diagnosis(Equations(tree, q, qd), given, tolerance, seconds, bias)


def diagnosis(equations: Equations, given, tolerance, seconds: float, bias: Callable | None) -> Diagnosis:
    rounded = np.fmax(tolerance, FACTOR * EPS * np.abs(given))  # large values are rounded too
    tolerance = np.where(tolerance > 0.0, rounded, 0.0)
    places = all_places(equations)
    if not np.isfinite(given).any(axis=0).all():  # M or h alone
        places = [place for place in places if place.entry != slice(None)]
    search = Search(equations, places, given, tolerance, time.monotonic() + seconds)
    if not search.differs:
        return Diagnosis(False)
    beyond = np.abs(search.off) > 1.0
    differing = beyond.any(axis=0)
    found = Diagnosis(
        True,
        entries=tuple(entry_name(entry, equations.names) for entry, off in zip(equations.entries, differing) if off),
        compared=int(search.known.any(axis=0).sum()),
        states=(int(beyond.any(axis=1).sum()), len(given)),
    )
    if len(np.unique(equations.q, axis=0)) < LEAST_STATES:
        return found._replace(too_few=len(given))
    singles, is_finished, numbers_searched = [], True, True
    try:
        singles = search.singles()
    except OutOfTime:
        is_finished = numbers_searched = False
    fitted = [one for one in singles if one.ratio <= 1.0 and is_possible(one, search, of_body=False)]
    compared = cache(lambda: Compared(equations, given, tolerance, bias))
    if sum(differing) == 1:  # the entry itself is the plainest
        fitted.sort(key=lambda one: one.places[0].kind != "coefficient")
    nearest = sorted(singles, key=lambda one: one.left)[:KEPT]
    found = found._replace(nearest=tuple((one.places[0].name, one.left) for one in nearest))
    try:
        for causes in ranks(search, fitted, numbers_searched, compared):
            if causes:
                return found._replace(causes=tied(causes), is_small=compared().is_small)
    except OutOfTime:
        is_finished = False
    left = min([one.left for one in (*singles, *search.pair_fits)], default=1.0)
    digits = float(-np.log10(np.abs(search.off[search.known]).max() * EPS * FACTOR))
    found = found._replace(left=left, digits=digits, is_small=compared().is_small, **compared().details())
    return found if is_finished else found._replace(seconds=seconds, numbers_searched=numbers_searched)


def ranks(
    search: Search, singles: Sequence[Fitted], pairs: bool, compared: Callable[[], Compared]
) -> Iterable[list[Cause]]:
    """The explanations of each rank, computed when the previous ranks are empty; pairs: whether there is time for the last.

    Where joints may be otherwise, numbers and terms that explain as much are listed too: whoever states the joints so, and has a
    wrong number, agrees with a wrong model.
    """
    equations = search.equations
    coordinates = Coordinates(equations.tree.hinge_names, equations.tree.kind)
    of_joints = list(conventions(equations))
    options = list(program_options(equations))
    first = [of_variant(*variant) for variant in explained(search, options) + explained_by_joints(search, of_joints)]
    first += [of_fitted(fit, 1, coordinates) for fit in singles if fit.places[0].rank == 1]
    if not all(cause.joints for cause in first):
        yield first
    numbers = [fit for fit in singles if fit.places[0].rank == 2]
    second = [of_fitted(fit, 2, coordinates) for fit in numbers if is_possible(fit, search)]
    second += [of_variant(*variant) for variant in plainest(explained(search, slips(equations), bounded=not first))]
    if not second and (cause := compared().cause(1)):
        second = [cause]
    if not first and not second:  # a slip in a number need not leave a rigid body
        second = [of_fitted(fit, 2, coordinates)._replace(of_no_body=True) for fit in numbers]
    yield first + second
    if not pairs:
        return
    third = [of_variant(*variant) for variant in explained(search, both(equations, search.given, search.weight))]
    of_numbers = [fit for fit in search.pairs() if fit.ratio <= 1.0 and is_telling(fit) and is_possible(fit, search)]
    if len(of_numbers) <= MOST_PAIRS:
        third += [of_fitted(fit, 3, coordinates) for fit in of_numbers]
    if cause := compared().cause(2):
        third.append(cause)
    try:
        simple = [variant for variant in (*options, *of_joints) if variant.is_simple]
        third += with_a_number(search, simple, coordinates)
    except OutOfTime:
        if not third:
            raise
    yield third


def change_of(variant: Variant) -> Change:
    """An option, a convention or a slip."""
    form = "slip" if variant.kind == "slip" and variant.explains == "yes" else "option"
    return Change(variant.kind, variant.name, variant.stated, variant.explains, form=form)


def of_variant(variant: Variant, left: float) -> Cause:
    return cause_of(variant.rank, [change_of(variant)], left, variant.joints)


def of_fitted(fitted: Fitted, rank: int, coordinates: Coordinates, variant: Variant | None = None) -> Cause:
    """A number, a term or a coefficient, or two of them; or one together with a variant."""
    changes = [change_of(variant)] if variant else []
    changes += [place_changed(place, change) for place, change in zip(fitted.places, fitted.changes)]
    joints = None
    if all(place.is_zero for place in fitted.places) and (variant is None or variant.joints):
        joints = with_zeros(fitted.places, fitted.changes, coordinates, variant and variant.joints)
    return cause_of(rank, changes, fitted.left, joints)


def explained(search: Search, variants: Iterable[Variant], bounded: bool = False) -> list[tuple[Variant, float]]:
    """The variants that leave nothing, and the share that they leave. bounded: within the time of the search."""
    explaining = []
    for variant in variants:
        if bounded and time.monotonic() > search.end:
            raise OutOfTime
        left = search.weighted(variant.equations().values()[0])
        if np.abs(left).max() <= 1.0:
            explaining.append((variant, float(np.linalg.norm(left)) / search.size))
    return explaining


def plainest(found: list[tuple[Variant, float]]) -> list[tuple[Variant, float]]:
    """Without those of every body, or of M alone, where the same slip of one body, or everywhere, does the same."""
    names = {variant.name for variant, _ in found}

    def is_covered(name: str) -> bool:
        before, of_all, after = name.partition(EVERY_BODY)
        alone = bool(of_all) and any(one.startswith(before) and one.endswith(after) for one in names - {name})
        return alone or name.removesuffix(IN_MASS_ALONE) in names - {name}

    return [(variant, left) for variant, left in found if not is_covered(variant.name)]


def explained_by_joints(search: Search, variants: Sequence[Variant]) -> list[tuple[Variant, float]]:
    """The conventions of the joints that leave nothing. They may be many: a few states come first."""
    few = min(FEW, len(search.given))
    known, weight = search.known[:few], search.weight[:few]
    given = np.where(known, search.given[:few], 0.0)
    near = [
        variant
        for variant, values in zip(variants, values_of(search.equations, [one.joints for one in variants], few))
        if np.abs(np.where(known, given - values, 0.0) * weight).max() <= 1.0
    ]
    return explained(search, near)


def with_a_number(search: Search, variants: Sequence[Variant], coordinates: Coordinates) -> list[Cause]:
    """One option or convention together with one number or term, of the few with the smallest estimated remainder."""
    places = [place for place in search.places if place.column is None]
    causes = []
    for left, _, variant in sorted(promises(search, variants, places), key=lambda one: one[:2])[:MOST_VARIANTS]:
        if left < NEAR:
            inner = Search(variant.equations(), places, search.given, search.tolerance, search.end)
            causes += [
                of_fitted(one, 3, coordinates, variant)
                for one in inner.singles()
                if one.ratio <= 1.0 and is_telling(one) and is_possible(one, search)
            ]
    return causes


def promises(search: Search, variants: Sequence[Variant], places: Sequence[Place]) -> list[tuple[float, int, Variant]]:
    """The share that a variant together with one of these places leaves at few states, about, and its number.

    Variants of the joints are evaluated together, as states.
    """
    of_joints, of_options = ([v for v in variants if bool(v.joints) is joined] for joined in (True, False))
    equations, few = search.equations, min(PROMISING, len(search.given))
    size, which = np.array([[place.size] for place in places]), np.arange(len(places))[:, None]
    all_given = np.where(search.known, search.given, 0.0)

    def promise(up, right, down, states: int) -> float:
        given, weight = all_given[:states], search.weight[:states]
        near = nearest_changes(
            (up - down) / 2.0 * weight, ((up + down) / 2.0 - right) * weight, (given - right) * weight
        )
        total = np.linalg.norm(search.off[:states])
        return min((left for left, _ in near), default=0.0) / total if total else 0.0

    shares = []
    for variant in of_options:  # which may change more than the values at states
        inner = Search(variant.equations(), places, search.given, search.tolerance, search.end)
        up, down = (inner.values(which, sign * size) for sign in (1.0, -1.0))
        shares.append((promise(up, inner.right, down, len(all_given)), len(shares), variant))
    if not of_joints:
        return shares
    maps = [variant.joints for variant in of_joints]
    q = np.concatenate([one.positions(equations.q[:few]) for one in maps])
    together = Equations(equations.tree, q, np.concatenate([one.speeds(equations.qd[:few]) for one in maps]))
    blank = np.zeros((len(q), len(equations.entries)))
    inner = Search(together, places, blank, blank + 1.0, search.end)
    up, down = (inner.values(which, sign * size) for sign in (1.0, -1.0))
    for k, variant in enumerate(of_joints):
        part, (index, sense) = slice(k * few, (k + 1) * few), packing(variant.joints, equations)
        values = [one[..., part, :][..., index] * sense for one in (up, inner.right, down)]
        shares.append((promise(*values, few), len(shares), variant))
    return shares


def is_possible(fitted: Fitted, search: Search, of_body: bool = True) -> bool:
    """Whether no mass, armature, moment of inertia, damping or stiffness is below zero.

    of_body: and no moment of inertia is larger than the two others together. A term of Mbar may have the other sign, by a slip;
    other factors below zero mean a negative mass or inertia.
    """
    changed, seen = {}, set(search.seen)
    of_mass = [BODY_TERMS.index(term) for term in ("translation", "rotation")]
    for place, change in zip(fitted.places, fitted.changes):
        value = value_of(place, change)
        is_of_mass = any(path.field == "factor" and path.index[1] in of_mass for path, _ in place.moves)
        if value < 0.0 and (place.kind == "force" or (is_of_mass and abs(value + 1.0) > CLOSE)):
            return False
        for path, coefficient in place.moves:
            changed[path] = changed.get(path, 0.0) + coefficient * (value_of(place, change) - place.stated)
    numbers = search.equations.stated
    for path, more in changed.items():
        if path.field in ("mass", "armature") and numbers[path.field][path.index] + more < 0.0:
            return False
    inertias = np.array(numbers["inertia"])
    for path, more in changed.items():
        if path.field == "inertia":
            inertias[path.index] += more
    return all(
        is_inertia(inertias[b], [k for k in range(3) if Path("inertia", (b, k, k)) in seen], of_body)
        for b in {path.index[0] for path in changed if path.field == "inertia"}
    )


def is_inertia(inertia: np.ndarray, seen: list[int], of_body: bool) -> bool:
    """Whether a rigid body can have it. seen: the axes about which it enters Mbar or h; about others it may be anything."""
    least = -ROUNDED_INERTIA * np.abs(inertia).max()
    if len(seen) < 3 or not of_body:
        return bool(np.linalg.eigvalsh(inertia[np.ix_(seen, seen)]).min(initial=0.0) >= least)
    a, b, c = np.linalg.eigvalsh(inertia)
    return bool(a >= least and a + b - c >= least)


def is_telling(fitted: Fitted) -> bool:
    """Whether a pair is informative: an arbitrary factor together with another number fits nearly everything."""
    return all(
        place.unit != "times" or any(abs(value_of(place, change) - factor) <= CLOSE for factor in FACTORS)
        for place, change in zip(fitted.places, fitted.changes)
    )
