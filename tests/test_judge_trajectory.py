"""The judge of runs: the width of the band, for each rule a row just inside and one just outside, whose number stands where."""

import dataclasses

import mpmath
import numpy as np
import pytest
from judged import verdicts

import tmt
from compare import band as band_of_rounding
from compare import drift, horizon, leaving, motion, reduction, told, trajectory
from compare.agreement import Result, Setup
from compare.band import band, step_rounding
from compare.engine import Engine
from compare.engine_file import load
from compare.scenes import SCENES, Scene
from tmt.methods import METHODS, amplification, one_step

EPS = 2.0**-52
BY_NAME = {scene.name: scene for scene in SCENES}
FREE, HELD, DAMPED = (BY_NAME[name] for name in ("bent, free", "ball catch, held", "bent, damped"))
TURN = tmt.Tree(  # one hinge without gravity: a linear system, and nothing but a sum of roundings
    hinge_names=("turn",), parent=(-1,), offset=((0.0, 0.0, 0.0),), axis=((0.0, 0.0, 1.0),), damping=(0.0,),
    body_names=("disc",), body_hinge=(0,), mass=(1.0,),
    com=((0.0, 0.0, 0.0),), inertia=(((1.0, 0, 0), (0, 1.0, 0), (0, 0, 2.0)),),
    gravity=(0.0, 0.0, 0.0),
)  # fmt: skip


# the width of the band


def turning(steps, dt, torque=3.0, rate=5.0):
    """States of the disc under a constant torque, and the rounding of each step as the report states it."""
    t, a = dt * np.arange(steps + 1), torque / 2.0
    q, qd = 1.0 + rate * t + a * t**2 / 2, rate + a * t
    rounding = (64 * EPS * 2.0 * a + 64 * EPS * torque) / 2.0
    rates = dt * rounding + 8 * EPS * (qd + dt * a)
    return q[:, None], qd[:, None], 8 * EPS * (q + dt * qd) + dt * rates, rates


@pytest.mark.parametrize("method", ["semi_implicit_euler", "rk4"])
def test_the_rounding_of_a_step_is_64_eps_of_the_solve_and_8_eps_of_the_sums(method):
    q, qd, angles, rates = turning(8, 0.1)
    found = step_rounding(METHODS[method], TURN, q, qd, np.array([3.0]), 0.1)
    # the stages of RK4 lie ahead of the state, where nothing of the disc's sums is larger
    assert found == pytest.approx(np.stack([angles, rates], axis=1), rel=1e-9)


def test_the_force_of_a_step_counts_every_term_by_its_absolute_value():
    """Elbow alone, damped: gravity of both links, the centripetal term, torque and damping."""
    scene = Scene("elbow", (0.0, 0.0, 30.0), "free", locked=("alpha", "beta"), damping=0.5)
    q, qd, tau, dt, M = 0.3, -4.0, 2.0, 0.01, 0.05275
    (h,) = tmt.bias(np.array([q]), np.array([qd]), scene.model)
    a = (tau - 0.5 * qd - h) / M
    S = 9.81 * (1.9 * 0.15 + 1.5 * 0.45) + 1.5 * 0.15**2 * abs(np.sin(2 * q)) * qd**2 + tau + 0.5 * 4.0
    rates = dt * (64 * EPS * M * abs(a) + 64 * EPS * S) / M + 8 * EPS * (4.0 + dt * abs(a))
    expected = [8 * EPS * (q + dt * 4.0) + dt * rates, rates]
    damped = dataclasses.replace(METHODS["semi_implicit_euler"])
    found = step_rounding(
        METHODS["explicit_euler"], scene.model, np.array([[q]]), np.array([[qd]]), np.array([tau]), dt
    )
    assert found[0] == pytest.approx(expected, rel=1e-9)
    implicit = step_rounding(damped, scene.model, np.array([[q]]), np.array([[qd]]), np.array([tau]), dt)
    assert 0.85 < implicit[0, 1] / rates < 1.0  # the same with Mbar + dt D in Mbar's place


