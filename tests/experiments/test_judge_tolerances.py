"""Tolerances and rules of what is compared at states and with printed numbers, from the stated numbers written out."""

import numpy as np
import pytest
from edited import MOON, setup_of
from judged import verdicts

import tmt
from compare.engines.mujoco import parse
from compare.experiments import acceleration, gravity, kinematics, mass, published
from compare.judge.check import Result
from compare.robots.arm import ARM, PRINTED
from compare.robots.states import Sample
from compare.run.examine import Setup

EPS = 2.0**-52
WEIGHT = 9.81 * (1.9 * 0.15 + 1.5 * 0.45)  # N m: sum of m g reach
BOUND = 64 * EPS * 126.8333**2  # of the largest condition number


def tolerances(module, qd) -> dict:
    """Of the arm at one state, zero with these rates, in units of 64 eps, by quantity."""
    setup, zero = setup_of(make=Setup, states=1, exact_states=1), np.zeros((1, 3))
    setup.__dict__["random"] = Sample(ARM.tree, "random states", zero, np.array([qd]), zero, 1)
    checks = module.rows(setup).checks
    return {check.quantity: check.tolerance / (64 * EPS) for check in checks if check.scene == "random states"}


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


# printed numbers

ITEMS = {item.item: item for item in PRINTED}


def of_item(name, ours=0.0, theirs=0.0, scale=0.0, exactly=0.0, printed=True):
    """The verdicts on an item: each answer is so far from what is printed, or from the exact value."""
    item, result = ITEMS[name], Result("published")
    value = np.array(item.values)
    truth = value + exactly if printed else np.zeros_like(value)
    answer = published.Answer(truth.astype(object), truth + ours, truth + theirs, scale)
    published.check_answer(result, item, answer, ARM.joints)
    return verdicts(result)


@pytest.mark.parametrize("name", ["c", "f1", "g", "h"])
@pytest.mark.parametrize("off, inside", [(0.499e-4, True), (-0.499e-4, True), (0.501e-4, False), (-0.501e-4, False)])
def test_four_decimals_are_met_to_half_a_unit_of_the_last(name, off, inside):
    what = ITEMS[name].quantity + " - printed"
    assert of_item(name, ours=off) == {f"TMT: {what}": inside, f"MuJoCo: {what}": True, f"exact: {what}": True}
    assert of_item(name, theirs=off) == {f"TMT: {what}": True, f"MuJoCo: {what}": inside, f"exact: {what}": True}


@pytest.mark.parametrize("name", ["f2", "f3", "f4"])
@pytest.mark.parametrize("share, inside", [(0.99, True), (1.01, False)])
def test_what_is_zero_but_for_rounding_is_met_to_64_eps_of_its_scale(name, share, inside):
    away = share * 64 * EPS * 1e5
    for off, verdict in (({"ours": away}, (inside, True)), ({"theirs": away}, (True, inside))):
        found = of_item(name, scale=1e5, printed=False, **off)
        assert (found["TMT: qdd - exact"], found["MuJoCo: qdd - exact"]) == verdict


@pytest.mark.parametrize("off, inside", [(0.49e-18, True), (0.51e-18, False)])
def test_the_printed_digits_of_f2_and_f3_are_met_to_half_a_unit_of_the_last(off, inside):
    assert of_item("f3", ours=off)["TMT: qdd - printed"] is inside
    assert of_item("f3", exactly=off)["exact: qdd - printed"] is inside
    assert of_item("f2", exactly=off)["exact: |qdd_alpha| - |printed|"] is inside


def test_each_column_is_whose_it_says_and_f4_is_asked_under_the_torque_of_c():
    of_moon = published.rows(setup_of(MOON)).rows
    moon = {(row["item"], row["component"]): row for row in of_moon}
    ours, least = tmt.gravity_balance(np.zeros(3)), np.linalg.eigvalsh(tmt.mass_matrix(ARM.posture("hanging")))
    theirs = parse(MOON, tmt.ARM).of(ARM.case()).gravity_balance(np.zeros(3))
    assert [moon["c", name]["tmt"] for name in ARM.joints] == list(ours)
    assert [moon["c", name]["mujoco"] for name in ARM.joints] == list(theirs)
    of_alpha = moon["c", "alpha"]
    assert of_alpha["exact"] == pytest.approx(-2.20725) and of_alpha["tolerance"] == pytest.approx(0.5e-4, rel=1e-6)
    for name in ("tmt", "exact"):
        assert max(abs(float(row[name])) for row in of_moon if row["item"] == "f4") < 1e-12
    allowed = 64 * EPS * (least[-1] / least[0] + 1.0) / least[0] * 9.4176
    assert moon["f2", "alpha"]["tolerance"] == pytest.approx(allowed, rel=1e-9)
