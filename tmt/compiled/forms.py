"""Which form of the dynamics is traced for a tree: of the same sums in another order, that with the fewest operations.

It is counted for each quantity. Up to some ten joints in a row, and for trees of short branches, those are the sums in the frames
of the joints (composite.py); the bias is nearly always shorter there. Mbar of long paths, and the accelerations of large trees,
are shorter in the axes of the world (articulated.py).
"""

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property

from tmt.derivation import articulated, composite
from tmt.derivation.dual import seeded
from tmt.derivation.mechanism import AnyTree
from tmt.derivation.method import Terms, reduced_force
from tmt.derivation.quantities import QUANTITIES, State
from tmt.derivation.scalar import Rows, Scalar, Values
from tmt.derivation.vectors import Scalars
from tmt.methods.dynamics import Dynamics, Held, Implicit, minus, plus
from tmt.methods.stepping import Method
from tmt.model.tree import Tree

from .straight import Traced, trace
from .trace import Expression

DENSE = 10  # speeds from which solving linear systems and the derivatives of the bias are loops and no longer straight lines


def mixed(tree: AnyTree, q: Scalars, qd: Scalars) -> tuple[Rows, Values]:
    """Mbar in the axes of the world, h in the frames of the joints."""
    M, _ = articulated.mass_matrix_and_bias(tree, q, [0.0] * len(qd))
    return M, composite.mass_matrix_and_bias(tree, q, qd)[1]


FORMS: tuple[Terms, ...] = composite.mass_matrix_and_bias, articulated.mass_matrix_and_bias, mixed


def shortest(candidates: Iterable[Traced]) -> Traced:
    return min(candidates, key=lambda traced: traced.length)


class Regrouped(State):
    """A state whose Mbar and h are those of a form."""

    def __init__(self, terms: Terms, tree: AnyTree, q: Scalars, qd: Scalars | None, tau: Scalars):
        super().__init__(tree, q, qd, tau)
        self.form = terms

    @cached_property
    def terms(self) -> tuple[Rows, Values]:
        return self.form(self.tree, self.q, self.qd)

    @cached_property
    def mass_matrix(self) -> Rows:
        return self.terms[0]

    @cached_property
    def bias(self) -> Values:
        return self.terms[1]

    @property
    def gravity_balance(self) -> Values:
        return self.form(self.tree, self.q, [0.0] * len(self.qd))[1]


class Traceable(Dynamics):
    """Mbar and h of a form, for traced functions.

    Of more than a few speeds the derivatives of h by the speeds and the solution of linear systems are functions that are called.
    by_bodies: accelerations are those of articulated bodies, where all that a method takes implicitly acts at single joints: then
    it counts as armature.
    """

    def __init__(self, tree: Tree, terms: Terms, by_bodies: bool = False):
        super().__init__(terms)
        self.n, self.by_bodies = len(tree.axis), by_bodies

    def acceleration(
        self, tree: AnyTree, q: Values, qd: Values, tau: Values, implicit: Held = None
    ) -> Values:
        if not self.by_bodies or (implicit and not acts_at_single_joints(implicit)):
            return super().acceleration(tree, q, qd, tau, implicit)
        force, armature = reduced_force(tree, [0.0] * self.n, q, qd, tau), list(tree.armature)
        if implicit:
            force = minus(force, implicit.pull)
            armature = plus(armature, [row[i] for i, row in enumerate(implicit.matrix)])
        return articulated.acceleration(tree, q, qd, force, armature)

    def bias_rates(self, tree: AnyTree, q: Values, qd: Values) -> Rows:
        if self.n <= DENSE:
            return super().bias_rates(tree, q, qd)
        rates = q[0].tape.call("bias_rates", [*q, *qd], self.n * self.n)
        return [rates[self.n * i : self.n * (i + 1)] for i in range(self.n)]

    def solve_any(self, matrix: Rows, right: Values) -> Values:
        if self.n <= DENSE:
            return super().solve_any(matrix, right)
        tape = next(x.tape for x in (*right, matrix[0][0]) if isinstance(x, Expression))
        return tape.call("solution", [*(x for row in matrix for x in row), *right], self.n)


