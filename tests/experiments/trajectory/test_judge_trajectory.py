"""The rules of runs, of their derivative, of drift and of many digits, just inside and just outside; and what is found beside."""

import dataclasses

import mpmath
import numpy as np
import pytest
from trajectory_curves import CASES, FREE, HELD, run_of

import tmt
from compare.engines.mujoco import parse
from compare.engines.mujoco.engine import METHODS as OF_MUJOCO
from compare.experiments.trajectory import drift, many_digits, rules, true_motion
from compare.experiments.trajectory.rules import check_derivative
from compare.judge.check import Result
from compare.judge.run import check_movement, departure, required_time
from compare.judge.scale import EPS
from compare.robots.arm import ARM
from compare.robots.case import Coordinates
from tmt.methods import METHODS, one_step

LIFT_AND_HEAD = Coordinates(("lift", "head"), ("slide", "ball"))  # four movements, and four speeds
THROWN = CASES["thrown, no gravity"]
BY_ENGINE = pytest.mark.parametrize("engine, label", [("tmt", "TMT"), ("mujoco", "MuJoCo")])
NARROW, AT_ONCE = np.full(11, 0.999e-3), np.array([0.0, 1e-9, *[np.inf] * 9])


def verdicts(check, *arguments) -> dict:
    """Whether each check that is made passes, by the name of its quantity."""
    result = Result("trajectory")
    check(result, "x", *arguments)
    return {check.quantity: check.passed for check in result.checks}


def test_a_run_is_judged_while_its_band_is_below_a_thousandth_of_a_radian_and_nothing_has_diverged():
    times, never = np.arange(5.0), {"tmt": None, "mujoco": None}
    narrow, wide = np.full(5, 0.999e-3), np.array([0.0, 0.999e-3, 1.001e-3, 0.0, 0.0])
    assert rules.judged(times, narrow, never) == 5
    assert rules.judged(times, wide, never) == 2
    assert rules.judged(times, narrow, {"tmt": 2.5, "mujoco": 4.0}) == 3
    assert rules.judged(times, wide + 1.0, never) == 1


def level(difference, bar, name="open loop"):
    """The check and the row of differences (states, 2 nv)."""
    result, times = Result("trajectory"), np.arange(len(difference)) / 2
    rules.check_level(result, "x", {"level": name}, LIFT_AND_HEAD, np.array(difference), bar, times, {})
    return result.checks[0], result.rows[0]


@pytest.mark.parametrize("off, bar", [(0.999, 1.0), (1.001, 1.0), (np.nan, 1.0), (0.0, 0.0), (1e-300, 0.0)])
@pytest.mark.parametrize("place, name, unit", [(0, "lift", "m"), (3, "head z", "rad"), (5, "head x", "rad/s")])
def test_a_row_is_the_component_and_the_time_that_come_closest_to_the_tolerance(place, name, unit, off, bar):
    differences = np.zeros((3, 8))
    differences[1, place] = off
    check, row = level(differences, bar)
    assert check.passed is (off in (0.999, 0.0)) and row["worst_difference"] == check.value
    if bar:
        assert (check.unit, row["worst_unit"]) == (unit, unit) and check.note.startswith(name) and "0.500" in check.note


def test_a_row_has_the_largest_movement_beside_the_worst_component():
    _, row = level([[0.2, 0, 0, 0.7, 3.0, 0, 0, 0], [0.1, 0, 0, 0.4, 0, 0, 0, 0.9]], 1.0)
    assert (row["largest_difference"], row["worst_difference"], row["unit"]) == (0.7, 3.0, "rad or m")
    check, row = level(np.ones((1, 4)), 1.0, "derivative")
    assert (check.unit, row["unit"]) == ("m/s2", "rad/s2 or m/s2")


def test_what_a_scene_asks_for_depends_on_the_scheme_and_the_step():
    assert required_time(FREE, "rk4", 5 / 64) == 5.0 and required_time(HELD, "rk4", 5 / 64) == 2.5
    assert [required_time(FREE, "implicit", dt) for dt in (0.0099, 0.0101)] == [5.0, 0.3]


@pytest.mark.parametrize(
    "ours, theirs, width, found",
    [
        (None, None, NARROW, []),
        (0.5, 0.5, NARROW, [True]),
        (0.5, 0.51, NARROW, [False]),
        (None, 0.5, NARROW, [False]),
        (0.5, None, NARROW + 2e-6, []),
        (0.1, 0.11, AT_ONCE, [False]),
        (0.12, 0.13, AT_ONCE, []),  # the band opens before the next recorded state
    ],
)
def test_both_diverge_at_the_same_step_while_the_band_is_narrow(ours, theirs, width, found):
    ends = {"tmt": ours, "mujoco": theirs}
    assert [*verdicts(rules.check_divergence, ends, 0.01, 100, width).values()] == found


