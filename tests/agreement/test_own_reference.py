"""Equations of one's own from the command line: what is loaded, compared and left out, and each bad reference."""

import json
import sys
from pathlib import Path
from tempfile import mkdtemp
from types import SimpleNamespace

import numpy
import numpy as np
import pytest
from helpers import own_equations
from helpers.in_process import InProcess, Lines, answered, without_workers

from compare.cli import command_line
from compare.core.text import say
from compare.engines.own import OwnError
from compare.engines.own.own_file import own_object
from compare.experiments import EXPERIMENTS, skipped
from compare.experiments.setup import Setup, engines
from compare.run import command
from compare.run import examine as experiment
from compare.run.reference import compared_with

STATIC = ["mass", "gravity", "acceleration"]
ALL = "all", "--quick", "--mjcf", "double.xml", "--reference"
OTHERS = [name for name in EXPERIMENTS if name not in (*STATIC, "trajectory", "diagnosis")]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    before = set(sys.modules)
    own_equations.write(tmp_path)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    for name in set(sys.modules) - before:  # of other tests' folders
        if str(tmp_path) in (getattr(sys.modules[name], "__file__", None) or ""):
            del sys.modules[name]
    assert not list(tmp_path.rglob("__pycache__"))


IDLE = SimpleNamespace(submit=lambda *_: SimpleNamespace(result=list))  # workers that draw nothing


def examined(folder, asked, names, mjcf="double.xml", joints=None, states=30, workers=IDLE):
    """Experiments with equations of one's own, in this process: sections, causes, the robot, the checks that fail."""
    reference, robot, mujoco, reading = compared_with(asked, str(mjcf), joints)
    of = {"states": states, "exact_states": 1, "finer": (1,), "size": "quick", "reading": reading}
    setup = Setup(robot, engines(mujoco, reference.own), **of)
    run = experiment.Run(names, setup, Path(mkdtemp(dir=folder)), Lines(), workers).examined()
    failed = [check for section in run.sections for check in section.result.checks if not check.passed]
    return SimpleNamespace(sections=run.sections, causes=run.causes, robot=robot, failed=failed)


@pytest.mark.parametrize("asked, joints", [
    ("mine.py:Object", None), ("mine.py:named", None), ("mine.py:swapped", "knee,hip"),
])  # fmt: skip
def test_right_equations_agree_in_whatever_form(folder, asked, joints):
    run = examined(folder, asked, STATIC, joints=joints)
    assert not run.failed and all(section.result.checks for section in run.sections)
    quantities = {row.quantity for section in run.sections for row in section.result.rows}
    assert ("energy above the zero position's" in quantities) == ("energy" in run.robot.own)


@pytest.mark.parametrize("asked, names, where, quantity", [
    ("sign", STATIC, "acceleration", "bias"), ("doubled", STATIC, "gravity", "yours: gravity - bias at rest"),
    ("nan", ["diagnosis"], "diagnosis", "bias returns valid values"),
    ("nan", ["acceleration"], "acceleration", "bias returns valid values"),
    ("late", ["mass", "acceleration"], "acceleration", "bias returns valid values"),
])  # fmt: skip
def test_what_is_wrong_is_seen_where_it_acts(folder, asked, names, where, quantity):
    run = examined(folder, f"mine.py:{asked}", names)
    quantities = {check.quantity for check in run.failed}
    assert {check.experiment for check in run.failed} == {where} and quantity in quantities
    assert "runs to its end" not in quantities


def test_one_slip_is_one_cause_beneath_the_first_experiment_that_differs(folder, capsys):
    """What explains the same is beneath it, and what own equations do not serve is one line."""
    those = {name: EXPERIMENTS[name] for name in (*STATIC, *OTHERS[:3], "diagnosis")}
    with pytest.MonkeyPatch.context() as patch, without_workers():
        for module in (command, command_line, experiment):
            patch.setattr(module, "EXPERIMENTS", those)
        status, out, _ = answered([*ALL, "mine.py:sign"], capsys)
    lines, words = out.splitlines(), [line.split()[:2] for line in out.splitlines() if line]
    at = words.index(["acceleration", "differs"])
    assert status == 1 and words[at + 1] == ["CAUSE", "h[hip],"]
    assert sum(line[0] == "CAUSE" for line in words) == 1
    assert ["double.xml", "and"] in words and "3 experiments need more than mass_matrix and bias." in lines
    assert "With the cause mended, M and h agree at all 24 states of the search." in lines
    assert not {"parameters", "FAIL"} & {line[0] for line in words} and max(map(len, lines)) <= 100
    (cause,) = json.loads(Path("reports/latest/results.json").read_text())["causes"]
    _, *others = cause["text"].split("; or ")
    assert others and [f"     or {x}" for x in others] == [x for x in lines if x.startswith("     or ")]