@pytest.mark.parametrize("every", [1, 4, 64])
def test_the_band_is_the_sum_of_what_each_step_adds_carried_to_the_present(every):
    """J of the disc is ((1, dt), (0, 1)): an error of rate becomes m dt times as much of angle after m steps."""
    steps, dt = 128, 0.05
    q, qd, angles, rates = turning(steps, dt)
    found = band(METHODS["semi_implicit_euler"], TURN, q, qd, np.array([3.0]), dt, every)
    assert found.shape == (steps // every + 1, 2) and not found[0].any()
    for row, n in zip(found[1:], range(every, steps + 1, every)):
        k = np.arange(n)
        # an error of rate reaches the angle in its own step through the sum, in each later one through dt
        expected = [(angles[:n] + (n - 1 - k) * dt * rates[:n]).sum(), rates[:n].sum()]
        assert row == pytest.approx(expected, rel=1e-9 if every == 1 else 0.04)


@pytest.mark.parametrize("share, inside", [(0.999, True), (1.001, False)])
def test_errors_of_every_step_within_its_bound_stay_in_the_band_and_larger_ones_leave_it(share, inside):
    """Each step is off by a share of its bound, all to one side; a million times as large, so that nothing else is seen."""
    steps, dt, tau, large = 64, 0.05, np.array([3.0]), 1e6
    q, qd, *delta = turning(steps, dt)
    path = tmt.simulate(q[0], qd[0], tau, dt, steps, "semi_implicit_euler", TURN)[1:]
    width = band(METHODS["semi_implicit_euler"], TURN, *path, tau, dt)
    state = [q[0], qd[0]]
    for k in range(steps):
        state = [x[1] for x in tmt.simulate(*state, tau, dt, 1, "semi_implicit_euler", TURN)[1:]]
        state = [x + large * share * d[k] for x, d in zip(state, delta)]
        off = np.concatenate([x - p[k + 1] for x, p in zip(state, path)])
        assert (np.abs(off) <= large * width[k + 1]).all() == inside


def test_the_band_of_a_run_that_diverges_is_infinite_from_there():
    q, qd, *_ = turning(8, 0.1)
    q[5:] = np.nan
    width = band(METHODS["rk4"], TURN, q, qd, np.array([3.0]), 0.1)
    assert np.isfinite(width[:5]).all() and np.isinf(width[5:]).all()
    q[0] = np.nan
    assert np.isinf(band(METHODS["rk4"], TURN, q, qd, np.array([3.0]), 0.1)[1:]).all()


# what is judged, and the three levels


def test_a_run_is_judged_while_its_band_is_below_a_thousandth_of_a_radian_and_nothing_has_diverged():
    times, never = np.arange(5.0), {"TMT": None, "MuJoCo": None}
    narrow, wide = np.full(5, 0.999e-3), np.array([0.0, 0.999e-3, 1.001e-3, 0.0, 0.0])
    assert trajectory.judged(times, narrow, never) == 5
    assert trajectory.judged(times, wide, never) == 2
    assert trajectory.judged(times, narrow, {"TMT": None, "MuJoCo": 3.0}) == 3
    assert trajectory.judged(times, narrow, {"TMT": 2.5, "MuJoCo": 4.0}) == 3
    assert trajectory.judged(times, wide + 1.0, never) == 1


@pytest.fixture(scope="module")
def damped():
    """TMT's side of a scene that is judged to its end, and MuJoCo's model of it."""
    return trajectory.ours(DAMPED, 64, "rk4")


def judged_with(engine, mine, scene=DAMPED) -> dict:
    """The checks of a run whose TMT side may be edited, by quantity."""
    result = Result("trajectory")
    trajectory.pair(result, scene, scene.engine(engine), 64, "rk4", ["RK4"], mine)
    return {check.quantity: check for check in result.checks}


@pytest.mark.parametrize(
    "level, field", [("derivative", "derivative_bar"), ("one step", "step_bar"), ("open loop", "width")]
)
def test_each_level_uses_its_own_bound_and_no_other(level, field, engine, damped):
    name = f"{level}, TMT to MuJoCo"
    checks = judged_with(engine, damped)
    used = checks[name].over_bar
    assert all(check.passed for check in checks.values()) and 1e-5 < used < 1.0
    assert checks[name].tolerance in getattr(damped, field)
    for more, passes in ((1.01, True), (0.99, False)):
        tight = judged_with(engine, damped._replace(**{field: more * used * getattr(damped, field)}))
        assert {quantity for quantity, check in tight.items() if not check.passed} == (set() if passes else {name})


def test_a_row_is_the_component_and_the_time_that_come_closest_to_the_tolerance():
    bar, times = np.full((3, 4), 1.0), np.array([0.0, 0.5, 1.0])
    for off, passes in ((0.999, True), (1.001, False), (np.nan, False), (np.inf, False)):
        difference, result = np.zeros((3, 4)), Result("trajectory")
        difference[1, 3] = off
        trajectory.level(result, "x", {"level": "open loop"}, ("alpha", "beta"), difference, bar, times, {})
        (check,), (row,) = result.checks, result.rows
        assert (check.passed, check.unit, check.note) == (passes, "rad/s", "beta at t = 0.500 s")
        assert row["worst_difference"] == check.value and (row["largest_difference"] is None) == (check.value is None)
    difference = np.array([[0.2, 0.7, 3.0, 0.0], [0.1, 0.4, 0.0, 0.0], [0.0, 0.5, 0.0, 0.9]])
    result = Result("trajectory")
    trajectory.level(result, "x", {"level": "open loop"}, ("alpha", "beta"), difference, bar, times, {})
    assert (result.rows[0]["largest_difference"], result.rows[0]["worst_difference"]) == (0.7, 3.0)
    for off, passes in (
        (0.0, True),
        (1e-300, False),
        (np.nan, False),
    ):  # where rounding has nothing to add, nothing may differ
        result, difference = Result("trajectory"), np.array([[0.0, 0.0, off, 0.0]])
        trajectory.level(result, "x", {"level": "open loop"}, ("alpha", "beta"), difference, 0.0 * bar[:1], times, {})
        assert result.checks[0].passed is passes


@pytest.mark.parametrize("judged, passes", [(3.12, True), (3.13, False)])
def test_the_time_that_is_judged_is_at_least_what_the_scene_asks_for(judged, passes, engine):
    scene = dataclasses.replace(HELD, judged=judged)
    checks = judged_with(engine, trajectory.ours(scene, 64, "rk4"), scene)
    assert (checks["time judged"].value, checks["time judged"].passed) == (3.125, passes)


def test_what_a_scene_asks_for_depends_on_the_scheme_and_the_step():
    assert FREE.required("rk4", 5 / 64) == 5.0 and HELD.required("rk4", 5 / 64) == 2.5
    for twin in ("semi_implicit_euler", "implicit"):
        assert (FREE.required(twin, 0.0099), FREE.required(twin, 0.0101)) == (5.0, 0.3)
    assert dataclasses.replace(FREE, judged=0.2).required("implicit", 5 / 64) == 0.2


# the rules of a run


@pytest.mark.parametrize(
    "ours, theirs, width, found",
    [
        (None, None, 0.0, {}),
        (0.5, 0.5, 0.0, True),
        (0.5, 0.51, 0.0, False),
        (0.51, 0.5, 0.0, False),
        (None, 0.5, 0.0, False),
        (0.5, None, 0.0, False),
        (0.5, None, 0.999e-3, False),
        (0.5, None, 1.001e-3, {}),
    ],
)
def test_both_diverge_at_the_same_step_while_the_band_is_narrow(ours, theirs, width, found):
    result = Result("trajectory")
    trajectory.divergence(result, "x", {"TMT": ours, "MuJoCo": theirs}, 0.01, 100, np.full(11, width))
    assert verdicts(result) == ({} if found == {} else {"step of divergence, MuJoCo's, is TMT's": found})
    assert all(check.rule == "equal" for check in result.checks)


def test_a_free_run_moves_by_a_tenth_of_a_radian():
    for moved, passes in ((0.1001, True), (0.0999, False)):
        result = Result("trajectory")
        trajectory.movement(result, "x", moved)
        assert verdicts(result) == {"movement": passes}


def test_integrators_that_are_one_scheme_give_the_same_bits():
    one = [np.array([1.0, np.nan]), np.array([2.0, 3.0])]
    for other, passes in (
        (one, True), ([one[0].copy(), one[1] + 0.0], True), ([one[0], np.nextafter(one[1], 9.0)], False),
        ([one[0] + 1, one[1]], False),
    ):  # fmt: skip
        result = Result("trajectory")
        trajectory.same_bits(result, "x", "Euler", one, other)
        assert verdicts(result) == {"the same bits as Euler": passes}


def test_what_is_kept_of_a_run_is_whose_it_says(engine):
    moon = HELD.engine(engine.variant(gravity=(0.0, 0.0, -1.62)))
    mine, result = trajectory.ours(HELD, 64, "rk4"), Result("trajectory")
    trajectory.pair(result, HELD, moon, 64, "rk4", ["RK4"], mine)
    (kept,) = result.curves.values()
    theirs = moon.trajectory(*HELD.start, HELD.tau, 5 / 64, 64)
    assert all(np.array_equal(a, b) for a, b in zip(kept["tmt"], (mine.q, mine.qd)))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(kept["mujoco"], theirs[1:]))
    assert kept["left"] == {"TMT": None, "MuJoCo": 5 / 64} and kept["ended"]["TMT"] is None
    assert kept["ended"]["MuJoCo"] == motion.diverged_at(HELD, *theirs)
    assert {row["diverged_at_s"] for row in result.rows} == {kept["ended"]["MuJoCo"]}


