"""Implicit Runge-Kutta methods: their stages solve an equation, by Newton's method with exact Jacobians.

The unknowns are the accelerations a_i of the stages, a_i = qdd(q_i, qd_i), at
q_i = q + dt c_i qd + dt^2 sum_j (A A)_ij a_j and qd_i = qd + dt sum_j A_ij a_j. A ball's quaternions p_i follow from the
speeds of the stages by linear equations, p_i = p + dt sum_j A_ij p_j o (0, omega_j) / 2.

A large step has several solutions. Newton's method starts from that of the equations made linear at (q, qd), and finds
the one nearby.
"""

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from tmt.derivation.dual import Dual, jacobian, seeded, unit_vectors
from tmt.derivation.vectors import solve_any
from tmt.methods.stepping import Method, checked_sums, checked_tableau
from tmt.model.coordinates import FLAT, normalized, product

ITERATIONS = (
    50  # Newton's method doubles the correct digits each time: a stage that needs more is not being found
)
CLOSE = 1e-10  # change of the accelerations, relative to 1 rad/s2 + their size: the next change would be its square


@dataclass(frozen=True)
class ImplicitRungeKutta(Method):
    """An implicit Runge-Kutta method, given by its Butcher tableau, applied to (q, qd) as one first-order system.

    Raises ValueError if A is not square, a row of A does not sum to c, or b does not sum to 1.
    """

    order: int = field()  # it must be given, though Method has a default
    A: tuple  # row i: the weights of all stages in stage i
    b: tuple  # the weights of the stages in the step
    c: tuple  # the time of each stage in units of dt

    solves_stages = True

    def __post_init__(self):
        checked_tableau(self, "A")
        if not len(self.A) == self.stages == len(self.c) or any(len(row) != self.stages for row in self.A):
            raise ValueError("A must be square, and b and c must have one entry for each of its rows")
        checked_sums(self)

    @property
    def stages(self) -> int:
        """Evaluations of the dynamics in one iteration of Newton's method."""
        return len(self.b)

    def step(self, slope, q, qd, dt, joints=FLAT):
        """The state (q, qd) one dt later, on floats, arrays and dual numbers of them.

        Raises ArithmeticError where Newton's method does not find the stages (a compiled run ends there).
        """

        def linear(q_i, qd_i):
            """The slope as it would be if it were linear, as at (q, qd)."""
            x = seeded([*q, *qd], [new - old for old, new in zip((*q, *qd), (*q_i, *qd_i))])
            return [sum(x[0].parts(f)) for f in slope(x[: len(q)], x[len(q) :])]

        def left_over(a, slope=slope):
            """qdd - a of the stages."""
            slopes = [slope(*state) for state in self.stage_states(q, qd, dt, a, joints)]
            return [f - x for f, x in zip((f for part in slopes for f in part), a)]

        a, last = [0.0] * (len(qd) * self.stages), False
        for function in (partial(left_over, slope=linear), *[left_over] * ITERATIONS):
            matrix = [[x * -1.0 for x in row] for row in jacobian(function, a)]
            change = solve_any(matrix, function(a))
            a = [old + new for old, new in zip(a, change)]
            if last:  # once more after the values are found: only then are their derivatives exact
                return self.finish(q, qd, dt, a, joints)
            last = function is left_over and largest(change) <= CLOSE * (1.0 + largest(a))
        raise ArithmeticError(f"Newton's method does not find the stages at dt = {dt} s")

    def stage_states(self, q, qd, dt, a, joints):
        """The states (q_i, qd_i) of the stages with accelerations a, all of them in one list."""
        n, s = len(qd), range(self.stages)
        speeds = [[qd[k] + dt * weighted(self.A[i], a[k::n]) for k in range(n)] for i in s]
        balls = [self.ball_stages(q[joint.q], [of[joint.qd] for of in speeds], dt) for joint in joints.balls]
        for i in s:
            twice = [sum(self.A[i][k] * self.A[k][j] for k in s) for j in s]
            moved = [dt * (self.c[i] * qd[k] + dt * weighted(twice, a[k::n])) for k in range(n)]
            yield placed(joints, q, moved, [of[i] for of in balls]), speeds[i]

    def ball_stages(self, p, omegas, dt):
        """The quaternions p_i of a ball that starts at p and has these speeds in the stages."""
        s = range(self.stages)
        matrix = [[1.0 if i == j else 0.0 for j in range(4 * len(s))] for i in range(4 * len(s))]
        for j in s:
            for c, unit in enumerate(unit_vectors(4)):
                for r, value in enumerate(product(unit, [0.0, *omegas[j]])):
                    for i in s:
                        entry = matrix[4 * i + r][4 * j + c]
                        matrix[4 * i + r][4 * j + c] = entry - dt * (0.5 * self.A[i][j] * value)
        found = solve_any(matrix, [*p] * len(s))
        return [found[4 * i : 4 * i + 4] for i in s]

    def finish(self, q, qd, dt, a, joints):
        """The state (q, qd) one dt later, from the accelerations of the stages."""
        n, s = len(qd), range(self.stages)
        twice = [sum(self.b[k] * self.A[k][j] for k in s) for j in s]
        moved, balls = [dt * (qd[k] + dt * weighted(twice, a[k::n])) for k in range(n)], []
        if joints.balls:
            stages = list(self.stage_states(q, qd, dt, a, joints))
            for joint in joints.balls:
                rates = [product(q_i[joint.q], [0.0, *qd_i[joint.qd]]) for q_i, qd_i in stages]
                means = [0.5 * weighted(self.b, of) for of in zip(*rates)]
                balls.append(normalized([p + dt * mean for p, mean in zip(q[joint.q], means)]))
        return placed(joints, q, moved, balls), [qd[k] + dt * weighted(self.b, a[k::n]) for k in range(n)]


def placed(joints, q, moved, balls) -> list:
    """The position after a movement from q, (nv,), of all but the balls, and these quaternions."""
    if not balls:
        return [x + y for x, y in zip(q, moved)]
    balls, result = iter(balls), []
    for joint in joints.joints:
        result += next(balls) if joint.kind == "ball" else [q[joint.q.start] + moved[joint.qd.start]]
    return result


def weighted(weights, values):
    """Sum of weights * values."""
    terms = [w * v for w, v in zip(weights, values)]
    return sum(terms[1:], terms[0])


def largest(values) -> float:
    """The largest absolute value; of dual numbers that of their values."""

    def plain(value):
        return plain(value.value) if isinstance(value, Dual) else np.max(np.abs(value))

    return float(np.max([plain(value) for value in values]))
