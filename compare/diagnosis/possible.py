"""Whether a rigid body and a joint can have fitted numbers, and whether a pair of them is informative."""

import numpy as np

from .cause import CLOSE, FACTORS, value_of
from .fit import Fitted, Search
from .model import BODY_TERMS, Path
from .places import Place

ROUNDED_INERTIA = 1e-9  # of an inertia, that the digits of a fit may take from it


def is_possible(fitted: Fitted, search: Search, of_body: bool = True) -> bool:
    """Whether no mass, armature, moment of inertia, damping or stiffness is below zero.

    of_body: and no moment of inertia is larger than the two others together. A term of Mbar may have the other sign, by a slip;
    other factors below zero mean a negative mass or inertia.
    """
    changed, seen = {}, set(search.seen)
    for place, change in zip(fitted.places, fitted.changes):
        value = value_of(place, change)
        if value < 0.0 and (place.kind == "force" or (is_of_mass(place) and abs(value + 1.0) > CLOSE)):
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


def is_of_mass(place: Place) -> bool:
    """Whether it is the factor of a term of Mbar."""
    of_mass = [BODY_TERMS.index(term) for term in ("translation", "rotation")]
    return any(path.field == "factor" and path.index[1] in of_mass for path, _ in place.moves)


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
