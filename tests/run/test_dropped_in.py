"""An experiment and an engine are one file and one row each: added to a copy of the package, every command has them."""

import csv
import json
import shutil

import numpy as np
import pytest
from helpers.runs import ROOT, compare
from matplotlib.image import imread

PENDULUM = """<mujoco model="pendulum"><worldbody><body><joint name="hip" axis="0 1 0" damping="0.3"/>
<inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.02"/></body></worldbody></mujoco>"""
ENGINE = '''"""TMT's RK4 under another name."""

from ..engines import Method
from .tmt import Tmt


class Twin(Tmt):
    name = "twin"
    methods = {"rk4": Method("twin", "rk4", 4, "rk4")}


def engine(schemes):
    return Twin(schemes)
'''
EXPERIMENT = '''"""The trace of the mass matrix."""

from functools import partial

from matplotlib.figure import Figure

from ..core.check import Result


def rows(setup):
    values = [setup.engines[name].of(setup.robot.case()).mass_matrix(setup.named.q) for name in ("twin", "mujoco")]
    difference = abs(values[0] - values[1]).max()
    result = Result("trace", label="Twin")
    result.check("named postures", "trace of Mbar, Twin - MuJoCo", 0.5e-9 + difference, 1e-9, "kg m2", rounding=True)
    result.find("postures", count=len(setup.named.q))
    return result


def figures(result, robot):
    yield partial(drawn, result)


def drawn(result):
    return "trace", Figure(), result.finding("picture", count=3)
'''
TEXT = """{% macro summary() %}the trace of the mass matrix{% endmacro %}
{% macro title(robot) %}Trace of the {{ robot.noun }}'s mass matrix{% endmacro %}
{% macro help() %}The trace of the mass matrix.{% endmacro %}
{% macro claim(robot, values) %}The traces are equal.{% endmacro %}
{% macro tolerance(robot, values) %}1e-9 kg m2.{% endmacro %}
{% macro postures(count) %}Compared at {{ count }} postures.{% endmacro %}
{% macro picture(count) %}A caption with the number {{ count }}.{% endmacro %}
"""


@pytest.fixture
def copy(tmp_path):
    """A copy of the package with both files dropped in, and a folder of models."""
    root = tmp_path / "copy"
    for name in ("compare", "mjcf", "tmt"):
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    (root / "compare/engines/twin.py").write_text(ENGINE)
    record = 'EngineRecord("Twin", colour="#123456", marker="P", in_quick_runs=True)'
    for folder, before, row in (
        ("engines", "newton", f'"twin": {record}'),
        ("experiments", "gravity", '"trace": Experiment()'),
    ):
        file = root / "compare" / folder / "__init__.py"
        text = file.read_text()
        assert text.count(f'    "{before}": ') == 1
        file.write_text(text.replace(f'    "{before}": ', f'    {row},\n    "{before}": '))
    (root / "compare/experiments/trace.py").write_text(EXPERIMENT)
    (root / "compare/experiments/trace.md.jinja").write_text(TEXT)
    (root / "models").mkdir()
    (root / "models/pendulum.xml").write_text(PENDULUM)
    return root


def output(root, *arguments):
    run = compare(*arguments, cwd=root, env={"PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"})
    assert run.returncode == 0, run.stdout + run.stderr
    return run.stdout


@pytest.mark.slow
def test_all_and_a_fleet_run_them_and_the_report_the_chart_of_speed_and_the_table_have_them(copy):
    assert "the trace of the mass matrix" in output(copy, "--help")
    assert "trace" in output(copy, "all", "--quick", "--mjcf", "models/pendulum.xml", "--out", "report")
    checks = json.loads((copy / "report/results.json").read_text())["checks"]
    values = [check["value"] for check in checks if check["experiment"] == "trace"]
    assert values == pytest.approx([0.5e-9], rel=1e-3)
    report = (copy / "report/report.md").read_text()
    assert "Trace of the" in report and "Compared at" in report and "A caption with the number 3." in report
    with open(copy / "report/tables/speed.csv", newline="") as file:
        assert {row["engine"] for row in csv.DictReader(file)} == {"mujoco", "tmt", "twin"}
    colours = imread(copy / "report/figures/overview_times.png")[..., :3].reshape(-1, 3)
    assert (abs(colours - np.array([0x12, 0x34, 0x56]) / 255.0) < 0.02).all(axis=1).any()  # of a palette
    output(copy, "fleet", "models", "--only", "trace", "--out", "fleet", "--workers", "1")
    with open(copy / "fleet/fleet.csv", newline="") as file:
        (row,) = csv.DictReader(file)
    assert row["verdict"] == "self-consistent" and float(row["worst_ratio"]) == pytest.approx(0.5, rel=1e-3)
