"""The search for causes of given values of Mbar and h: everything alone, in parts, with a convention, in pairs."""

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
from .coefficients import Bias, Compared
from .consistency import follows_from
from .conventions import Convention, all_conventions, values_in
from .edits import edits
from .fit import PROMISING, Fitted, OutOfTime, Search, nearest_change
from .given import Given
from .groups import loads, several
from .likelihood import NATURAL, cost
from .model import ROUNDED, Equations, Values, packed
from .places import OF_ZERO
from .recursion import slips_of_recursion
from .statements import Stated, Statements
from .terms import all_places
from .variants import Variant, lagrange, other_angles, program_options

FEW = 2  # states at which conventions are tried first
SHOWN = 12  # single explanations that leave least
NEAR = 2  # conventions with which another cause is sought
NEARLY = 1e-9  # of the difference: what a number leaves at most that may explain it on a larger scale
SECOND_ORDER, MOST_NEAR = (
    0.1,
    200,
)  # pairs of a slip and a number that are tried: by what they leave to first order
PARTIAL = 0.7  # of the difference: what such a convention leaves at most
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


def best_change(search: Search, k: int, off: ndarray) -> tuple[float, float]:
    """What the best change of a place leaves of other differences, over its tolerance, and the change over its size."""
    first, second = (part[k] * search.weight for part in search.coefficients)
    _, x = nearest_change(first, second, off)
    for _ in range(2):  # Newton's steps: the roots of a cubic have half the digits
        slope, left = first + 2.0 * x * second, off - x * first - x * x * second
        x += float((slope * left).sum() / max((slope * slope).sum(), 1e-300))
    return float(np.abs(off - x * first - x * x * second).max()), x


