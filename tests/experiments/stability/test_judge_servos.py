"""Tolerances and rules of the step under servos, just inside and just outside, and what is said first; no runs."""

from types import SimpleNamespace

import numpy as np
import pytest

from compare.experiments.stability import servos
from compare.experiments.stability.servos import figures_step
from compare.experiments.stability.servos.predicted import Steps
from compare.experiments.stability.servos.sentences import at_the_top, in_seconds, shaking


def row(**more):
    """A row of step_limits.csv."""
    return {
        "posture": "p", "base": "fixed", "integrator": "Euler", "limit": "finite", "predicted_dt_s": 0.1, "file_dt_s": 0.1,
        "observed_dt_s": None, "file_integrator": "Euler", "limiting_joint": "joint7", "stable_at_file_dt": None,
        "step_response_error": None,
    } | more  # fmt: skip


@pytest.mark.parametrize("seen, kind, passed", [
    (0.100999, "finite", True), (0.10101, "finite", False), (0.099001, "finite", True), (0.09899, "finite", False),
    (None, "none", False), (None, "always", False),
])  # fmt: skip
def test_an_observed_limit_is_within_a_hundredth(result, seen, kind, passed):
    servos.check_observed(result, row(observed_dt_s=seen), kind, False)
    assert [check.passed for check in result.checks] == [passed]


@pytest.mark.parametrize("predicted_dt, checks", [(0.99e-7, 0), (1.01e-7, 1)])
def test_a_limit_below_the_shortest_step_that_is_tried_is_not_compared(result, predicted_dt, checks):
    servos.check_observed(result, row(predicted_dt_s=predicted_dt), "always", False)
    assert [check.passed for check in result.checks] == [False] * checks


def test_no_limit_is_no_check_where_runs_show_none_and_a_failed_one_where_they_do(result):
    none = row(limit="none", predicted_dt_s=None)
    servos.check_observed(result, none, "none", False)
    assert not result.checks
    servos.check_observed(result, none | {"observed_dt_s": 1.0}, "finite", True)
    assert not result.checks[0].passed and result.checks[0].scene == "p, fixed base, Euler"


@pytest.mark.parametrize("apart, beside, passed", [
    (0.99e-6, 0.99e-4, [True, True]), (1.01e-6, 1.01e-4, [False, False]), (None, None, []), (np.inf, np.nan, [False, False]),
])  # fmt: skip
def test_forms_of_a_limit_and_growth_of_a_step(result, apart, beside, passed):
    one = SimpleNamespace(name="p", at=SimpleNamespace(bases=("fixed",)))
    servos.check_steps(result, one, [Steps("fixed", "Euler", apart, beside)])
    assert [check.passed for check in result.checks] == passed


@pytest.mark.parametrize("more, passed", [
    ({}, [True]), ({"file_dt_s": 0.1001}, [False]), ({"base": "locked"}, []), ({"integrator": "RK4"}, []),
    ({"limit": "none", "predicted_dt_s": None}, [True]), ({"limit": "saddle", "predicted_dt_s": None}, []),
])  # fmt: skip
def test_a_step_is_stable_up_to_its_limit_where_one_counts(result, more, passed):
    servos.check_own_step(result, [row(**more)])
    assert [check.passed for check in result.checks] == passed


# what is said first


def limits(own=0.2, euler=6e-4, file="implicitfast", **more):
    """Rows of postures p, q under the file's integrator and Euler: a limit, s, None for none, or a word for another kind."""
    rows = []
    for integrator, places in (("Euler", euler), (file, own)):
        for name, limit in zip("pqr", places if isinstance(places, tuple) else (places,)):
            kind = limit if isinstance(limit, str) else "finite" if limit else "none"
            dt = limit if kind == "finite" else None
            rows.append(row(
                posture=name, integrator=integrator, limit=kind, predicted_dt_s=dt, file_dt_s=2e-3, file_integrator=file,
                stable_at_file_dt=dt is None or dt >= 2e-3, step_response_error=0.004) | more)  # fmt: skip
    return rows