@pytest.mark.parametrize("moved, passes", [(0.1001, True), (0.0999, False), (np.nan, False)])
def test_a_free_run_moves_by_a_tenth_of_a_radian(moved, passes):
    assert verdicts(check_movement, moved) == {"movement": passes}


@pytest.mark.parametrize("last, passes", [(3.0, True), (np.nextafter(3.0, 9.0), False)])
def test_integrators_that_are_one_scheme_give_the_same_bits(last, passes):
    one, other = ([np.array([1.0, np.nan]), np.array([2.0, end])] for end in (3.0, last))
    assert verdicts(rules.check_same_bits, "Euler", one, other) == {"the same bits as Euler": passes}


@pytest.mark.parametrize("share, passes", [(0.999, True), (1.001, False), (np.nan, False)])
@pytest.mark.parametrize("state, rates", [(0, 6.0), (1, 0.1)])
def test_the_derivative_of_the_bias_is_judged_by_the_rates_of_each_state(state, rates, share, passes):
    q, qd = np.zeros((2, 3)), np.array([[1.0, -2.0, 3.0], [0.1, 0.0, 0.0]])
    damped, size = dataclasses.replace(tmt.ARM, damping=(0.1, 0.5, 0.0)), tmt.mass_matrix(q[0]).max() * rates + 0.5
    theirs, result = np.zeros((2, 3, 3)), Result("trajectory")
    theirs[state, 2, 1] = share * 64 * EPS * size
    check_derivative(result, damped, q, qd, np.zeros((2, 3, 3)), theirs)
    assert result.checks[0].passed is passes


@BY_ENGINE
@pytest.mark.parametrize(
    "order, share, falls, is_small",
    [
        (1.149, 1e-4, True, True),
        (1.151, 1e-4, False, True),
        (0.851, 1e-4, True, True),
        (0.849, 1e-4, False, True),
        (1.0, 0.999e-3, True, True),
        (1.0, 1.001e-3, True, False),
    ],
)
def test_drift_falls_at_the_order_and_that_of_rk4_is_far_below_eulers(engine, label, order, share, falls, is_small):
    made = {OF_MUJOCO["Euler"]: [4.0, 2.0, 1.0], OF_MUJOCO["RK4"]: [256e-5, 16e-5, 1e-5]}
    made = {method: {"tmt": values, "mujoco": values} for method, values in made.items()}
    made[OF_MUJOCO["Euler"]][engine] = [4.0, 2.0**order, 1.0]
    made[OF_MUJOCO["RK4"]][engine] = [256 * share, 16 * share, share]
    result = Result("trajectory")
    drift.check_drifts(result, {("bent, free", "energy", "J"): made}, {})
    of_order = f"deviation from order 1: drift of energy bent, free, Euler, {label}, 1 s"
    of_share = f"drift of energy over that of Euler bent, free, RK4, {label}, 1 s"
    failed = {f"{check.quantity} {check.scene}" for check in result.checks if not check.passed}
    assert len(result.checks) == 6
    assert failed == {name for name, passes in ((of_order, falls), (of_share, is_small)) if not passes}


def with_gravity(gravity) -> dict:
    return {"mujoco": parse(ARM.mjcf.read_text().replace("0 0 -9.81", gravity), tmt.ARM)}


def test_drift_is_measured_where_nothing_takes_energy_and_an_engine_that_does_not_drift_is_seen(engines):
    """Without gravity MuJoCo's arm stays where it is let go, and TMT's falls."""
    scenes = tuple(CASES[name].scene for name in ("bent, free", "bent, damped", "bent, held", THROWN.name))
    robot = dataclasses.replace(ARM, scenes=scenes)
    result = drift.measure_drift(robot, engines | with_gravity("0 0 0"), {1: (32, 64), 4: (32, 64)})
    of_free, *others = result.curves["drift"]["drifts"].items()
    assert [name for name, _ in others] == [(THROWN.name, "energy", "J"), (THROWN.name, "alpha-momentum", "N m s")]
    found = of_free[1][OF_MUJOCO["RK4"]]
    assert found["mujoco"] == [0.0, 0.0] and min(found["tmt"]) > 0.0
    assert np.isnan(drift.largest_drift(np.add, ([0.0, np.nan], [0.0, 1.0])))  # of a run that has diverged
    assert not any(check.passed for check in result.checks if check.scene.startswith("bent, free, RK4, MuJoCo"))


# errors, and many digits


