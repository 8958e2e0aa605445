"""The turning of a free body: Jacobi's functions compared with the differential equations, digit by digit."""

import mpmath
import pytest

from compare.truth.free_body import free_turning

START = (0.8, -0.3, 0.4, 0.5)
BODIES = [  # moments, angular velocity: about the largest, nearly the middle axis, at a corner of the functions
    ((0.3, 0.2, 0.1), (4.0, 0.5, -1.0)),
    ((0.3, 0.2, 0.11), (0.01, -5.0, 0.02)),
    ((3.0, 2.0, 1.0), (1.0, 0.0, 1.5)),
    ((2.0, 2.0, 1.0), (1.0, 2.0, -3.0)),  # symmetric
    ((3.0, 2.0, 1.0), (0.0, -2.0, 0.0)),  # about a principal axis
]


def integrated(end, moments, omega, quaternion, order=30):
    """Angular velocity and quaternion by Euler's equations and qd = q o (0, omega) / 2: two Taylor series, 50 digits."""
    (A, B, C), w, q = (list(map(mpmath.mpf, v)) for v in (moments, omega, quaternion))
    q = [v / mpmath.norm(q) for v in q]
    rates = (B - C) / A, (C - A) / B, (A - B) / C
    for _ in range(2):
        ws, qs = [w], [q]
        for k in range(order):

            def products(x, y, k=k):
                """Of each component of one series with each of the other, at this order."""
                return [
                    [mpmath.fdot((x[s][i], y[k - s][j]) for s in range(k + 1)) for j in range(3)]
                    for i in range(len(x[0]))
                ]

            ww, qw = products(ws, ws), products(qs, ws)
            w_next = rates[0] * ww[1][2], rates[1] * ww[2][0], rates[2] * ww[0][1]
            q_next = [-(qw[1][0] + qw[2][1] + qw[3][2])]
            for i in range(3):
                j, l = (i + 1) % 3, (i + 2) % 3
                q_next.append(qw[0][i] + qw[j + 1][l] - qw[l + 1][j])
            ws.append([v / (k + 1) for v in w_next])
            qs.append([v / (2 * (k + 1)) for v in q_next])
        w, q = ([mpmath.polyval(column[::-1], mpmath.mpf(end) / 2) for column in zip(*rows)] for rows in (ws, qs))
    return w, q


def assert_solves(end, moments, omega, size=1e-32):
    with mpmath.workdps(50):
        found = free_turning([0.0, end], moments, omega, START)
        for values, expected in zip(found, integrated(end, moments, omega, START)):
            assert max(abs(x - y) for x, y in zip(values[1], expected)) < size
        assert max(abs(x - y) for x, y in zip(found[0][0], omega)) < 1e-48


@pytest.mark.parametrize("moments, omega", BODIES)
def test_it_solves_the_differential_equations(moments, omega):
    assert_solves(0.1, moments, omega)


@pytest.mark.parametrize("moments, omega", BODIES[:2])
def test_two_runs_make_one_over_many_turns(moments, omega):
    """Half way, and on from there: the precession and the sign of the quaternion too."""
    with mpmath.workdps(50):
        speeds, quaternions = free_turning([17.0, 34.0], moments, omega, START)
        more, on = free_turning([17.0], moments, speeds[0], quaternions[0])
        assert abs(more[0] - speeds[1]).max() < 1e-40 and abs(on[0] - quaternions[1]).max() < 1e-40


@pytest.mark.parametrize("away, refused", [(5e-20, True), (7e-20, False), (-7e-20, False), (-5e-20, True)])
def test_the_separatrix_is_refused_and_what_lies_beside_it_is_not(away, refused):
    """(3, 2, 1) with omega_1 = 1: L2 - 2 E I2 is 3 - omega_3^2."""
    with mpmath.workdps(50):
        omega = (1, 1, mpmath.sqrt(3 + mpmath.mpf(away)))
        if not refused:
            return assert_solves(0.1, (3, 2, 1), omega)
        with pytest.raises(ValueError, match="separatrix"):
            free_turning([1.0], (3, 2, 1), omega, START)
