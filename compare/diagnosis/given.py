"""Given values of Mbar and h with their parts, and tolerances of their own scale; where they differ."""

from collections.abc import Callable

import numpy as np
from numpy import ndarray

from tmt import Tree

from .cause import Detail
from .conventions import Convention
from .model import MOST_SPEEDS, ROUNDED, Entry, Equations, Layout, Values, coefficients_of

SUMMED = 8.0  # times the tolerance of an entry: of a sum of its values at several speeds
MOST_POSITIONS = 6  # in a sentence
Bias = Callable[[ndarray], ndarray]  # speeds (states, nv) -> h (states, nv) at the positions of the states


class Given:
    """Values of Mbar and h, in a layout that has their parts, beside the right ones at the same states."""

    def __init__(
        self, tree: Tree, values: Values, bias: Bias | None,
        mass_matrix: Callable[[ndarray], ndarray] | None = None, rest: ndarray | None = None,
        qdd: ndarray | None = None,
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
        """The size of each entry at a state, by its largest value at all: large values are rounded too."""
        speed = 1.0 + np.abs(self.values.qd).max(axis=1, keepdims=True, initial=0.0) ** 2
        of_state, start = np.ones_like(self.packed), self.layout.in_h.start
        of_state[:, start : start + self.layout.nv] = speed
        return np.nanmax(np.abs(self.packed) / of_state, axis=0, initial=0.0) * of_state

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
        equations, details = self.equations, []
        right, of_M = equations.coefficients, equations.entries[equations.in_M]
        tolerances = dict.fromkeys(right, SUMMED * self.tolerance[:, equations.in_h].max(axis=1))
        tolerances |= dict(zip(of_M, self.tolerance.T))
        for entry, yours in (dict(zip(of_M, self.packed.T)) | self.coefficients_of_h).items():
            off = np.abs(yours - right[entry])
            if np.isfinite(yours).all() and (off > tolerances[entry]).any():
                k = int(np.argmax(off))
                positions = zip(equations.coordinates.positions[:MOST_POSITIONS], equations.q[k])
                at = tuple(f"{name} = {value:.6g}" for name, value in positions)
                numbers = (x if abs(x) > tolerances[entry][k] else 0.0 for x in (yours[k], right[entry][k]))
                your_number, right_number = numbers
                details.append(Detail(entry.named(equations.speeds), your_number, right_number, at))
        return tuple(details)

    @property
    def coefficients_of_h(self) -> dict[Entry, ndarray]:
        """The given coefficients of h, (states,) each, as far as they are known."""
        bias, nv, qd = self.bias, self.equations.nv, self.values.qd
        if not qd.any():
            return {Entry("gravity", (i,)): column for i, column in enumerate(self.values.bias.T)}
        if bias is None or nv > MOST_SPEEDS:
            return {}
        return coefficients_of(lambda speeds: np.stack([bias(speed + 0.0 * qd) for speed in speeds]), nv)
