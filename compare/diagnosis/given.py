"""Given values of Mbar and h with their parts, and tolerances of their own scale; where they differ."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy import ndarray

from tmt import Tree

from ..core.cause import Cause
from ..robots.coordinates import Coordinates
from ..robots.joint_map import Joint, JointMap, within_a_turn
from .cause import Detail
from .consistency import follows_from
from .fit import Fitted
from .hypothesis import OF_ZERO
from .kinds.conventions import Convention
from .layout import MOST_SPEEDS, ROUNDED, Entry, Layout, Values, coefficients_of
from .model import Equations

SUMMED = 8.0  # times the tolerance of an entry: of a sum of its values at several speeds
MOST_POSITIONS = 6  # in a sentence
Bias = Callable[[ndarray], ndarray]  # speeds (states, nv) -> h (states, nv) at the positions of the states


class Given:
    """Values of Mbar and h, in a layout that has their parts, beside the right ones at the same states."""

    def __init__(
        self, tree: Tree, values: Values, bias: Bias | None,
        mass_matrix: Callable[[ndarray], ndarray] | None = None, rest: ndarray | None = None,
        qdd: ndarray | None = None, with_forces: bool = False,
    ):  # fmt: skip
        self.tree, self.values, self.bias, self.mass_matrix = tree, values, bias, mass_matrix
        M, h, (of_M, of_h) = values.mass_matrix, values.bias, values.tolerances
        if rest is None and bias is not None and values.qd.any() and np.isfinite(h).all():
            rest = np.asarray(bias(np.zeros_like(values.qd)))
        self.rest = rest if rest is not None and np.isfinite(rest).all() else None
        skew = np.abs(M - np.swapaxes(M, 1, 2))
        is_symmetric = not (skew > 2.0 * of_M + ROUNDED * np.abs(M)).any()
        self.layout = Layout(len(tree.axis), self.rest is not None, is_symmetric, qdd, with_forces)
        self.equations = Equations(tree, values.q, values.qd, self.layout)
        if qdd is not None:  # h are the forces of these accelerations
            self.packed, self.tolerance = h, of_h
            return
        at_rest, of_rest = (0.0 * h, 0.0 * of_h) if self.rest is None else (self.rest, of_h)
        self.packed = self.layout.packed(M, h - at_rest, at_rest)
        rounded = self.layout.packed(of_M, of_h, of_rest)
        # large values are rounded too: the size of each entry at a state, by its largest value at all
        of_state, part = np.ones_like(self.packed), list(self.layout.parts.values())[1]
        of_state[:, part] = 1.0 + np.abs(values.qd).max(axis=1, keepdims=True, initial=0.0) ** 2
        own_scale = np.nanmax(np.abs(self.packed) / of_state, axis=0, initial=0.0) * of_state
        self.tolerance = np.where(rounded > 0.0, np.fmax(rounded, ROUNDED * own_scale), 0.0)

    @cached_property
    def h_follows_from_M(self) -> bool:
        """Whether the velocity terms are those of the given Mbar, by its derivatives."""
        values = self.values
        if self.mass_matrix is None or self.rest is None or self.equations.coordinates.has_balls:
            return False
        return follows_from(self.mass_matrix, values.q, values.qd, values.bias - self.rest)

    def in_the_model(self, convention: Convention) -> "Given":
        """The values as the model has them, if they are in a convention."""
        q, qd, qdd = convention.q, convention.qd, self.layout.qdd
        M, h, tolerances = self.values.mass_matrix, self.values.bias, self.values.tolerances
        if qdd is not None:  # S a + drift; the forces are S'^-1 of those that are given
            qdd = np.einsum("sij,sj->si", convention.S, qdd) + convention.drift
            force = np.linalg.solve(np.swapaxes(convention.S, 1, 2), h[..., None])[..., 0]
            return Given(self.tree, Values(q, qd, M, force, tolerances), None, qdd=qdd)
        rest = np.zeros_like(h) if self.rest is None else self.rest
        M, h, rest = convention.removed(M, Equations(self.tree, q, qd).parts[0], h, rest)
        values = Values.of(self.tree, q, qd, M, h)
        return Given(self.tree, values, None, None, None if self.rest is None else rest)

    def details(self) -> tuple[Detail, ...]:
        """Entries of Mbar, gravity and coefficients of h that differ, where they are furthest apart."""
        equations, bias, qd, details = self.equations, self.bias, self.values.qd, []
        own = dict(zip(equations.entries[equations.in_M], self.packed.T))
        of_h = SUMMED * self.tolerance[:, equations.in_h].max(axis=1)
        tolerances = dict(zip(own, self.tolerance.T))
        if not qd.any():
            own |= {Entry("gravity", (i,)): column for i, column in enumerate(self.values.bias.T)}
        elif bias is not None and equations.nv <= MOST_SPEEDS:
            still = np.zeros_like(qd)
            own |= coefficients_of(lambda speeds: np.stack([bias(x + still) for x in speeds]), equations.nv)
        for entry, yours in own.items():
            right, tolerance = equations.coefficients[entry], tolerances.get(entry, of_h)
            off = np.abs(yours - right)
            if np.isfinite(yours).all() and (off > tolerance).any():
                k = int(np.argmax(off))
                positions = zip(equations.coordinates.positions[:MOST_POSITIONS], equations.q[k])
                at = tuple(f"{name} = {value:.6g}" for name, value in positions)
                least, name = tolerance[k], entry.named(equations.speeds)
                own_number, right_number = (float(x[k]) if abs(x[k]) > least else 0.0 for x in (yours, right))
                details.append(Detail(name, own_number, right_number, at))
        return tuple(details)


# how joints are to be stated in the convention of a cause


class Stated(NamedTuple):
    """How the joints of given equations are stated."""

    joints: JointMap
    by: Literal["argument", "option"] = "argument"  # joints=[...] of assert_agrees, or --joints


def causes_of(fits: Iterable[Fitted], coordinates: Coordinates, stated: Stated | None) -> Iterator[Cause]:
    """The fits as causes; of conventions and zeros of joints with the joints to state.

    stated: the joints as stated, which may be wrong; None: they cannot be.
    """
    for fit in fits:
        cause, joints = fit.cause, fit.hypotheses[0].joints
        if all(part.kind == OF_ZERO for part in cause.parts or (cause,)):
            joints = with_zeros(fit, coordinates)
        yield from restated(cause, joints, coordinates, stated)


def with_zeros(fit: Fitted, coordinates: Coordinates) -> JointMap:
    """Joints with the zeros of a fit."""
    changes = zip(fit.hypotheses, fit.changes)
    zeros = {one.cause.place: one.value(change) - float(one.cause.stated) for one, change in changes}
    joints = []
    for name, kind in zip(coordinates.names, coordinates.all_kinds):
        zero = within_a_turn(zeros.get(f"zero of {name}", 0.0), kind == "slide")
        joints.append(Joint(name, zero=float(f"{zero:.12g}"), slides=kind == "slide"))
    return JointMap(coordinates, joints)


def restated(
    cause: Cause, convention: JointMap | None, coordinates: Coordinates, stated: Stated | None
) -> list[Cause]:
    """A cause with how joints are to be stated in its convention; [] if that cannot be."""
    if stated is None or convention is None:
        return [cause]
    wrong, by = stated
    joints = convention if wrong.is_same else wrong.after(convention, coordinates)
    if joints is None:
        return []
    if joints.is_same and not wrong.is_same and not cause.parts:
        names = ", ".join(map(str, wrong.joints))
        part = Cause(rank=1, kind="order", place="joints", stated=names, explains="those of the model")
        cause = replace(cause, parts=(part,))
    own = list(map(str, joints.joints))
    return [replace(cause, joints=f"--joints={','.join(own)}" if by == "option" else f"joints={own}")]
