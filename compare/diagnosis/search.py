"""The search for causes, rank by rank, of given values of Mbar and h."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from math import inf
from typing import Literal, NamedTuple

import numpy as np

from tmt import Tree

from ..core.cause import Cause
from ..robots.joint_map import Joint, JointMap, within_a_turn
from .cause import LEAST_STATES, Diagnosis, ranked
from .coefficients import Bias, Compared
from .fit import Fitted, Search
from .model import ROUNDED, Equations, Values
from .places import ALL, OF_ZERO, all_places, is_common
from .slips import slips
from .variants import conventions, program_options, values_in

FEW = 2  # states at which conventions are tried first
UNCOMMON = 2  # see `order`
SHOWN = 12  # single explanations that leave least


class Stated(NamedTuple):
    """How the joints of given equations are stated."""

    joints: JointMap
    by: Literal["argument", "option"] = "argument"  # joints=[...] of assert_agrees, or --joints


def diagnose(
    tree: Tree, values: Values, seconds: float = inf, bias: Bias | None = None, stated: Stated | None = None
) -> Diagnosis:
    """What explains given values that differ from those of a tree's equations.

    seconds: for the search of numbers, terms and pairs. bias: the given h at the same q and other speeds, if
    there is a function. stated: how the joints were stated, which may be wrong; None: they cannot be.
    """
    given, tolerance = values.packed, values.packed_tolerance
    with np.errstate(all="ignore"):  # values may be no numbers, or beyond the largest
        equations = Equations(tree, values.q, values.qd)
        rounded = np.fmax(tolerance, ROUNDED * np.abs(given))  # large values are rounded too
        tolerance = np.where(tolerance > 0.0, rounded, 0.0)
        places = all_places(equations)
        if not np.isfinite(given).any(axis=0).all():  # M or h alone
            both = ("coefficient", "part")
            places = [place for place in places if place.entry != ALL or place.kind not in both]
        search = Search(equations.values, places, given, tolerance, time.monotonic() + seconds)
        compared = Compared(equations, given, search.tolerance, bias)
        return Explanations(equations, search, compared, stated, seconds).diagnosis()


class Explanations(NamedTuple):
    """What explains the values of a search."""

    equations: Equations
    search: Search
    compared: Compared
    stated: Stated | None
    seconds: float  # for the search

    def diagnosis(self) -> Diagnosis:
        search, q, names = self.search, self.equations.q, self.equations.speeds
        differing = (np.abs(search.off) > 1.0).any(axis=0)
        if not differing.any():
            return Diagnosis(False)
        entries = tuple(self.equations.entries[k].named(names) for k in np.flatnonzero(differing))
        found = Diagnosis(True, entries=entries, compared=int(search.known.any(axis=0).sum()))
        if len(np.unique(q, axis=0)) < LEAST_STATES:
            return found._replace(too_few=len(q))
        singles = search.in_time(search.singles)
        possible = [fit for fit in singles if fit.is_possible]
        nearest = sorted(possible, key=lambda fit: fit.left_over)[:SHOWN]
        shares = tuple((fit.places[0].name, fit.left_over, fit.explains) for fit in nearest)
        causes = next(filter(None, self.ranks([fit for fit in singles if fit.explains])), [])
        found = found._replace(nearest=shares, causes=ranked(causes))
        if causes:
            return found
        unfinished = None if search.is_finished else self.seconds
        closest = nearest[0].cause if nearest else None
        return found._replace(closest=closest, details=self.compared.details(), seconds=unfinished)

    def ranks(self, singles: list[Fitted]) -> Iterator[list[Cause]]:
        """The explanations of each rank, computed when the previous ranks are empty. singles: that explain.

        Where joints may be otherwise, numbers and terms that explain as much are listed too: whoever states
        the joints so, and has a wrong number, agrees with a wrong model.
        """
        search, compared = self.search, self.compared
        options, of_joints = search.explained(program_options(self.equations)), self.of_joints()
        first = options + [cause for cause in of_joints if cause.rank == 1]
        first += self.causes([fit for fit in singles if fit.places[0].rank == 1])
        if options:
            yield first
        second = self.causes([fit for fit in singles if fit.places[0].rank == 2])
        for lists in slips(self.equations):
            second += next(filter(None, map(search.explained, lists)), [])
        second.sort(key=order)
        least = order(second[0]) if second else UNCOMMON
        if least >= UNCOMMON:
            second = compared.causes(1) + second
        yield first + [cause for cause in second if least > 0 or order(cause) < UNCOMMON]
        pairs = search.in_time(partial(search.pairs, ("number", OF_ZERO)))
        third = [cause for cause in of_joints if cause.rank == 3]
        yield third + self.causes([fit for fit in pairs if fit.explains]) + compared.causes(2)

    def of_joints(self) -> list[Cause]:
        """The conventions of the joints that leave nothing. They may be many: a few states come first."""
        equations, explained, causes = self.equations, self.search.explained, []
        variants = list(conventions(equations))
        every = values_in(equations, [joints for _, joints in variants], FEW) if variants else ()
        for (cause, joints), few in zip(variants, every):
            if explained([(cause, few)]):
                (values,) = values_in(equations, [joints], len(equations.q))
                for complete in explained([(cause, values)]):
                    causes += self.restated(complete, joints)
        return causes

    def causes(self, fits: Sequence[Fitted]) -> list[Cause]:
        """The fits as causes; of zeros of joints with the joints to state."""
        causes = []
        for fit in fits:
            if all(place.kind == OF_ZERO for place in fit.places):
                causes += self.restated(fit.cause, self.with_zeros(fit))
            else:
                causes.append(fit.cause)
        return causes

    def with_zeros(self, fit: Fitted) -> JointMap:
        """Joints with the zeros of a fit."""
        changes = zip(fit.places, fit.changes)
        zeros = {place.name: place.value(change) - place.stated for place, change in changes}
        coordinates, joints = self.equations.coordinates, []
        for name, kind in zip(coordinates.names, coordinates.all_kinds):
            zero = within_a_turn(zeros.get(f"zero of {name}", 0.0), kind == "slide")
            joints.append(Joint(name, zero=float(f"{zero:.12g}"), slides=kind == "slide"))
        return JointMap(coordinates, joints)

    def restated(self, cause: Cause, convention: JointMap) -> list[Cause]:
        """A cause with how joints are to be stated in its convention; [] if that cannot be."""
        if self.stated is None:
            return [cause]
        wrong, by = self.stated
        joints = convention if wrong.is_same else wrong.after(convention, self.equations.coordinates)
        if joints is None:
            return []
        if joints.is_same and not wrong.is_same:
            names = ", ".join(map(str, wrong.joints))
            part = Cause(rank=1, kind="order", place="joints", stated=names, explains="those of the model")
            cause = replace(cause, parts=(part,))
        statement = list(map(str, joints.joints))
        option = f"--joints={','.join(statement)}"
        return [replace(cause, joints=option if by == "option" else f"joints={statement}")]


def order(cause: Cause) -> int:
    """A key to sort causes of rank 2: slips and common factors, numbers, other factors, negative ones."""
    if cause.unit != "times" or not isinstance(cause.explains, float):
        return int(cause.kind != "slip")
    return 0 if is_common(cause.explains) else UNCOMMON + (cause.explains < 0.0)
