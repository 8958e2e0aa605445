"""The judge of speed: every rule with a row just inside and one just outside; times and engines keep their places."""

import time
from decimal import Decimal

import numpy as np
import pytest
from matplotlib.colors import to_hex

from compare import accuracy, advice, clock, draw_speed, evaluations, reference, speed, targets
from compare.agreement import Result
from compare.evaluations import EACH, EQUAL, FORWARD, LANES, MJ_STEP, STEP, WAITING, WHOLE
from compare.scenes import SCENES

ORANGE, BLUE = "#e69f00", "#0072b2"  # MuJoCo's, tmt's


def row(engine, method, error, steps=64, seconds=1e-3, **more):
    """A row of speed: diverged where the error is None."""
    return {
        "scene": "bent, free", "engine": engine, "method": method, "dt_s": 5.0 / steps, "tolerance": None, "steps": steps,
        "evaluations": 4 * steps, "seconds": seconds, "error_rad": error, "worst_error_rad": error, "energy_error_J": error,
        "diverged": error is None, "early": error,
    } | more  # fmt: skip


def judged(judge, rows, *arguments):
    """(quantity, passed) of each check that a judge makes of rows."""
    result = Result("speed", rows=rows)
    judge(result, *arguments)
    return {check.quantity: check.passed for check in result.checks}


# the same scheme, the smallest errors


@pytest.mark.parametrize(
    "ours, theirs, verdict",
    [
        (1e-3, 1e-3 + 63e-10, True),
        (1e-3, 1e-3 + 65e-10, False),
        (1e-3, 1e-3 - 65e-10, False),
        (1e-3, None, False),
        (None, 1e-3, False),
        (0.0999, 0.2, False),
        (0.2, 0.0999, False),
        (0.1001, 0.2, None),
        (None, 0.2, None),
        (None, None, None),
    ],
)
def test_the_same_scheme_makes_the_same_error(ours, theirs, verdict):
    rows = [row("tmt", "rk4", ours), row("mujoco", "RK4", theirs), row("tmt", "rk4", 1.0, 128)]
    found = judged(accuracy.same_schemes, rows, {"bent, free": 1e-10})
    assert found == ({} if verdict is None else {"the same error as tmt's rk4": verdict})


@pytest.mark.parametrize("left, passes", [(1e-14, True), (0.9e-14, True), (0.99e-14 / 64 / 2, False)])
def test_errors_that_have_stopped_are_of_the_size_of_rounding(left, passes):
    stops = [1e-6, 1e-14, 2e-14]  # 64 of the rounding, at least, where the last is not the least
    rows = [row("mujoco", "RK4", e, 64 << k) for k, e in enumerate(stops)]
    rows += [row("tmt", "rk4", e, 64 << k) for k, e in enumerate([1e-6, 1e-14])]
    found = judged(accuracy.smallest_errors, rows, {"bent, free": left})
    assert found.pop("smallest error of mujoco's RK4, where smaller steps gain nothing") is passes
    assert list(found) == ["smallest error of MuJoCo's RK4, beside that of tmt's rk4"]


def test_the_factor_of_rounding_is_64():
    for error, passes in ((63e-14, True), (65e-14, False)):
        rows = [row("mujoco", "RK4", e, 64 << k) for k, e in enumerate([error, 1.0])]
        found = judged(accuracy.smallest_errors, rows + [row("tmt", "rk4", error)], {"bent, free": 1e-14})
        assert found["smallest error of mujoco's RK4, where smaller steps gain nothing"] is passes


@pytest.mark.parametrize(
    "ours, theirs, passes",
    [(1e-9, 2e-9 + 63e-14, True), (1e-9, 2e-9 + 65e-14, False), (1e-9, None, False), (None, 63e-14, True), (None, 65e-14, False)],
)  # fmt: skip
def test_mujoco_comes_as_near_as_tmt(ours, theirs, passes):
    rows = [row("tmt", "rk4", ours), row("mujoco", "RK4", theirs)]
    found = judged(accuracy.smallest_errors, rows, {"bent, free": 1e-14})
    assert found == {"smallest error of MuJoCo's RK4, beside that of tmt's rk4": passes}


@pytest.mark.parametrize(
    "found, work, best, last, ends",
    [
        (0.71e-14, 121, 1e-14, 100, True),
        (0.69e-14, 121, 1e-14, 100, False),
        (0.71e-14, 119, 1e-14, 100, False),
        (29e-15, 200, 29e-15, 100, True),
        (31e-15, 200, 31e-15, 100, False),
        (np.inf, 200, 1e-15, 100, True),
        (np.nan, 200, 1e-15, 100, True),
    ],
)
def test_a_series_ends_where_a_run_gains_nothing(found, work, best, last, ends):
    assert accuracy.gained_nothing(found, work, best, last, 1e-15) is ends


