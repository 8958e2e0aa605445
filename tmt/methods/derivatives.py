"""Derivatives of a step: of the slope by those of the linear system that gives it.

A slope a solves residual(a, x) = 0, which is linear in a; so da/dx = -A^-1 dresidual/dx at fixed a, with A = dresidual/da. Then
dual numbers need not go through the solution, nor through derivatives of derivatives.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from tmt.derivation import composite
from tmt.derivation.dual import Dual, seeded
from tmt.derivation.mechanism import AnyTree
from tmt.derivation.method import reduced_force
from tmt.derivation.quantities import Form, State, added
from tmt.derivation.vectors import Factors, Rows, Scalar, Values, is_zero, solve_any, total
from tmt.methods.stepping import LITERAL, Dynamics, Held, Implicit, Method, minus, plus, stepped
from tmt.methods.stepping import State as Reached

Array = np.ndarray
FEW_SPEEDS = 4  # up to which dual numbers go through the solution of the linear system too
PART = 4096  # states times speeds that are taken at once: more do not stay in the processor's cache


class Differentiated(Dynamics):
    """Accelerations at many states, of dual numbers by the derivatives of the linear system."""

    def __init__(self) -> None:
        super().__init__(composite.mass_matrix_and_bias)
        # of the last states: A (states, nv, nv) and the force (states, nv) of A a = force
        self.system: tuple[Array, Array]

    def residual(
        self, tree: AnyTree, a: Values, q: Values, qd: Values, tau: Values, implicit: Held
    ) -> Values:
        """What a leaves of the linear system, (nv,): zero where it is the slope, and linear in a.

        dh/dqd a is (h(qd + a) - h(qd - a)) / 2, as h is quadratic in the speeds.
        """
        M, h = self.terms(tree, q, qd)
        force = reduced_force(tree, h, q, qd, tau)
        if implicit is None:
            return minus(times(M, a), force)
        left = minus(plus(times(M, a), times(implicit.matrix, a)), minus(force, implicit.pull))
        if implicit.bias_rows:
            ahead, behind = (self.terms(tree, q, speeds)[1] for speeds in (plus(qd, a), minus(qd, a)))
            for i in implicit.bias_rows:
                left[i] = left[i] + 0.5 * implicit.dt * (ahead[i] - behind[i])
        return left

    def acceleration(
        self, tree: AnyTree, q: Values, qd: Values, tau: Values, implicit: Held = None
    ) -> Values:
        plain_q, plain_qd, plain_tau, plain = plain_parts(q, qd, tau, implicit)
        n, states = len(qd), plain_qd[0].shape
        unknown = seeded(np.zeros((n, *states)), np.eye(n)[..., None])
        left = self.residual(tree, unknown, plain_q, plain_qd, plain_tau, plain)
        A = np.array([np.broadcast_to(row.slope, (n, *states)) for row in left]).transpose(2, 0, 1)
        self.system = A, -np.array([np.broadcast_to(row.value, states) for row in left]).T
        a = np.linalg.solve(A, self.system[1][..., None])[..., 0].T.copy()
        dual = next((x for x in (*q, *qd, *tau) if isinstance(x, Dual)), None)
        if dual is None:
            return list(a)
        left = self.residual(tree, list(a), q, qd, tau, implicit)
        # what no state changes is no dual number: a sphere that floats free
        rows = np.array([np.broadcast_to(dual.parts(x)[1], (len(dual.slope), a.shape[1])) for x in left])
        slopes = -np.linalg.solve(A, rows.transpose(2, 0, 1)).transpose(1, 2, 0)
        return [Dual(value, slope, dual.level) for value, slope in zip(a, slopes.copy())]


class Change(NamedTuple):
    """Accelerations at a state and torque, and what changes them: matrix da = dtau - by_movement dq - by_speed dqd."""

    a: Values
    by_movement: Rows
    by_speed: Rows
    solve: Callable[[Values], Values]  # the linear system


class Linearized(Dynamics):
    """Accelerations of dual numbers over any scalar, with the derivatives of the linear system by those of Mbar qdd + h."""

    def __init__(self, form: Form):
        super().__init__(form.terms)
        self.form = form
        # all directions of dual numbers meet the same states
        self.changes: dict[tuple[Scalar, ...], Change] = {}

    def acceleration(
        self, tree: AnyTree, q: Values, qd: Values, tau: Values, implicit: Held = None
    ) -> Values:
        plain_q, plain_qd, plain_tau, plain = plain_parts(q, qd, tau, implicit)
        key = tuple(x.i if hasattr(x, "i") else x for x in (*plain_q, *plain_qd, *plain_tau))
        if key not in self.changes:
            self.changes[key] = self.change(tree, plain_q, plain_qd, plain_tau, plain)
        change = self.changes[key]
        dual = next((x for x in (*q, *qd, *tau) if isinstance(x, Dual)), None)
        if dual is None:
            return change.a
        dq, dqd, right = ([dual.parts(x)[1] for x in part] for part in (q, qd, tau))
        moved = tree.coordinates.tangent(plain_q, dq)
        right = minus(right, plus(times(change.by_movement, moved), times(change.by_speed, dqd)))
        if implicit:
            right = minus(right, [dual.parts(x)[1] for x in implicit.pull])
        return [Dual(value, slope, dual.level) for value, slope in zip(change.a, change.solve(right))]

    def change(self, tree: AnyTree, q: Values, qd: Values, tau: Values, implicit: Held) -> Change:
        a = super().acceleration(tree, q, qd, tau, implicit)
        state = State(tree, {"q": q, "qd": qd, "qdd": a}, self.form)
        matrix, (by_movement, by_speed) = state.mass_matrix, state.torque_rates
        if implicit:
            matrix = added(matrix, implicit.matrix)
        if implicit is None or implicit.acts_at_single_joints:
            return Change(a, by_movement, by_speed, Factors(matrix).solve)
        if implicit.bias_rows:
            changes = self.changes_of_bias(tree, q, qd, a, implicit)
            matrix, by_movement, by_speed = map(added, (matrix, by_movement, by_speed), changes)
        return Change(a, by_movement, by_speed, partial(solve_any, matrix))

    def changes_of_bias(
        self, tree: AnyTree, q: Values, qd: Values, a: Values, implicit: Implicit
    ) -> list[Rows]:
        """dt dh/dqd in the rows that are implicit, and the derivatives of dt dh/dqd a by movements and by speeds."""
        rest, half = [0.0] * len(qd), [0.5] * len(qd)
        now, ahead, behind = (
            State(tree, {"q": q, "qd": speeds, "qdd": rest}, self.form).force_rates
            for speeds in (qd, plus(qd, a), minus(qd, a))
        )
        dts = [implicit.dt if i in implicit.bias_rows else 0.0 for i in range(len(qd))]
        changes = [scaled(half, [minus(*rows) for rows in zip(*pair)]) for pair in zip(ahead, behind)]
        return [scaled(dts, rows) for rows in (now[1], *changes)]


def one_step(
    stepping: Method, tree: AnyTree, q: Values, qd: Values, tau: Values, dt: Scalar,
    dynamics: Dynamics = LITERAL,
) -> Reached:  # fmt: skip
    """The state (q, qd) of a tree one dt later by a method, over any scalar."""
    return stepped(stepping, tree, lambda q, qd: stepping.slope(tree, q, qd, tau, dt, dynamics), q, qd, dt)


def amplification(
    stepping: Method, tree: AnyTree, q: Array, qd: Array, tau: Array, dt: float | Array
) -> Array:
    """The exact Jacobian of one step of a method, d(q, qd)+/d(q, qd), shape (..., 2 nv, 2 nv), for movements of q.

    q (..., nq), qd (..., nv): states, rad and rad/s; tau: torque (nv,), N m; dt: step in s, one for all or (...). At an
    equilibrium it is what a step does to a small deviation: its eigenvalues are the growth of each mode per step. By dual
    numbers, all directions at once; so it holds for partitioned and implicit methods too.
    """
    return transition(stepping, tree, q, qd, np.array(tau, float), dt, by_torque=False)


def transition(
    stepping: Method, tree: AnyTree, q: Array, qd: Array, tau: Array, dt: float | Array,
    by_torque: bool = True,
) -> Array:  # fmt: skip
    """The same by q, qd and then tau (..., nv), each a column: (..., 2 nv, 3 nv) or, not by_torque, (..., 2 nv, 2 nv)."""
    nv = tree.coordinates.nv
    width = (2 + by_torque) * nv
    batch = np.broadcast_shapes(*(np.shape(x)[:-1] for x in (q, qd, tau)), np.shape(dt))
    q, qd, tau = (
        np.broadcast_to(x, (*batch, np.shape(x)[-1])).reshape(-1, np.shape(x)[-1]) for x in (q, qd, tau)
    )
    steps, size = np.broadcast_to(dt, batch).reshape(-1), max(1, PART // nv)
    jacobians = [np.empty((0, 2 * nv, width))]
    for k in range(0, len(steps), size):
        part = slice(k, k + size)
        states = q[part], qd[part], tau[part]
        jacobians.append(jacobian_of_part(stepping, tree, *states, steps[part], width))
    return np.concatenate(jacobians).reshape(*batch, 2 * nv, width)


def jacobian_of_part(
    stepping: Method, tree: AnyTree, q: Array, qd: Array, tau: Array, dt: Array, width: int
) -> Array:
    """The same of a few states: q (states, nq), qd and tau (states, nv), dt (states,); width: how many columns."""
    joints, nv, nq = tree.coordinates, qd.shape[1], q.shape[1]
    start = [*q.T.copy(), *qd.T.copy(), *tau.T.copy()]
    directions = np.eye(width)[..., None]  # component, direction, state
    moved = [*joints.component_rates(start[:nq], directions[:nv]), *directions[nv:]]
    state = [*seeded(start[: len(moved)], moved), *start[len(moved) :]]
    # the Jacobian of stages that are solved for is by dual numbers of dual numbers
    through_solution = nv <= FEW_SPEEDS or stepping.solves_stages
    dynamics = Dynamics(composite.mass_matrix_and_bias) if through_solution else Differentiated()
    torque = state[nq + nv :]
    new_q, new_qd = one_step(stepping, tree, state[:nq], state[nq : nq + nv], torque, dt, dynamics)
    moved = joints.tangent([x.value for x in new_q], [x.slope for x in new_q])
    slopes = [np.broadcast_to(slope, (width, len(dt))) for slope in (*moved, *(x.slope for x in new_qd))]
    return np.array(slopes).transpose(2, 0, 1)


def plain_parts(q: Values, qd: Values, tau: Values, implicit: Held) -> tuple[Values, Values, Values, Held]:
    """A state, a torque and what is implicit, without derivatives."""
    plain = implicit._replace(pull=values_of(implicit.pull)) if implicit else None
    return values_of(q), values_of(qd), values_of(tau), plain


def values_of(numbers: Values) -> Values:
    return [x.value if isinstance(x, Dual) else x for x in numbers]


def times(matrix: Rows, values: Values) -> Values:
    some = [k for k, x in enumerate(values) if not is_zero(x)]
    return [total(row[k] * values[k] for k in some) for row in matrix]


def scaled(factors: Values, rows: Rows) -> Rows:
    return [[factor * x for x in row] for factor, row in zip(factors, rows)]