def acts_at_single_joints(implicit: Implicit) -> bool:
    """Whether what a method takes implicitly is diagonal."""
    across = [x for i, row in enumerate(implicit.matrix) for j, x in enumerate(row) if i != j]
    return not implicit.bias_rows and all(isinstance(x, float) and x == 0.0 for x in across)


def all_dynamics(tree: Tree) -> list[Traceable]:
    """The ways to the accelerations of a tree: by Mbar and h in each form, and by articulated bodies."""
    by_terms = [Traceable(tree, terms) for terms in FORMS]
    return [*by_terms, Traceable(tree, articulated.mass_matrix_and_bias, by_bodies=True)]


def quantity(
    tree: Tree,
    name: str,
    more: Sequence[int] = (),
    tree_of: Callable[[Sequence[Values]], AnyTree] | None = None,
) -> Traced:
    """A quantity as a function of (q, qd, tau), flat.

    tree_of: the tree, from more arrays of these sizes, which the function takes too.
    """
    takes, n = QUANTITIES[name].takes, len(tree.axis)

    def traced(terms: Terms, by_bodies: bool = False) -> Traced:
        def function(q: Values, qd: Values, tau: Values, *arrays: Values) -> Values:
            model = tree_of(arrays) if tree_of else tree
            if name == "acceleration":
                return Traceable(tree, terms, by_bodies).acceleration(model, q, qd, tau)
            state = Regrouped(terms, model, q, qd if "qd" in takes else None, tau)
            return flat(QUANTITIES[name].of(state))

        return trace("quantity", (tree.coordinates.nq, n, n, *more), function)

    candidates = [traced(terms) for terms in FORMS]
    if name == "acceleration":
        candidates.append(traced(articulated.mass_matrix_and_bias, by_bodies=True))
    return shortest(candidates)


def flat(nested: Scalar) -> Values:
    """The scalars of nested lists or tuples, in a row."""
    return [x for part in nested for x in flat(part)] if isinstance(nested, (list, tuple)) else [nested]


def slope(tree: Tree, stepping: Method) -> Traced:
    """The slope of a method as a function of (q, qd, tau, dt)."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv

    def traced(dynamics: Traceable) -> Traced:
        def function(q: Values, qd: Values, tau: Values, dt: Values) -> Values:
            return stepping.slope(tree, q, qd, tau, dt[0], dynamics)

        return trace("slope", (nq, n, n, 1), function)

    return shortest(map(traced, all_dynamics(tree)))


def directional(tree: Tree, stepping: Method) -> Traced:
    """The slope and its derivative: (q, qd, tau, dt, dq, dqd) -> (qdd, dqdd); dq (nq) is a change of the numbers in q."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv

    def traced(dynamics: Traceable) -> Traced:
        def both(q: Values, qd: Values, tau: Values, dt: Values, dq: Values, dqd: Values) -> Values:
            x = seeded([*q, *qd], [*dq, *dqd])
            slopes = stepping.slope(tree, x[:nq], x[nq:], tau, dt[0], dynamics)
            parts = [x[0].parts(value) for value in slopes]
            return [*(value for value, _ in parts), *(slope for _, slope in parts)]

        return trace("directional", (nq, n, n, 1, nq, n), both)

    return shortest(map(traced, all_dynamics(tree)))


def bias_rate(tree: Tree) -> Traced:
    """The derivative of h along a change of the speeds: (q, qd, dqd) -> dh."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv

    def traced(terms: Terms) -> Traced:
        def function(q: Values, qd: Values, dqd: Values) -> Values:
            rates = seeded(qd, dqd)
            return [rates[0].parts(x)[1] for x in terms(tree, q, rates)[1]]

        return trace("bias_rate", (nq, n, n), function)

    return shortest(map(traced, (composite.mass_matrix_and_bias, articulated.mass_matrix_and_bias)))
