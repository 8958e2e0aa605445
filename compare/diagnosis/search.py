"""The search for causes of given values of Mbar and h: alone, in parts, with a convention, in pairs."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import chain
from math import inf

import numpy as np
from numpy import ndarray

from tmt import Tree

from ..core.cause import Cause
from .cause import LEAST_STATES, Diagnosis, ranked, together
from .consistency import follows_from
from .conventions import Convention, all_conventions, values_in
from .edits import edits
from .fit import PROMISING, Fitted, OutOfTime, Search
from .given import Bias, Given
from .groups import loads, several, turned
from .likelihood import NATURAL, cost
from .model import Values
from .places import OF_ZERO
from .recursion import slips_of_recursion
from .statements import Stated, Statements
from .terms import all_places
from .variants import Variant, exchanged_entries, lagrange, other_angles, other_variables, program_options

FEW = 2  # states at which conventions are tried first
NEAREST = 0.5  # of the difference: what leaves more is not near
NEAR = 2  # conventions with which another cause is sought
PARTIAL = 0.7  # of the difference: what such a convention leaves at most
# pairs of a slip and a number that are tried: by what they leave to first order
SECOND_ORDER, MOST_NEAR = 0.1, 200
WITHOUT = "velocity terms in h", "bias"  # left out: nothing else can be wrong there
IN_PARTS = {  # how the parts in which alone a slip was made are said
    ("M",): " in M alone", ("h",): " in h alone", ("velocity terms", "gravity"): " in h alone",
    ("velocity terms",): " in the velocity terms of h alone", ("gravity",): " in gravity alone",
    ("M", "velocity terms"): ", but not in gravity", ("M", "gravity"): ", but not in the velocity terms of h",
}  # fmt: skip


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
        return Explanations(given, time.process_time() + seconds, stated, seconds).diagnosis()


class Explanations:
    """What explains given values. end: the time.process_time() at which the search ends."""

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

    def diagnosis(self) -> Diagnosis:
        if not self.off.any():
            return Diagnosis(False)
        layout, known = self.equations.layout, self.search.known.any(axis=0)
        names = [entry.named(self.equations.speeds) for entry in self.equations.entries]
        places = [[k] for k in range(layout.in_M.stop)] + [layout.of_row(i) for i in range(layout.nv)]
        found = Diagnosis(
            True, entries=tuple(name for name, at in zip(names, places) if self.off[at].any()),
            compared=sum(known[at].any() for at in places), parts=tuple(self.differing),
            known=tuple(self.known), is_symmetric=layout.is_symmetric,
        )  # fmt: skip
        if len(np.unique(self.equations.q, axis=0)) < LEAST_STATES:
            return found._replace(too_few=len(self.equations.q))
        causes = next(filter(None, self.stages()), [])
        if causes:
            return found._replace(causes=ranked(distinct(sorted(causes, key=self.cost))))
        near = [fit for fit in self.all_singles if fit.is_possible and fit.left_over < NEAREST]
        closest = min(near, key=lambda fit: fit.left_over, default=None)
        return found._replace(
            closest=closest.cause if closest else None,
            details=self.given.details() if layout.qdd is None else (),
            seconds=None if self.is_finished else self.seconds,
        )

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
            unusual += causes
            if stage == self.groups:
                yield [cause for cause in unusual if cause.kind in ("number", OF_ZERO)]
            if not self.is_finished:
                break
        yield unusual

    def everything(self) -> Iterator[Cause]:
        """Options, conventions, single numbers and terms, and edits of several numbers."""
        yield from self.search.explained(self.options)
        for convention, values in self.in_conventions(self.search):
            for cause in self.search.explained([(convention.cause, values)]):
                yield from self.statements.restated(cause, convention.joints)
        yield from self.statements.causes(fit for fit in self.all_singles if fit.explains)
        yield from self.search.explained(self.variants)

    def slips(self) -> list[Cause]:
        """Slips of a recursion."""
        return self.search.explained(self.recursions)

    def angles(self) -> list[Cause]:
        """Sines and cosines of a hinge, in an entry or a part."""
        return self.search.explained(other_angles(self.equations, self.search))

    def groups(self) -> Iterator[Cause]:
        """Loads, and tensors about other axes."""
        yield from loads(self.equations, self.search)
        yield from turned(self.equations, self.search)

    def of_parts(self) -> list[Cause]:
        """Slips in some parts alone, in all that differ."""
        different, known = self.independent(self.differing), self.independent(self.known)
        causes = self.within(known, self.known) if known != self.known else []
        if different != self.known:
            causes += self.within(different, self.differing)
        return causes

    def of_each_part(self) -> Iterator[Cause]:
        """One cause for some parts, and one for the others."""
        different = self.independent(self.differing)
        for part in different if len(different) > 2 else different[:-1]:
            one, others = self.within([part], [part]), [name for name in different if name != part]
            if one and (two := self.within(others, others)):
                yield together([one[0], two[0]], 0.0)

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
            where = IN_PARTS.get(tuple(said), "") if is_elsewhere else ""
            causes.extend(replace(cause, place=cause.place + where) for cause in found)

        angles = other_angles(self.equations, search)
        for variant in chain(self.all_variants, angles):
            add(search.explained([variant]), variant[1] - search.right)
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
            causes = inner.search.explained(chain(inner.options, inner.variants))
            causes += [fit.cause for fit in inner.search.singles(is_thorough=False) if fit.explains]
            for cause in (cause for cause in causes if inner.cost(cause) < NATURAL):
                both = together([convention.cause, cause], 0.0)
                yield from self.statements.restated(both, convention.joints)

    def two_causes(self) -> Iterator[Cause]:
        yield from self.beside_conventions()
        yield from several(self.search)
        fits = self.search.pairs(("number", OF_ZERO), ("number", OF_ZERO, "term", "coefficient"))
        yield from self.statements.causes(fit for fit in fits if fit.explains)
        yield from self.of_each_part()
        yield from self.with_slips()

    def with_slips(self) -> Iterator[Cause]:
        """An edit or a slip beside a number, a term or another slip; their changes are added."""
        variants, search = self.all_variants, self.search
        moved = np.stack([((values - search.right) * search.weight).ravel() for _, values in variants])
        left = search.off.ravel() - moved
        squares, enough = np.einsum("vm,vm->v", left, left), (PROMISING * search.size) ** 2
        columns = search.expansion[0].reshape(len(search.places), -1)
        lengths = np.linalg.norm(columns, axis=1)
        along = left @ (columns / np.where(lengths > 0.0, lengths, 1.0)[:, None]).T
        after = squares[:, None] - along**2
        near = np.argwhere(after < enough + SECOND_ORDER * squares[:, None])
        for v, k in near[np.argsort(after[tuple(near.T)])][:MOST_NEAR].tolist():
            ratio, change = search.best_change(k, left[v].reshape(search.off.shape))
            if ratio <= 1.0 and search.places[k].is_possible(change):
                yield together([variants[v][0], search.places[k].cause(change)], 0.0)
        both = squares[:, None] + np.einsum("vm,vm->v", moved, moved) - 2.0 * left @ moved.T
        for v, w in np.argwhere(np.triu(both < enough)).tolist()[:MOST_NEAR]:
            pair = variants[v][0], variants[w][0]
            if np.abs(left[v] - moved[w]).max() <= 1.0 and not any(cause.place in WITHOUT for cause in pair):
                yield together(pair, 0.0)

    # what is computed once

    @cached_property
    def options(self) -> list[Variant]:
        return list(program_options(self.equations))

    @cached_property
    def variants(self) -> list[Variant]:
        kinds = edits, lagrange, exchanged_entries, other_variables
        return [*chain.from_iterable(kind(self.equations) for kind in kinds)]

    @cached_property
    def recursions(self) -> list[Variant]:
        return list(slips_of_recursion(self.equations))

    @property
    def all_variants(self) -> list[Variant]:
        return [*self.options, *self.variants, *self.recursions]

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


def distinct(causes: Iterable[Cause]) -> list[Cause]:
    """Each cause once; none of every body or joint where one of them suffices."""
    once: dict[frozenset[tuple[str, str]], Cause] = {}
    for cause in causes:
        parts = cause.parts if len(cause.parts) > 1 else (cause,)
        once.setdefault(frozenset((part.place, str(part.explains)) for part in parts), cause)
    return [cause for cause in once.values() if not any(is_of_one(other, cause) for other in once.values())]


def is_of_one(cause: Cause, of_all: Cause) -> bool:
    """Whether a cause is for one body or joint what another is for every one."""
    before, every, after = of_all.place.partition("every ")
    if not every or "every " in cause.place or (cause.kind, cause.explains) != (of_all.kind, of_all.explains):
        return False
    return cause.place.startswith(before) and cause.place.endswith(after.partition(" ")[2])