def said_of(bias, folder, capsys) -> str:
    """What a run says that differs, of the equations with another bias."""
    (folder / "holed.py").write_text(f"from mine import *\n\nholed = changed(bias=lambda q, v: {bias})\n")
    with without_workers():
        status, out, _ = answered([*ALL, "holed.py:holed"], capsys)
    words = " ".join(out.split())
    assert status == 1 and "With the cause mended" not in words
    return words


def test_an_entry_that_is_never_finite_is_named_and_has_no_cause(folder, capsys):
    """h[hip] is NaN, h[knee] is 0: that your h is 0 would be untrue."""
    words = said_of("np.array([np.nan, 0.0])", folder, capsys)
    assert "bias[0] is not finite" in words and "CAUSE" not in words
    assert "h[hip] is not finite" in Path("reports/latest/report.md").read_text(encoding="utf-8")


def test_what_is_finite_at_some_states_has_a_cause_there(folder, capsys):
    words = said_of("0.0 * v + (np.nan if q[0] > 1.0 else 0.0)", folder, capsys)
    assert 0 < words.index("bias is not finite") < words.index("CAUSE ")


def test_torques_that_act_with_gears_are_one_cause_in_words(folder):
    geared = "lambda q, v, tau: acceleration(q, v, [25.0, 2.0] * tau)"
    (folder / "gears.py").write_text(f"from mine import *\n\ngears = changed(acceleration={geared})\n")
    (cause,) = examined(folder, "gears.py:gears", ["acceleration", "diagnosis"]).causes
    for name, gear in (("hip", 25), ("knee", 2)):
        assert f"tau of {name}: your acceleration takes {gear} times it" in cause.text


def test_accelerations_or_inverse_dynamics_alone_are_a_reference(folder):
    names = [*STATIC, "trajectory", "diagnosis"]
    asked = [name for name in names if not skipped(name, examined(folder, "mine.py:alone", []).robot)]
    assert asked == ["acceleration", "trajectory", "diagnosis"]
    assert not examined(folder, "mine.py:alone", asked).failed
    assert not examined(folder, "mine.py:inverse", STATIC).failed
    of_sign = "h[hip], coefficient of knee'^2"
    for reference, place in (("alone_sign", of_sign), ("alone_damped", "damping of hip")):
        run = examined(folder, f"mine.py:{reference}", ["acceleration", "diagnosis"])
        assert run.causes[0].place == place
        assert {check.experiment for check in run.failed} == {"acceleration", "diagnosis"}


def test_slow_equations_get_fewer_states_no_scenes_and_a_cause(folder):
    run = examined(folder, "mine.py:slow_sign", ["mass", "trajectory"], states=5000)
    mass, trajectory = (section.result for section in run.sections)
    (states,) = {row.states for row in mass.rows if row.scene == "random states"}
    assert 1 <= states < 5000 and mass.notes
    assert trajectory.notes and not trajectory.checks and not run.failed
    run = examined(folder, "mine.py:slow_sign", ["diagnosis"])
    assert run.failed and run.causes


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_equations_without_any_use_are_compared_to_the_end(folder):
    names = ["acceleration", "trajectory", "diagnosis"]
    run = examined(folder, "mine.py:infinite", names, workers=InProcess())
    found = {check.quantity for check in run.failed}
    assert any(one.startswith("bias") for one in found) and "runs to its end" not in found
    assert not any(one.startswith("figure") for one in found)
    for section in run.sections:
        for text in (section.title, section.claim, *(caption for _, caption in section.figures)):
            assert "TMT" not in text and "nan" not in text