def test_an_engine_that_rests_or_does_not_drift_is_named(engine):
    """Without gravity MuJoCo's arm stays where it is let go, and TMT's falls."""
    rests = engine.variant(gravity=0.0)
    checks = judged_with(rests, trajectory.ours(DAMPED, 64, "rk4"))
    assert (checks["movement"].value, checks["movement"].passed) == (0.0, False)
    result = Result("trajectory")
    drift.drift(result, rests, {"Euler": (32, 64), "RK4": (32, 64)})
    for integrator in ("Euler", "RK4"):
        of = result.curves["drift"]["drifts"]["bent, free", "energy", "J"][integrator]
        assert of["MuJoCo"] == [0.0, 0.0] and min(of["TMT"]) > 0.0


def test_each_engine_is_compared_with_many_digits(engine):
    path = tmt.simulate(*FREE.start, FREE.tau, 5 / 64, 64, "rk4", FREE.model)[1]
    curve = run_of(FREE) | {"tmt": [path, path]}
    result = Result("trajectory", curves={"runs": {("bent, free", "rk4", 64): curve}})
    horizon.many_digits(result, engine.variant(gravity=0.0), [FREE], [{"RK4": path.astype(object)}])
    assert [(check.quantity[:6], check.passed) for check in result.checks] == [("TMT to", True), ("MuJoCo", False)]
    assert "TMT is at most 0.0e+00 rad off, MuJoCo" in result.notes[0] and "to 5.00 s" in result.notes[0]


