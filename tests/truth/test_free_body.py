"""The turning of a free body: Jacobi's functions compared with the differential equations, digit by digit."""

import mpmath
import pytest

from compare.truth.free_body import free_turning

START = (0.8, -0.3, 0.4, 0.5)
BODIES = [  # moments, angular velocity: about the largest, the smallest, through all signs, nearly the middle axis
    ((0.3, 0.2, 0.1), (4.0, 0.5, -1.0)),
    ((0.3, 0.2, 0.1), (-0.5, 0.6, -7.0)),
    ((0.3, 0.2, 0.11), (0.01, -5.0, 0.02)),
    ((2.0, 2.0, 1.0), (1.0, 2.0, -3.0)),  # symmetric
    ((2.0, 2.0, 2.0), (1.0, 2.0, -3.0)),
    ((3.0, 2.0, 1.0), (0.0, -2.0, 0.0)),  # about a principal axis
    ((3.0, 2.0, 1.0), (0.0, 0.0, 0.0)),
    ((3.0, 2.0, 1.0), (1.0, 0.0, 1.5)),  # at a corner of its elliptic functions
]


PRODUCT = (  # of a quaternion and a vector: sign and components of each term
    ((-1, 1, 0), (-1, 2, 1), (-1, 3, 2)),
    ((1, 0, 0), (1, 2, 2), (-1, 3, 1)),
    ((1, 0, 1), (1, 3, 0), (-1, 1, 2)),
    ((1, 0, 2), (1, 1, 1), (-1, 2, 0)),
)


def integrated(end, steps, moments, omega, quaternion, order=30):
    """Angular velocity and quaternion by Euler's equations and qd = q o (0, omega) / 2, Taylor series, 50 digits."""
    (A, B, C), w, q = (list(map(mpmath.mpf, v)) for v in (moments, omega, quaternion))
    q = [v / mpmath.norm(q) for v in q]
    dt = mpmath.mpf(end) / steps
    rates = (B - C) / A, (C - A) / B, (A - B) / C
    for _ in range(steps):
        ws, qs = [w], [q]
        for k in range(order):

            def convolved(x, i, y, j, k=k):
                return mpmath.fdot((x[s][i], y[k - s][j]) for s in range(k + 1))

            w_next = [rate * convolved(ws, i, ws, j) for rate, i, j in zip(rates, (1, 2, 0), (2, 0, 1))]
            q_next = [sum(sign * convolved(qs, i, ws, j) for sign, i, j in terms) / 2 for terms in PRODUCT]
            ws.append([v / (k + 1) for v in w_next])
            qs.append([v / (k + 1) for v in q_next])
        w, q = ([mpmath.polyval([row[i] for row in rows[::-1]], dt) for i in range(len(rows[0]))] for rows in (ws, qs))
    return w, q


@pytest.mark.parametrize("moments, omega", BODIES)
def test_it_solves_the_differential_equations(moments, omega):
    end = 0.2
    speeds, quaternions = free_turning([0.0, end], moments, omega, START)
    with mpmath.workdps(50):
        for found, expected in zip((speeds[1], quaternions[1]), integrated(end, 4, moments, omega, START)):
            assert max(abs(x - y) for x, y in zip(found, expected)) < 1e-32
        assert max(abs(x - y) for x, y in zip(speeds[0], omega)) < 1e-48


@pytest.mark.parametrize("moments, omega", BODIES[1::2])
def test_two_runs_make_one_over_many_turns(moments, omega):
    """Half way, and on from there: the precession and the sign of the quaternion too."""
    with mpmath.workdps(50):
        speeds, quaternions = free_turning([17.0, 34.0], moments, omega, START)
        more, on = free_turning([17.0], moments, speeds[0], quaternions[0])
        assert abs(more[0] - speeds[1]).max() < 1e-40 and abs(on[0] - quaternions[1]).max() < 1e-40


@pytest.mark.parametrize("away, refused", [(0, True), (5e-20, True), (7e-20, False), (-7e-20, False), (-5e-20, True)])
def test_the_separatrix_is_refused_and_what_lies_beside_it_is_not(away, refused):
    """(3, 2, 1) with omega_1 = 1: L2 - 2 E I2 is 3 - omega_3^2."""
    with mpmath.workdps(50):
        omega = (1, 1, mpmath.sqrt(3 + mpmath.mpf(away)))
        if refused:
            with pytest.raises(ValueError, match="middle"):
                free_turning([1.0], (3, 2, 1), omega, START)
        else:
            found = free_turning([0.1], (3, 2, 1), omega, START)
            for values, expected in zip(found, integrated(0.1, 2, (3, 2, 1), omega, START)):
                assert abs(values[0] - expected).max() < 1e-32


def test_a_moment_that_is_not_positive_is_refused():
    with pytest.raises(ValueError, match=r"0\.3, 0\.0, 0\.1"):
        free_turning([1.0], (0.3, 0.0, 0.1), (1.0, 2.0, 3.0), START)
