"""Which form of the dynamics is traced for a tree: of the same sums in another order, that with fewer operations.

Up to some ten joints in a row, and for trees of short branches, those are the sums in the frames of the joints (composite.py);
beyond, those in the axes of the world (articulated.py), whose number grows with the number of joints.
"""

from functools import lru_cache

from tmt.derivation import articulated, composite, linearized
from tmt.derivation.dual import seeded
from tmt.derivation.mechanism import AnyTree
from tmt.derivation.method import Terms, reduced_force
from tmt.derivation.quantities import Form, State, Step, argument_of, quantity_of
from tmt.derivation.scalar import Rows, Scalar, Values
from tmt.methods import Linearized, method_named, one_step
from tmt.methods.derivatives import is_straight
from tmt.methods.dynamics import Dynamics, Held, acts_at_single_joints, minus, plus
from tmt.methods.stepping import Method
from tmt.model.tree import Tree

from .straight import Traced, trace
from .trace import Expression

# speeds: up to FEW the composite form alone is traced, from MANY on the articulated one alone
FEW, MANY = 5, 20
DENSE = 10  # speeds from which solving linear systems and the derivatives of the bias are loops and no longer straight lines
FORMS = (
    Form(composite.mass_matrix_and_bias, composite.generalized_force),
    Form(articulated.mass_matrix_and_bias, articulated.generalized_force, linearized.rates),
)


class Traceable(Dynamics):
    """Mbar and h of a tree for its traced functions, in the form with fewer operations.

    Of more than a few speeds the derivatives of h by the speeds and the solution of linear systems are functions that are called.
    by_bodies: accelerations are those of articulated bodies, where all that a method takes implicitly acts at single joints: then
    it counts as armature.
    """

    def __init__(self, tree: AnyTree, by_bodies: bool = False):
        form = articulated if is_shorter_articulated(tree) else composite
        super().__init__(form.mass_matrix_and_bias)
        self.n, self.by_bodies, self.has_used_bodies = len(tree.axis), by_bodies, False

    def acceleration(
        self, tree: AnyTree, q: Values, qd: Values, tau: Values, implicit: Held = None
    ) -> Values:
        if not self.by_bodies or (implicit and not acts_at_single_joints(implicit)):
            return super().acceleration(tree, q, qd, tau, implicit)
        self.has_used_bodies = True
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


@lru_cache(maxsize=64)
def is_shorter_articulated(tree: Tree) -> bool:
    """Whether Mbar and h have fewer operations in the articulated form."""
    n = len(tree.axis)
    if n <= FEW or n >= MANY:
        return n >= MANY

    def length(terms: Terms) -> int:
        return len(trace("terms", (tree.coordinates.nq, n), lambda q, qd: flat(terms(tree, q, qd))).nodes)

    return length(articulated.mass_matrix_and_bias) < length(composite.mass_matrix_and_bias)


def quantity(tree: Tree, name: str) -> Traced:
    """A quantity, by its full name, as a function of (q, qd, tau or qdd, dt), flat."""
    if name == "acceleration":
        return slope(tree, Method(), "quantity", with_step=False)
    if not (quantity_of(name).is_long or name == "inverse_dynamics"):
        return in_form(tree, name, FORMS[is_shorter_articulated(tree)])
    forms = FORMS[len(tree.axis) >= MANY :]
    return min((in_form(tree, name, form) for form in forms), key=lambda traced: traced.length)


def in_form(tree: Tree, name: str, form: Form) -> Traced:
    """A quantity whose sums are in the order of a form."""
    row, (nq, n) = quantity_of(name), (tree.coordinates.nq, len(tree.axis))
    step = straight_step(tree, argument_of(name), form) if row.argument == "method" else None

    def function(*arrays: Values) -> Values:
        state = State(tree, dict(zip(row.takes, arrays)), form, argument_of(name), step)
        return flat(row.of(state))

    return trace("quantity", (nq, n, n, 1), function)


def straight_step(tree: AnyTree, name: str, form: Form) -> Step:
    """A step of the method of that name without loops; ValueError of one that solves its stages."""
    stepping = method_named(name)
    if not is_straight(stepping):
        raise ValueError(f"a step of {name} is no fixed row of operations: NumPy alone gives its derivatives")
    dynamics = Linearized(form)
    return lambda q, qd, tau, dt: one_step(stepping, tree, q, qd, tau, dt, dynamics)


def flat(nested: Scalar) -> Values:
    """The scalars of nested lists or tuples, in a row."""
    return [x for part in nested for x in flat(part)] if isinstance(nested, (list, tuple)) else [nested]


def slope(tree: Tree, stepping: Method, name: str = "slope", with_step: bool = True) -> Traced:
    """The slope of a method as a function of (q, qd, tau) and, with_step, dt."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv

    def traced(dynamics: Traceable) -> Traced:
        def function(q: Values, qd: Values, tau: Values, dt: Values = [0.0]) -> Values:  # noqa: B006
            return stepping.slope(tree, q, qd, tau, dt[0], dynamics)

        return trace(name, (nq, n, n, *[1] * with_step), function)

    by_bodies = Traceable(tree, by_bodies=n > FEW)
    first = traced(by_bodies)
    if n >= MANY or not by_bodies.has_used_bodies:
        return first
    return min(traced(Traceable(tree)), first, key=lambda function: function.length)


def directional(tree: Tree, stepping: Method) -> Traced:
    """The slope and its derivative: (q, qd, tau, dt, dq, dqd) -> (qdd, dqdd); dq (nq) is a change of the numbers in q."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv

    def both(q: Values, qd: Values, tau: Values, dt: Values, dq: Values, dqd: Values) -> Values:
        x = seeded([*q, *qd], [*dq, *dqd])
        slopes = stepping.slope(tree, x[:nq], x[nq:], tau, dt[0], Traceable(tree, by_bodies=n > FEW))
        parts = [x[0].parts(value) for value in slopes]
        return [*(value for value, _ in parts), *(slope for _, slope in parts)]

    return trace("directional", (nq, n, n, 1, nq, n), both)


def bias_rate(tree: Tree) -> Traced:
    """The derivative of h along a change of the speeds: (q, qd, dqd) -> dh."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv

    def function(q: Values, qd: Values, dqd: Values) -> Values:
        rates = seeded(qd, dqd)
        return [rates[0].parts(x)[1] for x in articulated.bias(tree, q, rates)]

    return trace("bias_rate", (nq, n, n), function)