def test_every_rule_of_a_run_is_applied(engine):
    """The names of the checks that each kind of scene gets, with every integrator."""
    found = {}
    for scene in (BY_NAME["ball catch, free"], HELD):
        for check in trajectory.follow(scene, engine, (64,)).checks:
            assert check.passed, str(check)
            found.setdefault(check.scene, set()).add(check.quantity)
    levels = {f"{level}, TMT to MuJoCo" for level in ("derivative", "one step", "open loop")} | {"time judged"}
    diverges, bits = {"step of divergence, MuJoCo's, is TMT's"}, {"the same bits as Euler"}
    of = "ball catch, free, {}, dt = 5/64 s"
    assert found[of.format("RK4")] == levels | {"movement"}
    assert found[of.format("Euler")] == found[of.format("implicit")] == levels | {"movement"} | diverges
    assert found[of.format("implicitfast")] == levels | {"movement"} | diverges | bits
    assert found["ball catch, held, RK4, dt = 5/64 s"] == levels
    assert found["ball catch, held, implicitfast, dt = 5/64 s"] == levels | bits


def kicked(scene, share, q=None) -> list:
    """A run of two states whose second has gained this share of the energy that the scene's arm can have."""
    start, rate = scene.start
    q = start if q is None else q
    M = tmt.mass_matrix(start, scene.model)
    allowed = 2.0 * 9.81 * (1.9 * 0.15 + 1.5 * 0.45) + rate @ M @ rate / 2
    gained = tmt.potential_energy(q, scene.model) - tmt.potential_energy(start, scene.model) - (q - start) @ scene.tau
    kinetic = share * allowed + rate @ M @ rate / 2 - gained
    new = np.array([np.sqrt(2.0 * kinetic / tmt.mass_matrix(q, scene.model)[0, 0]), 0.0, 0.0])
    return [np.array([start, q]), np.array([rate, new])]


@pytest.mark.parametrize("scene", [FREE, HELD, BY_NAME["thrown, no gravity"]], ids=lambda scene: scene.name)
def test_a_run_has_diverged_beyond_the_energy_that_the_arm_can_have(scene):
    t = np.array([0.0, 0.5])
    for q in (None, scene.start[0] + [0.1, -0.2, 0.3]):
        assert motion.diverged_at(scene, t, *kicked(scene, 0.999, q)) is None
        assert motion.diverged_at(scene, t, *kicked(scene, 1.001, q)) == 0.5


def test_a_run_has_diverged_where_it_is_not_finite():
    q, qd = np.zeros((3, 3)), np.zeros((3, 3))
    for values in (q, qd):
        for wrong in (np.nan, np.inf):
            values[2, 1] = wrong
            assert motion.diverged_at(FREE, np.arange(3.0), q, qd) == 2.0
            assert motion.worst(q) is None or values is qd
            values[2, 1] = 0.0


def test_an_arm_has_left_at_a_tenth_of_a_radian():
    t, path = np.arange(3.0), np.ones((3, 2))
    for off, left in ((0.0999, None), (0.1001, 1.0), (-0.1001, 1.0)):
        path[1, 1] = 1.0 + off
        assert motion.departure(t, path) == left
    assert motion.farthest(np.array([0.1, -0.3, np.nan])) == 0.3 == motion.worst(np.array([0.1, -0.3]))


# drift, derivative, many digits


def drifts(order=1.0, euler=1.0, share=1e-4, engine="TMT") -> dict:
    """Drifts of one scene; MuJoCo's or TMT's falls at another order, or RK4's is another share of Euler's."""
    good = {"Euler": [4.0, 2.0, 1.0], "RK4": [256e-5, 16e-5, 1e-5]}
    made = {integrator: {name: list(values) for name in ("TMT", "MuJoCo")} for integrator, values in good.items()}
    made["Euler"][engine] = [4.0, 2.0**order * euler, euler]
    made["RK4"][engine] = [256 * share, 16 * share, share]
    return {("bent, free", "energy", "J"): made}


