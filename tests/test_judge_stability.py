"""The judge of stability on rows just inside and just outside of each of its rules; no runs."""

import numpy as np
import pytest

import tmt
from compare import (
    beyond,
    claims,
    departure,
    draw_departure,
    draw_failure,
    draw_stability,
    failure,
    limits,
    long_runs,
    motion,
    stability,
)
from compare.agreement import Result, gravity_scale
from compare.linear import held
from compare.parties import Party
from compare.scenes import posture

EPS = 2.0**-52
INSIDE, OUTSIDE = 0.999, 1.001  # of a tolerance
BOTH = pytest.mark.parametrize("share, passes", [(INSIDE, True), (OUTSIDE, False)])


@pytest.fixture
def result():
    return Result("stability")


def only(result) -> bool:
    """Whether the one check of a result passes."""
    (check,) = result.checks
    return check.passed


# amplification


@BOTH
def test_amplification_within_the_rounding_of_a_difference_quotient(result, share, passes):
    ours, q = np.diag([3.0, -7.0]), np.array([1.0, -2.0])
    stability.amplification(result, "", q, ours, ours + [[0.0, share * 64 * EPS * 3.0 * 7.0 / 1e-6], [0.0, 0.0]])
    assert only(result) is passes


def test_an_amplification_that_is_no_number_fails(result):
    stability.amplification(result, "", np.ones(1), np.eye(2), np.full((2, 2), np.nan))
    assert not only(result)


# step limits


def limit_row(predicted=0.1, observed=0.1, kind="finite", seen="finite", **more):
    return {
        "scene": "bent", "engine": "TMT", "method": "rk4", "damping": 0.0, "mode_per_s": 9.1, "predicted_dt_s": predicted,
        "observed_dt_s": observed, "limit": kind, "criterion": "", "seen": seen, **more,
    }  # fmt: skip


@BOTH
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_observed_limit_within_a_thousandth(result, share, passes, sign, damping):
    limits.judge(
        result, [{"rows": [limit_row(observed=0.1 * (1 + sign * share * 1e-3), damping=damping)], "growths": []}]
    )
    assert only(result) is passes


@pytest.mark.parametrize("kind", ["never_fails", "always_fails"])
@pytest.mark.parametrize("seen", ["never_fails", "always_fails", "finite"])
def test_kind_of_limit_is_as_predicted(result, kind, seen):
    limits.judge(result, [{"rows": [limit_row(None, None, kind, seen)], "growths": []}])
    assert only(result) is (kind == seen)


def test_a_limit_that_no_run_shows_fails_and_is_told(result):
    limits.judge(result, [{"rows": [limit_row(observed=None, seen="never_fails")], "growths": []}])
    assert not only(result) and "In 1 cases the runs show no finite limit" in result.notes[0]


def test_the_largest_difference_of_a_limit_is_told():
    (told,) = limits.tell_limits([limit_row(observed=observed) for observed in (0.1, 0.1005, 0.0998)])
    assert "largest difference: 0.500 % undamped" in told and told.startswith("3 finite limits")


@BOTH
def test_growth_in_all_steps_within_a_thousandth(result, share, passes):
    row = {"scene": "upright", "engine": "MuJoCo", "method": "Euler", "dt_s": 0.01, "predicted_growth": 1.1,
           "observed_growth": 1.1, "steps": 70, "total_off": share * 1e-3}  # fmt: skip
    limits.judge(result, [{"rows": [], "growths": [row]}])
    assert only(result) is passes and "total_off" not in row


@pytest.mark.parametrize(
    "early, late, grown",
    [
        (1.0, 1.0009, False),
        (1.0, 1.0011, True),
        (1e-4, 0.9e-3, False),  # decayed: what is left is rounding
        (1e-4, 1.1e-3, True),
        (200.0, 99.0, False),
        (200.0, 101.0, True),  # it has grown before, and no longer grows
        (np.nan, np.nan, True),
    ],
)
def test_when_a_deviation_grows(early, late, grown):
    assert limits.grows(np.array([0.5, early]), np.array([0.4, late])) is grown


# departures


def fall(observed, predicted, dt=0.01, size=1e-6, engine="TMT", scene="ball catch"):
    return {"scene": scene, "engine": engine, "method": "rk4", "dt_s": dt, "perturbation_rad": size,
            "predicted_s": predicted, "observed_s": observed}  # fmt: skip


