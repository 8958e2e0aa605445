"""`compare diagnosis`: a file or one's own equations beside the reference, and its place beside other experiments."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from edited import XML, setup_of
from small_runs import Here, Lines

from compare import experiment
from compare.experiments import diagnosis, module
from compare.experiments.diagnosis import single_steps
from compare.judge.check import Result

HEAVY = XML.replace('mass="1.5"', 'mass="1.51"')
DAMPED = XML.replace('axis="1 0 0"/>', 'axis="1 0 0" damping="0.1"/>')


def checks(text):
    return diagnosis.rows(setup_of(text)).checks


def test_the_arm_has_nothing_to_explain():
    setup = setup_of()
    result = diagnosis.rows(setup)
    assert all(check.passed for check in result.checks) and result.rows == []
    assert result.notes == ["There is nothing to explain: Mbar, h and accelerations agree."]
    assert result.checks[0].note == "nothing to explain"
    steps = [check.quantity for check in result.checks if "one step of" in check.quantity]
    assert len(steps) == len(setup.engines["mujoco"].methods)


def test_a_cause_is_a_row_and_the_note_of_the_check_that_fails():
    result = diagnosis.rows(setup_of(HEAVY))
    (row,) = result.rows
    assert list(row) == ["rank", "kind", "place", "stated", "explains", "unit", "left_over", "tied"]
    assert (row["rank"], row["kind"], row["place"], row["stated"], row["unit"], row["tied"]) == (
        2, "number", "mass of forearm", 1.5, "kg", 0,
    )  # fmt: skip
    assert row["explains"] == pytest.approx(1.51, rel=1e-12)
    (failed,) = [check for check in result.checks if not check.passed]
    assert failed.note == "mass of forearm: 1.51 kg in place of 1.5 would explain it."
    (cause,) = result.curves["causes"]
    assert set(cause) == {"rank", "place", "stated", "found", "text"}


def test_damping_is_seen_in_accelerations_alone():
    result = diagnosis.rows(setup_of(DAMPED))
    failed = [check for check in result.checks if not check.passed]
    assert [row["place"] for row in result.rows] == ["damping of beta"]
    assert len(failed) == 1 and "accelerations follow from M and h" in failed[0].quantity


def test_a_wrong_integrator_is_named_where_all_else_agrees(monkeypatch):
    setup = setup_of()
    methods = {name: m._replace(scheme="implicit" if name == "Euler" else m.scheme)
               for name, m in setup.engines["mujoco"].methods.items()}  # fmt: skip
    setup.engines["mujoco"].methods = methods
    result = diagnosis.rows(setup)
    (failed,) = [check for check in result.checks if not check.passed]
    assert "Euler" in failed.quantity and "scheme: semi_implicit_euler in place of implicit" in failed.note


def test_steps_of_many_joints_are_left_out(monkeypatch):
    monkeypatch.setattr(single_steps, "MOST_SPEEDS_STEPPED", 2)
    assert not any("one step" in check.quantity for check in checks(XML))


@pytest.mark.parametrize("ratio, passes", [(0.999, True), (1.0, True), (1.001, False)])
def test_a_ratio_of_one_is_allowed(ratio, passes):
    setup = setup_of()
    found = diagnosis.diagnosed(setup)
    setup.background["diagnosis"] = found._replace(ratio=ratio, steps=())
    assert diagnosis.rows(setup).checks[0].passed is passes
    setup.background["diagnosis"] = found._replace(force_ratio=ratio, steps=())
    assert diagnosis.rows(setup).checks[1].passed is passes


def examined(names, text, folder):
    lines = Lines()
    return (*experiment.examine(names, setup_of(text), Path(folder), lines, Here()), lines)


def test_beside_others_it_is_skipped_where_nothing_failed(tmp_path):
    sections, causes, reasons, lines = examined(["mass", "diagnosis"], XML, tmp_path)
    assert [section.name for section in sections] == ["mass"] and causes == []
    assert reasons == {"diagnosis": "nothing failed"}
    assert "diagnosis     skipped: nothing failed" in lines


def test_beside_others_it_is_made_where_one_fails(tmp_path):
    sections, causes, reasons, _ = examined(["mass", "diagnosis"], HEAVY, tmp_path)
    assert [section.name for section in sections] == ["mass", "diagnosis"] and reasons == {}
    assert [cause["text"] for cause in causes] == ["mass of forearm: stated 1.5 kg, compiled 1.51 kg"]


def test_alone_it_is_never_skipped(tmp_path):
    sections, *_ = examined(["diagnosis"], XML, tmp_path)
    assert [section.name for section in sections] == ["diagnosis"]


def test_what_parameters_do_not_name_is_sought_in_the_values(tmp_path, monkeypatch):
    monkeypatch.setattr(experiment, "find_causes", lambda setup: [])
    _, causes, *_ = examined(["mass"], HEAVY, tmp_path)
    assert [cause["text"] for cause in causes] == ["mass of forearm: 1.51 kg in place of 1.5 would explain it"]


def test_figures_say_what_is_left():
    result = diagnosis.rows(setup_of(HEAVY))
    ((name, figure, caption),) = [draw() for draw in diagnosis.figures(result, None)]
    assert name == "diagnosis_nearest" and "mass of forearm leaves" in caption
    (ax,) = figure.axes
    assert ax.get_xscale() == "log" and ax.get_xlabel() and len(ax.patches) == len(result.curves["nearest"])
    assert list(diagnosis.figures(Result("diagnosis"), None)) == []


def test_values_that_are_no_numbers_fail():
    setup = setup_of()
    mujoco = setup.engines["mujoco"]
    right = mujoco.of

    def broken(case):
        dynamics = right(case)
        values = {name: getattr(dynamics, name) for name in ("bias", "acceleration")}
        return SimpleNamespace(mass_matrix=lambda q: dynamics.mass_matrix(q) * np.nan, **values)

    mujoco.of = broken
    assert not diagnosis.rows(setup).checks[0].passed


def test_it_is_the_module_of_its_name():
    assert module("diagnosis") is diagnosis
