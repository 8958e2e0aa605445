"""The elliptic function of a pendulum, and small oscillations about an equilibrium."""

import numpy as np
import pytest

import tmt
from compare.robots.arm import ARM
from compare.truth.linear import modes, small_oscillation, stiffness
from compare.truth.pendulum import exact_swing, pendulum, swing
from tmt.exact.values import distance

SWING = next(case for case in ARM.cases if len(case.joints) == 1)


def test_the_swing_is_its_elliptic_function():
    hanging, frequency = pendulum(SWING.tree)
    assert hanging == pytest.approx(np.pi / 2)
    assert frequency**2 == pytest.approx(41.8436, abs=5e-5)  # the assignment's f1
    t = np.linspace(0.0, 3.0, 61)
    for q, qd in ((0.0, 0.0), (0.3, 4.0), (2.0, -7.0), (8.0, 1.0)):
        exact = swing(t, q, qd, hanging, frequency)
        assert exact[0] == pytest.approx(q) and np.ptp(exact) > 0.3
        assert distance(exact, exact_swing(t, q, qd, hanging, frequency)).max() < 1e-14 * (1.0 + 30.0)
        _, path, _ = tmt.simulate([q], [qd], [0.0], 3.0 / 6000, 6000, model=SWING.tree)
        assert np.abs(path[::100, 0] - exact).max() < 1e-10
    assert np.isnan(swing(t, 0.0, 20.0, hanging, frequency)).all()  # turns over


def test_a_pendulum_in_any_posture_of_the_locked_hinges():
    case = ARM.case("tilted", posture=(30, 20, 60), speed=(0, 0, 100), locked=("alpha", "beta"))
    hanging, frequency = pendulum(case.tree)
    assert tmt.gravity_balance([hanging], case.tree)[0] == pytest.approx(0.0, abs=1e-14)
    about = stiffness(case.tree, np.array([hanging])) / tmt.mass_matrix([0.0], case.tree)
    assert frequency**2 == pytest.approx(about[0, 0])


def test_modes_and_small_oscillations():
    q = ARM.posture("hanging")
    frequencies, shapes = modes(tmt.ARM, q)
    assert np.allclose(shapes.T @ tmt.mass_matrix(q) @ shapes, np.eye(3), atol=1e-12)
    assert np.allclose(shapes.T @ stiffness(tmt.ARM, q) @ shapes, np.diag(frequencies**2), atol=1e-9)
    away = np.array([0.1, -0.2, 0.3])
    start = small_oscillation(np.array([0.0, 1e-4]), tmt.ARM, q, away)
    assert np.allclose(start[0] - q, away)
    acceleration = -np.linalg.solve(tmt.mass_matrix(q), stiffness(tmt.ARM, q) @ away)
    assert np.allclose((start[1] - start[0]) * 2e8, acceleration, rtol=1e-3)
