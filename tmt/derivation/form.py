"""The dynamics as sums in one order, and the accelerations that follow from them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

from . import articulated, composite, linearized, method, vectors
from .mechanism import Mechanism
from .vectors import Rows, Scalar, Values, added, is_zero, minus, plus

Rates = tuple[Rows, Rows]  # by tangent vectors of q and by speeds


class Implicit(NamedTuple):
    """What a method takes at the end of its step: (Mbar + matrix [+ dt dh/dqd in rows]) a = Qbar - force."""

    matrix: Rows  # (nv, nv)
    force: Values  # (nv,), N m
    dt: Scalar  # s
    bias_rows: frozenset[int]  # speeds of whose bias it takes the change

    @property
    def acts_at_single_joints(self) -> bool:
        across = [x for i, row in enumerate(self.matrix) for j, x in enumerate(row) if i != j]
        return not self.bias_rows and all(map(is_zero, across))


@dataclass(eq=False)
class Form:
    """Mbar and h, and Mbar qdd + h, as sums in one order.

    rates: of the latter, None: by dual numbers. by_bodies: accelerations without Mbar, where all that a
    method takes implicitly acts at single joints. solve_any: of a system that is not symmetric.
    """

    terms: Callable[..., tuple[Rows, Values]]
    generalized_force: Callable[..., Values]
    rates: Callable[..., Rates] | None = None
    by_bodies: Callable[..., Values] | None = None
    solve_any: Callable[[Rows, Values], Values] = vectors.solve_any

    def acceleration(
        self, tree: Mechanism, q: Values, qd: Values, tau: Values, implicit: Implicit | None = None
    ) -> Values:
        """a (nv,) from Mbar a = Qbar, or from the linear system of an implicit method."""
        if self.by_bodies and (implicit is None or implicit.acts_at_single_joints):
            force, armature = method.reduced_force(tree, [0.0] * len(qd), q, qd, tau), list(tree.armature)
            if implicit:
                force = minus(force, implicit.force)
                armature = plus(armature, [row[i] for i, row in enumerate(implicit.matrix)])
            return self.by_bodies(tree, q, qd, force, armature)
        matrix, force = self.system(tree, q, qd, tau, implicit)
        return self.solve_any(matrix, force) if implicit else vectors.Factors(matrix).solve(force)

    def system(
        self, tree: Mechanism, q: Values, qd: Values, tau: Values, implicit: Implicit | None
    ) -> tuple[Rows, Values]:
        """The matrix of the linear system, and its right side."""
        M, h = self.terms(tree, q, qd)
        force = method.reduced_force(tree, h, q, qd, tau)
        if implicit is None:
            return M, force
        matrix = added(M, implicit.matrix)
        if implicit.bias_rows:
            rates = self.bias_rates(tree, q, qd)
            for i in implicit.bias_rows:
                matrix[i] = plus(matrix[i], [implicit.dt * rate for rate in rates[i]])
        return matrix, minus(force, implicit.force)

    def bias_rates(self, tree: Mechanism, q: Values, qd: Values) -> Rows:
        if self.rates is None:
            return method.bias_rates(tree, q, qd, self.terms)
        return self.rates(tree, q, qd, [0.0] * len(qd))[1]


LITERAL = Form(method.mass_matrix_and_bias, method.generalized_force)
COMPOSITE = Form(composite.mass_matrix_and_bias, composite.generalized_force, linearized.rates)
ARTICULATED = Form(articulated.mass_matrix_and_bias, articulated.generalized_force, linearized.rates)
BY_BODIES = replace(ARTICULATED, by_bodies=articulated.acceleration)
