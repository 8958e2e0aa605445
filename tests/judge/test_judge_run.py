"""When a run has left, has diverged, and how far it went."""

import numpy as np
import pytest

import tmt
from compare.judge.run import departure, deviation, deviation_alive, diverged_at, number_or_none
from compare.robots.arm import ARM

CASES = {case.name: case for case in ARM.cases}


def kicked(case, share, q=None) -> list:
    """A run of two states whose second has gained this share of the energy that the case's arm can have."""
    start, rate = case.start
    q = start if q is None else q
    M = tmt.mass_matrix(start, case.tree)
    allowed = 2.0 * 9.81 * (1.9 * 0.15 + 1.5 * 0.45) + rate @ M @ rate / 2
    gained = tmt.potential_energy(q, case.tree) - tmt.potential_energy(start, case.tree) - (q - start) @ case.tau
    kinetic = share * allowed + rate @ M @ rate / 2 - gained
    new = np.array([np.sqrt(2.0 * kinetic / tmt.mass_matrix(q, case.tree)[0, 0]), 0.0, 0.0])
    return [np.array([start, q]), np.array([rate, new])]


@pytest.mark.parametrize("name", ["bent, free", "ball catch, held", "thrown, no gravity"])
def test_a_run_has_diverged_beyond_the_energy_that_the_arm_can_have(name):
    case, t = CASES[name], np.array([0.0, 0.5])
    for q in (None, case.q + [0.1, -0.2, 0.3]):
        assert diverged_at(case, t, *kicked(case, 0.999, q)) is None
        assert diverged_at(case, t, *kicked(case, 1.001, q)) == 0.5


def test_a_run_has_diverged_where_it_is_not_finite():
    q, qd = np.zeros((3, 3)), np.zeros((3, 3))
    for values in (q, qd):
        for wrong in (np.nan, np.inf):
            values[2, 1] = wrong
            assert diverged_at(CASES["bent, free"], np.arange(3.0), q, qd) == 2.0
            assert number_or_none(deviation(q, q[0])) is None or values is qd
            values[2, 1] = 0.0


def test_an_arm_has_left_at_a_tenth_of_a_radian():
    t, path = np.arange(3.0), np.ones((3, 2))
    for off, left in ((0.0999, None), (0.1001, 1.0), (-0.1001, 1.0)):
        path[1, 1] = 1.0 + off
        assert departure(t, path) == left
    assert deviation_alive(np.array([1.1, 0.7, np.nan]), 1.0) == pytest.approx(0.3)
    assert (
        deviation(np.array([1.1, 0.7]), 1.0) == pytest.approx(0.3) and deviation(np.array([1.1, np.nan]), 1.0) == np.inf
    )


def test_silent_nonsense_is_found_by_its_energy(mujoco):
    """implicit at 5/64 s from ball catch: finite, no warning, far beyond its physical energy."""
    case = CASES["ball catch, free"]
    t, q, v, *_ = mujoco.of(case).run(*case.start, case.tau, 5 / 64, 64, "implicit")
    assert np.isfinite(q).all()
    assert diverged_at(case, t, q, v) is not None
    t, q, v, *_ = mujoco.of(case).run(*case.start, case.tau, 5 / 64, 64, "RK4")
    assert diverged_at(case, t, q, v) is None
