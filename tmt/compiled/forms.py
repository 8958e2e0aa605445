"""Which form of the dynamics is traced for a tree: of the same sums that with the fewest operations.

It is counted for each quantity. Up to some ten joints in a row, and for trees of short branches, those are
the sums in the frames of the joints (composite.py); the bias is nearly always shorter there. Mbar of long
paths, and the accelerations of large trees, are shorter in the axes of the world (articulated.py).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache, partial
from typing import TypeVar

from tmt.derivation import articulated, composite, linearized
from tmt.derivation.dual import seeded
from tmt.derivation.mechanism import AnyTree
from tmt.derivation.method import reduced_force
from tmt.derivation.quantities import Form, State, Step, argument_of, quantity_of
from tmt.derivation.vectors import Rows, Scalar, Values, minus, plus
from tmt.methods import Linearized, method_named, one_step
from tmt.methods.stepping import Dynamics, Implicit, Method
from tmt.model.tree import Tree

from .straight import Traced, trace
from .trace import Expression

Way = TypeVar("Way")
MANY = 20  # speeds from which derivatives are not traced by dual numbers
DENSE = 10  # speeds up to which systems are solved in straight lines, dh/dqd is by dual numbers
FORMS = (
    Form(composite.mass_matrix_and_bias, composite.generalized_force),
    Form(articulated.mass_matrix_and_bias, articulated.generalized_force, linearized.rates),
)
LONG_FORMS = (*FORMS[1:], FORMS[0]._replace(rates=linearized.rates))  # of derivatives


def shortest(name: str, sizes: Sequence[int], way: Callable[..., Values], ways: Iterable[Way]) -> Traced:
    return min((trace(name, sizes, partial(way, w)) for w in ways), key=lambda traced: traced.length)


class Traceable(Dynamics):
    """Mbar and h of a form, for traced functions.

    Of more than a few speeds the derivatives of h are in closed form, and linear systems solved by a call.
    by_bodies: by articulated bodies, where all that a method takes implicitly acts at single joints.
    """

    def __init__(self, tree: AnyTree, form: Form, by_bodies: bool = False):
        self.n, self.by_bodies = len(tree.axis), by_bodies
        super().__init__(form._replace(rates=linearized.rates if self.n > DENSE else None))

    def acceleration(
        self, tree: AnyTree, q: Values, qd: Values, tau: Values, implicit: Implicit | None = None
    ) -> Values:
        if not self.by_bodies or (implicit and not implicit.acts_at_single_joints):
            return super().acceleration(tree, q, qd, tau, implicit)
        force, armature = reduced_force(tree, [0.0] * self.n, q, qd, tau), list(tree.armature)
        if implicit:
            force = minus(force, implicit.force)
            armature = plus(armature, [row[i] for i, row in enumerate(implicit.matrix)])
        return articulated.acceleration(tree, q, qd, force, armature)

    def solve_any(self, matrix: Rows, right: Values) -> Values:
        if self.n <= DENSE:
            return super().solve_any(matrix, right)
        tape = next(x.tape for x in (*right, matrix[0][0]) if isinstance(x, Expression))
        return tape.call("solution", [*(x for row in matrix for x in row), *right], self.n)


def all_dynamics(tree: AnyTree) -> list[Traceable]:
    """The ways to the accelerations of a tree: by Mbar and h in each form, and by articulated bodies."""
    return [*(Traceable(tree, form) for form in FORMS), Traceable(tree, FORMS[-1], by_bodies=True)]


@lru_cache(maxsize=64)
def dynamics_for(tree: Tree) -> list[Traceable]:
    """The ways that are traced for slopes; of a large tree the shortest to its accelerations."""
    nq, n, every = tree.coordinates.nq, len(tree.axis), all_dynamics(tree)
    if n <= DENSE:
        return every

    def length(dynamics: Dynamics) -> float:
        return trace("acceleration", (nq, n, n), partial(dynamics.acceleration, tree)).length

    return [min(every, key=length)]


TreeOf = Callable[[Sequence[Values]], AnyTree]


def quantity(tree: Tree, name: str, more: Sequence[int] = (), tree_of: TreeOf | None = None) -> Traced:
    """A quantity, by its full name, as a function of (q, qd, tau or qdd, dt), flat.

    more: the sizes of further arrays, from which tree_of makes the tree.
    """
    row, nq, n = quantity_of(name), tree.coordinates.nq, len(tree.axis)
    sizes = nq, n, n, 1, *more

    def model_of(arrays: Sequence[Values]) -> AnyTree:
        return tree_of(arrays[4:]) if tree_of else tree

    def in_form(form: Form, *arrays: Values) -> Values:
        return values_in(form, model_of(arrays), name, dict(zip(row.takes, arrays)))

    def by_dynamics(dynamics: Dynamics, *arrays: Values) -> Values:
        q, qd, tau, *_ = arrays
        return dynamics.acceleration(model_of(arrays), q, qd, tau)

    if name == "acceleration":
        return shortest("quantity", sizes, by_dynamics, all_dynamics(tree))
    some = (*FORMS[: n < MANY], *LONG_FORMS) if row.is_long else FORMS  # the first by dual numbers
    return shortest("quantity", sizes, in_form, some if row.has_forms else some[:1])


def values_in(form: Form, tree: AnyTree, name: str, arrays: Mapping[str, Values]) -> Values:
    """The numbers of a quantity, by its full name, of a state in arrays by name, flat."""
    row, argument = quantity_of(name), argument_of(name)
    step = straight_step(tree, argument, form) if row.argument == "method" else None
    return flat(row.of(State(tree, arrays, form, argument, step)))


def straight_step(tree: AnyTree, name: str, form: Form) -> Step:
    """A step of the method of that name without loops; ValueError of one that solves its stages."""
    stepping = method_named(name)
    if stepping.solves_stages:
        raise ValueError(f"a step of {name} is no fixed row of operations: NumPy alone gives its derivatives")
    dynamics = Linearized(form)
    return lambda q, qd, tau, dt: one_step(stepping, tree, q, qd, tau, dt, dynamics)


def flat(nested: Scalar) -> Values:
    return [x for part in nested for x in flat(part)] if isinstance(nested, (list, tuple)) else [nested]


def slope(tree: Tree, stepping: Method) -> Traced:

    def function(dynamics: Dynamics, q: Values, qd: Values, tau: Values, dt: Values) -> Values:
        return stepping.slope(tree, q, qd, tau, dt[0], dynamics)

    nq, n = tree.coordinates.nq, tree.coordinates.nv
    return shortest("slope", (nq, n, n, 1), function, dynamics_for(tree))


def directional(tree: Tree, stepping: Method) -> Traced:
    nq, n = tree.coordinates.nq, tree.coordinates.nv

    def both(
        dynamics: Dynamics, q: Values, qd: Values, tau: Values, dt: Values, dq: Values, dqd: Values
    ) -> Values:
        x = seeded([*q, *qd], [*dq, *dqd])
        slopes = stepping.slope(tree, x[:nq], x[nq:], tau, dt[0], dynamics)
        parts = [x[0].parts(value) for value in slopes]
        return [*(value for value, _ in parts), *(slope for _, slope in parts)]

    return shortest("directional", (nq, n, n, 1, nq, n), both, dynamics_for(tree))