def test_what_nothing_explains_is_drawn_along_the_coordinate_that_tells_most(folder):
    """h[hip] has sin(5 knee) too much."""
    odd = "lambda q, v: bias(q, v) + [np.sin(5 * q[1]) + q[0] / 9, 0]"
    (folder / "odd.py").write_text(f"from mine import *\n\nodd = changed(bias={odd})\n")
    run = examined(folder, "odd.py:odd", ["diagnosis"], workers=InProcess())
    (section,) = run.sections
    curve = section.result.curve
    assert (curve.entry, curve.coordinate) == ("h[hip]", "knee") and not run.causes
    assert np.ptp(curve.yours - curve.right) == pytest.approx(2.0, rel=0.03)
    assert [name for name, _ in section.figures] == ["diagnosis_curve"]


def test_a_report_has_what_can_be_compared_and_the_rest_gets_status_2(inside, folder, capsys):
    robot = compared_with("mine.py:", "double.xml").robot
    assert [name for name in EXPERIMENTS if (reason := skipped(name, robot)) and say(reason)] == OTHERS
    asked = ["--quick", "--mjcf", "double.xml", "--reference", "mine.py:Object", "--out", "out"]
    status, out, err = answered(["speed", *asked], capsys)
    assert (status, out) == (2, "") and "speed does not apply to double" in err.splitlines()[-1]
    status, out, err = answered(["gravity", "--joints=-hip,knee", *asked], capsys)
    assert (status, err) == (1, "a user's file may print\n")
    assert out.startswith("\ndouble.xml and mine.py:Object differ")
    results = json.loads((folder / "out" / "results.json").read_text(encoding="utf-8"))
    assert results["reference"] == {"kind": "own", "name": "mine.py:Object"} and not results["passed"]
    assert {path.name for path in folder.iterdir()} == {"double.xml", "mine.py", "numbers_beside.py", "out"}


BROKEN = "x = 1\ndef mass_matrix(q:\n"


@pytest.mark.parametrize("asked, word", [
    ("nowhere/mine.py:Object", "nowhere/mine.py"), ("mne:Object", "mine"), ("no such:Object", "'no such'"),
    (":Object", "':Object'"), ("./:Object", "folder"), ("mine.py:inside.also", "no 'inside.also'"),
    ("mine.py:insied", "known: inside"),
    ("broken.py:", "broken.py, line 2: SyntaxError"), ("broken:", "broken, line 2: SyntaxError"),
    ("leaving.py:x", "leaving.py, line 2: SystemExit: 3"), ("mine.py:Needing", "'mass'"),
    ("mine.py:&--joints&-hip,ankle", "'ankle'"), ("values.csv", "compare.assert_agrees"), ("mine", "FILE.py,"),
    ("zeros.py", "zeros.py: "),
])  # fmt: skip
def test_a_bad_reference_gets_one_line_and_status_2(folder, capsys, asked, word):
    (folder / "broken.py").write_text(BROKEN)
    (folder / "zeros.py").write_bytes(b"x = 1\0")
    (folder / "leaving.py").write_text("import sys\nsys.exit(3)\n")
    before = sorted(folder.iterdir())
    words = ["mass", "--quick", "--mjcf", "double.xml", "--reference", *asked.split("&")]
    status, out, err = answered(words, capsys)
    lines = [line for line in err.splitlines() if line != "a user's file may print"]
    assert (status, out, len(lines)) == (2, "", 1)
    assert lines[0].startswith("python -m compare: ") and word in lines[0] and "None" not in lines[0]
    assert sorted(folder.iterdir()) == before


def test_a_file_shadows_no_package_and_finds_the_modules_beside_it(folder):
    (folder / "numpy.py").write_text("import numpy\nfrom numbers_beside import g\npi = numpy.pi\n")
    (folder / "broken.py").write_text(BROKEN)
    assert own_object("numpy.py:").g == 9.81
    assert own_object("numpy.py:pi") == numpy.pi and sys.modules["numpy"] is numpy
    path = list(sys.path)
    with pytest.raises(OwnError):
        own_object("broken.py:")
    assert sys.path == path
