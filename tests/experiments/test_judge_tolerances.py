"""Tolerances of what is compared at states, from the stated numbers written out."""

import dataclasses

import numpy as np
import pytest
from crane import TREE, crane
from crane import XML as CRANE
from edited import setup_of

import tmt
from compare.engines.mujoco import parse
from compare.experiment import Setup, engines
from compare.experiments import acceleration, gravity, kinematics, mass
from compare.robots.arm import ARM
from compare.states import Sample

EPS = 2.0**-52
WEIGHT = 9.81 * (1.9 * 0.15 + 1.5 * 0.45)  # N m: sum of m g reach


def one_state(qd) -> Setup:
    """A setup whose random states are one: zero, at these rates."""
    setup = setup_of(make=Setup, states=1, exact_states=1)
    sample = Sample(ARM.tree, "random states", np.zeros((1, 3)), np.array([qd]), np.zeros((1, 3)), 1)
    setup.__dict__["random"] = sample
    return setup


def tolerances(module, setup) -> dict:
    """Tolerances at the one state in units of 64 eps, by quantity."""
    checks = module.rows(setup).checks
    return {check.quantity: check.tolerance / (64 * EPS) for check in checks if check.scene == "random states"}


def test_tolerances_are_64_eps_of_the_sums_that_are_added_up():
    found = tolerances(gravity, one_state([0.0, 0.0, 0.0]))
    torques = [found[name] for name in found if "torque" in name and "qdd" not in name]
    assert len(torques) == 6 and torques == pytest.approx([WEIGHT] * 6)
    least, most = np.linalg.eigvalsh(tmt.mass_matrix(np.zeros(3)))[[0, -1]]
    assert found["qdd of MuJoCo under TMT's torque"] == pytest.approx((most / least + 1.0) / least * WEIGHT)
    found = tolerances(kinematics, one_state([1.0, -2.0, 3.0]))
    expected = {"x_b": 0.45, "omega_b": 6.0, "T_b": 0.45, "B_b": 1.0, "v_conv": 0.45 * 36.0, "w_conv": 36.0}
    assert {name: found[name] for name in expected} == pytest.approx(expected)
    assert tolerances(mass, one_state([0.0, 0.0, 0.0]))["Mbar"] == pytest.approx(0.24450, abs=1e-5)


def test_tolerances_in_motion_grow_with_the_terms_of_the_bias():
    """Only gamma turns: the forearm's centripetal term 1.5 kg x 0.15 m x w^2 acts on alpha by 0.3 m."""
    rate = 8.0
    found = tolerances(acceleration, one_state([0.0, 0.0, rate]))
    size = WEIGHT + 1.5 * 0.15 * rate**2 * 0.3
    M = tmt.mass_matrix(np.zeros(3))
    least, most = np.linalg.eigvalsh(M)[[0, -1]]
    expected = {
        "bias": size,
        "qdd": (most / least + 1.0) / least * size,
        "tau from MuJoCo's qdd by TMT": most / least * size,
        "tau from TMT's qdd by mj_inverse": most / least * size,
        "energy": WEIGHT + M[2, 2] * rate**2 / 2,
        "potential energy": WEIGHT,
        "dE/dt - tau.qd at TMT's qdd": most / least * size * rate,
        "dE/dt - tau.qd at MuJoCo's qdd": most / least * size * rate,
        "dp_alpha/dt at TMT's qdd, no gravity": most / least * M.max() * rate**2,
        "dp_alpha/dt at MuJoCo's qdd, no gravity": most / least * M.max() * rate**2,
    }
    assert {name: found[name] for name in expected} == pytest.approx(expected)


def test_texts_name_the_scales_of_the_stated_arm():
    assert "9.42 N m" in gravity.tolerance(ARM) and "9.42 J" in acceleration.tolerance(ARM)
    assert kinematics.tolerance(ARM).count("0.45 m") == 2 and "from the shoulder" in kinematics.tolerance(ARM)


# a robot with damping


def damped(tmp_path, stated=0.3, compiled=0.3):
    """A small run of the crane, its first two joints damped."""
    robot = dataclasses.replace(crane(tmp_path), tree=dataclasses.replace(TREE, damping=(stated, 0.1, 0.0, 0.0)))
    text = CRANE.replace('name="swing"', f'name="swing" damping="{compiled}"')
    text = text.replace('name="lift"', 'name="lift" damping="0.1"')
    return Setup.small(robot, engines(parse(text, robot.tree)))


def test_damping_takes_from_energy_and_momentum_what_it_must(tmp_path):
    checks = acceleration.rows(damped(tmp_path)).checks
    assert [str(check) for check in checks if not check.passed] == []
    found = {check.quantity for check in checks}
    for name in ("TMT", "MuJoCo"):
        assert f"dE/dt - (tau - D qd).qd at {name}'s qdd" in found
        assert f"dp_swing/dt + D qd at {name}'s qdd, no gravity" in found
    failed = {check.quantity for check in acceleration.rows(damped(tmp_path, compiled=0.31)).checks if not check.passed}
    assert {"qdd", "tau from MuJoCo's qdd by TMT", "tau from TMT's qdd by mj_inverse"} <= failed
    assert {"dE/dt - (tau - D qd).qd at MuJoCo's qdd", "dp_swing/dt + D qd at MuJoCo's qdd, no gravity"} <= failed
    assert not any("at TMT's qdd" in name for name in failed)


def test_damping_is_one_of_the_terms_of_a_tolerance(tmp_path):
    """A thousand N m s/rad: all other terms are small beside it."""
    setup = damped(tmp_path, 1e3, 1e3)
    sample = Sample(setup.robot.tree, "random states", np.zeros((1, 4)), np.eye(4)[:1], np.zeros((1, 4)), 1)
    setup.__dict__["random"] = sample
    found = tolerances(acceleration, setup)
    least, most = np.linalg.eigvalsh(tmt.mass_matrix(np.zeros(4), setup.robot.tree))[[0, -1]]
    for name in ("tau from MuJoCo's qdd by TMT", "dE/dt - (tau - D qd).qd at TMT's qdd"):
        assert found[name] == pytest.approx(1e3 * most / least, rel=0.05)
    assert found["dp_swing/dt + D qd at TMT's qdd, no gravity"] == pytest.approx(1e3 * most / least, rel=0.05)
    assert "|D rates|" in acceleration.tolerance(setup.robot) and "|D rates|" not in acceleration.tolerance(ARM)
    assert "damping" in acceleration.claim(setup.robot) and "damping" not in acceleration.claim(ARM)