@pytest.mark.parametrize("engine", ["TMT", "MuJoCo"])
def test_drift_falls_at_the_order_of_the_scheme_and_rk4s_is_far_below_that_of_euler(engine):
    order = f"order of the drift of energy, from 1 bent, free, Euler, {engine}, 1 s"
    share = f"drift of energy over that of Euler bent, free, RK4, {engine}, 1 s"
    for made, failed in (
        ({}, set()), ({"order": 1.149}, set()), ({"order": 1.151}, {order}), ({"order": 0.849}, {order}),
        ({"order": 0.851}, set()),
        ({"share": 0.999e-3}, set()), ({"share": 1.001e-3}, {share}),
        ({"euler": np.nan}, {order, share}), ({"euler": 0.0}, {order, share}),
    ):  # fmt: skip
        result = Result("trajectory")
        drift.judge(result, drifts(engine=engine, **made))
        assert len(result.checks) == 6
        assert {f"{check.quantity} {check.scene}" for check in result.checks if not check.passed} == failed


def test_the_derivative_of_the_bias_is_judged_by_the_rates_of_each_state():
    q, qd = np.zeros((2, 3)), np.array([[1.0, -2.0, 3.0], [0.1, 0.0, 0.0]])
    largest = tmt.mass_matrix(q[0]).max()
    for k, size in ((0, largest * 6.0 + 0.5), (1, largest * 0.1 + 0.5)):
        for share, passes in ((0.999, True), (1.001, False), (np.nan, False)):
            theirs, result = np.zeros((2, 3, 3)), Result("trajectory")
            theirs[k, 2, 1] = share * 64 * EPS * size
            motion.judge_derivative(result, q, qd, np.zeros((2, 3, 3)), theirs, 0.5)
            assert result.checks[0].passed is passes


@pytest.mark.parametrize("engine", ["TMT", "MuJoCo"])
def test_a_run_stays_in_the_band_about_many_digits(engine):
    width = np.array([0.0, 1e-12, 2e-12])
    for share, passes in ((0.999, True), (1.001, False), (np.nan, False)):
        off, result = {name: np.zeros(3) for name in ("TMT", "MuJoCo")}, Result("trajectory")
        off[engine][2] = share * 2e-12
        horizon.judge_digits(result, "x", off, width, 0.5)
        passed = {"TMT": True, "MuJoCo": True} | {engine: passes}
        assert verdicts(result) == {f"{name} to many digits of its own scheme": ok for name, ok in passed.items()}
    first, second = ("2.0e-12", "0.0e+00") if engine == "TMT" else ("0.0e+00", "2.0e-12")
    horizon.judge_digits(result, "x", {name: np.full(3, 2e-12 * (name == engine)) for name in off}, width, 0.5)
    assert f"TMT is at most {first} rad off, MuJoCo {second} rad" in result.notes[-1]


# what is said


def test_a_horizon_is_where_a_difference_of_the_last_digit_has_grown_to_a_radian():
    t = np.linspace(0.0, 60.0, 61)
    assert horizon.reach(t, 0.3 * t, 16) == 54.0 and horizon.reach(t, 0.26 * t, 16) is None
    growth, horizons = horizon.growth_told(t, {"calm": 0.1 * t, "wild": 0.4 * t})
    assert "calm: 10^0.5 and 10^6.0; wild: 10^2.0 and 10^24.0" in growth and "over 5 s and 60 s" in growth
    assert horizons.endswith("on the step: wild: about 41 s for doubles (16 digits) and more than 60 s for 30 digits.")
    assert horizon.growth_told(t, {"calm": 0.1 * t})[1].startswith("No scene has a horizon within 60 s")


def test_the_linear_map_says_when_a_torque_that_is_off_makes_the_arm_leave():
    for size in (1e-3, 1e-9):
        push = size * np.array([1.0, 0.5, -1.0])
        tau = HELD.tau + tmt.mass_matrix(HELD.start[0]) @ push
        t, q, _ = tmt.simulate(*HELD.start, tau, 5 / 64, 64, "rk4")
        assert leaving.predicted(HELD, push) == pytest.approx(motion.departure(t, q), abs=5 / 64)
    assert leaving.predicted(BY_NAME["bent, held"], 1e-9 * np.ones(3)) is None


def test_rounding_is_the_cause_only_of_what_rounding_can_do():
    may = leaving.allowed(HELD)
    assert 1e-13 < may < 1e-11
    for size, at, left, said in (
        (0.999 * may, 4.69, 4.69, ": the cause is rounding of the torque"),
        (1.001 * may, 4.69, 4.69, ": that is no rounding"),
        (0.5 * may, 4.69 + 2.4 * 5 / 64, 4.69, ": the cause is rounding of the torque"),
        (0.5 * may, 4.69 - 2.6 * 5 / 64, 4.69, ": rounding of the torque alone does not explain it"),
        (0.5 * may, None, 4.69, ": rounding of the torque alone does not explain it"),
        (9.0 * may, 0.1, None, ""),
    ):
        assert leaving.cause(HELD, size, may, at, left) == said


