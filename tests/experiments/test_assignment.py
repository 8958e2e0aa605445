"""The assignment's own formulas, symbol by symbol: what the method must give. Its M and h: tests/tmt/test_equations.py."""

import numpy as np
import sympy

import tmt


def test_positions_are_equation_1_and_angular_velocities_the_stated_B(rng):
    q, d, e = sympy.symbols("a b g"), *sympy.symbols("d e")
    (ca, cb, cg), (sa, sb, sg) = ([f(x) for x in q] for f in (sympy.cos, sympy.sin))
    x1 = sympy.Matrix([-d * cb * sa, d * sb, -d * ca * cb])  # d: to the CoM of the upper arm, d/2 of (1)
    x2 = e * sympy.Matrix([ca * cg - cb * sa * sg, sb * sg, -cg * sa - ca * cb * sg]) + 2 * x1
    B1 = sympy.Matrix([[0, 1, 0], [cb, 0, 0], [-sb, 0, 0]])
    B2 = sympy.Matrix([[sb * sg, cg, 0], [cb, 0, 1], [-cg * sb, sg, 0]])
    formulas = sympy.lambdify([*q, d, e], [x1, x2, B1, B2])
    for angles in rng.uniform(-np.pi, np.pi, (20, 3)):
        *x, B1, B2 = formulas(*angles, 0.15, 0.15)
        assert np.allclose(tmt.com_positions(tmt.ARM, angles), np.array(x)[:, :, 0], atol=1e-15)
        assert np.allclose(tmt.jacobians(tmt.ARM, angles)[1], [B1, B2], atol=1e-15)