# orders


@pytest.mark.parametrize(
    "order, measured, passes",
    [(4, 4.149, True), (4, 4.151, False), (4, 3.851, True), (4, 3.849, False), (1, 1.151, False), (8, 7.01, True),
     (8, 6.99, False), (8, 12.0, True), (4, np.nan, False)],
)  # fmt: skip
def test_the_order_is_measured_within_its_margin(order, measured, passes):
    result = Result("speed")
    advice.judge_order(result, "bent, free, tmt rk4", order, measured)
    assert [check.passed for check in result.checks] == [passes]


def test_an_order_is_measured_where_errors_fall_regularly():
    def shown(errors, complete=True):
        rows = [row("tmt", "rk4", e, 64 << k) for k, e in enumerate(errors)]
        result = Result("speed", rows=rows)
        table = advice.orders(result, ["bent, free"], [("tmt", "rk4", 4)], complete)
        return [t["measured_order"] for t in table], [check.passed for check in result.checks]

    assert shown([0.29, 2.9e-2, 2.9e-2 / 16]) == ([pytest.approx(4.0)], [True, True])
    assert shown([3.1e-2, 2.9e-2 / 16]) == ([], [False])  # one error only is below 3e-2 rad
    assert shown([3.1e-2, 2.9e-2 / 16], complete=False) == ([], [])
    assert shown([16 * 2.1e-12, 2.1e-12]) == ([pytest.approx(4.0)], [True, True])
    assert shown([16 * 1.9e-12, 1.9e-12]) == ([], [False])
    assert shown([2.9e-2, 2.8e-2, 2.8e-2 / 16]) == ([pytest.approx(4.0)], [True, True])  # the finest two count
    assert shown([2.9e-2, 2.9e-2 / 16, 2.8e-2 / 16])[1] == [False, True]


# the error at the assignment's step


def test_the_true_error_is_that_of_rk4_at_64_steps():
    rows = [row("tmt", "rk4", 1.5), row("mujoco", "RK4", 1.6), row("tmt", "rk4", 1e-3, 128), row("tmt", "dopri8", 1e-6)]
    rows += [row("tmt", "rk4", 0.02, scene="bent, damped"), row("mujoco", "RK4", None, scene="bent, damped")]
    assert accuracy.true_error(rows) == {"bent, free": (1.5, 1.6), "bent, damped": (0.02, None)}
    assert accuracy.true_error([]) == {} and accuracy.true_errors_told([]) == []


@pytest.mark.parametrize(
    "ours, theirs, says",
    [
        (1.5, 1.501, "bent, free: TMT 1.5 rad, MuJoCo 1.5 rad. bent, free: both engines make this error"),
        (1.5, 1.6, "bent, free: TMT 1.5 rad, MuJoCo 1.6 rad. bent, free: the errors are not the same"),
        (0.099, 0.099, "MuJoCo 0.099 rad."),
        (0.099, None, "MuJoCo no number. bent, free: the errors are not the same"),
    ],
)
def test_the_true_error_is_told(ours, theirs, says):
    (told,) = accuracy.true_errors_told([row("tmt", "rk4", ours), row("mujoco", "RK4", theirs)])
    assert says in told and ("rad. bent" in told or "number. bent" in told) == ("not" in says or "both" in says)


# times


