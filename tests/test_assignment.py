"""The assignment's own formulas, symbol by symbol, and Lagrange's equations from them: what the method must give."""

from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
import sympy

import tmt
from tmt.equations import method
from tmt.equations import vectors as space
from tmt.exact.values import DIGITS, exact

space.sin.register(sympy.Expr, sympy.sin)
space.cos.register(sympy.Expr, sympy.cos)


# the assignment, symbol by symbol


@pytest.fixture(scope="module")
def symbols():
    """The arm in symbols, and the bodies that the method makes of it."""
    d, e, a, b, g, ad, bd, gd = sympy.symbols("d e a b g ad bd gd", real=True)
    zero, one = sympy.Integer(0), sympy.Integer(1)
    tree = SimpleNamespace(
        parent=(-1, 0, 1),
        offset=((zero,) * 3, (zero,) * 3, (zero, zero, -d)),
        axis=((zero, one, zero), (one, zero, zero), (zero, one, zero)),
        body_hinge=(1, 2),
        com=((zero, zero, -d / 2), (sympy.Rational(2, 5) * e, zero, zero)),
        mass=(one, one),
        inertia=(((one,) * 3,) * 3,) * 2,
        moves=tmt.ARM.moves,
        coordinates=tmt.ARM.coordinates,
        reference=(zero,) * 3,
    )
    return SimpleNamespace(
        d=d, e=e, a=a, b=b, g=g, bodies=method.bodies(tree, [a, b, g], [ad, bd, gd]), qd=(ad, bd, gd)
    )


def same(found, expected):
    """Whether expressions are the same, at two points, but for rounding."""
    off = [sympy.sympify(f - x) for f, x in zip(found, expected, strict=True)]
    names = sorted(set().union(*(one.free_symbols for one in off)), key=str)
    points = [
        dict(zip(names, map(sympy.Rational, (f"{k}/7", "5/3", "-3/11", "8/5", "-9/4", "1/9", "4/7", "2/13"))))
        for k in (3, 11)
    ]
    return all(abs(one.subs(point).evalf()) < 1e-14 for one in off for point in points)


def test_positions_are_equation_1(symbols):
    s = symbols
    ca, sa, cb, sb, cg, sg = (f(x) for x in (s.a, s.b, s.g) for f in (sympy.cos, sympy.sin))
    k = sympy.Rational(2, 5) * s.e
    assert same(s.bodies[0].x, (-s.d / 2 * cb * sa, s.d / 2 * sb, -s.d / 2 * ca * cb))
    assert same(
        s.bodies[1].x,
        (
            k * (ca * cg - cb * sa * sg) - s.d * cb * sa,
            s.d * sb + k * sb * sg,
            -k * (cg * sa + ca * cb * sg) - s.d * ca * cb,
        ),
    )


def test_angular_velocities_are_the_stated_B(symbols):
    s = symbols
    cb, sb, cg, sg = (f(x) for x in (s.b, s.g) for f in (sympy.cos, sympy.sin))
    for body, B in zip(
        s.bodies,
        (((0, 1, 0), (cb, 0, 0), (-sb, 0, 0)), ((sb * sg, cg, 0), (cb, 0, 1), (-cg * sb, sg, 0))),
    ):
        rows = list(zip(*(list(column) for column in body.B)))
        for row, expected in zip(rows, B):
            assert same(row, expected)
        assert same(body.omega, [sum(x * rate for x, rate in zip(row, s.qd)) for row in B])


# each quantity is the derivative that its name says


def test_lagrange_from_equation_1_and_energies_alone(rng):
    """Kinetic energy from (1) and from R, potential energy from (1): no B, no convective terms, 50 digits.

    The rotational energy is tr(Rd J Rd') / 2 with J = tr(I)/2 - I, from the rotation matrix itself.
    """
    q = sympy.symbols("a b g")
    qd = sympy.symbols("ad bd gd")
    d, e = sympy.symbols("d e")
    m, I, grav = sympy.symbols("m1 m2"), sympy.symbols("I11 I12 I13 I21 I22 I23"), sympy.Symbol("grav")
    (ca, cb, cg), (sa, sb, sg) = ([f(x) for x in q] for f in (sympy.cos, sympy.sin))
    x1 = sympy.Matrix([-d * cb * sa, d * sb, -d * ca * cb])  # d: to the CoM of the upper arm, d/2 of (1)
    x2 = sympy.Matrix(
        [
            e * (ca * cg - cb * sa * sg) - 2 * d * cb * sa,
            2 * d * sb + e * sb * sg,
            -e * (cg * sa + ca * cb * sg) - 2 * d * ca * cb,
        ]
    )
    Ra = sympy.Matrix([[ca, 0, sa], [0, 1, 0], [-sa, 0, ca]])
    Rb = sympy.Matrix([[1, 0, 0], [0, cb, -sb], [0, sb, cb]])
    Rg = sympy.Matrix([[cg, 0, sg], [0, 1, 0], [-sg, 0, cg]])

    def rate(matrix):
        return sum((matrix.diff(x) * v for x, v in zip(q, qd)), sympy.zeros(*matrix.shape))

    T = V = 0
    for k, (x, R) in enumerate(((x1, Ra * Rb), (x2, Ra * Rb * Rg))):
        moments = sympy.diag(*I[3 * k : 3 * k + 3])
        J = moments.trace() / 2 * sympy.eye(3) - moments
        Rd = rate(R)
        T += m[k] * rate(x).dot(rate(x)) / 2 + (Rd * J * Rd.T).trace() / 2
        V += m[k] * grav * x[2]
    p = [T.diff(v) for v in qd]
    M = [[pi.diff(v) for v in qd] for pi in p]
    h = [sum(pi.diff(x) * v for x, v in zip(q, qd)) - (T - V).diff(x) for pi, x in zip(p, q)]
    evaluate = sympy.lambdify([*q, *qd, d, e, *m, *I, grav], [M, h], "mpmath", cse=True)

    numbers = (0.15, 0.15, 1.9, 1.5, 0.015, 0.014, 0.002, 0.001, 0.019, 0.019, 9.81)
    for _ in range(5):
        q0, qd0 = rng.uniform(-np.pi, np.pi, 3), rng.uniform(-10, 10, 3)
        truth = exact(tmt.ARM, q0, qd0, np.zeros(3))
        with mpmath.workdps(DIGITS):
            M0, h0 = evaluate(*map(mpmath.mpf, map(float, (*q0, *qd0, *numbers))))
            assert max(abs(x - y) for row, line in zip(M0, truth.mass_matrix) for x, y in zip(row, line)) < 1e-47
            assert max(abs(x - y) for x, y in zip(h0, truth.bias)) < 1e-45
