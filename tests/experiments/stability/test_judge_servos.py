"""Tolerances and rules of the step under servos, just inside and just outside, and what is said first; no runs."""

from types import SimpleNamespace

import numpy as np
import pytest

from compare.experiments.stability import servos
from compare.experiments.stability.servos import figures_step
from compare.experiments.stability.servos.predicted import Steps
from compare.experiments.stability.servos.sentences import at_the_top, shaking


def row(**more):
    """A row of step_limits.csv."""
    return {
        "posture": "p", "base": "fixed", "integrator": "Euler", "limit": "finite", "predicted_dt_s": 0.1, "file_dt_s": 0.1,
        "observed_dt_s": None, "file_integrator": "Euler", "limiting_joint": "joint7", "stable_at_file_dt": None,
        "step_response_error": None,
    } | more  # fmt: skip


NONE = {"limit": "none", "predicted_dt_s": None}


@pytest.mark.parametrize("more, kind, passed", [
    ({"observed_dt_s": 0.100999}, "finite", [True]), ({"observed_dt_s": 0.10101}, "finite", [False]),
    ({"observed_dt_s": 0.099001}, "finite", [True]), ({"observed_dt_s": 0.09899}, "finite", [False]),
    ({}, "none", [False]), ({}, "always", [False]), (NONE, "none", []), (NONE | {"observed_dt_s": 1.0}, "finite", [False]),
    # below the shortest step that is tried nothing is compared
    ({"predicted_dt_s": 0.99e-7}, "always", []), ({"predicted_dt_s": 1.01e-7}, "always", [False]),
])  # fmt: skip
def test_an_observed_limit_is_within_a_hundredth(result, more, kind, passed):
    servos.check_observed(result, row(**more), kind, False)
    assert [check.passed for check in result.checks] == passed


@pytest.mark.parametrize("apart, beside, passed", [
    (0.99e-6, 0.99e-4, [True, True]), (1.01e-6, 1.01e-4, [False, False]), (None, None, []), (np.inf, np.nan, [False, False]),
])  # fmt: skip
def test_forms_of_a_limit_and_growth_of_a_step(result, apart, beside, passed):
    one = SimpleNamespace(name="p", at=SimpleNamespace(bases=("fixed",)))
    servos.check_steps(result, one, [Steps("fixed", "Euler", apart, beside)])
    assert [check.passed for check in result.checks] == passed


@pytest.mark.parametrize("more, passed", [
    ({}, [True]), ({"file_dt_s": 0.1001}, [False]), ({"base": "locked"}, []), ({"integrator": "RK4"}, []), (NONE, [True]),
    ({"limit": "saddle", "predicted_dt_s": None}, []),
])  # fmt: skip
def test_a_step_is_stable_up_to_its_limit_where_one_counts(result, more, passed):
    servos.check_own_step(result, [row(**more)])
    assert [check.passed for check in result.checks] == passed


# what is said first


def limits(own=0.2, euler=6e-4, file="implicitfast"):
    """Rows of postures p, q under the file's integrator and Euler: a limit, s, None for none, or a word for another kind."""
    rows = []
    for integrator, places in (("Euler", euler), (file, own)):
        for name, limit in zip("pq", places if isinstance(places, tuple) else (places,)):
            kind = limit if isinstance(limit, str) else "finite" if limit else "none"
            dt = limit if kind == "finite" else None
            rows.append(row(
                posture=name, integrator=integrator, limit=kind, predicted_dt_s=dt, file_dt_s=2e-3, file_integrator=file,
                stable_at_file_dt=dt is None or dt >= 2e-3, step_response_error=0.34))  # fmt: skip
    return rows


def run(integrator, speed, stable, posture="p"):
    """A row of full_model.csv."""
    return {
        "posture": posture, "integrator": integrator, "rms_speed": speed, "warnings": 1, "resets": 0,
        "predicted_stable": stable, "calm": speed is not None and speed < 1e-3,
    }  # fmt: skip


@pytest.mark.parametrize("rows, begins, numbers", [
    (limits(), "Stable", ["2 ms", "0.2 s, joint7", "0.6 ms, joint7", "34 %"]),
    (limits(euler=None), "Stable", ["0.2 s, joint7", "5 s"]),
    (limits(own=1e-3, euler=0.1), "Not stable", ["1 ms, joint7", "0.1 s, joint7"]),
    (limits(file="Euler", own=1.991e-3, euler=()), "Not stable", ["1.991 ms, joint7"]),
    (limits(own=(1e-3, 0.1), euler=1.0), "Not stable", ["1 ms, joint7", "p"]),
    (limits(own=(0.1, "saddle"), euler=0.1), "Stable", ["0.1 s, joint7", "q: a saddle"]),
    (limits(own=("drifts", "not_at_rest"), euler=()), "Whether", ["p: ", "q: "]),
])  # fmt: skip
def test_the_first_words_say_whether_the_step_is_stable_and_its_limits(rows, begins, numbers):
    text = at_the_top(rows, [])
    assert text.startswith(begins) and all(number in text for number in numbers)


@pytest.mark.parametrize("full, kind", [
    ([], ""), ([run("Euler", 0.4, False)], "shakes"), ([run("Euler", 1e-5, False)], "calm"),
    ([run("Euler", None, False)], "shakes"),
    # beside what it does under an integrator that is stable
    ([run("Euler", 0.99, False), run("RK4", 0.1, True)], "both"),
    ([run("Euler", 1.01, False), run("RK4", 0.1, True)], "shakes"),
    # at one posture of several
    ([run("Euler", 1e-5, False), run("Euler", 0.4, False, "q")], "shakes"),
])  # fmt: skip
def test_what_the_full_model_does_where_a_step_is_not_stable(full, kind):
    found, warned = shaking(full, limits(own=(), euler=(1e-3, 1e-3)))
    assert found == kind and ("1 warning" in warned) is (kind == "shakes")
    assert (at_the_top(limits(), full) != at_the_top(limits(), [])) is bool(full)


def test_a_figure_has_the_files_own_point_and_says_its_number(result):
    lines = {"Euler": [(1e-3, 0.01), (6e-4, 0.1)], "implicitfast": [(1e-3, 0.002), (0.2, 0.9)]}
    result.curves["step response"] = {"posture": "p", "rows": limits(), "lines": lines}
    _, fig, caption = figures_step.draw_step_response(result, None)
    (own,) = (line for line in fig.axes[0].lines if line.get_marker() == "*")
    assert own.get_xydata().tolist() == [[0.002, 0.34]] and "34 %" in caption
