"""The search for causes of given values of Mbar and h: alone, in parts, with a convention, in pairs."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product
from math import inf

import numpy as np
from numpy import ndarray

from tmt import Tree

from ..core.cause import Cause
from .cause import LEAST_STATES, Diagnosis, distinct, ranked, together
from .fit import Family, Fitted, OutOfTime, Search, explaining
from .given import Bias, Given, Stated, causes_of, restated
from .hypothesis import NATURAL, OF_ZERO, Hypothesis, cost
from .kinds.angles import linearized, orders_of_rotation, other_angles, sums_of_angles
from .kinds.conventions import conventions
from .kinds.edits import edits
from .kinds.numbers import forces_in_bias, numbers
from .kinds.recursion import slips_of_recursion
from .kinds.slips import slips_of_kinematics
from .kinds.terms import coefficients, squares_of_velocities, terms
from .kinds.variants import lagrange, program_options
from .layout import IN_PARTS, Values
from .model import Equations
from .pairs import of_numbers, of_slips
from .regression import several

# states at which hypotheses are tried first: at least this number, and values for those of two numbers
FEW, ENOUGH = 3, 40
LARGE = 7e7  # times the tolerance of 64 eps: 1e-6 of the scale
NEAREST = 0.05  # of the difference: what leaves more is not near
NEAR = 2  # conventions with which another cause is sought, and single changes of which the nearest is told
PARTIAL = 0.7  # of the difference: what such a convention leaves at most
IN_PART, CONVENTION_IN_PART = 0.12, 0.32  # costs of a slip, of a convention in some parts alone

Kind = Callable[[Equations], Iterator[Hypothesis]]
FACTORS: tuple[Kind, ...] = (terms, squares_of_velocities, coefficients, forces_in_bias)
COMPLETE: tuple[Kind, ...] = (program_options, edits, lagrange)
SLIPS: tuple[Kind, ...] = (
    orders_of_rotation, slips_of_kinematics, slips_of_recursion, linearized, sums_of_angles,
)  # fmt: skip
# two of the first, or one of them and one of the others
PAIRS: tuple[tuple[Kind, ...], ...] = ((numbers,), (numbers, terms, coefficients))
FIRST: tuple[Kind, ...] = (program_options, conventions, numbers, *FACTORS, edits, lagrange)


def diagnose(
    tree: Tree, values: Values, seconds: float = inf, bias: Bias | None = None, stated: Stated | None = None,
    mass_matrix: Callable[[ndarray], ndarray] | None = None, qdd: ndarray | None = None,
    with_forces: bool = False,
) -> Diagnosis:  # fmt: skip
    """What explains given values that differ from those of a tree's equations.

    seconds: for the search. bias: the given h at the same q and other speeds, and mass_matrix: the given Mbar
    at other q, if there are functions. stated: how the joints were stated, which may be wrong; None: they
    cannot be. qdd: accelerations, of which the given h are the forces Mbar qdd + h. with_forces: whether h is
    what accelerations leave beside the model's damping and springs, which are then in the convention of the
    joints too.
    """
    with np.errstate(all="ignore"):  # values may be no numbers, or beyond the largest
        given = Given(tree, values, bias, mass_matrix, qdd=qdd, with_forces=with_forces)
        return Explanations(given, time.monotonic() + seconds, stated, seconds).diagnosis()


class Explanations:
    """What explains given values. end: the time.monotonic() at which the search ends."""

    def __init__(self, given: Given, end: float, stated: Stated | None, seconds: float = inf):
        self.given, self.equations, self.seconds, self.end = given, given.equations, seconds, end
        self.joints = given.equations.coordinates, stated  # of the model, and as they are stated
        # a robot with springs has them in the forces that are compared
        self.at_rest = "the forces at rest" if given.tree.has_springs else "gravity"
        self.search = Search(self.equations.values, given.packed, given.tolerance, end)
        known, parts = self.search.known, given.layout.parts
        states = max(FEW, -(-ENOUGH // max(1, known.any(axis=0).sum())))
        few = np.sort(np.argsort(-known.sum(axis=1), kind="stable")[:states])  # where most is given
        self.at_few = self.equations.at(few)
        self.few = Search(self.at_few.values, given.packed[few], self.search.tolerance[few], end)
        self.off = (np.abs(self.search.off) > 1.0).any(axis=0)
        self.known = [name for name, part in parts.items() if known[:, part].any()]
        self.differing = [name for name, part in parts.items() if self.off[part].any()]
        self.is_finished = True
        self.near: list[tuple[Kind, Fitted]] = []  # single changes that leave little at a few states
        self.families: dict[Kind, Family] = {}
        self.listed: dict[Kind, list[Hypothesis]] = {}

    def diagnosis(self) -> Diagnosis:
        if not self.off.any():
            return Diagnosis(False)
        layout, known = self.equations.layout, self.search.known.any(axis=0)
        names = [entry.named(self.equations.speeds) for entry in self.equations.entries]
        places = [[k] for k in range(layout.in_M.stop)] + [layout.of_rows([i]) for i in range(layout.nv)]
        found = Diagnosis(
            True, entries=tuple(name for name, at in zip(names, places) if self.off[at].any()),
            compared=sum(known[at].any() for at in places), parts=self.named(self.differing),
            known=self.named(self.known), is_symmetric=layout.is_symmetric, is_of_forces=layout.qdd is not None,
            is_large=bool(np.nanmax(np.abs(self.search.off)) > LARGE),
        )  # fmt: skip
        if len(np.unique(self.equations.q, axis=0)) < LEAST_STATES:
            return found._replace(too_few=len(self.equations.q))
        causes = next(filter(None, self.stages()), [])
        seconds = None if self.is_finished else self.seconds
        if causes:
            return found._replace(causes=ranked(distinct(sorted(causes, key=self.cost))), seconds=seconds)
        details = self.given.details() if layout.qdd is None else ()
        found = found._replace(details=details, seconds=seconds)
        with suppress(OutOfTime):
            return found._replace(closest=self.closest() if self.is_finished else None)
        return found

    def named(self, parts: Sequence[str]) -> tuple[str, ...]:
        return tuple(self.at_rest if part == "gravity" else part for part in parts)

    def cost(self, cause: Cause) -> float:
        return cost(cause, self.equations)

    def said(self, fits: Iterable[Fitted]) -> Iterator[Cause]:
        return causes_of(fits, *self.joints)

    def closest(self) -> Cause | None:
        """The single change that leaves least, if that is little."""
        near = sorted(self.near, key=lambda found: found[1].left_over)[:NEAR]
        those = [one for kind, fit in near for one in self.at_all(kind, fit.hypotheses)]
        fits = self.search.alone(self.search.expanded(those)) if those else []
        closest = min(fits, key=lambda fit: fit.left_over, default=None)
        return closest.cause if closest and closest.left_over < NEAREST and closest.is_possible else None

    def stages(self) -> Iterator[list[Cause]]:
        """Explanations of everything: the natural ones of each stage, if there are any; then the others.

        One number with many digits is simpler than two causes.
        """
        unusual, said = list[Cause](), self.said
        stages: tuple[Callable[[], Iterable[Cause]], ...] = (
            lambda: said(self.explained(FIRST)), lambda: said(self.explained(SLIPS)), self.of_parts,
            lambda: said(self.of_angles(self.search)), self.groups, self.two_causes,
        )  # fmt: skip
        for stage in stages:
            causes: list[Cause] = []
            try:
                causes += stage()  # what was found before the end is kept
            except OutOfTime:
                self.is_finished = False
            yield [cause for cause in causes if self.cost(cause) < NATURAL]
            unusual += (cause for cause in causes if cause.kind != "whole")
            if stage == self.groups:
                yield [cause for cause in unusual if cause.kind in ("number", OF_ZERO)]
            if not self.is_finished:
                break
        yield unusual

    def groups(self) -> Iterator[Cause]:
        """The ten numbers of a body, the same number of all, the components of an offset or a CoM."""
        if any(several(self.at_few, self.family(numbers), self.few)):
            yield from several(self.equations, self.search.expanded(self.hypotheses(numbers)), self.search)

    def of_parts(self) -> list[Cause]:
        """Slips in some parts alone, in all that differ."""
        different, known = self.independent(self.differing), self.independent(self.known)
        causes = self.within(known, self.known) if known != self.known else []
        if different != self.known:
            causes += self.within(different, self.differing)
        return causes

    def two_causes(self) -> Iterator[Cause]:
        yield from self.beside_conventions()
        for kinds in PAIRS:
            fits = of_numbers(self.few, [self.family(kind) for kind in kinds])
            every = {one.key: one for kind in kinds for one in self.hypotheses(kind)}
            sets = [tuple(every[one.key] for one in fit.hypotheses) for fit in fits]
            starts = np.array([fit.changes for fit in fits])
            found = list(self.said(explaining(self.search.fitted(sets, starts)) if sets else ()))
            yield from found
            if any(self.cost(cause) < NATURAL for cause in found):
                break
        for open_kind, complete in {numbers: (*COMPLETE, *SLIPS), coefficients: (program_options,)}.items():
            families = {kind: self.family(kind) for kind in complete}
            for kind, one, other in of_slips(self.few, self.family(open_kind), families):
                for slip, number in product(self.at_all(kind, [one]), self.at_all(open_kind, [other])):
                    beside = self.search.beside(slip)
                    for fit in explaining(beside.alone(beside.expanded([number]))):
                        yield together([slip.cause, fit.cause], 0.0)

    # the search

    def hypotheses(self, kind: Kind) -> list[Hypothesis]:
        """Those of a kind at all states, computed once."""
        if kind not in self.listed:
            self.listed[kind] = self.all_of(kind, self.equations)
        return self.listed[kind]

    def family(self, kind: Kind) -> Family:
        """Those of a kind at a few states, computed once."""
        if kind not in self.families:
            self.families[kind] = self.few.expanded(self.all_of(kind, self.at_few))
        return self.families[kind]

    def all_of(self, kind: Kind, equations: Equations) -> list[Hypothesis]:
        """The hypotheses of a kind that act, as far as there is time; options are always tried."""
        found, known = [], self.search.known.any(axis=0)
        for one in kind(equations):
            if one.column is None or one.column[:, known].any():
                found.append(one)
            if kind is not program_options:
                self.search.in_time()
        return found

    def at_all(self, kind: Kind, those: Iterable[Hypothesis]) -> list[Hypothesis]:
        """Hypotheses of a few states at all."""
        keys = {one.key for one in those}
        return [one for one in self.hypotheses(kind) if one.key in keys]

    def explained(self, kinds: Iterable[Kind], entries: ndarray | None = None) -> Iterator[Fitted]:
        """What leaves nothing of some entries, or of all: at a few states, then at all."""
        few, every = self.few, self.search
        if entries is not None:
            few, every = few.within(entries), every.within(entries)
        for kind in kinds:
            fits = few.alone(self.family(kind), entries is None)
            near = [fit.hypotheses[0] for fit in fits if fit.ratio <= 1.0]
            if entries is None and kind in FIRST:
                places = ((fit, fit.hypotheses[0]) for fit in fits if fit.left_over < NEAREST)
                self.near += ((kind, fit) for fit, one in places if one.is_open and one.cause.kind != "whole")
            if near:
                those = every.expanded(self.at_all(kind, near))
                yield from explaining(every.alone(those, entries is None))

    def of_angles(self, search: Search) -> list[Fitted]:
        """Other sines and cosines."""
        those = list(other_angles(self.equations, search))
        return explaining(search.alone(search.expanded(those))) if those else []

    def independent(self, parts: Sequence[str]) -> list[str]:
        """The parts without velocity terms that follow from a given Mbar that differs."""
        is_left_out = {"velocity terms", "M"} <= set(self.differing) and self.given.h_follows_from_M
        return [name for name in parts if not (is_left_out and name == "velocity terms")]

    def entries_in(self, parts: Iterable[str]) -> ndarray:
        entries = np.zeros(self.search.right.shape[1], bool)
        for name in parts:
            entries[self.equations.layout.parts[name]] = True
        return entries

    def within(self, parts: Sequence[str], said: Sequence[str]) -> list[Cause]:
        """Natural explanations of some parts, whatever the others are, the likeliest first.

        said: the parts that are meant.
        """
        entries = self.entries_in(parts)
        search, others = self.search.within(entries), self.entries_in(set(self.known) - set(said))
        if not (np.abs(search.off) > 1.0).any():
            return []
        causes: list[Cause] = []
        for fit in [*self.explained((*FIRST, *SLIPS), entries), *self.of_angles(search)]:
            (one,), (change,) = fit.hypotheses, fit.changes
            moved = change * (search.expanded([one]).first[0] / one.size)
            is_elsewhere = (np.abs(moved) > self.search.tolerance)[:, others].any()
            where = IN_PARTS.get(tuple(said), "").format(rest=self.at_rest) if is_elsewhere else ""
            is_convention = one.convention is not None or one.cause.kind == "order"
            more = (CONVENTION_IN_PART if is_convention else IN_PART) * bool(where)
            those = [fit.cause] if one.convention else self.said([fit])
            causes += [replace(cause, place=cause.place + where, cost=cause.cost + more) for cause in those]
        return sorted((cause for cause in causes if self.cost(cause) < NATURAL), key=self.cost)

    def beside_conventions(self) -> Iterator[Cause]:
        """A convention and one more cause, in the model's own joints."""
        fits = self.few.alone(self.family(conventions))
        near = sorted((fit for fit in fits if fit.left_over < PARTIAL), key=lambda fit: fit.left_over)[:NEAR]
        for one in self.at_all(conventions, [fit.hypotheses[0] for fit in near]):
            inner = Explanations(self.given.in_the_model(one.convention), self.end, None)
            if not inner.off.any():
                continue
            causes = [fit.cause for fit in inner.explained((*COMPLETE, numbers, *FACTORS))]
            for cause in (cause for cause in causes if inner.cost(cause) < NATURAL):
                yield from restated(together([one.cause, cause], 0.0), one.joints, *self.joints)
