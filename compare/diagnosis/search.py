"""The search for causes of given values of Mbar and h: alone, in parts, with a convention, in pairs."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from math import inf

import numpy as np
from numpy import ndarray

from tmt import Tree

from ..core.cause import Cause
from .angles import linearized, orders_of_rotation, other_angles, sums_of_angles
from .cause import LEAST_STATES, Diagnosis, ranked, together
from .consistency import follows_from
from .conventions import Convention, all_conventions, values_in
from .edits import edits
from .fit import PROMISING, Fitted, OutOfTime, Search
from .given import Bias, Given
from .groups import inertial_numbers, several, vectors
from .hypothesis import Hypothesis
from .likelihood import NATURAL, cost, in_part
from .model import Equations, Values
from .places import OF_ZERO
from .recursion import slips_of_recursion
from .slips import slips_of_kinematics
from .statements import Stated, Statements
from .terms import all_places
from .variants import lagrange, program_options

FEW = 2  # states at which conventions are tried first
TRIED = 3  # states at which other explanations are tried first
LARGE = 7e7  # times the tolerance of 64 eps: 1e-6 of the scale
NEAREST = 0.05  # of the difference: what leaves more is not near
NEAR = 2  # conventions with which another cause is sought
PARTIAL = 0.7  # of the difference: what such a convention leaves at most
# pairs of a slip and a number that are tried: by what they leave to first order
SECOND_ORDER, MOST_NEAR = 0.1, 200
IN_PARTS = {  # how the parts in which alone a slip was made are said
    ("M",): " in M alone", ("h",): " in h alone", ("velocity terms", "gravity"): " in h alone",
    ("velocity terms",): " in the velocity terms of h alone", ("gravity",): " in {rest} alone",
    ("M", "velocity terms"): ", but not in {rest}", ("M", "gravity"): ", but not in the velocity terms of h",
}  # fmt: skip


Kind = Callable[[Equations], Iterator[Hypothesis]]
SLIPS: tuple[Kind, ...] = (
    orders_of_rotation,
    slips_of_kinematics,
    slips_of_recursion,
    linearized,
    sums_of_angles,
)
ALL_KINDS: tuple[Kind, ...] = (program_options, edits, lagrange, *SLIPS)


def diagnose(
    tree: Tree, values: Values, seconds: float = inf, bias: Bias | None = None, stated: Stated | None = None,
    mass_matrix: Callable[[ndarray], ndarray] | None = None, qdd: ndarray | None = None,
) -> Diagnosis:  # fmt: skip
    """What explains given values that differ from those of a tree's equations.

    seconds: for the search of numbers, terms and pairs. bias: the given h at the same q and other speeds, and
    mass_matrix: the given Mbar at other q, if there are functions. stated: how the joints were stated, which
    may be wrong; None: they cannot be. qdd: accelerations, of which the given h are the forces Mbar qdd + h.
    """
    with np.errstate(all="ignore"):  # values may be no numbers, or beyond the largest
        given = Given(tree, values, bias, mass_matrix, qdd=qdd)
        return Explanations(given, time.monotonic() + seconds, stated, seconds).diagnosis()


class Explanations:
    """What explains given values. end: the time.monotonic() at which the search ends."""

    def __init__(self, given: Given, end: float, stated: Stated | None, seconds: float = inf):
        self.given, self.equations, self.seconds, self.end = given, given.equations, seconds, end
        self.statements = Statements(given.equations.coordinates, stated)
        known = np.isfinite(given.packed).any(axis=0)
        places = all_places(self.equations)
        places = [place for place in places if place.column is None or place.column[:, known].any()]
        self.search = Search(self.equations.values, places, given.packed, given.tolerance, end)
        self.off = (np.abs(self.search.off) > 1.0).any(axis=0)
        parts = given.layout.parts
        self.known = [name for name, part in parts.items() if known[part].any()]
        self.differing = [name for name, part in parts.items() if self.off[part].any()]
        self.is_finished = True
        self.computed: dict[tuple[Kind, bool], list[Hypothesis]] = {}

    def diagnosis(self) -> Diagnosis:
        if not self.off.any():
            return Diagnosis(False)
        layout, known = self.equations.layout, self.search.known.any(axis=0)
        names = [entry.named(self.equations.speeds) for entry in self.equations.entries]
        places = [[k] for k in range(layout.in_M.stop)] + [layout.of_row(i) for i in range(layout.nv)]
        found = Diagnosis(
            True, entries=tuple(name for name, at in zip(names, places) if self.off[at].any()),
            compared=sum(known[at].any() for at in places), parts=self.named(self.differing),
            known=self.named(self.known), is_symmetric=layout.is_symmetric, is_of_forces=layout.qdd is not None,
            is_large=bool(np.nanmax(np.abs(self.search.off)) > LARGE),
        )  # fmt: skip
        if len(np.unique(self.equations.q, axis=0)) < LEAST_STATES:
            return found._replace(too_few=len(self.equations.q))
        causes = next(filter(None, self.stages()), [])
        if causes:
            return found._replace(causes=ranked(distinct(sorted(causes, key=self.cost))))
        whole = [fit for fit in self.all_singles if fit.is_possible and fit.left_over < NEAREST]
        near = [fit for fit in whole if fit.places[0].kind != "whole"]
        closest = min(near, key=lambda fit: fit.left_over, default=None)
        return found._replace(
            closest=closest.cause if closest else None,
            details=self.given.details() if layout.qdd is None else (),
            seconds=None if self.is_finished else self.seconds,
        )

    @property
    def at_rest(self) -> str:
        """The part of h at rest: a robot with springs has them in the forces that are compared."""
        return "the forces at rest" if self.equations.tree.has_springs else "gravity"

    def named(self, parts: Sequence[str]) -> tuple[str, ...]:
        return tuple(self.at_rest if part == "gravity" else part for part in parts)

    def cost(self, cause: Cause) -> float:
        return cost(cause, self.equations)

    # stages

    def stages(self) -> Iterator[list[Cause]]:
        """Explanations of everything: the natural ones of each stage, if there are any; then the others.

        One number with many digits is simpler than two causes.
        """
        unusual: list[Cause] = []
        for stage in (self.everything, self.slips, self.of_parts, self.angles, self.groups, self.two_causes):
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

    def everything(self) -> Iterator[Cause]:
        """Options, conventions, single numbers and terms, and edits of several numbers."""
        yield from self.search.explained(self.variants(program_options))
        for convention, values in self.in_conventions(self.search):
            for cause in self.search.explained([(convention.cause, values)]):
                yield from self.statements.restated(cause, convention.joints)
        yield from self.statements.causes(fit for fit in self.all_singles if fit.explains)
        yield from self.explained(self.search, (edits, lagrange))

    def slips(self) -> list[Cause]:
        """Slips of positions, angular velocities and tensors, and of a recursion."""
        return [cause for kind in SLIPS for cause in self.explained(self.search, (kind,))]

    def explained(self, search: Search, kinds: Iterable[Kind]) -> list[Cause]:
        """The causes of some kinds that leave nothing of what is searched: at a few states, then at all."""
        causes: list[Cause] = []
        few = search.at(self.tried)
        for kind in kinds:
            if near := {key_of(cause) for cause in few.explained(self.variants_at_few(kind))}:
                causes += search.explained(pair for pair in self.variants(kind) if pair.key in near)
        return causes

    def angles(self) -> list[Cause]:
        """Sines and cosines of a hinge, in an entry or a part."""
        return self.search.explained(other_angles(self.equations, self.search))

    def groups(self) -> Iterator[Cause]:
        """The ten numbers of a body, the same number of all, the components of an offset or a CoM."""
        yield from inertial_numbers(self.equations, self.search)
        yield from several(self.search)
        yield from vectors(self.search)

    def of_parts(self) -> list[Cause]:
        """Slips in some parts alone, in all that differ."""
        different, known = self.independent(self.differing), self.independent(self.known)
        causes = self.within(known, self.known) if known != self.known else []
        if different != self.known:
            causes += self.within(different, self.differing)
        return causes

    def independent(self, parts: Sequence[str]) -> list[str]:
        """The parts without velocity terms that follow from a given Mbar that differs."""
        is_left_out = {"velocity terms", "M"} <= set(self.differing) and self.h_follows_from_M
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
        search = self.search.within(self.entries_in(parts))
        others = self.entries_in(set(self.known) - set(said))
        if not (np.abs(search.off) > 1.0).any():
            return []
        causes: list[Cause] = []

        def add(found: list[Cause], moved: ndarray) -> None:
            is_elsewhere = (np.abs(moved) > search.tolerance)[:, others].any()
            where = IN_PARTS.get(tuple(said), "").format(rest=self.at_rest) if is_elsewhere else ""
            for cause in found:
                more = in_part(cause) if where else 0.0
                causes.append(replace(cause, place=cause.place + where, cost=cause.cost + more))

        few = search.at(self.tried)
        for kind in ALL_KINDS:
            if near := {key_of(cause) for cause in few.explained(self.variants_at_few(kind))}:
                for pair in (pair for pair in self.variants(kind) if pair.key in near):
                    add(search.explained([pair]), pair[1] - search.right)
        for pair in other_angles(self.equations, search):
            add(search.explained([pair]), pair[1] - search.right)
        for convention, values in self.in_conventions(search):
            add(search.explained([(convention.cause, values)]), values - search.right)
        for fit in (fit for fit in search.singles(is_thorough=False) if fit.explains):
            add(self.statements.causes([fit]), search.change(fit))
        return sorted((cause for cause in causes if self.cost(cause) < NATURAL), key=self.cost)

    def beside_conventions(self) -> Iterator[Cause]:
        """A convention and one more cause, in the model's own joints."""
        for convention in self.near_conventions:
            inner = Explanations(self.given.in_the_model(convention), self.end, None)
            if not inner.off.any():
                continue
            causes = inner.explained(inner.search, (program_options, edits, lagrange))
            causes += [fit.cause for fit in inner.search.singles(is_thorough=False) if fit.explains]
            for cause in (cause for cause in causes if inner.cost(cause) < NATURAL):
                both = together([convention.cause, cause], 0.0)
                yield from self.statements.restated(both, convention.joints)

    def two_causes(self) -> Iterator[Cause]:
        yield from self.beside_conventions()
        fits = self.search.pairs(("number", OF_ZERO), ("number", OF_ZERO, "term", "coefficient"))
        yield from self.statements.causes(fit for fit in fits if fit.explains)
        yield from self.with_slips()
        if not any(fit.explains for fit in fits):
            numbers = [fit for fit in fits if all(place.kind == "number" for place in fit.places)]
            yield from self.statements.causes(fit for fit in self.search.thirds(numbers) if fit.explains)

    def with_slips(self) -> Iterator[Cause]:
        """An edit or a slip beside a number or a term; their changes are added."""
        search = self.search.at(self.tried)
        variants = [(kind, *pair) for kind in ALL_KINDS for pair in self.variants_at_few(kind)]
        moved = np.stack([((values - search.right) * search.weight).ravel() for *_, values in variants])
        left = search.off.ravel() - moved
        squares, enough = np.einsum("vm,vm->v", left, left), (PROMISING * search.size) ** 2
        columns = search.expansion[0].reshape(len(search.places), -1)
        lengths = np.linalg.norm(columns, axis=1)
        along = left @ (columns / np.where(lengths > 0.0, lengths, 1.0)[:, None]).T
        acts = np.abs(moved).max(axis=1) > 1.0
        may = np.array([place.kind != "whole" for place in search.places])
        after = np.where(acts[:, None] & may, squares[:, None] - along**2, np.inf)
        near = np.argwhere(after < enough + SECOND_ORDER * squares[:, None])
        for v, k in near[np.argsort(after[tuple(near.T)])][:MOST_NEAR].tolist():
            if search.best_change(k, left[v].reshape(search.off.shape))[0] > 1.0:
                continue
            kind, cause, _ = variants[v]
            values = next(values for other, values in self.variants(kind) if key_of(other) == key_of(cause))
            ratio, change = self.search.best_change(k, self.search.weighted(values))
            if ratio <= 1.0 and search.places[k].is_possible(change):
                yield together([cause, search.places[k].cause(change)], 0.0)

    # what is computed once

    @cached_property
    def tried(self) -> ndarray:
        """The states at which explanations are tried first: where most is given."""
        return np.sort(np.argsort(-self.search.known.sum(axis=1), kind="stable")[:TRIED])

    def variants(self, kind: Kind) -> list[Hypothesis]:
        """The explanations of a kind, computed once."""
        if (kind, False) not in self.computed:
            self.computed[kind, False] = self.all_of(kind, self.equations)
        return self.computed[kind, False]

    def all_of(self, kind: Kind, equations: Equations) -> list[Hypothesis]:
        """The explanations of a kind, as far as there is time; options are always tried."""
        found = []
        for pair in kind(equations):
            found.append(pair)
            if kind is not program_options:
                self.search.in_time()
        return found

    def variants_at_few(self, kind: Kind) -> list[Hypothesis]:
        """The same at a few states."""
        if (kind, True) not in self.computed:
            self.computed[kind, True] = self.all_of(kind, self.equations.at(self.tried))
        return self.computed[kind, True]

    @cached_property
    def all_singles(self) -> list[Fitted]:
        try:
            return self.search.singles()
        except OutOfTime:
            self.is_finished = False
            return []

    @cached_property
    def conventions(self) -> list[tuple[Convention, ndarray]]:
        """The conventions, and the values in each at a few states."""
        those = list(all_conventions(self.equations))
        return list(zip(those, values_in(self.equations, [convention.first(FEW) for convention in those])))

    def shares(self, search: Search) -> list[tuple[float, Convention]]:
        """What each convention leaves at a few states, a share, and the convention."""
        size = float(np.linalg.norm(search.off[:FEW])) or 1.0
        left = [float(np.linalg.norm(search.weighted(values))) for _, values in self.conventions]
        return [(norm / size, convention) for norm, (convention, _) in zip(left, self.conventions)]

    def in_conventions(self, search: Search) -> Iterator[tuple[Convention, ndarray]]:
        """The conventions that leave nothing at a few states, with the values at all."""
        for convention in (convention for share, convention in self.shares(search) if share < 1e-3):
            yield from ((convention, values) for values in values_in(self.equations, [convention]))

    @property
    def near_conventions(self) -> list[Convention]:
        """The conventions that leave least, if they leave something."""
        best = sorted(self.shares(self.search), key=lambda pair: pair[0])[:NEAR]
        return [convention for share, convention in best if share < PARTIAL]

    @property
    def h_follows_from_M(self) -> bool:
        """Whether the velocity terms are those of the given Mbar, by its derivatives."""
        given, values = self.given, self.given.values
        if given.mass_matrix is None or given.rest is None or self.equations.coordinates.has_balls:
            return False
        return follows_from(given.mass_matrix, values.q, values.qd, values.bias - given.rest)


def key_of(cause: Cause) -> tuple[str, str]:
    """What tells the explanations of a kind apart."""
    return cause.place, str(cause.explains)


def distinct(causes: Iterable[Cause]) -> list[Cause]:
    """Each cause once; none of every body or joint where one of them suffices, no part of a term where a number does."""
    once: dict[frozenset[tuple[str, str]], Cause] = {}
    for cause in causes:
        parts = cause.parts if len(cause.parts) > 1 else (cause,)
        once.setdefault(frozenset((part.place, str(part.explains)) for part in parts), cause)
    kinds, fewest = {cause.kind for cause in once.values()}, dict[tuple[str, str], int]()
    for cause in once.values():
        key = cause.form, str(cause.explains)
        fewest[key] = min(cause.owners, fewest.get(key, cause.owners))
    return [
        cause for cause in once.values()
        if not (cause.form and cause.owners > fewest[cause.form, str(cause.explains)])
        and not (cause.kind == "part" and kinds & {"number", "body"})
    ]  # fmt: skip