def test_what_is_said_of_a_held_arm_follows_its_numbers(engine):
    moon = engine.variant(gravity=(0.0, 0.0, -1.62))
    earth, other = (leaving.told(HELD, HELD.engine(e), {"TMT": None, "MuJoCo": 4.69}) for e in (engine, moon))
    assert earth[0] == "The linear map of RK4 lets small deviations grow by up to e^7.5 per second."
    assert earth[1].startswith("TMT: ") and earth[1].endswith("it stays within 0.1 rad.")
    assert earth[2].endswith("it is 0.1 rad away at 4.69 s: the cause is rounding of the torque.")
    assert other[1] == earth[1] and other[2].endswith(": that is no rounding.") and "3.8e+01 rad/s2" in other[2]
    bent = BY_NAME["bent, held"]
    assert leaving.told(bent, bent.engine(engine), {"TMT": None, "MuJoCo": None})[0].endswith(
        "lets no small deviation grow."
    )


def run_of(scene, ours=0.0, theirs=0.0, until=5.0, ended=(None, None), left=(None, None)) -> dict:
    """The curves of a run of 64 steps whose angles end so far from where they started."""
    t = np.linspace(0.0, 5.0, 65)
    ramp = np.linspace(0.0, 1.0, 65)[:, None] * np.ones(len(scene.hinges))
    start = scene.start[0]
    return {
        "integrator": "RK4", "t": t, "every": 1, "tmt": [start + ours * ramp, 10.0 + ours * ramp],
        "mujoco": [start + theirs * ramp, 20.0 + theirs * ramp], "band": np.full(65, 1e-9), "ulp": start + 0.0 * ramp,
        "judged_until_s": until, "ended": dict(zip(("TMT", "MuJoCo"), ended)), "left": dict(zip(("TMT", "MuJoCo"), left)),
    }  # fmt: skip


def test_what_is_said_of_a_claim_follows_the_run(engine):
    said = told.claim(HELD, engine, run_of(HELD, 0.25, 0.5, left=(3.0, None)))
    assert "in 5 s TMT's arm is 0.1 rad away at 3.00 s, MuJoCo's stays within 0.1 rad" in said
    assert "the farthest is TMT's 2.5e-01 rad and MuJoCo's 5.0e-01 rad" in said


def test_the_error_of_a_held_scene_is_its_distance_from_the_start():
    result = Result("trajectory", curves={"runs": {
        ("ball catch, held", "rk4", 64): run_of(HELD, 0.25, np.nan), ("ball catch, held", "rk4", 128): run_of(HELD, 9.0, 9.0),
        ("ball catch, held", "implicit", 64): run_of(HELD, 9.0, 9.0), ("bent, free", "rk4", 64): run_of(FREE, 9.0, 9.0),
    }})  # fmt: skip
    assert motion.held_errors(result) == {"ball catch, held": (0.25, None)}


def test_the_error_of_a_free_scene_is_its_distance_from_many_digits(engine):
    runs = {}
    for name in ("zero, free", "ball catch, free", "bent, free"):
        scene = BY_NAME[name]
        path = tmt.simulate(*scene.start, scene.tau, 5 / 64, 64, "rk4", scene.model)[1]
        runs[name, "rk4", 64] = run_of(scene) | {"tmt": [path, path], "mujoco": [path + 100.0, path]}
    errors = motion.free_errors(Result("trajectory", curves={"runs": runs}))
    found = {name: ours for name, (ours, _) in errors.items()}
    assert found == pytest.approx({"zero, free": 1.6, "ball catch, free": 10.2, "bent, free": 0.27}, rel=0.03)
    assert all(theirs > 90.0 for _, theirs in errors.values())


def test_what_is_said_of_errors_and_agreement_follows_the_numbers():
    runs = {("ball catch, held", "rk4", 64): run_of(HELD, 0.25, 0.26, until=2.5)}
    for ours, far in ((0.49, False), (0.51, True)):
        first, second = told.errors(runs, {"ball catch, held": (ours, 0.1)}, BY_NAME)
        assert (
            f"ball catch, held (true: rest): TMT {ours:.1e} rad, MuJoCo 1.0e-01 rad, apart 5.0e-03 rad in the 2.50 s"
            in first
        )
        assert ("these scenes: ball catch, held." in second) == far and ("In none of these scenes" in second) == (
            not far
        )
    first, second = told.errors(runs, {"ball catch, held": (0.1, None)}, BY_NAME)
    assert "MuJoCo no number (it diverged)" in first and "In none" in second and told.errors(runs, {}, BY_NAME) == []


