"""What the first screen draws and says of results: just inside and just outside of each tolerance, and when it is drawn."""

from functools import partial
from types import SimpleNamespace

import pytest
from made_overviews import RUN, drawn, limits, timed

from compare.experiments import EXPERIMENTS
from compare.judge.check import Result
from compare.report import engines_apart, figures_overview, methods_compared, overview
from compare.report.engines_apart import Agreement, SceneRun
from compare.report.methods_compared import Cheapest, Curve, Limit
from compare.report.one_number import one_number
from compare.report.verdict import Section
from compare.robots.arm import ARM


def test_every_picture_is_drawn_once_with_the_last_of_its_experiments_that_run():
    results = {name: Result(name, rows=[{"a": 1}], checks=[1], label="yours") for name in EXPERIMENTS}
    for names, expected in (
        (list(EXPERIMENTS), {"acceleration": ["mass", "acceleration"], "trajectory": ["trajectory"], "speed": ["speed"],
                             "stability": ["stability"]}),
        (["mass"], {"mass": ["mass"]}),
        (["parameters", "reduction"], {}),
    ):  # fmt: skip
        found = {}
        for k, name in enumerate(names):
            done = [Section(one, "", "", "", results[one]) for one in names[: k + 1]]
            needs = overview.results_needed(name, names, done)
            assert all(one.rows == [{"a": 1}] and one.label == "yours" and not one.checks for one in needs.values())
            if needs:
                found[name] = list(needs)
                assert len(overview.drawn_with(name, needs)) == 1
        assert found == expected


def test_the_agreement_is_the_largest_of_all_rows_of_a_quantity():
    row = {
        "quantity": "Mbar",
        "difference_eps": 2.0,
        "tmt_from_exact_eps": 1.0,
        "mujoco_from_exact_eps": None,
        "passed": True,
    }
    rows = [
        row,
        row | {"difference_eps": 7.0, "tmt_from_exact_eps": None},
        row | {"quantity": "other", "difference_eps": 9.0},
    ]
    results = {"mass": Result("mass", rows=rows)}
    assert engines_apart.agreements(results) == [Agreement("mass matrix M", 7.0, 1.0, None, True)]
    rows.append(row | {"difference_eps": float("nan"), "passed": False})
    (found,) = engines_apart.agreements(results)
    assert found.apart == float("inf") and not found.passed
    assert "differ in mass matrix M: up to no number of eps" in engines_apart.agreement_in_words([found], "TMT")


def test_the_sentence_on_agreement_comes_out_either_way():
    good, bad = Agreement("bias h", 4.8, 1.0, 5.0, True), Agreement("accelerations", 64.1, 1.0, 5.0, False)
    assert engines_apart.agreement_in_words([good], "TMT") == (
        "TMT and MuJoCo have the same bias h: at most 4.8 eps apart (bias h), and 5 eps from exact."
    )
    assert engines_apart.agreement_in_words([good, bad], "yours") == (
        "Yours and MuJoCo differ in accelerations: up to 64 eps apart (accelerations)."
    )


def test_a_scene_at_a_glance():
    rows = [RUN, RUN | {"judged_until_s": 0.5, "diverged_at_s": 0.6}, RUN | {"level": "one step", "difference_over_band": 0.7},
            RUN | {"scene": "a, more", "difference_over_band": None}]  # fmt: skip
    result = Result("trajectory", rows=rows)
    result.check("a, more, RK4", "one step", 2.0, 1.0, "rad")
    result.check("a, RK4", "one step", 1.0, 1.0, "rad")
    robot = SimpleNamespace(cases=[SimpleNamespace(name="a", duration=5.0, is_held=False)])
    found = engines_apart.scene_runs(result, robot)
    assert found == [
        SceneRun("a", 0.7, (0.5, 3.0), 5.0, 0.6, None, True),
        SceneRun("a, more", None, (3.0, 3.0), 3.0, None, None, False),
    ]
    assert engines_apart.scenes_in_words(found, "yours").startswith("Yours and MuJoCo do not move alike in a, more: ")
    assert engines_apart.scenes_in_words(found[:1], "TMT") == (
        "TMT and MuJoCo move alike in all 1 scenes: at most 70 % of the rounding band apart, judged for 0.5 to 3 s."
    )
    left = found[0]._replace(left=(None, 4.7))
    assert engines_apart.scenes_in_words([left], "TMT").endswith(
        "In a the posture is left by MuJoCo alone within its 5 s, at 4.7 s."
    )
    assert "is left" not in engines_apart.scenes_in_words([left._replace(left=(4.6, 4.7))], "TMT")


