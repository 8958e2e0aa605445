"""Derivatives of a step: of the slope by those of the linear system that gives it.

A slope a solves residual(a, x) = 0, which is linear in a; so da/dx = -A^-1 dresidual/dx at fixed a, with A =
dresidual/da. Then dual numbers need not go through the solution, nor through derivatives of derivatives.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from tmt.derivation.dual import Dual, values_of
from tmt.derivation.form import COMPOSITE, LITERAL, Form, Implicit
from tmt.derivation.mechanism import Mechanism
from tmt.derivation.quantities import State
from tmt.derivation.vectors import (
    Factors,
    Rows,
    Scalar,
    Values,
    added,
    is_zero,
    minus,
    plus,
    solve_any,
    total,
)
from tmt.methods.stepping import Method
from tmt.methods.stepping import State as Reached

Array = np.ndarray
FEW_SPEEDS = 4  # up to which dual numbers go through the solution of the linear system too
PART = 4096  # states times speeds that are taken at once: more do not stay in the processor's cache


class Change(NamedTuple):
    a: Values
    by_tangent: Rows
    by_speed: Rows
    matrix: Rows
    solve: Callable[[Values], Values]  # the linear system


class Linearized(Form):
    """Accelerations of dual numbers over any scalar, by the derivatives of the linear system."""

    def __init__(self, form: Form = COMPOSITE):
        super().__init__(**vars(form))
        self.last: Change  # of the state that was met last
        # dual numbers of traced scalars meet the same states once for each direction; i: of a scalar on the
        # tape
        self.changes: dict[tuple[int, ...], Change] = {}

    def acceleration(
        self, tree: Mechanism, q: Values, qd: Values, tau: Values, implicit: Implicit | None = None
    ) -> Values:
        plain_q, plain_qd, plain_tau = (values_of(part) for part in (q, qd, tau))
        plain = implicit._replace(force=values_of(implicit.force)) if implicit else None
        key = tuple(getattr(x, "i", -1) for x in (*plain_q, *plain_qd, *plain_tau))
        if -1 in key or key not in self.changes:
            self.changes[key] = self.change(tree, plain_q, plain_qd, plain_tau, plain)
        self.last = change = self.changes[key]
        dual = next((x for x in (*q, *qd, *tau) if isinstance(x, Dual)), None)
        if dual is None:
            return change.a
        dq, dqd, right = ([dual.parts(x)[1] for x in part] for part in (q, qd, tau))
        moved = tree.coordinates.tangent(plain_q, dq)
        right = minus(right, plus(times(change.by_tangent, moved), times(change.by_speed, dqd)))
        if implicit:
            right = minus(right, [dual.parts(x)[1] for x in implicit.force])
        return [Dual(value, slope, dual.level) for value, slope in zip(change.a, change.solve(right))]

    def change(
        self, tree: Mechanism, q: Values, qd: Values, tau: Values, implicit: Implicit | None
    ) -> Change:
        matrix, force = self.system(tree, q, qd, tau, implicit)
        is_symmetric = implicit is None or implicit.acts_at_single_joints
        solve = Factors(matrix).solve if is_symmetric else partial(solve_any, matrix)
        a = solve(force)
        by_tangent, by_speed = State(tree, {"q": q, "qd": qd, "qdd": a}, self).torque_rates
        if implicit and implicit.bias_rows:
            changes = self.changes_of_bias(tree, q, qd, a, implicit)
            by_tangent, by_speed = map(added, (by_tangent, by_speed), changes)
        return Change(a, by_tangent, by_speed, matrix, solve)

    def changes_of_bias(
        self, tree: Mechanism, q: Values, qd: Values, a: Values, implicit: Implicit
    ) -> list[Rows]:
        """The derivatives of dt dh/dqd a, of the implicit rows, by tangent vectors and by speeds."""
        rest, half = [0.0] * len(qd), [0.5] * len(qd)
        ahead, behind = (
            State(tree, {"q": q, "qd": speeds, "qdd": rest}, self).force_rates
            for speeds in (plus(qd, a), minus(qd, a))
        )
        dts = [implicit.dt if i in implicit.bias_rows else 0.0 for i in range(len(qd))]
        pairs = zip(ahead, behind)
        return [scaled(dts, scaled(half, [minus(*rows) for rows in zip(*pair)])) for pair in pairs]


def one_step(
    stepping: Method, tree: Mechanism, q: Values, qd: Values, tau: Values, dt: Scalar, form: Form = LITERAL
) -> Reached:
    """The state (q, qd) of a tree one dt later by a method, over any scalar."""

    def slope(q: Values, qd: Values) -> Values:
        return stepping.slope(tree, q, qd, tau, dt, form)

    return stepping.step(slope, q, qd, dt, tree.coordinates)


def amplification(
    stepping: Method, tree: Mechanism, q: Array, qd: Array, tau: Array, dt: float | Array
) -> Array:
    """The exact Jacobian of one step, d(q, qd)+/d(q, qd), shape (..., 2 nv, 2 nv), for tangent vectors of q.

    q (..., nq), qd (..., nv): states, rad and rad/s; tau: torque (nv,), N m; dt: step in s, one for all or
    (...). At an equilibrium its eigenvalues are the growth of each mode per step. By dual numbers, all
    directions at once; so it holds for partitioned and implicit methods too.
    """
    return transition(stepping, tree, q, qd, np.array(tau, float), dt, by_torque=False)


def transition(
    stepping: Method, tree: Mechanism, q: Array, qd: Array, tau: Array, dt: float | Array,
    by_torque: bool = True,
) -> Array:  # fmt: skip
    """The same by q, qd and tau (..., nv): (..., 2 nv, 3 nv) or, not by_torque, (..., 2 nv, 2 nv)."""
    nv = tree.coordinates.nv
    batch = np.broadcast_shapes(*(np.shape(x)[:-1] for x in (q, qd, tau)), np.shape(dt))
    arrays = [np.broadcast_to(x, (*batch, np.shape(x)[-1])) for x in (q, qd, tau, np.expand_dims(dt, -1))]
    states, size = [x.reshape(-1, x.shape[-1]) for x in arrays], max(1, PART // nv)
    # the Jacobian of stages that are solved for is by dual numbers of dual numbers
    form = COMPOSITE if nv <= FEW_SPEEDS or stepping.solves_stages else Linearized()
    step, jacobians = partial(one_step, stepping, tree, form=form), []
    for k in range(0, max(1, len(states[0])), size):
        part = [list(x[k : k + size].T.copy()) for x in states]
        state = State(tree, dict(zip(("q", "qd", "tau", "dt"), part)), step=step)
        rows = [np.broadcast_arrays(*row) for row in state.step_derivatives(by_torque)]
        jacobians.append(np.array(rows).transpose(2, 0, 1))
    return np.concatenate(jacobians).reshape(*batch, 2 * nv, (2 + by_torque) * nv)


def times(matrix: Rows, values: Values) -> Values:
    some = [k for k, x in enumerate(values) if not is_zero(x)]
    return [total(row[k] * values[k] for k in some) for row in matrix]


def scaled(factors: Values, rows: Rows) -> Rows:
    return [[factor * x for x in row] for factor, row in zip(factors, rows)]
