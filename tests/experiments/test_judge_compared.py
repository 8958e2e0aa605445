"""What is compared at states and with printed numbers: tolerances written out, and what is off fails its own checks."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.edited import MOON, setup_of
from helpers.judged import BOTH, verdicts

import tmt
from compare.core.check import Result
from compare.engines.mujoco import parse
from compare.experiments import functions, published, states
from compare.experiments.parameters.numbers import check_forces
from compare.experiments.quantities import QUANTITIES
from compare.experiments.states import check_wide
from compare.judge.entries import Entries
from compare.judge.scale import EPS
from compare.robots.arm import ARM, PRINTED
from compare.robots.states import Sample
from compare.run.examine import Setup
from tmt.exact.many import Pairs

NAMES = "kinematics", "mass", "gravity", "acceleration"
kinematics, mass, gravity, acceleration = map(functions, NAMES)
OF_MUJOCO = [  # the experiment, what is off (of a pair which), the checks of both engines that fail
    (kinematics, "com_positions", {}, {"x_b"}), (kinematics, "angular_velocities", {}, {"omega_b"}),
    (kinematics, "jacobians", {"place": 0}, {"T_b"}), (kinematics, "jacobians", {"place": 1}, {"B_b"}),
    (kinematics, "convective_terms", {"place": 0}, {"v_conv"}),
    (kinematics, "convective_terms", {"place": 1}, {"w_conv"}), (mass, "mass_matrix", {}, {"Mbar"}),
    (gravity, "gravity_balance", {}, {"holding torque"}), (acceleration, "bias", {}, {"bias", "bias from C qd"}),
    (kinematics, "com", {}, {"c"}), (kinematics, "com_jacobian", {}, {"dc/dq"}),
    (kinematics, "centroidal_momentum_matrix", {}, {"centroidal momentum matrix"}),
    (acceleration, "acceleration", {}, {"qdd", "tau from MuJoCo's qdd by TMT", "dE/dt - tau.qd at MuJoCo's qdd"}),
    (acceleration, "inverse", {}, {"tau from TMT's qdd by mj_inverse", "tau from Y theta"}),
    (acceleration, "energy", {}, {"energy"}), (acceleration, "potential_energy", {}, {"potential energy"}),
]  # fmt: skip
EXPERIMENTS = [kinematics, mass, gravity, acceleration]
ITEMS = {item.item: item for item in PRINTED}


def off(values, place=None):
    """Values that are a little off; of a pair only the one at the place, or both."""
    if isinstance(values, tuple):
        return tuple(off(part) if place in (None, k) else part for k, part in enumerate(values))
    return values * (1 + 1e-6) + 1e-6


class Off:
    """MuJoCo, or its dynamics of a case, that gives one quantity a little off."""

    name = "mujoco"

    def __init__(self, right, quantity, place=None):
        self.right, self.changed = right, (quantity, place)

    def of(self, case):
        return Off(self.right.of(case), *self.changed)

    def __getattr__(self, name):
        given, (quantity, place) = getattr(self.right, name), self.changed
        return given if name != quantity else lambda *states: off(given(*states), place)


def failing(experiment, mujoco) -> set:
    """The quantities whose comparison of both engines fails."""
    result = experiment.rows(setup_of(mujoco, make=Setup, states=10, exact_states=0, size="small"))
    failed = [check.quantity for check in result.checks if not check.passed]
    return {quantity for quantity in failed if not quantity.endswith("to exact")}


@pytest.mark.parametrize("experiment, quantity, which, expected", OF_MUJOCO)
def test_a_quantity_of_mujoco_that_is_off_fails_its_own_checks(mujoco, experiment, quantity, which, expected):
    compiled = {f"{name}, compiled" for name in expected & QUANTITIES.keys()}
    assert failing(experiment, Off(mujoco, quantity, **which)) == expected | compiled


def test_states_that_are_left_out_are_said(mujoco, monkeypatch):
    monkeypatch.setattr("compare.robots.states.MOST_NUMBERS", 4 * 3 * 2 * 3)  # of T_b: 4 states
    result = mass.rows(setup_of(mujoco, make=Setup, states=10, exact_states=0, size="small"))
    (note,) = [note for note in result.notes if note.kind == "fewer_states"]
    assert (note.values["count"], note.values["states"]) == (4, 10)


def test_a_mass_matrix_of_mujoco_that_is_not_definite_fails_its_own_check(mujoco, monkeypatch):
    monkeypatch.setitem(globals(), "off", lambda values, place: -values)
    (definiteness,) = failing(mass, Off(mujoco, "mass_matrix")) - {"Mbar", "Mbar, compiled"}
    assert definiteness.startswith("MuJoCo: least eigenvalue")


def test_a_joint_whose_accelerations_are_all_smaller_than_their_tolerance_is_not_judged(setup):
    """At all states together: 3 rad/s2 of alpha, 1 rad/s2 of beta, whose least tolerance is just below or above; gamma rests."""
    sizes, robot = [np.array([[3.0, 0.5, 0.0]]), np.array([[2.0, np.nan, 0.0], [0.0, 1.0, 0.0]])], setup.robot
    for least, judged in ((0.999, True), (1.001, False)):
        scales = [np.array([[4.0, 2.0, 1.0]]), np.array([[2.999, 3.0, 1.0], [9.0, least, 1.0]])]
        result, comparisons = Result("acceleration"), []
        for size, scale in zip(sizes, scales):
            of = {"robot": robot, "values": lambda name, size=size: [size, -size, None]}
            comparisons.append(SimpleNamespace(acceleration_scale=scale / (64 * 2.0**-52), **of))
        check_wide(result, comparisons)
        said = [("beta" in check.note, check.judged) for check in result.checks]
        assert said == [(True, False)] * (not judged)


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=NAMES)
def test_an_error_of_the_compiled_functions_alone_fails_their_own_check(mujoco, experiment, monkeypatch):
    assert failing(experiment, mujoco) == set()
    checks = {(quantity, name) for of, quantity, _, names in OF_MUJOCO if of is experiment
              for name in names & QUANTITIES.keys()}  # fmt: skip
    for quantity in dict(checks):
        right = getattr(tmt, quantity)
        monkeypatch.setattr(tmt, quantity, lambda *given, right=right, **named: off(right(*given, **named)))
    assert failing(experiment, mujoco) == {f"{name}, compiled" for _, name in checks}


@pytest.mark.parametrize("module", [kinematics, mass, gravity, acceleration])
def test_tolerances_are_64_eps_of_the_scale_of_an_entry_of_the_quantity(module):
    """Of the arm at one state, zero with these rates. The scales themselves: tests/judge/test_judge_scale.py."""
    setup, rates, zero = setup_of(make=Setup, states=1, exact_states=1), [1.0, -2.0, 8.0], np.zeros((1, 3))
    setup.__dict__["random"] = Sample(ARM.tree, "random states", zero, np.array([rates]), zero, 1)
    checks = [check for check in module.rows(setup).checks if check.scene == "random states"]
    found = {check.quantity: check.tolerance / (64 * EPS) for check in checks}
    of = Entries(ARM.tree, zero, np.array([rates]))
    force, qdd = of.force(), tmt.acceleration(tmt.ARM, np.zeros(3), rates, np.zeros(3))[None]
    sizes = {name: getattr(of, quantity.scale) for name, quantity in QUANTITIES.items() if name in found}
    if module is acceleration:
        closing = of.closing(force, qdd)
        sizes |= {name: closing for name in found if name.startswith("tau from")}
        sizes["qdd"] = of.acceleration(force, qdd)
        sizes |= {name: closing @ np.abs(rates) for name in found if name.startswith("dE/dt")}
        assert len(sizes) == 8
    assert sizes and all(np.isclose(found[name], size, rtol=1e-9).any() for name, size in sizes.items())


@pytest.mark.parametrize("least, passes", [(1.01, True), (0.99, False), (-1.0, False)])
def test_a_mass_matrix_is_definite_by_more_than_rounding(least, passes):
    result, small = Result("mass"), least * 64 * EPS
    # in units of its diagonal: eigenvalues 1 - c and 1 + c of ((1, c), (c, 1)), whatever the units
    c, units = (1 - small) / (1 + small), np.sqrt([1e-9, 1.0])
    M = np.array([[1.0, c], [c, 1.0]]) * np.outer(units, units)
    states.check_definiteness(result, "TMT", np.array([np.eye(2), M]))  # the worst state decides
    states.check_definiteness(result, "of the other sign", np.array([-np.eye(2)]))
    assert list(verdicts(result).values()) == [passes, False]


def test_forces_that_the_equations_lack_are_zero_except_for_rounding_of_what_is_subtracted():
    tree, state = dataclasses.replace(ARM.tree, damping=(0.5, 0.5, 0.5)), np.array([[0.1, 0.2, 0.3]])
    least, forces = 64 * EPS * 0.5 * 4.0, {"actuators": 0.0, "constraints and contacts": 1e-300}
    other_forces = lambda q, qd: {source: np.array([[force]]) for source, force in forces.items()}  # noqa: E731
    sample = Sample(tree, "random states", state, np.array([[1.0, -4.0, 2.0]]), state, 0)
    dynamics = SimpleNamespace(other_forces=other_forces)
    for share, passed in ((0.99, [True, False, True]), (1.01, [True, False, False])):
        forces["fluid and tendons"], result = share * least, Result("parameters")
        check_forces(result, sample, dynamics, False)
        assert list(verdicts(result).values()) == passed


@pytest.mark.parametrize("share, passes", [(0.99, True), (1.01, False)])
def test_a_mass_matrix_is_symmetric_within_the_scale_of_each_entry(share, passes):
    result, off = Result("mass"), share * 64 * EPS
    M = np.array([[[1.0, 1.0 + off * 2.0**10], [1.0, 1.0]]])
    states.check_symmetry(result, M, np.array([[[9e3, 1.0], [1.0, 9e3]]]) * 2.0**10)
    assert list(verdicts(result).values()) == [passes]


@pytest.mark.parametrize("rows, top", [
    ([(1.0, 0.2), (1.0, 0.7), (1.0, 0.4)], 1), ([(1.0, 0.9), (None, None)], 1), ([(1.0, None), (1.0, 0.1)], 1),
    ([(1.0, None)], None),
])  # fmt: skip
def test_the_headline_has_the_largest_share_and_what_is_no_number_first(rows, top):
    result = Result("mass")
    result.rows = [
        SimpleNamespace(worst_difference=worst, difference_over_bar=share) for worst, share in rows
    ]
    finding = states.headline(result)
    assert (finding and finding.values["row"]) is (None if top is None else result.rows[top])


def of_item(name, ours=0.0, theirs=0.0, scale=0.0, exactly=0.0, printed=True):
    """The verdicts on an item: each answer is so far from what is printed, or from the exact value."""
    item, result = ITEMS[name], Result("published")
    value = np.array(item.values)
    truth = value + exactly if printed else np.zeros_like(value)
    exact = Pairs(truth[None], np.zeros_like(truth)[None])
    answer = published.Answer(exact, truth + ours, truth + theirs, scale)
    published.check_answer(result, item, answer, ARM.joints)
    return verdicts(result)


@pytest.mark.parametrize("name", ["c", "f1", "g", "h"])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
@BOTH
def test_four_decimals_are_met_to_half_a_unit_of_the_last(name, share, passes, sign):
    what, off = ITEMS[name].quantity + " - printed", sign * share * 0.5e-4
    labels = [f"{label}: {what}" for label in ("TMT", "MuJoCo", "exact")]
    assert of_item(name, ours=off) == dict(zip(labels, (passes, True, True)))
    assert of_item(name, theirs=off) == dict(zip(labels, (True, passes, True)))


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


@pytest.mark.parametrize("of_tmt, of_mujoco, is_met", [
    (0.99, -0.99, True), (1.01, 0.0, False), (0.0, 1.01, False), (0.0, -1.01, False), (1.01, 1.01, False),
])  # fmt: skip
def test_a_printed_number_is_met_if_both_engines_meet_it(of_tmt, of_mujoco, is_met):
    about = {
        "item": "c",
        "posture": "",
        "quantity": "Mbar",
        "component": "",
        "unit": "",
        "exact": 2.0,
        "published": 2.0,
    }
    row = published.PrintedRow(
        tmt=2.0 + of_tmt * 1e-4, mujoco=2.0 + of_mujoco * 1e-4, tolerance=1e-4, **about
    )
    assert row.is_met is is_met


def test_each_column_is_whose_it_says_and_f4_is_asked_under_the_torque_of_c():
    of_moon = published.rows(setup_of(MOON)).rows
    moon = {(row.item, row.component): row for row in of_moon}
    ours, M = tmt.gravity_balance(tmt.ARM, np.zeros(3)), tmt.mass_matrix(tmt.ARM, ARM.posture("hanging"))
    least, *_, largest = np.linalg.eigvalsh(M)
    theirs = parse(MOON, tmt.ARM).of(ARM.case()).gravity_balance(np.zeros(3))
    assert [moon["c", name].tmt for name in ARM.joints] == list(ours)
    assert [moon["c", name].mujoco for name in ARM.joints] == list(theirs)
    of_alpha = moon["c", "alpha"]
    assert of_alpha.exact == pytest.approx(-2.20725) and of_alpha.tolerance == pytest.approx(0.5e-4, rel=1e-6)
    for name in ("tmt", "exact"):
        assert max(abs(float(getattr(row, name))) for row in of_moon if row.item == "f4") < 1e-12
    allowed = 64 * EPS * (largest / least + 1.0) / least * 9.4176
    assert moon["f2", "alpha"].tolerance == pytest.approx(allowed, rel=1e-9)
    assert published.scales(ARM.tree, ARM.posture("hanging"))["mass_matrix"] == np.abs(M).max()