def test_a_curve_has_what_nothing_of_the_same_engine_beats():
    rows = [
        timed("tmt", "rk4", 1e-3, 1e-3), timed("tmt", "rk4", 2e-3, 1e-2), timed("tmt", "dopri8", 4e-3, 1e-6),
        timed("tmt", "dopri8", 5e-3, 1e-9), timed("mujoco", "RK4", 1e-2, 1.1e-6), timed("tmt", "rk4", 1e-9, None, diverged=True),
        timed("tmt", "rk4", 1e-9, 2.0), timed("heyoka", "Taylor", None, None, why_not="absent"),
    ]  # fmt: skip
    result = Result("speed", rows=rows, curves={"regular": "s", "unit": "rad"})
    found = methods_compared.best_curves(result)
    assert found == [
        Curve("tmt", [1e-3, 1e-6, 1e-9], [1.0, 4.0, 5.0], Cheapest("dopri8", 4.0)),
        Curve("mujoco", [1.1e-6], [10.0], None),
    ]
    assert methods_compared.times_in_words(result).endswith("To 1e-06 rad (s): tmt dopri8, 4 ms.")
    rows.append(timed("mujoco", "RK4", 3e-3, 1e-6))
    assert methods_compared.times_in_words(result).endswith("(s): MuJoCo RK4, 3 ms; tmt dopri8, 4 ms.")
    assert methods_compared.times_in_words(Result("speed", rows=rows[:2], curves={"regular": "s"})).endswith(
        "None reaches 1e-06 rad."
    )


def test_the_cheapest_settings_have_their_scene_and_their_steps():
    rows = [
        timed("scipy", "DOP853", 5e-4, 1e-7), timed("mujoco", "RK4", 0.039, 1e-6, dt_s=0.00244140625, steps=2048.0),
        timed("tmt", "dopri8_adaptive", 9.3e-5, 1e-6, dt_s=None, steps=80, tolerance=1e-9),
    ]  # fmt: skip
    result = Result("speed", rows=rows, curves={"regular": "s", "unit": "m"})
    said = "o 1e-06 m (s): tmt dopri8_adaptive, tolerance 1e-09, 0.093 ms; MuJoCo RK4, 2048 steps (dt 0.0024 s), 39 ms"
    assert methods_compared.times_in_words(result) == f"The cheapest settings of each engine. T{said}."
    assert one_number(Section("speed", "", "", "", result)) == f"t{said}"


def test_limits_are_counted_where_they_are_predicted_and_observed():
    result = limits(0.1001, None)
    found = methods_compared.limits_found(result)
    assert found[0] == Limit("rk4", "tmt", "s", 0.5, "finite", 0.1, 0.1001, True) and len(found) == 2
    assert methods_compared.limits_at_a_glance(found) == (
        "1 step limits, predicted from one step of a method, are observed in runs within 0.1 %."
    )
    of_two = methods_compared.limits_found(limits(0.1001, 0.0995))
    assert methods_compared.limits_at_a_glance(of_two).startswith("2 step limits") and "within 0.5 %" in (
        methods_compared.limits_at_a_glance(of_two)
    )
    result.check("s, TMT rk4, damping 0.5", "growth in 8 steps", 2.0, 1.0, "")  # of something else
    assert all(one.passed for one in methods_compared.limits_found(result))
    result.check("s, TMT rk4, damping 0.5", "limit, observed / predicted - 1", 2.0, 1.0, "")
    assert not any(one.passed for one in methods_compared.limits_found(result))
    assert methods_compared.limits_at_a_glance(methods_compared.limits_found(result)).startswith(
        "2 of 2 step limits are not"
    )


@pytest.mark.parametrize("ratio, text", [(1.34, "1.3"), (134.4, "130"), (9.8e11, "9.8e+11")])
def test_ratios_in_print(ratio, text):
    assert overview.times_in_print(ratio) == text


@pytest.mark.parametrize("experiment, name", [("mass", "agreement"), ("trajectory", "scenes"), ("stability", "limits")])
def test_pictures_are_drawn_of_a_small_run(small, experiment, name):
    ((file, figure, caption),) = drawn(experiment, small(experiment))
    assert file == f"{overview.BEGINNING}{name}" and caption.endswith(".") and "nan" not in caption
    assert figure.get_size_inches()[0] == figures_overview.SIZE[0]


def test_what_fails_is_named_with_a_cross_in_its_picture(small):
    result = small("mass")
    rows = [row | {"passed": False, "difference_eps": 65.0} for row in result.rows]
    for given, crossed in ((result, False), (Result("mass", rows=rows), True)):
        ((_, figure, caption),) = drawn("mass", given)
        labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
        assert [label.startswith("✗ ") for label in labels] == [crossed] and ("differ" in caption) == crossed


def test_there_is_no_picture_without_data():
    for experiment, needs in (("speed", {}), ("speed", {"speed": Result("speed", curves={"regular": "s"})}),
                              ("mass", {"mass": Result("mass")}), ("stability", {"stability": Result("stability")})):  # fmt: skip
        assert not list(figures_overview.pictures(experiment, needs, ARM))
    assert isinstance(next(figures_overview.pictures("stability", {"stability": limits(0.1)}, ARM)), partial)
