"""The search for causes, rank by rank, of given values of Mbar and h."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
from numpy import ndarray

import tmt

from ..judge.scale import EPS, FACTOR
from ..robots.coordinates import Coordinates
from ..robots.joint_map import Joint, JointMap, within_a_turn
from .cause import LEAST_STATES, Cause, Diagnosis, cause_of, tied
from .coefficients import Compared
from .fit import Fitted, Search
from .model import Equations
from .places import OF_ZERO, all_places, entry_name, is_common
from .slips import slips
from .variants import Variant, conventions, program_options, values_in

FEW = 2  # states at which conventions are tried first
UNCOMMON = 2  # see `order`
SHOWN = 12  # single explanations that leave least


def diagnose(
    tree: tmt.Tree,
    q: ndarray,
    qd: ndarray,
    given: ndarray,
    tolerance: ndarray,
    seconds: float = np.inf,
    bias: Callable | None = None,
) -> Diagnosis:
    """What explains given values that differ from those of a tree's equations.

    q: (states, nq), qd: (states, nv). given, tolerance: (states, entries), see `packed`; NaN where nothing is given. seconds: for
    the search of numbers, terms and pairs. bias: the given h at the same q and other speeds, (states, nv) -> (states, nv), if
    there is a function.
    """
    with np.errstate(all="ignore"):  # values may be no numbers, or beyond the largest
        equations = Equations(tree, q, qd)
        rounded = np.fmax(tolerance, FACTOR * EPS * np.abs(given))  # large values are rounded too
        tolerance = np.where(tolerance > 0.0, rounded, 0.0)
        places = all_places(equations)
        if not np.isfinite(given).any(axis=0).all():  # M or h alone
            places = [place for place in places if place.entry != slice(None) or place.column is None]
        search = Search(equations, places, given, tolerance, time.monotonic() + seconds)
        return explanation(search, Compared(equations, given, tolerance, bias), seconds)


def explanation(search: Search, compared: Compared, seconds: float) -> Diagnosis:
    equations, differing = search.equations, (np.abs(search.off) > 1.0).any(axis=0)
    if not differing.any():
        return Diagnosis(False)
    entries = [entry for entry, off in zip(equations.entries, differing) if off]
    names = tuple(entry_name(entry, equations.names) for entry in entries)
    found = Diagnosis(True, entries=names, compared=int(search.known.any(axis=0).sum()))
    if len(np.unique(equations.q, axis=0)) < LEAST_STATES:
        return found._replace(too_few=len(equations.q))
    singles = search.in_time(search.singles)
    nearest = sorted((one for one in singles if one.is_possible), key=lambda one: one.left)[:SHOWN]
    found = found._replace(nearest=tuple((one.places[0].name, one.left, one.explains) for one in nearest))
    for causes in ranks(search, singles, compared):
        if causes:
            return found._replace(causes=tied(causes))
    closest = of_fitted(nearest[0], 2, search) if nearest else None
    return found._replace(
        closest=closest, details=compared.details(), seconds=None if search.is_finished else seconds
    )


def ranks(search: Search, singles: Sequence[Fitted], compared: Compared) -> Iterator[list[Cause]]:
    """The explanations of each rank, computed when the previous ranks are empty.

    Where joints may be otherwise, numbers and terms that explain as much are listed too: whoever states the joints so, and has a
    wrong number, agrees with a wrong model.
    """
    of_joints, explaining = explained_by_joints(search), [fit for fit in singles if fit.explains]
    first = explained(search, program_options(search.equations)) + [
        cause for cause in of_joints if cause.rank == 1
    ]
    first += [of_fitted(fit, 1, search) for fit in explaining if fit.places[0].rank == 1]
    if not all(cause.joints for cause in first):
        yield first
    second = [of_fitted(fit, 2, search) for fit in explaining if fit.places[0].rank == 2]
    for lists in slips(search.equations):
        second += next(filter(None, (explained(search, variants) for variants in lists)), [])
    second.sort(key=order)
    least = order(second[0]) if second else UNCOMMON
    if least >= UNCOMMON and (cause := compared.cause(1)):
        second.insert(0, cause)
    yield first + [cause for cause in second if least > 0 or order(cause) < UNCOMMON]
    pairs = search.in_time(lambda: search.pairs(("number", OF_ZERO)))
    third = [of_fitted(fit, 3, search) for fit in pairs if fit.explains]
    yield (
        [cause for cause in of_joints if cause.rank == 3]
        + third
        + [compared.cause(2)] * bool(compared.cause(2))
    )


def order(cause: Cause) -> int:
    """Of a cause of rank 2 in a list: slips and factors that are common mistakes, numbers, other factors, negative ones."""
    if cause.unit != "times":
        return int(cause.kind != "slip")
    return 0 if is_common(cause.explains) else UNCOMMON + (cause.explains < 0.0)


def of_fitted(fitted: Fitted, rank: int, search: Search) -> Cause:
    """A number, a term or a coefficient, or two of them; of zeros of joints with the joints to state."""
    changes, joints = [place.changed(change) for place, change in zip(fitted.places, fitted.changes)], None
    if all(place.kind == OF_ZERO for place in fitted.places):
        coordinates = Coordinates(search.equations.tree.joint_names, search.equations.tree.kind)
        zeros = {change.place: change.explains - change.stated for change in changes}
        stated = []
        for name, kind in zip(coordinates.names, coordinates.all_kinds):
            zero = within_a_turn(zeros.get(f"zero of {name}", 0.0), kind == "slide")
            stated.append(Joint(name, zero=float(f"{zero:.12g}"), slides=kind == "slide"))
        joints = JointMap(coordinates, stated)
    return cause_of(rank, changes, fitted.left, joints)


def explained(search: Search, variants: Iterable[Variant]) -> list[Cause]:
    """The variants that leave nothing."""
    causes = []
    for change, values, rank, joints in variants:
        left = search.weighted(values)
        if np.abs(left).max() <= 1.0:
            causes.append(cause_of(rank, [change], float(np.linalg.norm(left)) / search.size, joints))
    return causes


def explained_by_joints(search: Search) -> list[Cause]:
    """The conventions of the joints that leave nothing. They may be many: a few states come first."""
    equations, causes, variants = search.equations, [], list(conventions(search.equations.tree))
    every = values_in(equations, [variant.joints for variant in variants], FEW) if variants else ()
    for variant, few in zip(variants, every):
        if np.abs((search.given[:FEW] - few) * search.weight[:FEW]).max() <= 1.0:
            (values,) = values_in(equations, [variant.joints], len(equations.q))
            causes += explained(search, [variant._replace(values=values)])
    return causes
