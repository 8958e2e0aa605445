"""Slips in a derivation by Lagrange's equations, made in SymPy: a pan and a tilt with an arm that is along no axis."""

import numpy as np
import pytest
import sympy as sp
from sympy import Matrix, cos, sin

import tmt
from compare.diagnosis import Values, diagnose

OFFSET, COM, MASS, G = (0.2, 0.1, 0.3), (0.3, 0.02, -0.1), 1.7, 9.81
INERTIA = ((0.03, 0.002, -0.001), (0.002, 0.025, 0.003), (-0.001, 0.003, 0.015))
TREE = tmt.Tree(
    joint_names=("pan", "tilt"), parent=(-1, 0), offset=((0.0, 0.0, 0.0), OFFSET), axis=((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    damping=(0.0, 0.0), body_names=("turret", "arm"), body_joint=(0, 1), mass=(2.0, MASS), com=((0.0, 0.0, 0.1), COM),
    inertia=(np.diag([0.02, 0.02, 0.01]).tolist(), INERTIA), gravity=(0.0, 0.0, -G),
)  # fmt: skip
Q = PAN, TILT = sp.symbols("pan tilt")
U = sp.symbols("u v")
RATES = Matrix(U)
RZ = Matrix([[cos(PAN), -sin(PAN), 0], [sin(PAN), cos(PAN), 0], [0, 0, 1]])
RY = Matrix([[cos(TILT), 0, sin(TILT)], [0, 1, 0], [-sin(TILT), 0, cos(TILT)]])


def derived(slip):
    """M and h, functions of q, and of q and qd, by Lagrange's equations with a slip."""
    arm, I, offset = RZ * RY * Matrix(COM), Matrix(INERTIA), RZ * Matrix(OFFSET)
    omega = RY.T * Matrix([0, 0, U[0]]) + Matrix([0, U[1], 0])  # in body axes
    if slip == "CoM not turned by the pan":
        arm = RY * Matrix(COM)
    if slip == "sine for cosine":
        arm[0] = arm[0].subs(TILT, sp.pi / 2 - TILT)
    if slip == "sign of a component":
        arm[1] = -arm[1]
    if slip == "relative":
        omega = Matrix([0, U[1], 0])
    if slip == "sign in omega":
        omega[0] = -omega[0]
    first, second = (part.jacobian(Q) * RATES for part in (offset, arm))
    factor = sp.Rational(1, 2) if slip == "factor 2 of v^2" else 1
    v2 = first.dot(first) + 2 * factor * first.dot(second) + second.dot(second)
    if slip == "inertia not turned":
        world = RZ * RY * omega
        turning = (world.T * I * world)[0]
    else:
        turning = (omega.T * I * omega)[0]
    T = (MASS * v2 + turning + sp.Float(0.01) * U[0] ** 2) / 2
    V = MASS * G * (offset + arm)[2]
    M = sp.hessian(T, U)
    h = M.diff(PAN) * U[0] * RATES + M.diff(TILT) * U[1] * RATES - Matrix([T.diff(q) - V.diff(q) for q in Q])
    if slip == "gradient in one row":
        h[1] += 2 * T.diff(TILT)
    of_M, of_h = sp.lambdify([Q], M, "numpy"), sp.lambdify([Q, U], h, "numpy")
    return lambda q: np.array(of_M(q), float), lambda q, u: np.array(of_h(q, u), float).ravel()


SLIPS = {  # the place and what it explains
    "CoM not turned by the pan": ("CoM of arm", "not turned by pan"),
    "sine for cosine": ("CoM of arm", "sine and cosine of tilt exchanged in x"),
    "sign of a component": ("CoM of arm", "y with the other sign"),
    "relative": ("angular velocity of arm", "relative to the body before, not to the world"),
    "sign in omega": ("angular velocity of arm, x in its own axes", "pan' with the other sign"),
    "factor 2 of v^2": ("2 (offset of tilt) * (CoM of arm) in v^2 of arm", 0.5),
    "inertia not turned": ("inertia of arm", "not turned to the inertial frame"),
    "gradient in one row": ("gradient of the kinetic energy in h[tilt]", "of the other sign"),
}


def given(slip, count=12):
    M, h = derived(slip)
    q, qd = np.random.default_rng(4).uniform(-2.0, 2.0, (2, count, 2))

    def bias(speeds):
        return np.array([h(*state) for state in zip(q, speeds)])

    return Values.of(TREE, q, qd, np.array([M(x) for x in q]), bias(qd)), bias


def test_the_derivation_without_a_slip_is_right():
    values, bias = given("")
    assert not diagnose(TREE, values, bias=bias).differs


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_of_the_derivation_is_named_among_the_first(slip):
    """A sign of one component of two is that of the other."""
    values, bias = given(slip)
    place, explains = SLIPS[slip]
    causes = [cause for cause in diagnose(TREE, values, bias=bias).causes[:3] if cause.place == place]
    assert explains in [x if isinstance(x := cause.explains, str) else round(x, 9) for cause in causes]
