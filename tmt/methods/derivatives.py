"""Derivatives of a step for many states of a tree of many joints: of the slope by those of the linear system that gives it.

A slope a solves residual(a, x) = 0, which is linear in a, see `residual` of the methods; so da/dx = -A^-1 dresidual/dx at fixed
a, with A = dresidual/da. Then dual numbers need not go through the solution, nor through derivatives of derivatives.
"""

import numpy as np

from tmt.derivation import composite
from tmt.derivation.dual import Dual, seeded
from tmt.methods.stepping import Completed, stepped

FEW_SPEEDS = 4  # up to which dual numbers go through the solution of the linear system too
PART = 4096  # states times speeds that are taken at once: more do not stay in the processor's cache


def one_step(stepping, tree, q, qd, tau, dt, *terms):
    """The state (q, qd) of a tree one dt later by a method, over any scalar; terms: another form of the dynamics, if any."""
    return stepped(stepping, tree, lambda q, qd: stepping.slope(tree, q, qd, tau, dt, *terms), q, qd, dt)


def takes_terms(stepping) -> bool:
    """Whether a method's slope is one of tmt's own, which takes another form of the dynamics."""
    kind = next((kind for kind in type(stepping).__mro__ if "slope" in vars(kind)), None)
    return (
        kind is not None and kind.__module__.split(".")[0] == __name__.split(".")[0] and kind is not Completed
    )


def amplification(stepping, tree, q, qd, tau, dt) -> np.ndarray:
    """The exact Jacobian of one step of a method, d(q, qd)+/d(q, qd), shape (..., 2 nv, 2 nv), for movements of q.

    q (..., nq), qd (..., nv): states, rad and rad/s; tau: torque (nv,), N m; dt: step in s, one for all or (...). At an
    equilibrium it is what a step does to a small deviation: its eigenvalues are the growth of each mode per step. By dual
    numbers, all directions at once; so it holds for partitioned and implicit methods too.
    """
    joints, nq, nv = tree.coordinates, tree.coordinates.nq, tree.coordinates.nv
    batch = np.broadcast_shapes(np.shape(q)[:-1], np.shape(qd)[:-1], np.shape(dt))
    if nv > FEW_SPEEDS and has_residual(stepping):
        rows = [np.broadcast_to(x, (*batch, np.shape(x)[-1])).reshape(-1, np.shape(x)[-1]) for x in (q, qd)]
        each = np.broadcast_to(dt, batch).reshape(-1)
        found = in_parts(stepping, tree, *rows, [float(t) for t in tau], each)
        return found.reshape(*batch, 2 * nv, 2 * nv)
    start = [np.broadcast_to(values, (*batch, np.shape(values)[-1])) for values in (q, qd)]
    start = [values[..., i] for values in start for i in range(values.shape[-1])]
    directions = np.eye(2 * nv).reshape(2 * nv, 2 * nv, *(1 for _ in batch))  # component, direction, state
    state = seeded(start, [*joints.component_rates(start[:nq], directions[:nv]), *directions[nv:]])
    regrouped = [composite.mass_matrix_and_bias] * takes_terms(stepping)
    new_q, new_qd = one_step(stepping, tree, state[:nq], state[nq:], [float(t) for t in tau], dt, *regrouped)
    moved = joints.tangent([x.value for x in new_q], [x.slope for x in new_q])
    slopes = [np.broadcast_to(slope, (2 * nv, *batch)) for slope in (*moved, *(x.slope for x in new_qd))]
    return np.moveaxis(np.array(slopes), (0, 1), (-2, -1)).copy()


def has_residual(stepping) -> bool:
    """Whether a method says what a slope leaves of its linear system; not if its slope, or the matrix, is another since."""
    for kind in type(stepping).__mro__:
        if "residual" in vars(kind):
            return True
        if {"slope", "matrix"} & vars(kind).keys():
            return False
    return False


def linear_system(
    stepping, tree, q, qd, tau, dt, terms=composite.mass_matrix_and_bias
) -> tuple[np.ndarray, np.ndarray]:
    """A (states, nv, nv) and the force (states, nv) of A a = force, at states given by their components."""
    n, zero = len(qd), 0.0 * qd[0]
    a = seeded([zero] * n, np.eye(n)[..., None])
    left = stepping.residual(tree, a, q, qd, tau, dt, terms)
    A = np.array([np.broadcast_to(row.slope, (n, *zero.shape)) for row in left])
    force = np.array([np.broadcast_to(row.value, zero.shape) for row in left])
    return A.transpose(2, 0, 1), -force.T


def in_parts(stepping, tree, q, qd, tau, dt) -> np.ndarray:
    """d(q, qd)+/d(q, qd) of one step for movements of q, (states, 2 nv, 2 nv). q (states, nq), qd (states, nv), dt (states,)."""
    size = max(1, PART // qd.shape[1])
    parts = [slice(k, k + size) for k in range(0, len(qd), size)]
    return np.concatenate([of_part(stepping, tree, q[part], qd[part], tau, dt[part]) for part in parts])


def of_part(stepping, tree, q, qd, tau, dt):
    """The same of a few states."""
    joints, nv, nq = tree.coordinates, qd.shape[1], q.shape[1]
    start = [*q.T.copy(), *qd.T.copy()]
    directions = np.eye(2 * nv)[..., None]  # component, direction, state
    state = seeded(start, [*joints.component_rates(start[:nq], directions[:nv]), *directions[nv:]])
    level = state[0].level

    def slope(q, qd):
        values = [[x.value if isinstance(x, Dual) else x for x in part] for part in (q, qd)]
        A, force = linear_system(stepping, tree, *values, tau, dt)
        a = np.linalg.solve(A, force[..., None])[..., 0].T.copy()
        left = stepping.residual(tree, list(a), q, qd, tau, dt, composite.mass_matrix_and_bias)
        # what no state changes is no dual number: a sphere that floats free
        rows = np.array([np.broadcast_to(state[0].parts(x)[1], (2 * nv, a.shape[1])) for x in left])
        slopes = -np.linalg.solve(A, rows.transpose(2, 0, 1)).transpose(1, 2, 0)
        return [Dual(value, one, level) for value, one in zip(a, slopes.copy())]

    new_q, new_qd = stepped(stepping, tree, slope, state[:nq], state[nq:], dt)
    moved = joints.tangent([x.value for x in new_q], [x.slope for x in new_q])
    slopes = [np.broadcast_to(one, (2 * nv, len(dt))) for one in (*moved, *(x.slope for x in new_qd))]
    return np.array(slopes).transpose(2, 0, 1)
