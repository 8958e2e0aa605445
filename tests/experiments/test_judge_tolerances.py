"""Tolerances and rules of what is compared at states, from the stated numbers written out."""

import dataclasses

import numpy as np
import pytest
from crane import TREE, crane
from crane import XML as CRANE
from edited import XML, setup_of
from judged import verdicts

import tmt
from compare.engines.mujoco import parse
from compare.experiment import Setup, engines
from compare.experiments import acceleration, gravity, kinematics, mass
from compare.judge.check import Result
from compare.robots.arm import ARM
from compare.states import Sample

EPS = 2.0**-52
WEIGHT = 9.81 * (1.9 * 0.15 + 1.5 * 0.45)  # N m: sum of m g reach


def at_zero(setup, qd) -> Setup:
    """The setup, its random states one: zero, at these rates."""
    n = len(qd)
    sample = Sample(setup.robot.tree, "random states", np.zeros((1, n)), np.array([qd]), np.zeros((1, n)), 1)
    setup.__dict__["random"] = sample
    return setup


def tolerances(module, setup) -> dict:
    """Tolerances at the one state in units of 64 eps, by quantity."""
    checks = module.rows(setup).checks
    return {check.quantity: check.tolerance / (64 * EPS) for check in checks if check.scene == "random states"}


def of_arm(module, qd) -> dict:
    return tolerances(module, at_zero(setup_of(make=Setup, states=1, exact_states=1), qd))


def failing(result) -> set:
    return {check.quantity for check in result.checks if not check.passed}


def test_tolerances_are_64_eps_of_the_sums_that_are_added_up():
    found = of_arm(gravity, [0.0, 0.0, 0.0])
    torques = [found[name] for name in found if "torque" in name and "qdd" not in name]
    assert len(torques) == 6 and torques == pytest.approx([WEIGHT] * 6)
    least, most = np.linalg.eigvalsh(tmt.mass_matrix(np.zeros(3)))[[0, -1]]
    assert found["qdd of MuJoCo under TMT's torque"] == pytest.approx((most / least + 1.0) / least * WEIGHT)
    found = of_arm(kinematics, [1.0, -2.0, 3.0])
    expected = {"x_b": 0.45, "omega_b": 6.0, "T_b": 0.45, "B_b": 1.0, "v_conv": 0.45 * 36.0, "w_conv": 36.0}
    assert {name: found[name] for name in expected} == pytest.approx(expected)
    assert of_arm(mass, [0.0, 0.0, 0.0])["Mbar"] == pytest.approx(0.24450, abs=1e-5)


def test_tolerances_in_motion_grow_with_the_terms_of_the_bias():
    """Only gamma turns: the forearm's centripetal term 1.5 kg x 0.15 m x w^2 acts on alpha by 0.3 m."""
    rate = 8.0
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
    found = of_arm(acceleration, [0.0, 0.0, rate])
    assert {name: found[name] for name in expected} == pytest.approx(expected)


# rules of the mass matrix


@pytest.mark.parametrize("least, passes", [(1.01, True), (0.99, False), (0.0, False), (-1.0, False)])
def test_a_mass_matrix_is_definite_by_more_than_rounding(least, passes):
    result, small = Result("mass"), least * 64 * EPS
    mass.check_definiteness(result, "TMT", np.array([np.eye(3), np.diag([1.0, 1.0, small])]))
    assert verdicts(result) == {"TMT: least eigenvalue of Mbar over the largest": passes}
    # in units of its diagonal: eigenvalues 1 - c and 1 + c of ((1, c), (c, 1)), whatever the units
    c, units = (1 - small) / (1 + small), np.sqrt([1e-9, 1.0])
    result = Result("mass")
    mass.check_definiteness(
        result, "TMT", (np.array([[1.0, c], [c, 1.0]]) * np.outer(units, units))[None], in_units=True
    )
    assert list(verdicts(result).values()) == [passes]