def test_the_clock_reports_what_a_call_takes(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    lasts = {
        "a": [9.0e-3, 3e-3, 2e-3, 4e-3],
        "b": [0.2],
        "c": [0.09, 0.05, 0.06],
    }  # the first of a and c is not counted
    left = {name: list(taken) for name, taken in lasts.items()}

    def call(name):
        now[0] += left[name].pop(0)

    runs = {name: lambda name=name: call(name) for name in lasts}
    assert clock.fastest(runs, 3) == {"a": pytest.approx(2e-3), "b": pytest.approx(0.2), "c": pytest.approx(0.05)}
    assert left == {"a": [], "b": [], "c": []}


def test_a_row_gets_the_least_of_its_times():
    rows = [row("tmt", "rk4", 1.0), row("mujoco", "RK4", 1.0)]
    assert speed.fill_in(rows, [[3e-3, 2e-3, 5e-3], [0.4]]) == [pytest.approx(1.5)]
    assert [r["seconds"] for r in rows] == [2e-3, 0.4]
    assert "50.0% above the least" in speed.spread_told([1.5])[0] and speed.spread_told([]) == [
        "Each time is that of one run."
    ]


def test_nanoseconds_of_a_state():
    found = evaluations.per_state({(FORWARD, WHOLE, 1, 1): 100, (STEP, MJ_STEP, 1, 1): 10}, [[3e-4, 2e-4], [1e-4]])
    assert found == {(FORWARD, WHOLE, 1, 1): pytest.approx(2000.0), (STEP, MJ_STEP, 1, 1): pytest.approx(10_000.0)}
    assert [(r["quantity"], r["implementation"], r["ns_per_state"]) for r in evaluations.table({
        (FORWARD, EACH, 1000, 1): 30.0, (FORWARD, WHOLE, 1, 1): 1400.0})] == [
        (FORWARD, WHOLE, 1400.0), (FORWARD, EACH, 30.0)]  # fmt: skip


NS = {
    (FORWARD, WHOLE, 1, 1): 1000.0, (FORWARD, EQUAL, 1, 1): 500.0, (STEP, MJ_STEP, 1, 1): 4000.0, (FORWARD, WAITING, 1, 1): 50.0,
    (FORWARD, EACH, 1000, 1): 25.0, (FORWARD, LANES, 1000, 1): 10.0, (STEP, EACH, 1, 1): 200.0, (STEP, LANES, 1000, 1): 40.0,
}  # fmt: skip


def test_what_an_evaluation_costs_is_told():
    told = " ".join(evaluations.told(NS, (50e-6, 10e-6), (488, 133)))
    for words in ("mj_forward takes 1000 ns", "same work 500 ns", "the kernel 50.0 ns", "(20 times less; than the same work 10",
                  "25.0 ns where they are independent (40 times less; 20 times less)",
                  "lanes 10.0 (of 1,000 states) ns a state (100 times less)",
                  "mj_step 4000 ns, the kernel 200 ns (20 times less)", "64 steps takes 50 us, its loop alone 10 us",
                  "literal method has 488 operations, that of the composite form 133"):  # fmt: skip
        assert words in told, words
    slower = NS | {(STEP, MJ_STEP, 1, 1): 100.0}
    assert "(2.0 times more)" in " ".join(evaluations.told(slower, (1, 1), (1, 1)))
    without = {key: value for key, value in NS.items() if not key[1].startswith("MuJoCo")}
    assert "was not found" in " ".join(evaluations.told(without, (1, 1), (1, 1)))


# advice, aims


def known_rows():
    """MuJoCo's RK4 20 times slower than tmt's; of its integrators Euler is never as near; dopri8 needs fewest steps."""
    rows = []
    for k in range(5):
        steps, error = 64 << k, 2e-2 / 16**k
        rows += [row("mujoco", "RK4", error, steps, 20e-3 * 2**k), row("tmt", "rk4", error, steps, 1e-3 * 2**k)]
        rows += [
            row("mujoco", "Euler", 0.5 / 2**k, steps, 4e-3 * 2**k),
            row("tmt", "dopri8", error**2, steps, 2e-3 * 2**k),
        ]
    return [*rows, row("scipy", "DOP853", 1e-9, 500, 1e-4), row("mujoco", "implicit", None, 64, 1e-9)]


def test_the_advice_names_the_cheapest_of_each_engine_with_its_time():
    table = {line["target_rad"]: line for line in advice.advice(known_rows(), ["bent, free"], {"bent, free": 1e-16})}
    line = table[1e-3]
    assert (line["mujoco"], line["tmt"], line["of_all"]) == (
        "mujoco RK4, 256 steps", "tmt dopri8, 64 steps", "scipy DOP853, 500 steps")  # fmt: skip
    times = [line[f"{engine}_ms"] for engine in ("mujoco", "tmt", "of_all")]
    assert times == pytest.approx([80.0, 2.0, 0.1]) and line["mujoco_evaluations"] == 1024
    assert (line["ratio"], line["kernel_part"], line["method_part"]) == pytest.approx((40.0, 20.0, 2.0))
    assert line["integrator_part"] == pytest.approx(1.0) and line["why_not"] is None
    assert (
        table[1e-12]["mujoco"] is None
        and "MuJoCo's least error is 3.1e-07 rad: its steps end" in table[1e-12]["why_not"]
    )


def test_the_fewest_evaluations_are_those_of_the_coarsest_step_that_is_near_enough():
    result = Result("speed", rows=known_rows())
    assert draw_speed.fewest(result, "bent, free", 1e-3) == "For 1e-03 rad (bent, free) rk4 needs 1024, dopri8 256. "
    assert draw_speed.fewest(result, "bent, free", 1e-30) == ""


@pytest.mark.parametrize(
    "errors, left, says",
    [
        ([1.0, 0.5], 1e-16, "its steps end before"),
        ([1.0, 29e-14, 1.0], 1e-14, "rounding, of the size of 1e-14 rad, takes over"),
        ([1.0, 31e-14, 1.0], 1e-14, "finer steps come no nearer"),
    ],
)
def test_why_an_error_is_not_reached(errors, left, says):
    rows = [row("mujoco", "RK4", e, 64 << k) for k, e in enumerate(errors)]
    told = advice.why_not(rows, None, None, left)
    assert f"MuJoCo's least error is {min(errors):.1e} rad: " in told and says in told
    assert told.endswith("tmt has no run that did not diverge")


def aims(ratio, lanes=300.0, vectors="some processor, AVX-512"):
    """Which aims are met, and what is told, where tmt takes so many times what the aims allow."""
    result = Result("speed")
    ns = {(FORWARD, WHOLE, 1, 1): 4000.0, (FORWARD, EQUAL, 1, 1): 1200.0, (STEP, MJ_STEP, 1, 1): 2000.0,
          (FORWARD, WAITING, 1, 1): 100.0 * ratio, (FORWARD, EACH, 1000, 1): 100.0 * ratio, (STEP, EACH, 1, 1): 100.0 * ratio,
          (FORWARD, LANES, 1000, 1): 4000.0 / lanes}  # fmt: skip
    result.tables["evaluations"] = evaluations.table(ns)
    result.tables["what_should_i_use"] = [{"scene": s, "target_rad": t, "ratio": r / ratio} for s, t, r in (
        ("bent, free", 1e-6, 50), ("zero, free", 1e-9, 200), ("zero, free", 1e-12, 500), ("bent, damped", 1e-6, 1))]  # fmt: skip
    result.rows = [row("heyoka", "Taylor", 1e-10, seconds=1e-3), row("tmt", "dopri8", 1e-10, seconds=1e-3 * ratio)]
    found = targets.targets(result, {"bent, free": 1e-15}, vectors)
    return {t["what"]: t["met"] for t in found}, targets.told(found)


def test_an_aim_is_met_at_its_ratio_and_missed_below():
    met, told = aims(0.999)
    assert len(met) == 10 and all(met.values()) and told == ["Of 10 aims for speed 10 are met."]
    missed, told = aims(1.001, lanes=299.0)
    assert len(missed) == 10 and not any(missed.values())
    assert told[0].startswith("Of 10 aims for speed 0 are met; missed: forward dynamics, each evaluation waits")
    assert "bent, free, 1e-06 rad: MuJoCo's cheapest over tmt's: 50 of 50" in told[0]
    lanes = "forward dynamics: mj_forward over lanes of 1,000 states"
    assert [aims(1, n, "AVX2")[0][lanes] for n in (121, 119)] == [True, False]


# figures


def drawn_result():
    result = Result("speed", rows=known_rows(), curves={"floors": {"bent, free": 1e-15}})
    result.tables["what_should_i_use"] = advice.advice(result.rows, ["bent, free"], {"bent, free": 1e-15})
    result.tables["evaluations"] = evaluations.table(NS)
    result.check("bent, free", "the same error as tmt's rk4", 0.0, 1.0, "rad")
    result.check("bent, free", "the same error as tmt's implicit", 2.0, 1.0, "rad")
    return result


def test_the_figures_draw_the_numbers_of_each_engine():
    result = drawn_result()
    name, fig, caption = draw_speed.times(result, "bent, free")
    ax = fig.axes[0]
    lines = {(to_hex(line.get_color()), tuple(np.round(line.get_ydata(), 9))) for line in ax.get_lines()}
    assert (ORANGE, (20.0, 40.0, 80.0, 160.0, 320.0)) in lines and (BLUE, (1.0, 2.0, 4.0, 8.0, 16.0)) in lines
    labels = {line.get_label(): to_hex(line.get_color()) for line in ax.get_lines()}
    assert name == "speed_bent_free" and (labels["MuJoCo"], labels["tmt"]) == (ORANGE, BLUE)
    assert caption.startswith("Bent, free: MuJoCo's cheapest setting takes 20 times as long for 1e-02")
    assert "40 times as long for 1e-03 rad" in caption and "1 setting diverges" in caption
    _, fig, caption = draw_speed.evaluations(result)
    assert "Of 2 settings of MuJoCo near the reference 1 have the error" in caption
    assert "For 1e-09 rad (bent, free) rk4 needs" not in caption  # rk4 does not come so near
    for figure in (fig, draw_speed.energy(result)[1]):
        data = {line.get_label(): line for line in figure.axes[0].get_lines()}
        assert to_hex(data["MuJoCo: RK4"].get_color()) == ORANGE and to_hex(data["tmt: rk4"].get_color()) == BLUE
        assert np.allclose(data["tmt: dopri8"].get_xdata(), [(2e-2 / 16**k) ** 2 for k in range(5)])
    assert np.allclose(data["MuJoCo: RK4"].get_ydata(), [20.0, 40.0, 80.0, 160.0, 320.0])
    assert "MuJoCo RK4 3.1e-07 J" in draw_speed.energy(result)[2] and "time for 5 s" in figure.get_supylabel()


def test_the_bars_are_nanoseconds_of_each_way():
    _, fig, caption = draw_speed.cost_of_one(drawn_result())
    ax = fig.axes[0]
    names = [label.get_text() for label in ax.get_yticklabels()]
    bars = {name: (bar.get_width(), to_hex(bar.get_facecolor())) for name, bar in zip(names, ax.patches)}
    assert bars["MuJoCo, mj_forward, 1 state"] == (1000.0, ORANGE) and bars["lanes, 1,000 states"] == (10.0, BLUE)
    assert "from 1,000 ns (MuJoCo, mj_forward, 1 state) to 10.0 ns (lanes, 1,000 states)" in caption
    assert caption.endswith("MuJoCo's mj_forward takes 1,000 ns.")


def test_an_empty_section_has_no_figures_and_none_raises():
    empty = Result("speed", tables={"evaluations": []})
    assert list(speed.figures(empty)) == []
    for draw in (draw_speed.evaluations, draw_speed.energy, draw_speed.cost_of_one):
        assert len(draw(empty)) == 3


def test_sentences_of_first_order_and_smaller_models():
    rows = known_rows()
    assert "bent, free: 3.1e-02 rad in 64 ms (Euler, 1024 steps)" in accuracy.first_order(rows, ["bent, free"])[0]
    assert accuracy.first_order([], ["bent, free"]) == []
    smaller = row("tmt", "rk4", 1e-3, 64, 0.5e-3, scene="bent, free, beta locked")
    (told,) = accuracy.smaller_models([*rows, smaller])
    assert (
        "(tmt rk4, 64 steps): the whole model takes 2.00 times as long; 1.00e-03 rad off where that is 2.00e-02" in told
    )
    assert "Of the curves of all methods 1 come to within 30 times of it; in 0 of these" in accuracy.floors_told(
        rows, {"bent, free": 1e-14})[0]  # fmt: skip


# the reference as it is read


def test_only_a_whole_run_of_the_scene_is_a_reference(tmp_path):
    scene = next(scene for scene in SCENES if scene.name == "bent, free")
    rows = reference.read(reference.TABLE)[reference.key(scene)]
    assert reference.whole(rows) and reference.begins(rows, scene)
    assert not reference.whole(rows[:-1])
    for wrong in ("nan", "Infinity", "", "x", None):
        assert not reference.whole([rows[0] | {"beta_rad": wrong}, *rows[1:]]), wrong
    assert not reference.begins([rows[0] | {"beta_rad": "0.1"}, *rows[1:]], scene)
    assert not reference.begins([*rows[:-1], rows[-1] | {"t_s": "4.9"}], scene)
    for text in ("", "\0", "no,table\n1,2\n", "key\n\n"):
        path = tmp_path / "reference.csv"
        path.write_text(text, encoding="utf-8")
        assert reference.read(path) == {}


def test_a_reference_is_more_than_a_double():
    """Its numbers are the table's, to 30 digits; an error is taken from both halves of them."""
    for rows in reference.read(reference.TABLE).values():
        known = reference.reference(rows)
        for row, high, low in zip(rows, known.high.tolist(), known.low.tolist()):
            for name, h, v in zip(reference.STATE, high, low):
                assert abs(Decimal(row[name]) - Decimal(h) - Decimal(v)) <= abs(Decimal(row[name])) * Decimal("1e-30")
        assert 1e-18 < np.abs(known.low).max() < 1e-14
        assert np.array_equal(known.error(known.high[:, :3]), np.abs(known.low[:, :3]).max(axis=1))
        assert known.error(known.high[:, :3] + known.low[:, :3]).max() <= 1e-15