def test_the_error_of_a_held_scene_is_its_distance_from_the_start_and_of_a_free_one_that_from_many_digits():
    path = tmt.simulate(*FREE.start, FREE.tau, 5 / 64, 64, "rk4", FREE.tree).q
    runs = {(HELD.name, *of): run_of(HELD, 9.0, 9.0) for of in (("implicit", 64), ("rk4", 128))}
    runs |= {(HELD.name, "rk4", 64): run_of(HELD, 0.25, np.nan)}
    runs |= {(FREE.name, "rk4", 64): run_of(FREE) | {"tmt": [path], "mujoco": [path + 100.0]}}
    result = Result("trajectory", curves={"runs": runs})
    true_motion.find_errors(result, ARM, {})
    assert list(result.curves["errors"]) == [HELD.name, FREE.name]
    assert result.curves["errors"][HELD.name] == (0.25, None)
    assert result.notes[0].values["far"] == [] and len(result.notes[0].values["scenes"]) == 2
    ours, theirs = result.curves["errors"][FREE.name]
    assert ours == pytest.approx(0.27, rel=0.03) and theirs > 90.0


@pytest.mark.parametrize("error, far", [(0.49, False), (0.51, True), (None, False)])
def test_an_error_of_more_than_a_hundred_times_the_difference_is_far(error, far):
    assert true_motion.is_far((0.1, error), 0.005) is far
    curve = run_of(HELD, 0.25, 0.26, until=2.5)
    assert true_motion.difference_while_judged(curve, HELD) == pytest.approx(0.005)


@BY_ENGINE
@pytest.mark.parametrize("share, passes", [(0.999, True), (1.001, False), (np.nan, False)])
def test_a_run_stays_in_the_band_about_many_digits(engine, label, share, passes):
    off = {name: np.zeros(3) for name in ("tmt", "mujoco")}
    off[engine][2] = share * 2e-12
    found = verdicts(many_digits.check_digits, off, np.array([0.0, 1e-12, 2e-12]), 0.5)
    assert {name.split()[0]: ok for name, ok in found.items()} == {"TMT": True, "MuJoCo": True} | {label: passes}


def test_many_digits_are_many_and_those_of_the_own_steps_of_the_scene():
    """The same two steps with 80 digits; 50 are those of the run."""
    case = FREE.changed(duration=0.5, dt=0.125)
    (short,), (own,) = (many_digits.exact_runs(case, ["rk4"], most).values() for most in (2, 64))
    assert (short.shape, own.shape) == ((3, 3), (5, 3)) and (short == own[:3]).all()
    with mpmath.workdps(80):
        q, qd, tau = ([mpmath.mpf(float(v)) for v in values] for values in (*case.start, case.tau))
        for _ in range(2):
            q, qd = one_step(METHODS["rk4"], case.tree, q, qd, tau, mpmath.mpf(0.125))
        assert max(abs(a - b) for a, b in zip(short[-1], q)) < mpmath.mpf(10) ** -46


def test_the_linear_map_says_when_a_torque_that_is_off_makes_the_arm_leave():
    push = 1e-9 * np.array([1.0, 0.5, -1.0])
    t, q, _ = tmt.simulate(*HELD.start, HELD.tau + tmt.mass_matrix(HELD.q) @ push, 5 / 64, 64, "rk4")
    assert true_motion.predicted_departure(HELD, push) == pytest.approx(departure(t, q), abs=5 / 64)
    assert true_motion.predicted_departure(CASES["bent, held"], 1e-9 * np.ones(3)) is None


def test_rounding_is_the_cause_only_of_what_rounding_can_do():
    allowed = true_motion.allowed_acceleration(HELD)

    def cause(share, at, left=4.69):
        return true_motion.cause(HELD, share * allowed, allowed, at, left)

    assert (cause(0.999, 4.69), cause(1.001, 4.69), cause(np.nan, 4.69)) == ("rounding", "torque", "torque")
    assert cause(0.5, 4.69 + 2.4 * 5 / 64) == "rounding"
    assert cause(0.5, 4.69 - 2.6 * 5 / 64) == cause(0.5, None) == "unexplained"
    assert cause(9.0, 0.1, None) is None  # it stays


def test_a_torque_that_does_not_hold_is_not_rounding(engines):
    left, farthest = {"tmt": None, "mujoco": 0.1}, {"tmt": 0.0, "mujoco": 2.0}
    earth, moon = (
        true_motion.departures(HELD, engines | other, left, farthest) for other in ({}, with_gravity("0 0 -1.62"))
    )
    pushes = [[engine["push"] for engine in of["engines"]] for of in (earth, moon)]
    assert earth["rate"] == pytest.approx(7.5, abs=0.1) and max(pushes[0]) <= earth["allowed"] < 1e-11
    assert pushes[1] == [pushes[0][0], pytest.approx(38, rel=0.02)]
    assert [engine["cause"] for engine in moon["engines"]] == [None, "torque"]