class Explanations:
    """What explains given values. end: the time.process_time() at which the search ends."""

    def __init__(self, given: Given, end: float, stated: Stated | None, seconds: float = inf):
        self.given, self.equations, self.seconds, self.end = given, given.equations, seconds, end
        self.statements = Statements(given.equations.coordinates, stated)
        places = all_places(self.equations)
        if not np.isfinite(given.packed).any(axis=0).all():  # M or h alone
            right = np.isfinite(given.packed).any(axis=0)
            places = [place for place in places if place.column is None or place.column[:, right].any()]
        self.search = Search(self.equations.values, places, given.packed, given.tolerance, end)
        parts = given.layout.parts
        self.known = [name for name, part in parts.items() if self.search.known[:, part].any()]
        off = np.abs(self.search.off) > 1.0
        self.differing = [name for name in self.known if off[:, parts[name]].any()]
        self.off = off.any(axis=0)
        self.is_finished = True

    def diagnosis(self) -> Diagnosis:
        if not self.off.any():
            return Diagnosis(False)
        entries, parts = tuple(self.entries_that_differ()), tuple(self.differing)
        is_symmetric, known = self.equations.layout.is_symmetric, tuple(self.known)
        found = Diagnosis(True, entries=entries, compared=self.entries_compared, parts=parts, known=known)
        found = found._replace(is_symmetric=is_symmetric)
        if len(np.unique(self.equations.q, axis=0)) < LEAST_STATES:
            return found._replace(too_few=len(self.equations.q))
        causes = next(filter(None, self.stages()), [])
        possible = [fit for fit in self.all_singles if fit.is_possible]
        nearest = sorted(possible, key=lambda fit: fit.left_over)[:SHOWN]
        shares = tuple((fit.places[0].name, fit.left_over, fit.explains) for fit in nearest)
        found = found._replace(nearest=shares, causes=ranked(distinct(sorted(causes, key=self.cost))))
        if causes:
            return found
        unfinished = None if self.is_finished else self.seconds
        closest = nearest[0].cause if nearest else None
        details = self.compared.details() if self.equations.layout.qdd is None else ()
        return found._replace(closest=closest, details=details, seconds=unfinished)

    def cost(self, cause: Cause) -> float:
        return cost(cause, self.equations)

    @cached_property
    def compared(self) -> Compared:
        """The coefficients, of the lower triangle of Mbar and of h as one."""
        values, (of_M, of_h) = self.given.values, self.given.values.tolerances
        plain = Equations(self.given.tree, values.q, values.qd)
        if self.equations.layout.is_symmetric and "coefficients" in vars(self.equations):
            plain.coefficients = self.equations.coefficients
        tolerance, largest = packed(of_M, of_h), np.nanmax(np.abs(values.packed), axis=0, initial=0.0)
        tolerance = np.where(tolerance > 0.0, np.fmax(tolerance, ROUNDED * largest), 0.0)
        least = tolerance[tolerance > 0.0].min(initial=1.0)
        return Compared(plain, values.packed, np.where(tolerance > 0.0, tolerance, least), self.given.bias)

    def entries_that_differ(self) -> Iterator[str]:
        """The names of entries of Mbar and h."""
        equations, layout = self.equations, self.equations.layout
        count = layout.in_M.stop
        for k, entry in enumerate(equations.entries):
            at = [k] if k < count else layout.of_row(k - count)
            if self.off[at].any():
                yield entry.named(equations.speeds)

    @property
    def entries_compared(self) -> int:
        known, count = self.search.known.any(axis=0), self.equations.layout.in_M.stop
        return int(known[:count].sum() + known[count : count + self.equations.nv].sum())

    # stages

    def stages(self) -> Iterator[list[Cause]]:
        """Explanations of everything: of each stage those that are natural, if there are any; then the others.

        One number with many digits is simpler than two causes.
        """
        unusual: list[Cause] = []
        stages = (
            self.everything, self.derivations, self.of_parts, self.terms, self.groups, self.beside_conventions, self.pairs,
        )  # fmt: skip
        for stage in stages:
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
        yield from self.in_conventions
        yield from self.statements.causes(fit for fit in self.all_singles if fit.explains)
        yield from self.search.explained(self.variants)

    def derivations(self) -> Iterator[Cause]:
        """Slips of a recursion."""
        yield from self.search.explained(self.recursions)

    def groups(self) -> Iterator[Cause]:
        """Loads, and numbers of all bodies or joints."""
        yield from loads(self.equations, self.search)
        yield from several(self.equations, self.search)

    def of_parts(self) -> Iterator[Cause]:
        """Slips in some parts alone: in all that differ, or one cause for each."""
        different, known, causes = self.differing, self.known, []
        if "velocity terms" in different and "M" in different and self.h_follows_from_M:
            different, known = (
                [name for name in names if name != "velocity terms"] for names in (different, known)
            )
            causes += self.within(known, self.known)
        if different != self.known:
            causes += self.within(different, self.differing)
        yield from causes
        if causes:
            return
        for part in different if len(different) > 2 else different[:-1]:
            one, others = self.within([part], [part]), [name for name in different if name != part]
            if one and (two := self.within(others, others)):
                yield together([one[0], two[0]], 0.0)

    def within(self, parts: Sequence[str], said: Sequence[str]) -> list[Cause]:
        """Natural explanations of some parts, whatever the others are, the likeliest first; said: the parts that are meant."""
        entries = np.zeros(self.search.right.shape[1], bool)
        for name in parts:
            entries[self.equations.layout.parts[name]] = True
        search = self.search.within(entries)
        if not (np.abs(search.off) > 1.0).any():
            return []
        others = np.zeros_like(entries)
        for name in set(self.known) - set(said):
            others[self.equations.layout.parts[name]] = True
        causes: list[Cause] = []

        def add(found: Iterable[Cause], moved: ndarray) -> None:
            is_elsewhere = (np.abs(moved) > search.tolerance)[:, others].any()
            causes.extend(in_part(cause, said) if is_elsewhere else cause for cause in found)

        for cause, values in chain(self.options, self.variants, self.recursions, self.angles):
            add(search.explained([(cause, values)]), values - search.right)
        numbers = {place.name: k for k, place in enumerate(search.places)}
        for fit in search.singles(is_thorough=False):
            if fit.explains:
                size = fit.changes[0] / fit.places[0].size
                add(self.statements.causes([fit]), search.coefficients[0][numbers[fit.places[0].name]] * size)
        return sorted((cause for cause in causes if self.cost(cause) < NATURAL), key=self.cost)

    def terms(self) -> Iterator[Cause]:
        """Terms of coefficients; forces of accelerations have none."""
        yield from self.search.explained(self.angles)
        yield from self.compared.causes(1) if self.equations.layout.qdd is None else ()

    def beside_conventions(self) -> Iterator[Cause]:
        """A convention and one more cause, in the model's own joints."""
        for convention in self.near_conventions:
            inner = Explanations(self.given.in_the_model(convention), self.end, None)
            for cause in inner.everything_but_conventions():
                if inner.cost(cause) < NATURAL:
                    yield from self.statements.restated(
                        together([convention.cause, cause], 0.0), convention.joints
                    )

    def everything_but_conventions(self) -> Iterator[Cause]:
        if self.off.any():
            yield from self.search.explained(chain(self.options, self.variants))
            yield from (fit.cause for fit in self.search.singles(is_thorough=False) if fit.explains)

    def pairs(self) -> Iterator[Cause]:
        fits = self.search.pairs(("number", OF_ZERO), ("number", OF_ZERO, "term", "coefficient"))
        yield from self.statements.causes(fit for fit in fits if fit.explains)
        yield from self.with_slips()
        yield from self.compared.causes(2) if self.equations.layout.qdd is None else ()

    def with_slips(self) -> Iterator[Cause]:
        """An edit or a slip beside a number, a term or another slip, whose changes of the values are added."""
        variants, search = [*self.options, *self.variants, *self.recursions], self.search
        changes = [(values - search.right) * search.weight for _, values in variants]
        left = np.stack([(search.off - change).ravel() for change in changes])
        squares = np.einsum("vm,vm->v", left, left)
        columns = search.expansion[0].reshape(len(search.places), -1)
        lengths = np.einsum("km,km->k", columns, columns)
        after = squares[:, None] - np.divide(
            (left @ columns.T) ** 2, lengths, out=np.zeros((len(left), len(columns))), where=lengths > 0.0
        )
        near = np.argwhere(after < (PROMISING * search.size) ** 2 + SECOND_ORDER * squares[:, None])
        for v, k in near[np.argsort(after[tuple(near.T)])][:MOST_NEAR].tolist():
            place, off = search.places[k], left[v].reshape(search.off.shape)
            ratio, change = best_change(search, k, off)
            if ratio <= 1.0 and place.is_possible(change * place.size):
                yield together([variants[v][0], place.cause(change * place.size)], 0.0)
        moved = np.stack([change.ravel() for change in changes])
        both = squares[:, None] + np.einsum("vm,vm->v", moved, moved) - 2.0 * left @ moved.T
        for v, w in np.argwhere(np.triu(both < (PROMISING * search.size) ** 2)).tolist()[:MOST_NEAR]:
            if np.abs(left[v] - moved[w]).max() <= 1.0:
                yield together([variants[v][0], variants[w][0]], 0.0)

    # what is computed once

    @cached_property
    def options(self) -> list[Variant]:
        return list(program_options(self.equations))

    @cached_property
    def variants(self) -> list[Variant]:
        return [*edits(self.equations), *lagrange(self.equations)]

    @cached_property
    def angles(self) -> list[Variant]:
        return list(other_angles(self.equations))

    @cached_property
    def recursions(self) -> list[Variant]:
        return list(slips_of_recursion(self.equations))

    @cached_property
    def all_singles(self) -> list[Fitted]:
        try:
            return [self.on_its_scale(fit) for fit in self.search.singles()]
        except OutOfTime:
            self.is_finished = False
            return []

    def on_its_scale(self, fit: Fitted) -> Fitted:
        """A fit judged by the scale of the model with its number: a length in mm rounds what is small in the right one."""
        paths = [
            (path, change * factor)
            for place, change in zip(fit.places, fit.changes)
            for path, factor in place.moves
        ]
        if fit.ratio <= 1.0 or fit.left_over > NEARLY or not paths:
            return fit
        fields = {path.field: self.equations.stated[path.field].copy() for path, _ in paths}
        for path, change in paths:
            fields[path.field][path.at] += change
        try:
            tree = replace(self.equations.tree, **{name: field.tolist() for name, field in fields.items()})
        except ValueError:  # which no body can have
            return fit
        values = self.given.values
        M, h = Values.of(tree, values.q, values.qd, None, None).tolerances
        tolerance = np.fmax(
            self.search.tolerance,
            self.equations.layout.packed(M, h, h if self.given.rest is not None else 0.0 * h),
        )
        left = self.search.weighted(Equations(tree, values.q, values.qd, self.equations.layout).right)
        return fit._replace(ratio=float((np.abs(left) * self.search.tolerance / tolerance).max()))

    @cached_property
    def conventions(self) -> list[tuple[Convention, float]]:
        """Each convention, and what it leaves at a few states, a share."""
        equations, search = self.equations, self.search
        those = list(all_conventions(equations))
        few = [convention.first(FEW) for convention in those]
        size = float(np.linalg.norm(search.off[:FEW])) or 1.0
        left = [float(np.linalg.norm(search.weighted(values))) / size for values in values_in(equations, few)]
        return list(zip(those, left))

    @cached_property
    def in_conventions(self) -> list[Cause]:
        """The conventions that leave nothing."""
        causes = []
        for convention, left in self.conventions:
            if left < 1e-3:
                (values,) = values_in(self.equations, [convention])
                for complete in self.search.explained([(convention.cause, values)]):
                    causes += self.statements.restated(complete, convention.joints)
        return causes

    @cached_property
    def near_conventions(self) -> list[Convention]:
        """The conventions that leave least, if they leave something."""
        best = sorted((pair for pair in self.conventions if pair[1] < PARTIAL), key=lambda pair: pair[1])
        return [convention for convention, _ in best[:NEAR]]

    @cached_property
    def h_follows_from_M(self) -> bool:
        """Whether the velocity terms are those of the given Mbar, by its derivatives."""
        given = self.given
        if given.mass_matrix is None or given.rest is None or self.equations.coordinates.has_balls:
            return False
        return follows_from(
            given.mass_matrix, given.values.q, given.values.qd, given.values.bias - given.rest
        )


def in_part(cause: Cause, parts: Sequence[str]) -> Cause:
    """A cause that is meant in some parts alone."""
    return (
        replace(cause, place=f"{cause.place}{IN_PARTS[tuple(parts)]}") if tuple(parts) in IN_PARTS else cause
    )


def distinct(causes: Iterable[Cause]) -> list[Cause]:
    """Each cause once; none of every body or joint where one of them suffices."""
    once = list({(cause.place, str(cause.explains)): cause for cause in reversed(list(causes))}.values())[
        ::-1
    ]
    return [cause for cause in once if not any(is_of_one(other, cause) for other in once)]


def is_of_one(cause: Cause, of_all: Cause) -> bool:
    """Whether a cause is for one body or joint what another is for every one."""
    before, every, after = of_all.place.partition("every ")
    after = after.partition(" ")[2]
    is_alike = (
        cause.place.startswith(before) and cause.place.endswith(after) and cause.explains == of_all.explains
    )
    return bool(every) and "every " not in cause.place and cause.kind == of_all.kind and is_alike