@BOTH
@pytest.mark.parametrize("dt, aim", [(1e-3, 0.03), (0.01, 0.03), (5 / 64, 5 / 64)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_departure_within_one_step_or_three_hundredths(result, share, passes, dt, aim, sign):
    departure.judge(result, [fall(2.0 + sign * share * aim, 2.0, dt)], [])
    assert only(result) is passes and f"{int(passes)} of these within" in result.notes[0]


@pytest.mark.parametrize("observed, predicted, passes", [(None, None, True), (1.0, None, False), (None, 1.0, False)])
def test_where_the_map_stays_the_run_stays(result, observed, predicted, passes):
    departure.judge(result, [fall(observed, predicted)], [])
    assert only(result) is passes


def test_no_tolerance_of_a_departure_is_infinite(result):
    departure.judge(result, [fall(50.0, 1.0)], [])
    assert not only(result) and result.checks[0].tolerance < 0.031


@BOTH
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_exponent_of_the_time_to_leave_zero(result, share, passes, sign):
    power = -0.5 + sign * share * 0.02
    falls = [fall(10.0 * (size / 1e-4) ** power, 10.0, size=size, scene="zero") for size in (1e-2, 1e-4, 1e-5)]
    departure.judge(result, [], falls)
    by_side = {check.scene: check.passed for check in result.checks}
    assert by_side == {"zero, TMT, along the fall": passes, "zero, TMT, against it": False}  # that side has no runs


def test_left_is_a_tenth_of_a_radian():
    paths = [np.array([[0.0], [size], [0.0]]) for size in (0.0999, -0.1001)]
    assert [motion.departure(np.arange(3.0), path) for path in paths] == [None, 1.0]


def test_the_linear_map_says_when_a_tenth_of_a_radian_is_reached():
    at, size = held("ball catch", posture("ball catch")), 1e-4
    values, vectors = at.modes
    shape = size * vectors[:3, 0].real / np.abs(vectors[:3, 0]).max()
    (found,) = departure.predicted(at, "rk4", 1e-3, shape[None], np.zeros((1, 3)))
    assert found == pytest.approx(np.arccosh(0.1 / size + 1.0) / values[0].real, abs=2e-3)  # cosh - 1, from rest


# the published claims


def torque_rows(times=(4.7, 4.7), ulps=2.0, moved=0.0, sides=(1, 1), clear=(1, 1)):
    """Rows of claims.holding_torques, for TMT and for MuJoCo."""
    rows = []
    for party, time, side, away in zip(claims.PAIR, times, sides, clear):
        for name in claims.NAMES:
            pushed = away if "ulps" in name else 1
            rows.append({
                "scene": "ball catch", "engine": party.engine, "method": party.method, "dt_s": claims.DT, "torque": name,
                "push_rad_per_s2": 1e-14 * pushed, "predicted_s": time, "observed_s": time, "direction": side,
                "largest_residual_n_m": 1e-15, "moved_rad": moved if "own" in name else 1.0, "residual_ulps": ulps,
            })  # fmt: skip
    return rows


@pytest.mark.parametrize(
    "changed, reproduced, passes",
    [
        ({}, True, True),
        ({"times": (5.49, 3.51)}, True, True),
        ({"times": (5.51, 4.7)}, False, True),
        ({"times": (4.7, 3.49)}, False, True),
        ({"ulps": 15.9}, True, True),
        ({"ulps": 16.1}, False, True),
        ({"moved": 1e-17}, False, False),
        ({"clear": (1, -1)}, False, False),  # against its push
        ({"sides": (1, None)}, False, False),
    ],
)
def test_claim_1(result, changed, reproduced, passes):
    claims.judge_torques(result, torque_rows(**changed))
    assert result.notes[-1].startswith(f"Claim 1, {'reproduced' if reproduced else 'not reproduced'}:")
    assert all(check.passed for check in result.checks) is passes


@pytest.mark.parametrize("leaving, word", [(14, "reproduced"), (13, "not reproduced")])
def test_claim_1_asks_for_more_than_half(result, leaving, word):
    rows = torque_rows()
    for row in rows[leaving:27]:
        row["observed_s"] = row["direction"] = None
    claims.judge_torques(result, rows)
    assert f"Claim 1, {word}:" in result.notes[-1] and f"TMT: {leaving} leave" in result.notes[-1]


def test_a_claim_looks_at_its_own_checks_only(result):
    result.check("elsewhere", "something else", 2.0, 1.0, "")
    claims.judge_torques(result, torque_rows())
    assert result.notes[-1].startswith("Claim 1, reproduced")


def test_what_each_engine_does_is_told_of_that_engine(result):
    rows = torque_rows(times=(4.11, 5.22), sides=(1, -1), clear=(1, -1))
    claims.judge_torques(result, rows)
    tmt_part, mujoco_part = result.notes[-1].split("MuJoCo: ")
    assert "TMT: 27 leave, after 4.11 s" in tmt_part and "27 to larger alpha and 0 to smaller" in tmt_part
    assert mujoco_part.startswith("27 leave, after 5.22 s") and "0 to larger alpha and 27 to smaller" in mujoco_part
    result.tables["stability_torques"] = rows
    caption = draw_departure.torques(result)[2]
    assert "TMT after 4.11 s, 27 to larger α, 0 to smaller" in caption
    assert "MuJoCo after 5.22 s, 0 to larger α, 27 to smaller" in caption


def finer_rows(moved=0.0, directions=(1, -1), times=(5.0, 6.0)):
    return [
        {"scene": "ball catch", "engine": party.engine, "method": party.method, "dt_s": 5 / count, "ulps_alpha": sign,
         "push_rad_per_s2": 1e-15, "predicted_s": 4.9, "observed_s": time, "direction": side, "moved_rad": away,
         "step_rad": 1e-17, "half_ulp_rad": 5e-17}
        for party in claims.PAIR for sign in (1, -1)
        for count, time, side, away in ((64, times[0], directions[0], 1.0), (128, times[1], directions[1], 1.0),
                                        (4096, None, None, moved))
    ]  # fmt: skip


@pytest.mark.parametrize(
    "changed, word, passes",
    [
        ({}, "reproduced", True),
        ({"directions": (1, 1)}, "reproduced in part", True),
        ({"moved": 1e-17}, "reproduced in part", False),
        ({"moved": 1e-17, "directions": (1, 1)}, "not reproduced", False),
        ({"directions": (None, None), "times": (None, None)}, "not reproduced", True),
    ],
)
def test_claim_2(result, changed, word, passes):
    claims.judge_finer(result, finer_rows(**changed))
    assert result.notes[-1].startswith(f"Claim 2, {word}:")
    assert [check.passed for check in result.checks] == 4 * [passes]
    draw_departure.finer(result)


def test_the_printed_torque_is_judged_as_every_departure(result):
    printed = [fall(1.4, 1.4 - 0.029), fall(1.4, 1.4 - 0.031, engine="MuJoCo"), fall(None, None)]
    claims.judge(result, torque_rows(), [], printed)
    assert [check.passed for check in result.checks[-3:]] == [True, False, True]
    assert "after 1.40 s" in result.notes[-1] and "runs in which it stays: 1" in result.notes[-1]


def bent_runs(observed=None, largest=0.06, leaves=(), acceleration=50.0, rest=0.0):
    rows = [
        {"scene": "bent", "engine": party.engine, "method": party.method, "dt_s": dt, "torque": torque, "growth": 1.0,
         "observed_s": observed if dt < 0.31 else None, "steps": None, "diverged_at_s": None, "largest_rad": away,
         "run_s": 1000.0}
        for party in claims.PAIR for torque in beyond.TORQUES for dt, away in ((0.3, 1e-9), (0.35, largest))
    ]  # fmt: skip
    engines = [party.engine for party in claims.PAIR]
    return {
        "rows": rows, "limit": 0.3108, "fastest": 9.1, "counts": [1, 2, 3], "paths": {},
        "leaves_within_5_s": {(engine, torque): list(leaves) for engine in engines for torque in beyond.TORQUES},
        "acceleration_at_hanging": {engine: np.array([0.0, -acceleration, 0.0]) for engine in engines},
        "free_from_hanging": dict.fromkeys(engines, rest),
    }  # fmt: skip


@pytest.mark.parametrize(
    "changed, word, failing",
    [
        ({}, "bounded", 0),
        ({"observed": 999.0}, "not reproduced", 4),
        ({"leaves": (2,)}, "not reproduced", 2),
        ({"largest": 1.01e-3}, "bounded", 0),
        ({"largest": 0.99e-3}, "not reproduced", 0),
        ({"acceleration": 1.01}, "bounded", 0),
        ({"acceleration": 0.99}, "reproduced", 2),
        ({"rest": 0.99e-9}, "bounded", 0),
        ({"rest": 1.01e-9}, "bounded", 2),
    ],
)
def test_claim_3(result, changed, word, failing):
    beyond.judge(result, bent_runs(**changed))
    assert result.notes[0].startswith(f"Claim 3, {word}:")
    assert sum(not check.passed for check in result.checks) == failing and len(result.checks) == 10


# failures beyond the linear limits


@pytest.mark.parametrize(
    "small, large, passes",
    [
        (99.0, 101.0, (True, True)),
        (101.0, 99.0, (False, False)),
        (2.0, np.inf, (True, True)),
        (np.inf, 1e7, (False, True)),
    ],
)
def test_growth_at_the_resonance(result, small, large, passes):
    grown = np.array([[1.0, small], [1.0, large]])
    failure.judge_near(result, {"steps": 2000, "grown": {Party("MuJoCo", "implicit"): grown}})
    assert tuple(check.passed for check in result.checks) == passes


def silent_run(since=1.0, caught=1.0, warnings=0, resets=0, definite=-0.5):
    return {
        "t": np.array([0.0, 1.0, 2.0]), "energy": np.zeros(3), "clock": np.arange(3.0), "warnings": warnings, "range": 18.8,
        "gain": 30.0, "since_s": since, "caught_in_it_s": caught, "resets": resets, "caught_at_s": caught, "finite": True,
        "first_reset_s": 1.5 if resets else None, "after_q": np.zeros(3), "smallest": np.zeros(3),
        "definite": {64: definite, 128: 0.1},
    }  # fmt: skip


@BOTH
def test_a_silent_failure_is_caught_within_a_step(result, share, passes):
    failure.judge_silent(result, silent_run(None, None), silent_run(1.0, 1.0 + share * 5 / 64))
    assert only(result) is passes


def test_a_silent_failure_that_is_not_caught_fails(result):
    failure.judge_silent(result, silent_run(1.0, None, resets=1), silent_run(None, None))
    assert not only(result) and "It starts again once, first at 1.50 s" in result.notes[0]


def test_where_nothing_fails_nothing_has_to_be_caught(result):
    failure.judge_silent(result, silent_run(None, None), silent_run(None, None, definite=0.0123))
    assert not result.checks
    assert "it never starts again, and no failure is silent" in result.notes[0]
    assert "No failure" in result.notes[1] and "stays definite" in result.notes[1] and "0.0123" in result.notes[1]


@pytest.mark.parametrize("definite, word", [(-1e-9, "loses definiteness"), (1e-9, "stays definite")])
def test_definiteness_is_the_sign_of_an_eigenvalue(definite, word):
    assert word in failure.tell_gain(silent_run(definite=definite))


def run_with_gain(share):
    """A run of bent, free, that gains a share of the physical bound on its energy as motion in its second state."""
    q, qd = failure.BENT.start
    rate = np.sqrt(2.0 * share * 2.0 * gravity_scale() / tmt.mass_matrix(q)[0, 0])
    return {"q": np.array([q, q, q]), "qd": np.array([qd, [rate, 0.0, 0.0], qd]), "time": np.arange(3.0), "warnings": 0}


@pytest.mark.parametrize("share, found", [(INSIDE, None), (1.001, 1.0)])
def test_energy_gives_a_failure_away(share, found):
    t, run = np.arange(3.0), run_with_gain(share)
    assert failure.caught(failure.BENT, t, run) == found
    seen = failure.observed(t, run)
    assert seen["since_s"] == seen["caught_in_it_s"] == found
    assert seen["gain"] == pytest.approx(share * seen["range"], rel=1e-3)


def test_a_clock_that_goes_back_gives_a_failure_away():
    run = run_with_gain(0.5) | {"time": np.array([0.0, 1.0, 0.0])}
    assert failure.caught(failure.BENT, np.arange(3.0), run) == 2.0
    assert failure.observed(np.arange(3.0), run)["since_s"] == 2.0


# long runs


@pytest.mark.parametrize("deviations, kind", [(2.99, "bounded"), (3.01, "drifts"), (-3.01, "drifts")])
def test_energy_drifts_by_three_standard_deviations(deviations, kind):
    swing = np.tile([1.0, -1.0], 50)  # standard deviation 1
    off = np.concatenate([swing, np.zeros(300), swing + deviations])
    assert long_runs.behaviour(off) == (kind, pytest.approx(deviations))


def minute(engine, method, kind):
    ended = 1.0 if kind == "diverges" else None
    row = {"scene": "bent, free", "engine": engine, "method": method, "dt_s": 0.01, "energy": kind,
           "largest_j": None if ended else 0.1, "change_j": None if ended else 0.2, "diverged_at_s": ended}  # fmt: skip
    return {"row": row, "t": np.arange(3.0), "off": np.zeros(3), "seconds": 60.0}


@pytest.mark.parametrize("theirs, passes", [("drifts", True), ("bounded", False), ("diverges", False)])
def test_energy_does_as_by_the_same_scheme(result, theirs, passes):
    long_runs.judge_minutes(result, [minute("TMT", "rk4", "drifts"), minute("MuJoCo", "RK4", theirs)])
    assert only(result) is passes and "drifts: rk4 (by +0.2 J)" in result.notes[0]


@pytest.mark.parametrize(
    "found, rate, words",
    [
        (200, 1e200, ("never up to 2 s", "It finds every stage")),
        (100, 0.99e100, ("fails from 2 s", "before none of them do rates overflow")),
        (100, 1.01e100, ("fails from 2 s", "the rates are beyond 1e+100 rad/s in 1")),
        (100, None, ("fails from 2 s",)),
    ],
)
def test_what_ends_newtons_method(result, found, rate, words):
    rows = [
        {"method": "implicit_midpoint", "motion": "free", "dt_s": dt, "steps_found": steps, "last_rad_per_s": last,
         "steps": 200} for dt, steps, last in ((1.0, 200, 5.0), (2.0, found, rate))
    ]  # fmt: skip
    long_runs.judge_newton(result, [rows])
    assert all(text in result.notes[0] for text in words)


# figures: the right engine with the right number


def test_limits_figure_marks_mujoco_where_mujoco_is(result):
    limits.judge(result, [{"growths": [], "rows": [
        limit_row(0.1, 0.1001), limit_row(0.1, 0.0999, engine="MuJoCo", method="RK4"),
        limit_row(None, None, "never_fails", "never_fails", method="implicit_midpoint"),
        limit_row(0.2, None, method="implicit", seen="never_fails"),
    ]}])  # fmt: skip
    _, fig, caption = draw_stability.limits(result)
    marks = [line.get_xdata() for line in fig.axes[0].lines if line.get_marker() == "|" and len(line.get_xdata())]
    assert [float(*x) for x in marks] == [0.0999]
    ends = sorted(bar.get_x() + bar.get_width() for bar in fig.axes[0].patches if bar.get_y() >= -1)
    assert ends == pytest.approx([0.1, 0.1001, 0.2])
    assert "2 of 3 predicted limits are observed" in caption and "at most 0.100 %" in caption


def test_map_names_who_grows():
    dts = np.array([0.1, 0.2, 0.4, 0.8])
    parties = {
        Party("TMT", "rk4"): np.array([1.0, 1.0, 1e3, 1e3]), Party("MuJoCo", "RK4"): np.array([1.0, 99.0, 99.0, 99.0]),
        Party("MuJoCo", "Euler"): np.full(4, np.inf), Party("MuJoCo", "implicit"): np.array([1.0, 101.0, 1.0, 1.0]),
    }  # fmt: skip
    limit = {("TMT", "rk4"): 0.3, ("MuJoCo", "implicit"): 0.3}
    told = draw_stability.tell_map(parties, dts, 100.0, limit)
    assert "first at 0.20 to 0.40 s, for 1 of 2" in told
    assert "At every dt: MuJoCo Euler. At none: MuJoCo RK4." in told


def test_edge_names_each_engine_with_its_growth(result):
    near = {
        Party("TMT", "implicit"): np.array([[1.5], [200.0]]),
        Party("MuJoCo", "implicit"): np.array([[2.5], [np.inf]]),
    }
    result.curves["near"] = {
        "x": np.array([1.7, 1.75]),
        "steps": 2000,
        "grown": {k: v.repeat(2, 1) for k, v in near.items()},
    }
    result.curves["edge"] = {"x": np.array([1.0, 2.0]), "y": np.array([1e-3, 1e-2]), "steps": 2000,
                             "grown": {Party("TMT", "implicit"): np.ones((2, 2))}}  # fmt: skip
    caption = draw_failure.edge(result)[2]
    assert "TMT implicit 1.50-fold and 200.00-fold; MuJoCo implicit 2.50-fold and diverges" in caption


def test_departure_figure_marks_each_engine_at_its_times(result):
    result.tables["stability_modes"] = [{"scene": "ball catch", "real_per_s": 7.5}]
    result.tables["departure"] = [
        fall(2.0, 2.01),
        fall(3.0, 3.01, engine="MuJoCo") | {"method": "RK4"},
        fall(None, None),
    ]
    _, fig, caption = draw_departure.times(result)
    lines = {line.get_label(): line.get_ydata()[0] for line in fig.axes[0].lines}
    assert lines["MuJoCo RK4"] == 3.0 and lines["RK4"] == 2.0
    assert "Marks: 3 runs. 2 leave as the map does, 2 of them" in caption


def test_torques_figure_has_each_engine_on_its_own_axis(result):
    result.tables["stability_torques"] = torque_rows(times=(4.0, 5.0))
    _, fig, _ = draw_departure.torques(result)
    for ax, engine, time in zip(fig.axes, ("TMT", "MuJoCo"), (4.0, 5.0)):
        assert ax.get_ylabel() == f"runs, {engine}" and {line.get_xdata()[0] for line in ax.lines} == {time}
    fills = {(line.get_ydata()[0], line.get_fillstyle()) for line in fig.axes[2].lines if line.get_marker() == "^"
             and len(line.get_ydata())}  # fmt: skip
    assert fills == {(4.0, "full"), (5.0, "none")}


def test_bent_figure_dots_mujoco(result):
    paths = {(party.engine, torque, 0.3): np.full(3, size)
             for party, size in zip(claims.PAIR, (1e-3, 1e-6)) for torque in beyond.TORQUES}  # fmt: skip
    result.curves["bent"] = bent_runs() | {"paths": paths}
    _, fig, _ = draw_departure.bent(result)
    lines = [(line.get_linestyle(), line.get_ydata()) for line in fig.axes[0].lines]
    drawn = {(dash, y[0]) for dash, y in lines if len(y) and y[0] in (1e-3, 1e-6)}
    assert drawn == {("-", 1e-3), (":", 1e-6)}


def test_minute_figure_draws_lines_of_tmt_and_marks_of_mujoco(result):
    runs = [minute("TMT", "rk4", "drifts"), minute("MuJoCo", "RK4", "drifts")]
    for run, size in zip(runs, (0.1, 0.2)):
        run["t"], run["off"] = np.arange(60.0), np.full(60, size)
    result.curves |= {"minutes": runs, "silent": {"gain": {"range": 18.8}}}
    _, fig, caption = draw_failure.minutes(result)
    drawn = {line.get_label(): (line.get_marker(), line.get_ydata()[0]) for line in fig.axes[0].lines}
    assert drawn == {"RK4": ("None", 0.1), "MuJoCo, same scheme": ("o", 0.2)}
    assert "drifts: RK4" in caption


def test_the_farthest_departure_is_told():
    rows = [fall(1.01, 1.0), fall(2.02, 2.0, engine="MuJoCo"), fall(3.0, 3.0)]
    told = departure.tell_departures(rows)
    assert "3 leave in the run and in the prediction, 3 of these" in told
    assert "the largest difference is 0.020 s (ball catch, MuJoCo rk4" in told


@pytest.mark.parametrize("to, found", [(0.3, 1), (-0.3, -1), (np.nan, None)])
def test_the_side_to_which_an_arm_leaves(to, found):
    path = np.array([[1.0, 0.0, 0.0], [1.0 + to / 3, 0.0, 0.0], [1.0 + to, 9.0, 9.0]])
    assert claims.side(path, 0.2, 0.1) == found and claims.side(path, None, 0.1) is None


def test_a_failure_is_caught_at_the_first_of_its_signs():
    """A clock that goes back, and more energy than the arm can have: whichever comes first."""
    t, still = np.arange(5.0), np.tile(failure.BENT.start[0], (5, 1))
    for back, fast, first in ((3, 2, 2.0), (2, 3, 2.0), (None, 3, 3.0), (4, None, 4.0), (None, None, None)):
        time, qd = np.arange(5.0), np.zeros((5, 3))
        if back is not None:
            time[back:] -= 2.0
        if fast is not None:
            qd[fast:] = 1e3
        assert failure.caught(failure.BENT, t, {"time": time, "q": still, "qd": qd}) == first