@pytest.mark.parametrize("share, passes", [(0.99, True), (1.01, False)])
def test_a_mass_matrix_is_symmetric_within_the_scale_of_all_or_of_each_entry(share, passes):
    M, result = 2.0 * np.eye(3)[None], Result("mass")
    M[0, 0, 1] = share * 2.0 * 64 * EPS
    mass.check_symmetry(result, M)
    assert verdicts(result) == {"TMT: Mbar - Mbar' over its largest entry": passes}
    M, result = np.ones((1, 2, 2)), Result("mass")
    M[0, 0, 1] += share * 64 * EPS * 2.0**10
    mass.check_symmetry(result, M, np.array([[[9e3, 1.0], [1.0, 9e3]]]) * 2.0**10)
    assert list(verdicts(result).values()) == [passes]


BOUND = 64 * EPS * 126.8333**2


@pytest.mark.parametrize("off, worst, passes", [
    (0.0, (-90.0, 90.0), [True, True]),
    (0.99 * BOUND, (-90.0, 90.0), [True, True]),
    (1.01 * BOUND, (-90.0, 90.0), [False, True]),
    (0.0, (90.0099, 90.0), [True, True]),
    (0.0, (90.0101, 90.0), [True, False]),
    (0.0, (90.0, 90.0101), [True, False]),
    (0.0, (90.0, -90.0), [True, False]),
])  # fmt: skip
def test_the_worst_posture_and_its_condition_number_are_those_of_the_stated_arm(off, worst, passes):
    largest, result = mass.largest_condition(ARM), Result("mass")
    assert largest == pytest.approx(126.8333, abs=1e-4)
    mass.check_conditioning(result, ARM, "MuJoCo", largest + off, np.radians(worst))
    assert [check.passed for check in result.checks] == passes


def test_every_rule_of_the_mass_matrix_is_applied_to_both_engines():
    result = mass.rows(setup_of())
    compared = "Mbar", "Mbar, compiled", "Mbar, TMT to exact", "Mbar, MuJoCo to exact"
    rules = "least eigenvalue of Mbar over the largest", "condition number - 126.83", "distance from (+-90, 90) deg"
    of_each = {f"{name}: {rule}" for name in ("TMT", "MuJoCo") for rule in rules}
    assert {check.quantity for check in result.checks} == {
        *compared,
        "TMT: Mbar - Mbar' over its largest entry",
    } | of_each
    axis = '"gamma" type="hinge" axis="0 {}1'
    flipped = failing(mass.rows(setup_of(XML.replace(axis.format(""), axis.format("-")))))
    assert "MuJoCo: distance from (+-90, 90) deg" in flipped and not any(name.startswith("TMT") for name in flipped)
    worst = mass.rows(setup_of(XML.replace('mass="1.5"', 'mass="2.5"'))).curves["worst"]
    assert worst["tmt"][0] == pytest.approx(126.83, abs=0.01) and worst["mujoco"][0] > 190.0


# a robot with damping


def damped(tmp_path, stated=0.3, compiled=0.3):
    """A small run of the crane, its first two joints damped."""
    robot = dataclasses.replace(crane(tmp_path), tree=dataclasses.replace(TREE, damping=(stated, 0.1, 0.0, 0.0)))
    text = CRANE.replace('name="swing"', f'name="swing" damping="{compiled}"')
    text = text.replace('name="lift"', 'name="lift" damping="0.1"')
    return Setup.small(robot, engines(parse(text, robot.tree)))


def test_damping_takes_from_energy_and_momentum_what_it_must(tmp_path):
    result = acceleration.rows(damped(tmp_path))
    of = {
        name: {f"dE/dt - (tau - D qd).qd at {name}'s qdd", f"dp_swing/dt + D qd at {name}'s qdd, no gravity"}
        for name in ("TMT", "MuJoCo")
    }
    assert failing(result) == set() and of["TMT"] | of["MuJoCo"] <= {check.quantity for check in result.checks}
    failed = failing(acceleration.rows(damped(tmp_path, compiled=0.31)))
    assert {"qdd", "tau from MuJoCo's qdd by TMT", "tau from TMT's qdd by mj_inverse"} | of["MuJoCo"] <= failed
    assert not any("at TMT's qdd" in name for name in failed)
