"""Which form of the dynamics is traced for a tree: of the same sums that with the fewest operations.

It is counted for each quantity. Up to some ten joints in a row, and for trees of short branches, those are
the sums in the frames of the joints (composite.py); the bias is nearly always shorter there. Mbar of long
paths, and the accelerations of large trees, are shorter in the axes of the world (articulated.py).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

from tmt.derivation.dual import seeded
from tmt.derivation.form import ARTICULATED, BY_BODIES, COMPOSITE, Form
from tmt.derivation.mechanism import Mechanism
from tmt.derivation.quantities import State, Step, argument_of, quantity_of
from tmt.derivation.vectors import Rows, Scalar, Values, minus, plus
from tmt.methods import Linearized, method_named, one_step
from tmt.methods.stepping import Method
from tmt.model.tree import Tree

from .straight import Traced, trace
from .trace import Expression

MANY = 20  # speeds from which derivatives are not traced by dual numbers
DENSE = 10  # speeds up to which systems are solved in straight lines, dh/dqd is by dual numbers
FORMS = COMPOSITE, ARTICULATED, BY_BODIES
TreeOf = Callable[[Sequence[Values]], Mechanism]


def shortest(name: str, sizes: Sequence[int], way: Callable[..., Values], forms: Iterable[Form]) -> Traced:
    return min((trace(name, sizes, partial(way, form)) for form in forms), key=lambda traced: traced.length)


def forms_of(tree: Tree) -> list[Form]:
    """FORMS for accelerations; of more than a few speeds linear systems are solved by a call."""
    if tree.nv <= DENSE:
        return [replace(form, rates=None) for form in FORMS]
    return [replace(form, solve_any=solved_by_call) for form in FORMS]


def solved_by_call(matrix: Rows, right: Values) -> Values:
    tape = next(x.tape for x in (*right, matrix[0][0]) if isinstance(x, Expression))
    return tape.call("solution", [*(x for row in matrix for x in row), *right], len(right))


def forms_of_slopes(tree: Tree) -> list[Form]:
    return forms_of(tree) if tree.nv <= DENSE else [shortest_form(tree)]


@lru_cache(maxsize=64)
def shortest_form(tree: Tree) -> Form:
    """Of a large tree that with the shortest accelerations."""
    sizes = tree.nq, tree.nv, tree.nv
    return min(forms_of(tree), key=lambda form: trace("", sizes, partial(form.acceleration, tree)).length)


def quantity(tree: Tree, name: str, more: Sequence[int] = (), tree_of: TreeOf | None = None) -> Traced:
    """A quantity, by its full name, as a function of (q, qd, tau or qdd, dt), flat.

    more: the sizes of further arrays, from which tree_of makes the tree.
    """
    row = quantity_of(name)

    def in_form(form: Form, *arrays: Values) -> Values:
        mechanism = tree_of(arrays[4:]) if tree_of else tree
        return values_in(form, mechanism, name, dict(zip(row.takes, arrays)))

    forms: Sequence[Form] = FORMS[:2] if row.has_forms else FORMS[:1]
    if name == "acceleration":
        forms = forms_of(tree)
    elif row.is_long and row.has_forms:
        forms = [*[replace(COMPOSITE, rates=None)][: tree.nv < MANY], *forms]
    return shortest("quantity", (tree.nq, tree.nv, tree.nv, 1, *more), in_form, forms)


def values_in(form: Form, tree: Mechanism, name: str, arrays: Mapping[str, Values]) -> Values:
    """The numbers of a quantity, by its full name, of a state in arrays by name, flat."""
    row, argument = quantity_of(name), argument_of(name)
    step = straight_step(tree, argument, form) if row.argument == "method" else None
    return flat(row.of(State(tree, arrays, form, argument, step)))


def straight_step(tree: Mechanism, name: str, form: Form) -> Step:
    """A step of the method of that name without loops; ValueError of one that solves its stages."""
    stepping = method_named(name)
    if stepping.solves_stages:
        raise ValueError(f"a step of {name} is no fixed row of operations: NumPy alone gives its derivatives")
    dynamics = Linearized(form)
    return lambda q, qd, tau, dt: one_step(stepping, tree, q, qd, tau, dt, dynamics)


def flat(nested: Scalar) -> Values:
    return [x for part in nested for x in flat(part)] if isinstance(nested, (list, tuple)) else [nested]


def slope(tree: Tree, stepping: Method) -> Traced:
    def function(form: Form, q: Values, qd: Values, tau: Values, dt: Values) -> Values:
        return stepping.slope(tree, q, qd, tau, dt[0], form)

    return shortest("slope", (tree.nq, tree.nv, tree.nv, 1), function, forms_of_slopes(tree))


def directional(tree: Tree, stepping: Method) -> Traced:
    nq, nv = tree.nq, tree.nv

    def both(form: Form, q: Values, qd: Values, tau: Values, dt: Values, dq: Values, dqd: Values) -> Values:
        x = seeded([*q, *qd], [*dq, *dqd])
        slopes = stepping.slope(tree, x[:nq], x[nq:], tau, dt[0], form)
        parts = [x[0].parts(value) for value in slopes]
        return [*(value for value, _ in parts), *(slope for _, slope in parts)]

    return shortest("directional", (nq, nv, nv, 1, nq, nv), both, forms_of_slopes(tree))


def residual(tree: Tree, stepping: Any, linear: bool) -> Traced:
    """What accelerations a of the stages leave of their equations, and its derivative by da."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv

    def function(q: Values, qd: Values, tau: Values, dt: Values, a: Values, da: Values) -> Values:
        unknown, call = seeded(a, da), q[0].tape.call
        values: Values = []
        slopes: Values = []
        for state in stepping.stage_states(q, qd, dt[0], unknown, tree.coordinates):
            x, dx = map(list, zip(*(unknown[0].parts(number) for part in state for number in part)))
            start = [*q, *qd]
            qdd = call("directional", [*(start if linear else x), *tau, *dt, *dx], 2 * n)
            slopes += qdd[n:]
            if linear:
                moved = call("directional", [*start, *tau, *dt, *minus(x, start)], 2 * n)
                qdd = plus(moved, moved[n:])
            values += qdd[:n]
        return [*minus(values, a), *minus(slopes, da)]

    sizes = nq, n, n, 1, n * stepping.stages, n * stepping.stages
    return trace("linear_residual" if linear else "residual", sizes, function)