def run(integrator, speed, stable, warnings=0, resets=0, posture="p"):
    """A row of full_model.csv."""
    return {
        "posture": posture, "integrator": integrator, "rms_speed": speed, "warnings": warnings, "resets": resets,
        "predicted_stable": stable, "calm": speed is not None and speed < 1e-3,
    }  # fmt: skip


@pytest.mark.parametrize("rows, begins, numbers", [
    (limits(), "Stable", ["2 ms", "0.2 s, joint7", "0.6 ms, joint7"]),
    (limits(euler=4e-3), "Stable", ["0.2 s, joint7", "4 ms, joint7"]),
    (limits(euler=None), "Stable", ["0.2 s, joint7", "5 s"]),
    (limits(own=1e-3), "Not stable", ["1 ms, joint7", "0.6 ms, joint7"]),
    (limits(own=1e-3, euler=0.1), "Not stable", ["1 ms, joint7", "0.1 s, joint7"]),
    (limits(file="Euler", own=1.99e-3, euler=()), "Not stable", ["1.99 ms, joint7"]),
    (limits(own=(1e-3, 0.1), euler=1.0), "Not stable", ["1 ms, joint7", "p"]),
    (limits(own=(0.1, "saddle"), euler=0.1), "Stable", ["0.1 s, joint7", "q: a saddle"]),
    (limits(own="saddle", euler=(), file="Euler"), "Whether", ["p: a saddle"]),
    (limits(own=("drifts", "not_at_rest"), euler=()), "Whether", ["p: ", "q: "]),
    (limits(step_response_error=0.34), "Stable", ["34 %"]),
])  # fmt: skip
def test_the_first_words_say_whether_the_step_is_stable_and_its_limits(rows, begins, numbers):
    text = at_the_top(rows, [])
    assert text.startswith(begins) and all(number in text for number in numbers)


@pytest.mark.parametrize("full, kind, numbers", [
    ([], "", []), ([run("Euler", 0.4, False)], "shakes", []), ([run("Euler", 1e-5, False)], "calm", []),
    ([run("Euler", 0.4, False, 1, 2)], "shakes", ["1 ", "2 "]), ([run("Euler", None, False, 3)], "shakes", ["3 "]),
    # beside what it does under an integrator that is stable
    ([run("Euler", 0.9, False), run("RK4", 0.1, True)], "both", []),
    ([run("Euler", 1.1, False), run("RK4", 0.1, True)], "shakes", []),
    # at one posture of several
    ([run("Euler", 1e-5, False), run("Euler", 0.4, False, posture="q")], "shakes", []),
    ([run("Euler", 1e-5, False), run("Euler", 9e-4, False, posture="q")], "calm", []),
])  # fmt: skip
def test_what_the_full_model_does_where_a_step_is_not_stable(full, kind, numbers):
    rows = limits(own=(), euler=(1e-3, 1e-3))
    found, warned = shaking(full, rows)
    assert found == kind and all(number in warned for number in numbers)
    assert (at_the_top(limits(), full) != at_the_top(limits(), [])) is bool(full)


@pytest.mark.parametrize("dt, beside, text", [
    (2e-3, None, "2 ms"), (5.9312e-4, 2e-3, "0.59 ms"), (0.2011, 2e-3, "0.2 s"), (1.9912e-3, 2e-3, "1.991 ms"),
    (0.0999, None, "100 ms"),
])  # fmt: skip
def test_times_have_the_digits_that_tell_them_apart(dt, beside, text):
    assert in_seconds(dt, beside) == text


def test_a_figure_has_the_files_own_point_and_says_its_number(result):
    lines = {"Euler": [(1e-3, 0.01), (6e-4, 0.1)], "implicitfast": [(1e-3, 0.002), (0.2, 0.9)]}
    result.curves["step response"] = {"posture": "p", "rows": limits(), "lines": lines}
    name, fig, caption = figures_step.draw_step_response(result, None)
    (own,) = (line for line in fig.axes[0].lines if line.get_marker() == "*")
    assert own.get_xydata().tolist() == [[0.002, 0.004]] and "0.4 %" in caption and name == "stability_step_response"
    assert fig.axes[0].get_xscale() == fig.axes[0].get_yscale() == "log"
