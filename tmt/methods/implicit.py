"""Implicit Runge-Kutta methods: their stages solve an equation, by Newton's method with exact Jacobians.

The unknowns are the accelerations a_i of the stages, a_i = qdd(q_i, qd_i), at q_i = q + dt c_i qd + dt^2
sum_j (A A)_ij a_j and qd_i = qd + dt sum_j A_ij a_j. A ball's quaternions p_i follow from the speeds of the
stages by linear equations, p_i = p + dt sum_j A_ij p_j o (0, omega_j) / 2.

A large step has several solutions. Newton's method starts from that of the equations made linear at (q, qd),
and finds the one nearby.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np

from tmt.derivation.coordinates import Coordinates, Joint, normalized, product
from tmt.derivation.dual import jacobian, seeded, unit_vectors, values_of
from tmt.derivation.vectors import Scalar, Values, minus, plus, solve_any, weighted
from tmt.methods.stepping import Numbers, Slope, State, Tableau

ITERATIONS = 50  # Newton's method doubles the correct digits each time: a stage that needs more is not found
CLOSE = 1e-10  # change of the accelerations, of 1 rad/s2 + their size: the next would be its square


@dataclass(frozen=True)
class ImplicitRungeKutta(Tableau):
    """An implicit Runge-Kutta method, by its Butcher tableau, of (q, qd) as one first-order system."""

    solves_stages = True

    def check_row(self, i: int, row: Numbers) -> None:
        if len(row) != len(self.b):
            raise ValueError(f"A must be square, but row {i} has {len(row)} entries for {len(self.b)} stages")

    @property
    def stages(self) -> int:
        return len(self.b)

    def step(self, slope: Slope, q: Values, qd: Values, dt: Scalar, joints: Coordinates) -> State:
        """The state (q, qd) one dt later; ArithmeticError where Newton's method does not find the stages."""

        start = values_of(q), values_of(qd)

        def linear(q_i: Values, qd_i: Values) -> Values:
            """The slope as it would be if it were linear, as at (q, qd)."""
            x = seeded([*start[0], *start[1]], minus([*q_i, *qd_i], [*start[0], *start[1]]))
            return [sum(x[0].parts(f)) for f in slope(x[: len(q)], x[len(q) :])]

        def left_over(slope: Slope, q: Values, qd: Values, a: Values) -> Values:
            slopes = [slope(*state) for state in self.stage_states(q, qd, dt, a, joints)]
            return minus(list(chain(*slopes)), a)

        a, found = [0.0] * (len(qd) * self.stages), False
        for is_linear in (True, *[False] * ITERATIONS):
            function = partial(left_over, linear if is_linear else slope, *start)
            matrix = [[x * -1.0 for x in values_of(row)] for row in jacobian(function, a)]
            if (
                found
            ):  # once more: from this equation, with a constant matrix, the stages have their derivatives
                return self.finish(q, qd, dt, plus(a, solve_any(matrix, left_over(slope, q, qd, a))), joints)
            change = solve_any(matrix, values_of(function(a)))
            a = plus(a, change)
            found = not is_linear and largest(change) <= CLOSE * (1.0 + largest(a))
        raise ArithmeticError(f"Newton's method does not find the stages at dt = {dt} s")

    def stage_states(
        self, q: Values, qd: Values, dt: Scalar, a: Values, joints: Coordinates
    ) -> Iterator[State]:
        """The states (q_i, qd_i) of the stages with accelerations a, all of them in one list."""
        n, s = len(qd), range(self.stages)
        speeds = [[qd[k] + dt * weighted(self.A[i], a[k::n]) for k in range(n)] for i in s]
        balls = [self.ball_stages(joint, q, speeds, dt) for joint in joints.balls]
        for i in s:
            twice = [sum(self.A[i][k] * self.A[k][j] for k in s) for j in s]
            moved = [dt * (self.c[i] * qd[k] + dt * weighted(twice, a[k::n])) for k in range(n)]
            yield placed(joints, q, moved, [stages[i] for stages in balls]), speeds[i]

    def ball_stages(self, ball: Joint, q: Values, speeds: list[Values], dt: Scalar) -> list[Values]:
        """The quaternions p_i of a ball that starts at q and has the speeds of these stages."""
        s = range(self.stages)
        matrix = unit_vectors(4 * len(s))
        for j in s:
            for c, unit in enumerate(unit_vectors(4)):
                for r, value in enumerate(product(unit, [0.0, *speeds[j][ball.qd]])):
                    for i in s:
                        entry = matrix[4 * i + r][4 * j + c]
                        matrix[4 * i + r][4 * j + c] = entry - dt * (0.5 * self.A[i][j] * value)
        components = solve_any(matrix, q[ball.q] * len(s))
        return [components[4 * i : 4 * i + 4] for i in s]

    def finish(self, q: Values, qd: Values, dt: Scalar, a: Values, joints: Coordinates) -> State:
        n, s = len(qd), range(self.stages)
        twice = [sum(self.b[k] * self.A[k][j] for k in s) for j in s]
        moved, balls = [dt * (qd[k] + dt * weighted(twice, a[k::n])) for k in range(n)], []
        if joints.balls:
            stages = list(self.stage_states(q, qd, dt, a, joints))
            for joint in joints.balls:
                rates = [product(q_i[joint.q], [0.0, *qd_i[joint.qd]]) for q_i, qd_i in stages]
                means = [0.5 * weighted(self.b, rate) for rate in zip(*rates)]
                balls.append(normalized([p + dt * mean for p, mean in zip(q[joint.q], means)]))
        return placed(joints, q, moved, balls), [qd[k] + dt * weighted(self.b, a[k::n]) for k in range(n)]


def placed(joints: Coordinates, q: Values, moved: Values, balls: list[Values]) -> Values:
    """The position after a tangent from q, (nv,), of all but the balls, and these quaternions."""
    turned, result = iter(balls), []
    for joint in joints.joints:
        result += next(turned) if joint.kind == "ball" else [q[joint.q.start] + moved[joint.qd.start]]
    return result


def largest(values: Values) -> float:
    return float(np.max([np.max(np.abs(value)) for value in values]))
