"""Accelerations of a tree, by which every method steps: Mbar and h in one of their forms, and the solution of a linear system.

A method's `slope` asks a Dynamics for them. Another way to have them is a subclass: with calls in compiled code
(forms.py), with derivatives by those of the linear system (derivatives.py).
"""

from typing import NamedTuple

from tmt.derivation import method
from tmt.derivation.mechanism import AnyTree
from tmt.derivation.method import Terms as Terms
from tmt.derivation.vectors import Rows, Scalar, Scalars, Values, solve, solve_any


class Implicit(NamedTuple):
    """What a method takes at the end of its step: (Mbar + matrix [+ dt dh/dqd, in some rows]) a = Qbar - pull."""

    matrix: Rows  # (nv, nv)
    pull: Values  # (nv,), N m
    dt: Scalar  # s
    bias_rows: frozenset[int]  # speeds of whose bias it takes the change


Held = Implicit | None


def acts_at_single_joints(implicit: Implicit) -> bool:
    """Whether what a method takes implicitly is diagonal."""
    across = [x for i, row in enumerate(implicit.matrix) for j, x in enumerate(row) if i != j]
    return not implicit.bias_rows and all(isinstance(x, float) and x == 0.0 for x in across)


class Dynamics:
    """Accelerations from Mbar and h, which `terms` gives."""

    def __init__(self, terms: Terms = method.mass_matrix_and_bias):
        self.terms = terms

    def __call__(self, tree: AnyTree, q: Scalars, qd: Scalars) -> tuple[Rows, Values]:
        """Mbar (nv rows of nv) and h (nv,)."""
        return self.terms(tree, q, qd)

    def acceleration(
        self, tree: AnyTree, q: Values, qd: Values, tau: Values, implicit: Held = None
    ) -> Values:
        """a (nv,) from Mbar a = Qbar, or from the linear system of a method that takes something implicitly."""
        M, h = self(tree, q, qd)
        force = method.reduced_force(tree, h, q, qd, tau)
        if implicit is None:
            return solve(M, force)
        matrix = [plus(*rows) for rows in zip(M, implicit.matrix)]
        if implicit.bias_rows:
            rates = self.bias_rates(tree, q, qd)
            changes = {i: [implicit.dt * rate for rate in rates[i]] for i in implicit.bias_rows}
            matrix = [plus(row, changes[i]) if i in changes else row for i, row in enumerate(matrix)]
        return self.solve_any(matrix, minus(force, implicit.pull))

    def bias_rates(self, tree: AnyTree, q: Values, qd: Values) -> Rows:
        return method.bias_rates(tree, q, qd, self.terms)

    def solve_any(self, matrix: Rows, right: Values) -> Values:
        return solve_any(matrix, right)


LITERAL = Dynamics()


def dynamics_of(terms: Terms) -> Dynamics:
    """Dynamics as they are, or those of another function for Mbar and h."""
    return terms if isinstance(terms, Dynamics) else Dynamics(terms)


def plus(first: Values, second: Values) -> Values:
    return [a + b for a, b in zip(first, second)]


def minus(first: Values, second: Values) -> Values:
    return [a - b for a, b in zip(first, second)]
