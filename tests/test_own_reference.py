"""Equations of one's own from the command line: what is loaded, compared and left out, and each bad reference."""

import json
import sys
from types import SimpleNamespace

import own_equations
import pytest
from in_process import runs_in_this_process as runs_in_this_process
from models import PATHS
from small_runs import Here, Lines

from compare import experiment
from compare.__main__ import main
from compare.experiments import EXPERIMENTS, skipped
from compare.own_file import OwnFileError, own_object
from compare.reference import compared_with
from compare.setup import Setup, engines

OTHERS = ("parameters", "published", "kinematics", "speed", "stability", "reduction")
STATIC = ["mass", "gravity", "acceleration"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A user's folder, in which one works."""
    before = set(sys.modules)
    own_equations.write(tmp_path)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    for name in set(sys.modules) - before:  # of other tests' folders
        if getattr(sys.modules[name], "__file__", None) and str(tmp_path) in sys.modules[name].__file__:
            del sys.modules[name]
    assert not list(tmp_path.rglob("__pycache__"))


class Idle:
    """Workers that draw nothing."""

    def submit(self, function, *arguments):
        return SimpleNamespace(result=lambda: ([], []))


def examined(folder, asked, names, mjcf="double.xml", joints=None, states=30, draws=False):
    """Experiments with equations of one's own, in this process: sections, the setup; draws: their figures too."""
    reference, robot, mujoco, reading = compared_with(asked, str(mjcf), joints)
    of = {"states": states, "exact_states": 1, "finer": (1, 2), "size": "quick", "reading": reading}
    setup = Setup(robot, engines(mujoco, reference.own), **of)
    place = folder / f"out{len(list(folder.iterdir()))}"
    place.mkdir()
    sections, causes, _ = experiment.examine(names, setup, place, Lines(), Here() if draws else Idle())
    checks = [check for section in sections for check in section.result.checks]
    failed = [check for check in checks if not check.passed]
    return SimpleNamespace(
        sections=sections, causes=causes, setup=setup, reference=reference, checks=checks, failed=failed
    )


def rows_of(run):
    return [row for section in run.sections for row in section.result.rows]


# what is compared


@pytest.mark.parametrize("asked, joints", [
    ("mine.py:", None), ("mine:", None), ("mine.py:Object", None), ("mine:inside.also", None), ("mine.py:of_symbols", None),
    ("mine.py:mirrored", None), ("mine.py:swapped", "knee,hip"),
    ("mine.py:", "-hip,-knee"),  # the double pendulum is its own mirror image
])  # fmt: skip
def test_right_equations_agree_in_whatever_form(folder, asked, joints):
    run = examined(folder, asked, STATIC, joints=joints, draws=asked == "mine.py:Object")
    assert not run.failed and all(section.result.checks for section in run.sections)
    assert (run.reference.kind, run.reference.name) == ("own", asked)
    captions = [caption for section in run.sections for _, caption in section.figures]
    notes = [note for section in run.sections for note in section.result.notes]
    said = [text for s in run.sections for text in (s.title, s.claim)] + notes + captions
    assert not any("TMT" in text for text in said + [check.quantity for check in run.checks])
    has_energy = "energy" in run.setup.robot.own
    quantities = {row["quantity"] for row in rows_of(run)}
    assert ("yours: torque - dV/dq" in quantities) == ("energy above the zero position's" in quantities) == has_energy


@pytest.mark.parametrize("name", ["pendulum_ball", pytest.param("gripper", marks=pytest.mark.slow)])
def test_the_tree_of_another_robot_agrees(folder, name):
    text = "from pathlib import Path\nfrom compare.engines.mujoco import read\n"
    (folder / "trees.py").write_text(f"{text}tree = read(Path({str(PATHS[name])!r})).tree\n")
    run = examined(folder, "trees.py:tree", ["kinematics", *STATIC], PATHS[name])
    assert not run.failed and {row["quantity"] for row in run.sections[0].result.rows} == {"x_b", "T_b", "B_b"}


def test_without_a_file_it_is_the_arms_own(folder):
    (folder / "arm.py").write_text("from tmt import ARM, mass_matrix, bias\n")
    for asked in ("arm.py:", "arm.py:ARM"):
        reference, robot, _, reading = compared_with(asked, None)
        assert reference.kind == "own" and "mjcf/arm.xml" in reference.lines[0] and asked in reference.lines[0]
        assert robot.joints == ("alpha", "beta", "gamma") and robot.is_read and reading is not None


@pytest.mark.parametrize("more", [[], pytest.param(["trajectory"], marks=pytest.mark.slow)])
def test_a_wrong_sign_is_seen_where_it_acts(folder, more):
    run = examined(folder, "mine.py:sign", [*STATIC, *more])
    assert {check.experiment for check in run.failed} == {"acceleration", *more} and run.failed[0].quantity == "bias"


def test_trajectories_are_those_of_rk4(folder):
    run = examined(folder, "mine.py:Object", ["trajectory"])
    assert run.checks and not run.failed
    levels = ("derivative", "one step", "open loop")
    assert {(row["engine_integrator"], row["level"]) for row in rows_of(run)} == {("RK4", level) for level in levels}
    assert len({row["dt_s"] for row in rows_of(run)}) == 2


def test_slow_equations_get_fewer_states_and_no_scenes(folder):
    run = examined(folder, "mine.py:slowly", ["mass", "trajectory"], states=5000)
    rows = [row for row in run.sections[0].result.rows if row["scene"] == "random states"]
    assert 1 <= rows[0]["states"] < 5000 and any("5,000" in note for note in run.sections[0].result.notes)
    assert run.sections[1].result.notes and not run.sections[1].result.checks


@pytest.mark.parametrize("name, experiments, quantity, word", [
    ("nan", ["mass", "gravity"], "bias", "finite at q = ["), ("late", ["acceleration"], "bias", "ArithmeticError: too far"),
    ("skew", ["mass"], "mass_matrix", "symmetric at q = ["), ("changes", ["mass"], "mass_matrix", "argument q at q = ["),
])  # fmt: skip
def test_what_is_wrong_at_some_states_is_a_failed_check_with_the_state(folder, name, experiments, quantity, word):
    run = examined(folder, f"mine.py:{name}", experiments, draws=name == "nan")
    first = run.failed[0]
    assert first.quantity == f"{quantity} gives what it should" and word in first.note
    assert (first.experiment, first.value) == (experiments[-1], None)
    captions = " ".join(caption for section in run.sections for _, caption in section.figures)
    assert "nan" not in captions and all(check.quantity != "runs to its end" for check in run.failed)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("name, quantity", [("singular", "mass_matrix"), ("infinite", "bias")])
def test_equations_without_any_use_are_compared_to_the_end(folder, name, quantity):
    run = examined(folder, f"mine.py:{name}", [*STATIC, "trajectory", "diagnosis"], draws=name == "infinite")
    found = {check.quantity for check in run.failed}
    assert any(one.startswith(quantity) for one in found) and not any(one.startswith("figure") for one in found)
    assert "runs to its end" not in found


def test_gravity_of_ones_own_is_compared_with_the_bias_at_rest_too(folder):
    run = examined(folder, "mine.py:doubled", ["gravity", "acceleration"])
    assert {"holding torque", "yours: gravity - bias at rest"} <= {check.quantity for check in run.failed}
    assert {check.experiment for check in run.failed} == {"gravity"}


# what is left out


@pytest.mark.parametrize("name", OTHERS)
def test_experiments_that_need_more_get_status_2(folder, capsys, name):
    robot = compared_with("mine.py:", "double.xml").robot
    assert {name for name in EXPERIMENTS if skipped(name, robot)} == set(OTHERS)
    assert main([name, "--quick", "--mjcf", "double.xml", "--reference", "mine.py:Object"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and name in err.splitlines()[-1] and "double" in err.splitlines()[-1]


@pytest.mark.parametrize("more, status", [
    pytest.param(["all"], 0, marks=pytest.mark.slow), (["gravity", "--joints", "-hip,knee"], 1),
])  # fmt: skip
def test_a_report_of_what_can_be_compared(inside, folder, capsys, more, status):
    asked = ["--quick", "--mjcf", "double.xml", "--reference", "mine.py:Object", "--out", "out"]
    assert main([*more, *asked]) == status
    out, err = capsys.readouterr()
    assert out.startswith("reference: own; double.xml ") and err == "a user's file may print\n"
    results = json.loads((folder / "out" / "results.json").read_text(encoding="utf-8"))
    assert results["reference"] == {"kind": "own", "name": "mine.py:Object"}
    assert results["passed"] is (status == 0)
    assert [skip["experiment"] for skip in results["skipped"]][:6] == list(OTHERS) * (more == ["all"])
    assert (folder / "out" / "report.md").read_text(encoding="utf-8").startswith(out.splitlines()[0])
    assert {path.name for path in folder.iterdir()} == {"double.xml", "mine.py", "numbers_beside.py", "out"}


# bad references

BAD = {
    "broken.py": "x = 1\ndef mass_matrix(q:\n",
    "raising.py": "import math\n\nx = math.sqrt(-1.0)\n",
    "leaving.py": "import sys\nsys.exit(3)\n",
    "lacking.py": "import no_such_package\n",
    "null.py": "x = '\0'\n",
}


@pytest.mark.parametrize("asked, word", [
    ("mne.py:Object", "mine.py"), ("nowhere/mine.py:Object", "nowhere/mine.py"), ("no_such:Object", "no_such"),
    ("mne:Object", "mine"), ("no such:Object", "'no such'"), (":Object", "':Object'"), ("C:\\mine.py:Object", "C:\\mine.py"),
    ("./:Object", "folder"), ("mine.py:Objekt", "there is Object"), ("mine.py:inside.alsso", "there is also"),
    ("mine:Objekt", "there is Object"), ("broken.py:", "broken.py, line 2: SyntaxError"),
    ("broken:", "broken, line 2: SyntaxError"), ("raising.py:x", "raising.py, line 3: ValueError: math domain error"),
    ("raising:x", "raising, line 3: ValueError"), ("leaving.py:x", "leaving.py, line 2: SystemExit: 3"),
    ("lacking.py:x", "lacking.py, line 1: ModuleNotFoundError: No module named 'no_such_package'"),
    ("null.py:x", "null.py: SyntaxError"), ("double.xml:x", "double.xml, line 1: SyntaxError"),
    ("mine.py:Needing", "takes mass"), ("mine.py:Raising", "KeyError: 'mass'"), ("mine.py:complex_bias", "complex"),
    ("mine.py:short", "(1,); (2,)"), ("mine.py:first", "IndexError"), ("mine.py:no_bias", "bias"), ("mine.py:named", "'ankle'"),
    ("mine.py", "mine.py:OBJECT"), ("mine.py:&--joints&hip", "knee"), ("mine.py:&--joints&-hip,ankle", "'ankle'"),
])  # fmt: skip
def test_a_bad_reference_gets_one_line_and_status_2(folder, capsys, asked, word):
    for name, text in BAD.items():
        (folder / name).write_text(text)
    before = sorted(folder.iterdir())
    try:
        status = main(["mass", "--quick", "--mjcf", "double.xml", "--reference", *asked.split("&")])
    except SystemExit as stop:
        status = stop.code
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if line != "a user's file may print"]
    assert (status, out, len(lines)) == (2, "", 1) and lines[0].startswith("python -m compare: ") and word in lines[0]
    assert sorted(folder.iterdir()) == before


def test_a_file_shadows_no_package_and_finds_the_modules_beside_it(folder):
    (folder / "numpy.py").write_text("import numpy\nfrom numbers_beside import g\npi = numpy.pi\n")
    (folder / "broken.py").write_text(BAD["broken.py"])
    assert own_object("numpy.py:").g == 9.81
    import numpy

    assert own_object("numpy.py:pi") == numpy.pi and "numpy.py" not in numpy.__file__
    path = list(sys.path)
    with pytest.raises(OwnFileError):
        own_object("broken.py:")
    assert sys.path == path


# what explains a difference


@pytest.mark.parametrize("asked, joints, right", [
    ("mine.py:", "-hip,knee", "hip,knee"), ("mine.py:", "knee,hip", "hip,knee"),
    ("mine.py:swapped", None, "knee,hip"), ("mine.py:swapped", "-knee,hip", "knee,hip"),
])  # fmt: skip
def test_the_right_joints_are_named_in_place_of_the_stated_ones(folder, asked, joints, right):
    run = examined(folder, asked, ["diagnosis"], joints=joints)
    mirrored = ",".join(f"-{name}" for name in right.split(","))  # the mirror image of a double pendulum is the same
    assert any(f"--joints={one})" in cause["text"] for cause in run.causes for one in (right, mirrored))
    assert not examined(folder, asked, ["diagnosis"], joints=right).failed


def test_values_that_are_no_numbers_or_slow_are_diagnosed_as_far_as_that_goes(folder):
    run = examined(folder, "mine.py:nan", ["diagnosis"])
    assert run.failed[0].quantity == "bias gives what it should" and run.sections[0].result.notes
    run = examined(folder, "mine.py:slow_sign", ["diagnosis"])
    assert run.failed and run.causes
