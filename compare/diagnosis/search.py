"""The search for causes of given values of Mbar and h: everything alone, in parts, with a convention, in pairs."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import chain
from math import inf
from typing import Literal, NamedTuple

import numpy as np
from numpy import ndarray

from tmt import Tree

from ..core.cause import Cause
from ..robots.joint_map import Joint, JointMap, within_a_turn
from .cause import LEAST_STATES, Diagnosis, ranked, together
from .coefficients import Bias, Compared
from .consistency import follows_from
from .conventions import Convention, all_conventions, values_in
from .edits import edits
from .fit import Fitted, OutOfTime, Search
from .groups import loads, several
from .likelihood import NATURAL, cost
from .model import ROUNDED, Equations, Layout, Values
from .places import OF_ZERO, all_places
from .recursion import slips_of_recursion
from .slips import slips
from .variants import Variant, program_options

FEW = 2  # states at which conventions are tried first
SHOWN = 12  # single explanations that leave least
NEAR = 2  # conventions with which another cause is sought
NEARLY = 1e-9  # of the difference: what a number leaves at most that may explain it on a larger scale
PARTIAL = 0.7  # of the difference: what such a convention leaves at most
IN_PARTS = {  # how the parts in which alone a slip was made are said
    ("M",): " in M alone", ("h",): " in h alone", ("velocity terms", "gravity"): " in h alone",
    ("velocity terms",): " in the velocity terms of h alone", ("gravity",): " in gravity alone",
    ("M", "velocity terms"): ", but not in gravity", ("M", "gravity"): ", but not in the velocity terms of h",
}  # fmt: skip


class Stated(NamedTuple):
    """How the joints of given equations are stated."""

    joints: JointMap
    by: Literal["argument", "option"] = "argument"  # joints=[...] of assert_agrees, or --joints


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


class Given:
    """Values of Mbar and h, in a layout that has their parts, beside the right ones at the same states."""

    def __init__(
        self, tree: Tree, values: Values, bias: Bias | None, mass_matrix: Callable[[ndarray], ndarray] | None = None,
        rest: ndarray | None = None, qdd: ndarray | None = None,
    ):  # fmt: skip
        self.tree, self.values, self.bias, self.mass_matrix = tree, values, bias, mass_matrix
        M, h, nv = values.mass_matrix, values.bias, len(tree.axis)
        if rest is None and bias is not None and values.qd.any() and np.isfinite(h).all():
            rest = np.asarray(bias(np.zeros_like(values.qd)))
        self.rest = rest if rest is not None and np.isfinite(rest).all() else None
        skew = np.abs(M - np.swapaxes(M, 1, 2))
        is_symmetric = not (skew > 2.0 * values.tolerances[0] + ROUNDED * np.abs(M)).any()
        self.layout = Layout(nv, self.rest is not None, is_symmetric, qdd)
        self.equations = Equations(tree, values.q, values.qd, self.layout)
        at_rest = np.zeros_like(h) if self.rest is None else self.rest
        of_M, of_h = values.tolerances
        if qdd is not None:  # h are the forces of these accelerations
            self.packed, self.tolerance = h, of_h
            return
        self.packed = self.layout.packed(M, h - at_rest, at_rest)
        rounded = self.layout.packed(of_M, of_h, of_h if self.rest is not None else 0.0 * of_h)
        self.tolerance = np.where(rounded > 0.0, np.fmax(rounded, ROUNDED * self.own_scale), 0.0)

    @property
    def own_scale(self) -> ndarray:
        """The size of each entry at a state, by its largest value at all states: large values are rounded too."""
        speed = 1.0 + np.abs(self.values.qd).max(axis=1, keepdims=True, initial=0.0) ** 2
        of_state = np.ones_like(self.packed)
        of_state[
            :,
            self.layout.of_row(0, "velocity terms")[0] : self.layout.of_row(0, "velocity terms")[0]
            + self.layout.nv,
        ] = speed
        return np.nanmax(np.abs(self.packed) / of_state, axis=0, initial=0.0) * of_state

    def in_the_model(self, convention: Convention) -> "Given":
        """The values as the model has them, if they are in a convention."""
        M, h, (of_M, of_h) = self.values.mass_matrix, self.values.bias, self.values.tolerances
        rest = np.zeros_like(h) if self.rest is None else self.rest
        right = Equations(self.tree, convention.q, convention.qd).parts[0]
        M, h, rest = convention.removed(M, right, h, rest)
        scale = Values.of(self.tree, convention.q, convention.qd, M, h)
        if self.layout.qdd is not None:  # qdd = S a + drift
            qdd = np.einsum("sij,sj->si", convention.S, self.layout.qdd) + convention.drift
            moved = np.einsum("sji,sj->si", np.linalg.inv(convention.S), self.values.bias)
            return Given(
                self.tree, Values(convention.q, convention.qd, M, moved, (of_M, of_h)), None, qdd=qdd
            )
        return Given(self.tree, scale, None, None, None if self.rest is None else rest)


class Explanations:
    """What explains given values. end: the time.process_time() at which the search ends."""

    def __init__(self, given: Given, end: float, stated: Stated | None, seconds: float = inf):
        self.given, self.equations, self.stated, self.seconds, self.end = (
            given,
            given.equations,
            stated,
            seconds,
            end,
        )
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
        compared, names = self.compared, self.equations.speeds
        entries, parts = tuple(self.entries_that_differ()), tuple(self.differing)
        found = Diagnosis(
            True, entries=entries, compared=self.entries_compared, parts=parts, known=tuple(self.known)
        )
        if len(np.unique(self.equations.q, axis=0)) < LEAST_STATES:
            return found._replace(too_few=len(self.equations.q))
        causes = next(filter(None, self.stages()), [])
        nearest = sorted((fit for fit in self.all_singles if fit.is_possible), key=lambda fit: fit.left_over)[
            :SHOWN
        ]
        shares = tuple((fit.places[0].name, fit.left_over, fit.explains) for fit in nearest)
        found = found._replace(nearest=shares, causes=ranked(distinct(sorted(causes, key=self.cost))))
        if causes:
            return found
        unfinished = None if self.is_finished else self.seconds
        closest = nearest[0].cause if nearest else None
        return found._replace(closest=closest, details=compared.details(), seconds=unfinished)

    def cost(self, cause: Cause) -> float:
        return cost(cause, self.equations)

    @cached_property
    def compared(self) -> Compared:
        values, plain = (
            self.given.values,
            Equations(self.given.tree, self.given.values.q, self.given.values.qd),
        )
        if self.equations.layout.is_symmetric and "coefficients" in vars(self.equations):
            plain.coefficients = self.equations.coefficients
        of_M, of_h = values.tolerances
        tolerance = plain.layout.packed(of_M, of_h, 0.0 * of_h)
        packed = values.packed
        tolerance = np.where(
            tolerance > 0.0, np.fmax(tolerance, ROUNDED * np.nanmax(np.abs(packed), axis=0, initial=0.0)), 0.0
        )
        least = tolerance[tolerance > 0.0].min(initial=1.0)
        return Compared(plain, packed, np.where(tolerance > 0.0, tolerance, least), self.given.bias)

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
        """Explanations of everything: of each stage those that are natural, if there are any; then the others."""
        unusual: list[Cause] = []
        stages = (
            self.everything, self.derivations, self.of_parts, self.terms, self.groups, self.beside_conventions, self.pairs,
        )  # fmt: skip
        for stage in stages:
            causes: list[Cause] = []
            try:
                for cause in stage():  # what was found before the end is kept
                    causes.append(cause)
            except OutOfTime:
                self.is_finished = False
            yield [cause for cause in causes if self.cost(cause) < NATURAL]
            unusual += causes
            if not self.is_finished:
                break
        yield unusual

    def everything(self) -> Iterator[Cause]:
        """Options, conventions, single numbers and terms, and edits of several numbers."""
        yield from self.search.explained(self.options)
        yield from self.in_conventions
        yield from self.causes(fit for fit in self.all_singles if fit.explains)
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
        different, known, said = self.differing, self.known, self.differing
        if "velocity terms" in different and "M" in different and self.h_follows_from_M:
            different = [name for name in different if name != "velocity terms"]
            known = [name for name in known if name != "velocity terms"]
            causes = self.within(known)
            yield from causes
            if self.natural(causes):
                return
        if different != self.known:
            causes = [in_part(cause, said) for cause in self.within(different)]
            yield from causes
            if self.natural(causes):
                return
        for part in different[: len(different) if len(different) > 2 else len(different) - 1]:
            others = [name for name in different if name != part]
            first, second = self.natural(self.within([part])), self.natural(self.within(others))
            if first and second:
                yield together([self.in_its_part(first[0], [part]), self.in_its_part(second[0], others)], 0.0)

    def in_its_part(self, cause: Cause, parts: Sequence[str]) -> Cause:
        """A cause that is meant in some parts alone; as it is, where a place names its part."""
        return cause if cause.kind in ("coefficient", "part") else in_part(cause, parts)

    def natural(self, causes: Iterable[Cause]) -> list[Cause]:
        return sorted((cause for cause in causes if self.cost(cause) < NATURAL), key=self.cost)

    def within(self, parts: Sequence[str]) -> list[Cause]:
        """What explains some parts of the values, whatever the others are."""
        entries = np.zeros(self.search.right.shape[1], bool)
        for name in parts:
            entries[self.equations.layout.parts[name]] = True
        search = self.search.within(entries)
        if not (np.abs(search.off) > 1.0).any():
            return []
        variants = chain(self.options, self.variants, self.recursions)
        fits = [fit for fit in search.singles(is_thorough=False) if fit.explains]
        return [*search.explained(variants), *self.causes(fits)]

    def terms(self) -> Iterator[Cause]:
        """Terms of coefficients; forces of accelerations have none."""
        yield from self.compared.causes(1) if self.equations.layout.qdd is None else ()

    def beside_conventions(self) -> Iterator[Cause]:
        """A convention and one more cause, in the model's own joints."""
        for convention in self.near_conventions:
            inner = Explanations(self.given.in_the_model(convention), self.end, None)
            for cause in inner.everything_but_conventions():
                if inner.cost(cause) < NATURAL:
                    yield from self.restated(together([convention.cause, cause], 0.0), convention.joints)

    def everything_but_conventions(self) -> Iterator[Cause]:
        if self.off.any():
            yield from self.search.explained(chain(self.options, self.variants))
            yield from (fit.cause for fit in self.search.singles(is_thorough=False) if fit.explains)

    def pairs(self) -> Iterator[Cause]:
        fits = self.search.pairs(("number", OF_ZERO), ("number", OF_ZERO, "term", "coefficient"))
        yield from self.causes(fit for fit in fits if fit.explains)
        yield from self.compared.causes(2) if self.equations.layout.qdd is None else ()

    # what is computed once

    @cached_property
    def options(self) -> list[Variant]:
        return list(program_options(self.equations))

    @cached_property
    def variants(self) -> list[Variant]:
        return [*edits(self.equations), *chain.from_iterable(slips(self.equations))]

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
                    causes += self.restated(complete, convention.joints)
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

    # joints

    def causes(self, fits: Iterable[Fitted]) -> list[Cause]:
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

    def restated(self, cause: Cause, convention: JointMap | None) -> list[Cause]:
        """A cause with how joints are to be stated in its convention; [] if that cannot be."""
        if self.stated is None or convention is None:
            return [cause]
        wrong, by = self.stated
        joints = convention if wrong.is_same else wrong.after(convention, self.equations.coordinates)
        if joints is None:
            return []
        if joints.is_same and not wrong.is_same and not cause.parts:
            names = ", ".join(map(str, wrong.joints))
            part = Cause(rank=1, kind="order", place="joints", stated=names, explains="those of the model")
            cause = replace(cause, parts=(part,))
        statement = list(map(str, joints.joints))
        option = f"--joints={','.join(statement)}"
        return [replace(cause, joints=option if by == "option" else f"joints={statement}")]


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
