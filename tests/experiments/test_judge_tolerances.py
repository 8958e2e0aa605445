"""Tolerances and rules of what is compared at states, from the stated numbers written out."""

import dataclasses

import numpy as np
import pytest
from edited import XML, setup_of
from judged import verdicts
from model_edits import ALPHA, BETA, edited

import tmt
from compare.engines.mujoco import parse
from compare.experiment import Setup, engines
from compare.experiments import acceleration, gravity, kinematics, mass
from compare.judge.check import Result
from compare.robots.arm import ARM
from compare.states import Sample

EPS = 2.0**-52
WEIGHT = 9.81 * (1.9 * 0.15 + 1.5 * 0.45)  # N m: sum of m g reach
BOUND = 64 * EPS * 126.8333**2  # of the largest condition number
FEW = {"states": 20, "exact_states": 1, "size": "small"}


def tolerances(module, qd) -> dict:
    """Of the arm at one state, zero with these rates, in units of 64 eps, by quantity."""
    setup, zero = setup_of(make=Setup, states=1, exact_states=1), np.zeros((1, 3))
    setup.__dict__["random"] = Sample(ARM.tree, "random states", zero, np.array([qd]), zero, 1)
    checks = module.rows(setup).checks
    return {check.quantity: check.tolerance / (64 * EPS) for check in checks if check.scene == "random states"}


def failing(result) -> set:
    return {check.quantity for check in result.checks if not check.passed}


def test_tolerances_are_64_eps_of_the_sums_that_are_added_up():
    found = tolerances(gravity, [0.0, 0.0, 0.0])
    torques = [found[name] for name in found if "torque" in name and "qdd" not in name]
    assert len(torques) == 6 and torques == pytest.approx([WEIGHT] * 6)
    least, most = np.linalg.eigvalsh(tmt.mass_matrix(np.zeros(3)))[[0, -1]]
    assert found["qdd of MuJoCo under TMT's torque"] == pytest.approx((most / least + 1.0) / least * WEIGHT)
    found = tolerances(kinematics, [1.0, -2.0, 3.0])
    expected = {"x_b": 0.45, "omega_b": 6.0, "T_b": 0.45, "B_b": 1.0, "v_conv": 0.45 * 36.0, "w_conv": 36.0}
    assert {name: found[name] for name in expected} == pytest.approx(expected)
    assert tolerances(mass, [0.0, 0.0, 0.0])["Mbar"] == pytest.approx(0.24450, abs=1e-5)


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
    }
    for name in ("TMT", "MuJoCo"):
        expected[f"dE/dt - tau.qd at {name}'s qdd"] = most / least * size * rate
        expected[f"dp_alpha/dt at {name}'s qdd, no gravity"] = most / least * M.max() * rate**2
    found = tolerances(acceleration, [0.0, 0.0, rate])
    assert {name: found[name] for name in expected} == pytest.approx(expected)


@pytest.mark.parametrize("least, passes", [(1.01, True), (0.99, False), (-1.0, False)])
def test_a_mass_matrix_is_definite_by_more_than_rounding(least, passes):
    result, small = Result("mass"), least * 64 * EPS
    mass.check_definiteness(result, "TMT", np.array([np.eye(3), np.diag([1.0, 1.0, small])]))
    # in units of its diagonal: eigenvalues 1 - c and 1 + c of ((1, c), (c, 1)), whatever the units
    c, units = (1 - small) / (1 + small), np.sqrt([1e-9, 1.0])
    M = np.array([[1.0, c], [c, 1.0]]) * np.outer(units, units)
    mass.check_definiteness(result, "TMT", M[None], in_units=True)
    assert list(verdicts(result).values()) == [passes] * 2


@pytest.mark.parametrize("share, passes", [(0.99, True), (1.01, False)])
def test_a_mass_matrix_is_symmetric_within_the_scale_of_all_or_of_each_entry(share, passes):
    result, off = Result("mass"), share * 64 * EPS
    mass.check_symmetry(result, np.array([[[2.0, 2.0 * off], [0.0, 2.0]]]))
    M, scale = np.array([[[1.0, 1.0 + off * 2.0**10], [1.0, 1.0]]]), np.array([[[9e3, 1.0], [1.0, 9e3]]]) * 2.0**10
    mass.check_symmetry(result, M, scale)
    assert list(verdicts(result).values()) == [passes] * 2


@pytest.mark.parametrize("off, worst, passes", [
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


def test_the_worst_posture_of_each_engine_is_its_own():
    edits = ('mass="1.5"', 'mass="2.5"'), ('"gamma" type="hinge" axis="0 1', '"gamma" type="hinge" axis="0 -1')
    result = mass.rows(setup_of(edited(*edits), make=Setup, **FEW))
    of_place, worst = "{}: distance from (+-90, 90) deg", result.curves["worst"]
    assert of_place.format("MuJoCo") in failing(result) and of_place.format("TMT") not in failing(result)
    assert worst["tmt"][0] == pytest.approx(126.83, abs=0.01) and worst["mujoco"][0] > 190.0


def test_damping_takes_from_energy_and_momentum_what_it_must():
    robot = dataclasses.replace(ARM, tree=dataclasses.replace(ARM.tree, damping=(0.3, 0.1, 0.0)))

    def rows(compiled):
        text = edited((ALPHA, f'{ALPHA} damping="{compiled}"'), (BETA, f'{BETA} damping="0.1"'))
        return acceleration.rows(Setup(robot, engines(parse(text, robot.tree)), **FEW))

    right, failed = rows(0.3), failing(rows(0.31))
    names = {f"{of} at MuJoCo's qdd" for of in ("dE/dt - (tau - D qd).qd", "dp_alpha/dt + D qd")}
    assert failing(right) == set() and XML.count("damping") == 0
    assert names | {"qdd", "tau from MuJoCo's qdd by TMT"} <= {name.removesuffix(", no gravity") for name in failed}
    assert "tau from TMT's qdd by mj_inverse" in failed and not any("at TMT's qdd" in name for name in failed)