def test_what_is_said_of_order_1_follows_the_numbers():
    euler, implicit = (
        (name, twin, 64) for name, twin in (("bent, free", "semi_implicit_euler"), ("bent, free", "implicit"))
    )
    runs = {euler: run_of(FREE) | {"integrator": "Euler"}, implicit: run_of(FREE, until=0.3125, ended=(0.5, None))}
    (said,) = told.first_order(runs, BY_NAME)
    assert (
        "is 0.31 s (bent, free, RK4). bent, free, RK4: judged for 0.31 s, diverges: TMT at 0.50 s, MuJoCo never."
        in said
    )
    (said,) = told.first_order({euler: runs[euler]}, BY_NAME)
    assert "judged all along" in said and told.first_order({}, BY_NAME) == []
    (said,) = told.first_order({implicit: run_of(FREE, until=3.0)}, BY_NAME)
    assert "judged for 3.00 s, nothing diverges" in said


# figures: whose number stands where


def drawn(result, call, *arguments):
    from compare import draw_motion

    return getattr(draw_motion, call)(result, *arguments)


def test_lines_are_tmt_and_marks_are_mujoco_in_every_figure_of_a_run():
    curve = run_of(HELD, 0.1, 0.2, until=2.5, left=(None, 4.0))
    curves = {"runs": {("ball catch, held", twin, 64): curve for twin in ("rk4", "implicit", "semi_implicit_euler")}}
    result = Result("trajectory", curves=curves | {"errors": {"ball catch, held": (0.1, 0.2)}})
    name, fig, caption = drawn(result, "held", "ball catch, held", "assignment_figure_2")
    (ax,) = fig.axes
    lines = [line for line in ax.lines if len(line.get_xdata())]
    for i in range(3):
        assert (
            np.allclose(lines[2 * i].get_ydata(), np.degrees(curve["tmt"][0][:, i]))
            and lines[2 * i].get_marker() == "None"
        )
        assert np.allclose(lines[2 * i + 1].get_ydata(), np.degrees(curve["mujoco"][0][:, i]))
        assert lines[2 * i + 1].get_marker() == "o" and lines[2 * i].get_label().endswith("TMT")
    assert name == "assignment_figure_2"
    assert "the arm of TMT stays within 0.1 rad, that of MuJoCo is 0.1 rad away at 4.00 s" in caption
    assert "of that TMT is at most 1.0e-01 rad off, MuJoCo 2.0e-01 rad" in caption
    assert "while judged, to 2.50 s, they are 5.0e-02 rad apart" in caption

    about = {"scene": "ball catch, held", "level": "open loop", "engine_integrator": "RK4", "dt_s": 5 / 64}
    ends = ((None, 0.25), (0.0, None), (None, 0.125))
    result.rows = [about | {"diverged_at_s": at, "difference_over_band": used} for at, used in ends]
    name, fig, caption = drawn(result, "run", HELD)
    assert name == "trajectory_ball_catch_held" and "difference is at most 2.5e-01 of the band" in caption
    assert "With 64 steps of RK4 TMT is 1.0e-01 rad and MuJoCo 2.0e-01 rad from the true motion." in caption
    assert "MuJoCo's run diverged: RK4 at dt = 0.0781 s." in caption and "RK4 to 2.50 s" in caption
    angle, rate, difference = fig.axes[0], fig.axes[3], fig.axes[6]
    for ax, k in ((angle, 0), (rate, 1)):
        assert np.array_equal(ax.lines[0].get_ydata(), curve["tmt"][k][:, 0])
        assert np.array_equal(ax.lines[1].get_ydata(), curve["mujoco"][k][:, 0]) and ax.lines[1].get_marker() == "o"
    ours, apart, width = difference.lines
    assert ours.get_label() == "TMT, start 1 ulp away" and ours.get_ydata()[-1] == pytest.approx(0.1)
    assert apart.get_label() == "TMT to MuJoCo" and apart.get_ydata()[-1] == pytest.approx(0.1)
    assert set(width.get_ydata()) == {1e-9}


