"""Which form of the dynamics is traced for a tree: of the same sums in another order, that with fewer operations.

Up to some ten joints in a row, and for trees of short branches, those are the sums in the frames of the joints (composite.py);
beyond, those in the axes of the world (articulated.py), whose number grows with the number of joints.
"""

from collections.abc import Callable
from functools import lru_cache, partial

from tmt.derivation import articulated, composite
from tmt.derivation.dual import seeded
from tmt.derivation.quantities import QUANTITIES, State
from tmt.methods.stepping import Completed, Method
from tmt.model.values import shown

from .straight import Traced, trace
from .trace import Expression

FEW, MANY = (
    5,
    20,
)  # speeds: up to FEW the composite form alone is traced, from MANY on the articulated one alone
DENSE = 10  # speeds from which solving linear systems and the derivatives of the bias are loops and no longer straight lines
DYNAMICS = ("mass_matrix", "bias", "gravity_balance", "acceleration")


class Terms:
    """Mbar and h of a tree for its traced functions, in the form with fewer operations.

    Of more than a few speeds the derivatives of h by the speeds and the solution of linear systems are functions that are called.
    """

    def __init__(self, tree):
        self.n = len(tree.axis)
        self.form = (
            articulated.mass_matrix_and_bias
            if is_shorter_articulated(tree)
            else composite.mass_matrix_and_bias
        )
        if self.n > DENSE:
            self.bias_rates, self.solve_any = self.called_rates, self.called_solution

    def __call__(self, tree, q, qd):
        return self.form(tree, q, qd)

    def called_rates(self, tree, q, qd) -> list:
        """dh/dqd by the function of that name."""
        found = q[0].tape.call("bias_rates", [*q, *qd], self.n * self.n)
        return [found[self.n * i : self.n * (i + 1)] for i in range(self.n)]

    def called_solution(self, matrix, right) -> list:
        tape = next(x.tape for x in (*right, matrix[0][0]) if hasattr(x, "tape"))
        return tape.call("solution", [*(x for row in matrix for x in row), *right], self.n)


@lru_cache(maxsize=64)
def is_shorter_articulated(tree) -> bool:
    """Whether Mbar and h have fewer operations in the articulated form."""
    n = len(tree.axis)
    if n <= FEW or n >= MANY:
        return n >= MANY
    forms = articulated.mass_matrix_and_bias, composite.mass_matrix_and_bias
    inner, outer = (len(of_terms(tree, terms).nodes) for terms in forms)
    return inner < outer


def of_terms(tree, terms) -> Traced:
    """The upper triangle of Mbar, row by row, and h as a function of (q, qd, tau)."""
    n = len(tree.axis)

    def both(q, qd, tau):
        M, h = terms(tree, q, qd)
        return [*(M[i][j] for i in range(n) for j in range(i, n)), *h]

    return trace("quantity", (tree.coordinates.nq, n, n), both)


def quantity(tree, name: str, terms: Callable | None = None) -> Traced:
    """A quantity as a function of (q, qd, tau), flat; or "mass_matrix_and_bias", see `of_terms`.

    terms: another form of Mbar and h; ValueError if they are not what a function of tmt's would return.
    """
    terms = partial(checked_terms, terms) if terms else Terms(tree)
    if name == "mass_matrix_and_bias":
        return of_terms(tree, terms)
    if name == "acceleration" and isinstance(terms, Terms):
        return slope(tree, Method(), "quantity", with_step=False)

    def function(q, qd, tau):
        state = State(tree, q, qd if "qd" in QUANTITIES[name].takes else None, tau)
        if name in DYNAMICS:
            state.mass_matrix, state.bias = terms(tree, q, state.qd)
        return flat(state.bias if name == "gravity_balance" else QUANTITIES[name].of(state))

    return trace("quantity", (tree.coordinates.nq, len(tree.axis), len(tree.axis)), function)


def checked_terms(terms, tree, q, qd) -> tuple[list, list]:
    """Mbar and h as a user's function gives them."""
    n = len(tree.axis)
    try:
        M, h = terms(tree, q, qd)
        M, h = [[row[j] for j in range(n)] for row in (M[i] for i in range(n))], [h[i] for i in range(n)]
        if wrong := [
            x for x in (*h, *(x for row in M for x in row)) if not isinstance(x, int | float | Expression)
        ]:
            raise TypeError(f"{shown(wrong[0])} is no scalar")
        return M, h
    except Exception as error:
        why = f"{type(error).__name__}: {error}".splitlines()[0]
        wanted = f"Mbar, {n} rows of {n}, and h, {n} numbers"
        raise ValueError(f"terms(tree, q, qd) does not return {wanted}: {why}") from error


def flat(nested) -> list:
    return [x for part in nested for x in flat(part)] if isinstance(nested, (list, tuple)) else [nested]


def slope(tree, stepping: Method, name: str = "slope", with_step: bool = True) -> Traced:
    """The slope of a method as a function of (q, qd, tau) and, with_step, dt."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv

    def in_terms(q, qd, tau, dt=(0.0,)):
        return stepping.slope(tree, q, qd, tau, dt[0], Terms(tree))

    def in_bodies(q, qd, tau, dt=(0.0,)):
        return stepping.articulated(tree, q, qd, tau, dt[0])

    forms = [in_terms]
    if is_articulated(stepping, tree):
        forms = [in_terms] * (n < MANY) + [in_bodies] * (n > FEW)
    traced = (trace(name, (nq, n, n, *[1] * with_step), form) for form in forms)
    return min(traced, key=lambda one: one.length)


def is_articulated(stepping: Method, tree) -> bool:
    """Whether the slope of a method can be had from articulated bodies; not if it is another since."""
    if isinstance(stepping, Completed):
        return False
    kind = next(
        (kind for kind in type(stepping).__mro__ if {"slope", "articulated"} & vars(kind).keys()), None
    )
    return kind is not None and "articulated" in vars(kind) and stepping.articulates(tree)


def directional(tree, stepping: Method) -> Traced:
    """The slope and its derivative: (q, qd, tau, dt, dq, dqd) -> (qdd, dqdd); dq (nq) is a change of the numbers in q."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv

    def both(q, qd, tau, dt, dq, dqd):
        x = seeded([*q, *qd], [*dq, *dqd])
        if is_articulated(stepping, tree) and n > FEW:
            found = stepping.articulated(tree, x[:nq], x[nq:], tau, dt[0])
        else:
            found = stepping.slope(tree, x[:nq], x[nq:], tau, dt[0], Terms(tree))
        parts = [x[0].parts(value) for value in found]
        return [*(value for value, _ in parts), *(slope for _, slope in parts)]

    return trace("directional", (nq, n, n, 1, nq, n), both)


def bias_rate(tree) -> Traced:
    """The derivative of h along a change of the speeds: (q, qd, dqd) -> dh."""
    nq, n = tree.coordinates.nq, tree.coordinates.nv

    def function(q, qd, dqd):
        rates = seeded(qd, dqd)
        return [rates[0].parts(x)[1] for x in articulated.bias(tree, q, rates)]

    return trace("bias_rate", (nq, n, n), function)
