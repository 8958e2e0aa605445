"""The assignment's own formulas, symbol by symbol, and Lagrange's equations from them: what the method must give."""

from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
import sympy
from many_digits import DIGITS, exact

import tmt

NUMBERS = (0.15, 0.15, 1.9, 1.5, 0.015, 0.014, 0.002, 0.001, 0.019, 0.019, 9.81)  # d, e, m, I, g as below


@pytest.fixture(scope="module")
def assignment():
    """Equation (1), rotation matrices and the stated B in symbols."""
    q, qd, d, e = sympy.symbols("a b g"), sympy.symbols("ad bd gd"), *sympy.symbols("d e")
    (ca, cb, cg), (sa, sb, sg) = ([f(x) for x in q] for f in (sympy.cos, sympy.sin))
    x1 = sympy.Matrix([-d * cb * sa, d * sb, -d * ca * cb])  # d: to the CoM of the upper arm, d/2 of (1)
    x2 = e * sympy.Matrix([ca * cg - cb * sa * sg, sb * sg, -cg * sa - ca * cb * sg]) + 2 * x1
    Ra = sympy.Matrix([[ca, 0, sa], [0, 1, 0], [-sa, 0, ca]])
    Rb = sympy.Matrix([[1, 0, 0], [0, cb, -sb], [0, sb, cb]])
    Rg = sympy.Matrix([[cg, 0, sg], [0, 1, 0], [-sg, 0, cg]])
    B1 = sympy.Matrix([[0, 1, 0], [cb, 0, 0], [-sb, 0, 0]])
    B2 = sympy.Matrix([[sb * sg, cg, 0], [cb, 0, 1], [-cg * sb, sg, 0]])
    return SimpleNamespace(q=q, qd=qd, lengths=(d, e), x=(x1, x2), R=(Ra * Rb, Ra * Rb * Rg), B=(B1, B2))


def test_positions_are_equation_1_and_angular_velocities_the_stated_B(assignment, rng):
    formulas = sympy.lambdify([*assignment.q, *assignment.lengths], [*assignment.x, *assignment.B])
    for q in rng.uniform(-np.pi, np.pi, (20, 3)):
        *x, B1, B2 = formulas(*q, *NUMBERS[:2])
        assert np.allclose(tmt.com_positions(q), np.array(x)[:, :, 0], atol=1e-15)
        assert np.allclose(tmt.jacobians(q)[1], [B1, B2], atol=1e-15)


def test_lagrange_from_equation_1_and_energies_alone(assignment, rng):
    """No B, no convective terms, 50 digits; a turn has the energy tr(Rd J Rd') / 2 with J = tr(I)/2 - I."""
    q, qd = assignment.q, assignment.qd
    m, I, grav = sympy.symbols("m1 m2"), sympy.symbols("I11 I12 I13 I21 I22 I23"), sympy.Symbol("grav")

    def rate(matrix):
        return sum((matrix.diff(x) * v for x, v in zip(q, qd)), sympy.zeros(*matrix.shape))

    T = V = 0
    for k, (x, R) in enumerate(zip(assignment.x, assignment.R)):
        moments = sympy.diag(*I[3 * k : 3 * k + 3])
        J = moments.trace() / 2 * sympy.eye(3) - moments
        T += m[k] * rate(x).dot(rate(x)) / 2 + (rate(R) * J * rate(R).T).trace() / 2
        V += m[k] * grav * x[2]
    p = [T.diff(v) for v in qd]
    M = [[pi.diff(v) for v in qd] for pi in p]
    h = [sum(pi.diff(x) * v for x, v in zip(q, qd)) - (T - V).diff(x) for pi, x in zip(p, q)]
    evaluate = sympy.lambdify([*q, *qd, *assignment.lengths, *m, *I, grav], [M, h], "mpmath", cse=True)
    for _ in range(5):
        q0, qd0 = rng.uniform(-np.pi, np.pi, 3), rng.uniform(-10, 10, 3)
        truth = exact(tmt.ARM, q0, qd0, np.zeros(3))
        with mpmath.workdps(DIGITS):
            M0, h0 = evaluate(*map(mpmath.mpf, map(float, (*q0, *qd0, *NUMBERS))))
            for row, right in zip(M0, truth.mass_matrix):
                assert max(abs(x - y) for x, y in zip(row, right)) < 1e-47
            assert max(abs(x - y) for x, y in zip(h0, truth.bias)) < 1e-45