def test_the_figure_of_drift_says_whose_drift_falls_how():
    made = drifts()
    of = made["bent, free", "energy", "J"]
    of["implicit"] = {"TMT": [8.0, 4.0, 2.0], "MuJoCo": [16.0, 4.0, 1.0]}
    result = Result("trajectory", curves={"drift": {"drifts": made, "steps": drift.STEPS}})
    name, fig, caption = drawn(result, "drift")
    assert name == "trajectory_drift" and "implicit: TMT 1.00 to 1.00, MuJoCo 2.00 to 2.00" in caption
    assert "implicit at dt = 1/8192 s: TMT 2.0e+00 J, MuJoCo 1.0e+00 J" in caption
    assert "MuJoCo's drift over TMT's: 0.1 to 2." in caption
    lines = {line.get_label(): line for line in fig.axes[0].lines}
    assert lines["implicit, TMT"].get_ydata().tolist() == [8.0, 4.0, 2.0]
    assert [line.get_ydata().tolist() for line in fig.axes[0].lines if line.get_marker() == "o"][2] == [16.0, 4.0, 1.0]
    for engine in ("TMT", "MuJoCo"):  # nothing moves: no order, no ratio, and no error
        for values in of.values():
            values[engine] = [0.0, 0.0, 0.0]
    assert "TMT no number, MuJoCo no number" in drawn(made, "drift_caption", drift.STEPS)


def test_the_figure_of_growth_says_which_scene_grows_how_much():
    t = np.linspace(0.0, 60.0, 61)
    result = Result("trajectory", curves={"growth": {"t": t, "curves": {"calm": 0.1 * t, "wild": 0.4 * t}}})
    name, fig, caption = drawn(result, "growth")
    assert (
        name == "trajectory_growth" and "in 5 s and in 60 s: wild: 10^2.0 and 10^24; calm: 10^0.5 and 10^6." in caption
    )
    assert fig.axes[0].lines[0].get_ydata()[-1] == pytest.approx(6.0)


def test_growth_at_rest_on_a_saddle_is_that_of_the_powers_of_its_step():
    """Upright, held: every step has the same Jacobian, so a small difference grows as the norm of its powers."""
    q, steps, dt = np.radians([180.0, 0.0, 90.0]), 64, 0.01
    path = np.tile(q, (steps + 1, 1))
    tau = tmt.gravity_balance(q)
    (J,) = amplification(METHODS["rk4"], tmt.ARM, q[None], np.zeros((1, 3)), tau, dt)
    grown = band_of_rounding.growth(METHODS["rk4"], tmt.ARM, path, 0.0 * path, tau, dt, every=16)
    expected = [np.log10(np.linalg.norm(np.linalg.matrix_power(J, k), 2)) for k in range(0, steps + 1, 16)]
    assert grown == pytest.approx(expected, abs=1e-6) and grown[-1] > 2.0


def test_many_digits_are_many():
    """The same two steps with 80 digits; 50 are those of the run."""
    scene = next(scene for scene in SCENES if scene.name == "bent, free")
    found = horizon.exact_run(scene, "rk4", 2, scene.dt)[-1]
    with mpmath.workdps(80):
        q, qd, tau = ([mpmath.mpf(float(v)) for v in values] for values in (*scene.start, scene.tau))
        for _ in range(2):
            q, qd = one_step(METHODS["rk4"], scene.model, q, qd, tau, mpmath.mpf(scene.dt))
        assert max(abs(a - b) for a, b in zip(found, q)) < mpmath.mpf(10) ** -46


class Different(Engine):
    """An engine of which one integrator gives other bits, and whose smaller model has damping."""

    def trajectory(self, *arguments):
        t, q, qd = super().trajectory(*arguments)
        return t, q + 1e-15 * (arguments[-1] == "implicitfast"), qd

    def variant(self, *changes, **named):
        other = super().variant(*changes, **named)
        other.__class__ = Different
        return other

    def lock(self, angles):
        return super().lock(angles).variant(damping=0.1) if angles else self


@pytest.fixture
def different():
    engine = load()
    engine.__class__ = Different
    return engine


def test_an_integrator_of_other_bits_is_seen(different):
    scene = next(scene for scene in SCENES if scene.name == "bent, free")
    checks = trajectory.follow(scene, different, (64,)).checks
    failed = [check.scene for check in checks if "same bits" in check.quantity and not check.passed]
    assert failed == ["bent, free, implicitfast, dt = 5/64 s"]


def test_a_smaller_model_of_one_engine_that_is_wrong_is_seen(different):
    failed = [c for c in reduction.rows(Setup.small(different), timed=False).checks if not c.passed]
    where = {check.scene for check in failed if check.quantity == "smallest model to whole"}
    assert "zero, free, MuJoCo, RK4, dt = 5/1024 s" in where and not any("TMT" in scene for scene in where)


def test_a_run_is_no_number_from_the_step_at_which_its_clock_stands():
    engine = load()
    states = np.ones((1, 4, 7))
    states[0, :, 0] = [0.1, 0.2, 0.2, 0.3]
    start = np.zeros((1, 7))
    q = engine.path(start, states.copy(), 0.1)[1]
    assert np.isfinite(q[0]).all(axis=1).tolist() == [True, True, True, False, False]
    states[0, 1, 5] = np.inf
    assert np.isfinite(engine.path(start, states, 0.1)[2][0]).all(axis=1).tolist() == [True, True, False, False, False]
