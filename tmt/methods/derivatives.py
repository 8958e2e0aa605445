"""Derivatives of a step for many states of a tree of many joints: of the slope by those of the linear system that gives it.

A slope a solves residual(a, x) = 0, which is linear in a; so da/dx = -A^-1 dresidual/dx at fixed a, with A = dresidual/da. Then
dual numbers need not go through the solution, nor through derivatives of derivatives.
"""

from inspect import signature

import numpy as np

from tmt.derivation import composite
from tmt.derivation.dual import Dual, seeded
from tmt.derivation.mechanism import AnyTree
from tmt.derivation.method import reduced_force
from tmt.derivation.scalar import Rows, Scalar, Values
from tmt.methods.dynamics import Dynamics, Held, Terms, minus, plus
from tmt.methods.stepping import Method, State, stepped
from tmt.model.tree import Tree

Array = np.ndarray
FEW_SPEEDS = 4  # up to which dual numbers go through the solution of the linear system too
PART = 4096  # states times speeds that are taken at once: more do not stay in the processor's cache


class Differentiated(Dynamics):
    """Accelerations at states (numbers, or dual numbers of arrays), with the derivatives of the linear system."""

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
        M, h = self(tree, q, qd)
        force = reduced_force(tree, h, q, qd, tau)
        if implicit is None:
            return minus(times(M, a), force)
        left = minus(plus(times(M, a), times(implicit.matrix, a)), minus(force, implicit.pull))
        if implicit.bias_rows:
            ahead, behind = self(tree, q, plus(qd, a))[1], self(tree, q, minus(qd, a))[1]
            for i in implicit.bias_rows:
                left[i] = left[i] + 0.5 * implicit.dt * (ahead[i] - behind[i])
        return left

    def acceleration(
        self, tree: AnyTree, q: Values, qd: Values, tau: Values, implicit: Held = None
    ) -> Values:
        plain = implicit._replace(pull=values_of(implicit.pull)) if implicit else None
        plain_q, plain_qd = values_of(q), values_of(qd)
        n, states = len(qd), plain_qd[0].shape
        unknown = seeded(np.zeros((n, *states)), np.eye(n)[..., None])
        left = self.residual(tree, unknown, plain_q, plain_qd, tau, plain)
        A = np.array([np.broadcast_to(row.slope, (n, *states)) for row in left]).transpose(2, 0, 1)
        self.system = A, -np.array([np.broadcast_to(row.value, states) for row in left]).T
        a = np.linalg.solve(A, self.system[1][..., None])[..., 0].T.copy()
        dual = next((x for x in (*q, *qd) if isinstance(x, Dual)), None)
        if dual is None:
            return list(a)
        left = self.residual(tree, list(a), q, qd, tau, implicit)
        # what no state changes is no dual number: a sphere that floats free
        rows = np.array([np.broadcast_to(dual.parts(x)[1], (len(dual.slope), a.shape[1])) for x in left])
        slopes = -np.linalg.solve(A, rows.transpose(2, 0, 1)).transpose(1, 2, 0)
        return [Dual(value, slope, dual.level) for value, slope in zip(a, slopes.copy())]


def one_step(
    stepping: Method, tree: Tree, q: Values, qd: Values, tau: Values, dt: Scalar, *terms: Terms
) -> State:
    """The state (q, qd) of a tree one dt later by a method, over any scalar; terms: in place of the literal ones."""
    return stepped(stepping, tree, lambda q, qd: stepping.slope(tree, q, qd, tau, dt, *terms), q, qd, dt)


def takes_terms(stepping: Method) -> bool:
    """Whether the slope of a method takes other terms; a user's own need not have that argument."""
    return len(signature(stepping.slope).parameters) > 5  # tree, q, qd, tau, dt


def amplification(stepping: Method, tree: Tree, q: Array, qd: Array, tau: Array, dt: float | Array) -> Array:
    """The exact Jacobian of one step of a method, d(q, qd)+/d(q, qd), shape (..., 2 nv, 2 nv), for movements of q.

    q (..., nq), qd (..., nv): states, rad and rad/s; tau: torque (nv,), N m; dt: step in s, one for all or (...). At an
    equilibrium it is what a step does to a small deviation: its eigenvalues are the growth of each mode per step. By dual
    numbers, all directions at once; so it holds for partitioned and implicit methods too.
    """
    nv, torque = tree.coordinates.nv, [float(t) for t in tau]
    batch = np.broadcast_shapes(np.shape(q)[:-1], np.shape(qd)[:-1], np.shape(dt))
    q, qd = (np.broadcast_to(x, (*batch, np.shape(x)[-1])).reshape(-1, np.shape(x)[-1]) for x in (q, qd))
    steps, size = np.broadcast_to(dt, batch).reshape(-1), max(1, PART // nv)
    parts = [slice(k, k + size) for k in range(0, len(qd), size)]
    jacobians = [of_part(stepping, tree, q[part], qd[part], torque, steps[part]) for part in parts]
    return np.concatenate([np.empty((0, 2 * nv, 2 * nv)), *jacobians]).reshape(*batch, 2 * nv, 2 * nv)


def of_part(stepping: Method, tree: Tree, q: Array, qd: Array, tau: list[float], dt: Array) -> Array:
    """The same of a few states: q (states, nq), qd (states, nv), dt (states,)."""
    joints, nv, nq = tree.coordinates, qd.shape[1], q.shape[1]
    start = [*q.T.copy(), *qd.T.copy()]
    directions = np.eye(2 * nv)[..., None]  # component, direction, state
    state = seeded(start, [*joints.component_rates(start[:nq], directions[:nv]), *directions[nv:]])
    # the Jacobian of stages that are solved for is by dual numbers of dual numbers
    through_solution = nv <= FEW_SPEEDS or stepping.solves_stages
    terms = composite.mass_matrix_and_bias if through_solution else Differentiated()
    regrouped = [terms] if takes_terms(stepping) else []
    new_q, new_qd = one_step(stepping, tree, state[:nq], state[nq:], tau, dt, *regrouped)
    moved = joints.tangent([x.value for x in new_q], [x.slope for x in new_q])
    slopes = [np.broadcast_to(slope, (2 * nv, len(dt))) for slope in (*moved, *(x.slope for x in new_qd))]
    return np.array(slopes).transpose(2, 0, 1)


def values_of(numbers: Values) -> Values:
    return [x.value if isinstance(x, Dual) else x for x in numbers]


def times(matrix: Rows, values: Values) -> Values:
    return [sum(m * x for m, x in zip(row, values)) for row in matrix]
