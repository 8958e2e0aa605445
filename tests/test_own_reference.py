"""Equations of one's own from the command line: what is loaded, what is compared, what is left out, and each bad reference."""

import json
import sys
from types import SimpleNamespace

import own_equations
import pytest
from models import PATHS
from small_runs import Here, Lines

from compare import experiment
from compare.__main__ import main
from compare.experiments import EXPERIMENTS, skipped
from compare.own_file import OwnFileError, own_object
from compare.reference import compared_with
from compare.report import verdict
from compare.setup import Setup, engines

OTHERS = ("parameters", "published", "kinematics", "speed", "stability", "reduction")


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
    """Experiments with equations of one's own, in this process: sections, lines, the setup; draws: their figures too."""
    reference, robot, mujoco, reading = compared_with(asked, str(mjcf), joints)
    setup = Setup(
        robot,
        engines(mujoco, reference.own),
        states=states,
        exact_states=1,
        finer=(1, 2),
        size="quick",
        reading=reading,
    )
    place = folder / f"out{len(list(folder.iterdir()))}"
    place.mkdir()
    lines = Lines()
    sections, causes, _ = experiment.examine(names, setup, place, lines, Here() if draws else Idle())
    return SimpleNamespace(sections=sections, causes=causes, lines=lines, setup=setup, reference=reference)


def failed(run):
    return [check for section in run.sections for check in section.result.checks if not check.passed]


# what is compared


@pytest.mark.parametrize("asked, joints", [
    ("mine.py:", None), ("mine:", None), ("mine.py:Object", None), ("mine:inside.also", None), ("mine.py:of_symbols", None),
    ("mine.py:mirrored", None), ("mine.py:swapped", "knee,hip"),
    ("mine.py:", "-hip,-knee"),  # the double pendulum is its own mirror image
])  # fmt: skip
def test_right_equations_agree_in_whatever_form(folder, asked, joints):
    # captions are of equations with energy and without: they are the same in whatever form these stand
    draws = asked in ("mine.py:Object", "mine.py:of_symbols")
    run = examined(folder, asked, ["mass", "gravity", "acceleration"], joints=joints, draws=draws)
    assert all(bool(section.figures) == draws for section in run.sections)
    assert not failed(run) and all(section.result.checks for section in run.sections)
    assert run.reference.lines == (f"reference: own; double.xml compared with {asked}",)
    assert (run.reference.kind, run.reference.name) == ("own", asked)
    assert run.reference.compared == "Your equations and MuJoCo"
    said = "\n".join(
        text for s in run.sections for text in (s.title, s.claim, *s.result.notes, *(c for _, c in s.figures))
    )
    assert "TMT" not in said and all("TMT" not in check.quantity for s in run.sections for check in s.result.checks)
    has_energy = "energy" in run.setup.robot.own
    quantities = {row["quantity"] for section in run.sections for row in section.result.rows}
    assert ("yours: torque - dV/dq" in quantities) == ("energy above the zero position's" in quantities) == has_energy
    assert ("they have no energy" in said) != has_energy


@pytest.mark.parametrize("name", ["gripper", "pendulum_ball"])
def test_so_does_a_tree_of_another_robot(folder, name):
    text = "from pathlib import Path\nfrom compare.engines.mujoco import read\n"
    (folder / "trees.py").write_text(f"{text}tree = read(Path({str(PATHS[name])!r})).tree\n")
    run = examined(folder, "trees.py:tree", ["kinematics", "mass", "gravity", "acceleration"], PATHS[name], draws=True)
    assert not failed(run)
    assert {row["quantity"] for row in run.sections[0].result.rows} == {"x_b", "T_b", "B_b"}


def test_the_arms_own_file_is_run_without_another(folder):
    (folder / "arm.py").write_text("from tmt import ARM, mass_matrix, bias\n")
    for asked in ("arm.py:", "arm.py:ARM"):
        reference, robot, _, reading = compared_with(asked, None)
        assert reference.lines == (f"reference: own; mjcf/arm.xml compared with {asked}",)
        assert robot.joints == ("alpha", "beta", "gamma") and robot.is_read and reading is not None


def test_a_wrong_sign_is_seen_where_it_acts(folder):
    run = examined(folder, "mine.py:sign", ["mass", "gravity", "acceleration", "trajectory"])
    assert {check.experiment for check in failed(run)} == {"acceleration", "trajectory"}
    assert failed(run)[0].quantity == "bias"
    rows = run.sections[-1].result.rows
    assert {row["engine_integrator"] for row in rows} == {"RK4"}


def test_trajectories_are_those_of_rk4(folder):
    run = examined(folder, "mine.py:Object", ["trajectory"], draws=True)
    result = run.sections[0].result
    assert result.checks and not failed(run)
    assert {(row["engine_integrator"], row["level"]) for row in result.rows} == {
        ("RK4", level) for level in ("derivative", "one step", "open loop")
    }
    assert all("yours to MuJoCo" in check.quantity for check in result.checks if check.rounding)
    assert {"dt_s", "twin"} <= set(result.rows[0]) and len({row["dt_s"] for row in result.rows}) == 2


def test_slow_equations_get_fewer_states_and_that_is_said(folder):
    run = examined(folder, "mine.py:slowly", ["mass", "trajectory"], states=5000)
    rows = [row for row in run.sections[0].result.rows if row["scene"] == "random states"]
    assert 1 <= rows[0]["states"] < 5000
    assert any("random states in place of 5,000: your equations take" in note for note in run.sections[0].result.notes)
    assert any("too slow for all scenes" in note for note in run.sections[1].result.notes)
    assert verdict.outcome(run.sections[1]) == "It is not decided: nothing was compared."


@pytest.mark.parametrize("name, experiments, quantity, says", [
    ("nan", ["mass", "gravity"], "bias", "not finite at q = ["),
    ("late", ["acceleration"], "bias", "ArithmeticError: too far (mine.py, line"),
    ("skew", ["mass"], "mass_matrix", "not symmetric at q = ["),
    ("changes", ["mass"], "mass_matrix", "changes its argument q at q = ["),
])  # fmt: skip
def test_what_is_wrong_at_some_states_is_a_failed_check_with_the_state(folder, name, experiments, quantity, says):
    run = examined(folder, f"mine.py:{name}", experiments, draws=True)
    first = failed(run)[0]
    assert first.quantity == f"{quantity} gives what it should" and says in first.note
    assert (first.experiment, first.passed, first.value) == (experiments[-1], False, None)
    captions = " ".join(caption for section in run.sections for _, caption in section.figures)
    assert captions and "nan" not in captions
    assert all(check.quantity != "runs to its end" for check in failed(run))


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("name, says", [("singular", "mass_matrix is singular"), ("infinite", "bias is not finite")])
def test_equations_without_any_use_are_compared_to_the_end(folder, name, says):
    run = examined(
        folder, f"mine.py:{name}", ["mass", "gravity", "acceleration", "trajectory", "diagnosis"], draws=True
    )
    assert any(says in check.note for check in failed(run))
    assert not any(check.quantity == "runs to its end" or check.quantity.startswith("figure") for check in failed(run))


def test_gravity_of_ones_own_is_compared_with_the_bias_at_rest_too(folder):
    run = examined(folder, "mine.py:doubled", ["gravity", "acceleration"])
    assert {"holding torque", "yours: gravity - bias at rest"} <= {check.quantity for check in failed(run)}
    assert {check.experiment for check in failed(run)} == {"gravity"}


# what is left out


def test_experiments_that_need_more_say_why_not(folder):
    robot = compared_with("mine.py:", "double.xml").robot
    assert [name for name in EXPERIMENTS if skipped(name, robot)] == [name for name in EXPERIMENTS if name in OTHERS]
    assert skipped("kinematics", robot) == "your equations have neither com_positions nor jacobians"


@pytest.mark.parametrize("name", OTHERS)
def test_named_alone_they_get_status_2(folder, capsys, name):
    assert main([name, "--quick", "--mjcf", "double.xml", "--reference", "mine.py:Object"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.splitlines()[-1].startswith(f"python -m compare: {name} cannot serve double: ")


def test_all_is_a_report_of_what_can_be_compared(folder, capsys):
    asked = ["--quick", "--mjcf", "double.xml", "--reference", "mine.py:Object", "--out", "out"]
    for more, status in (["all"], 0), (["gravity", "--joints", "-hip,knee"], 1):
        assert main([*more, *asked]) == status
        out, err = capsys.readouterr()
        lines = out.splitlines()
        assert lines[0] == "reference: own; double.xml compared with mine.py:Object"
        assert err == "a user's file may print\n"
        results = json.loads((folder / "out" / "results.json").read_text(encoding="utf-8"))
        assert results["reference"] == {"kind": "own", "name": "mine.py:Object"}
        assert results["passed"] is (status == 0)
        assert [skip["experiment"] for skip in results["skipped"]][:6] == list(OTHERS) * (status == 0)
        text = (folder / "out" / "report.md").read_text(encoding="utf-8")
        assert text.startswith(f"{lines[0]}\n") and "# Your equations and MuJoCo compared on double.xml" in text
        agree = "agree in" if status == 0 else "do not agree in"
        assert any(line.startswith(f"Your equations and MuJoCo {agree} ") for line in lines)
    assert {path.name for path in folder.iterdir()} == {"double.xml", "mine.py", "numbers_beside.py", "out"}


# bad references


BAD = {
    "broken.py": "x = 1\ndef mass_matrix(q:\n",
    "raising.py": "import math\n\nx = math.sqrt(-1.0)\n",
    "leaving.py": "import sys\nsys.exit(3)\n",
    "lacking.py": "import no_such_package\n",
    "null.py": "x = '\0'\n",
}


@pytest.mark.parametrize("asked, says", [
    ("mne.py:Object", "mne.py: no such file; there is mine.py"),
    ("nowhere/mine.py:Object", "nowhere/mine.py: no such file"),
    ("no_such:Object", "no_such: no such module"),
    ("mne:Object", "mne: no such module; there is mine"),
    ("no such:Object", "'no such' is no name of a module; FILE.py:OBJECT or MODULE:OBJECT is expected"),
    (":Object", "':Object' names no file and no module"),
    ("C:\\mine.py:Object", "C:\\mine.py: no such file"),
    ("./:Object", "it is a folder; a Python file is expected"),
    ("mine.py:Objekt", "mine.py: there is no 'Objekt'; there is Object"),
    ("mine.py:inside.alsso", "mine.py: there is no 'alsso' in inside; there is also"),
    ("mine:Objekt", "mine: there is no 'Objekt'; there is Object"),
    ("broken.py:", "broken.py, line 2: SyntaxError, '(' was never closed: def mass_matrix(q:"),
    ("broken:", "broken, line 2: SyntaxError, '(' was never closed"),
    ("raising.py:x", "raising.py, line 3: ValueError: math domain error"),
    ("raising:x", "raising, line 3: ValueError: math domain error"),
    ("leaving.py:x", "leaving.py, line 2: SystemExit: 3"),
    ("lacking.py:x", "lacking.py, line 1: ModuleNotFoundError: No module named 'no_such_package'"),
    ("null.py:x", "null.py: SyntaxError, source code"),
    ("double.xml:x", "double.xml, line 1: SyntaxError"),
    ("mine.py:Needing", "mine.py:Needing: the class Needing takes mass; an object of it is expected"),
    ("mine.py:Raising", ": KeyError: 'mass'"),
    ("mine.py:complex_bias", "mine.py:complex_bias: bias is complex"),
    ("mine.py:short", "mine.py:short: bias has shape (1,); (2,) is expected"),
    ("mine.py:first", "mine.py:first: bias raised IndexError"),
    ("mine.py:no_bias", "has no bias"),
    ("mine.py:named", "there is no joint 'ankle'; hip and knee are known"),
])  # fmt: skip
def test_a_bad_reference_gets_one_line_and_status_2(folder, capsys, asked, says):
    for name, text in BAD.items():
        (folder / name).write_text(text)
    before = sorted(folder.iterdir())
    assert main(["mass", "--quick", "--mjcf", "double.xml", "--reference", asked]) == 2
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if line != "a user's file may print"]
    assert out == "" and len(lines) == 1
    assert lines[0].startswith("python -m compare: ") and says in lines[0]
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize("more, says", [
    (["--reference", "mine.py"], "a colon is missing: mine.py:OBJECT, or mine.py: for the file itself"),
    (["--joints", "hip,knee"], "--joints is for equations of your own"),
    (["--joints", "hip,knee", "--reference", "model"], "--joints is for equations of your own"),
    (["--joints", "hip", "--reference", "mine.py:"], "--joints: joints do not name knee"),
    (["--joints", "-hip,ankle", "--reference", "mine.py:"], "--joints: there is no joint 'ankle'"),
])  # fmt: skip
def test_so_do_other_wrong_words(folder, capsys, more, says):
    try:
        status = main(["mass", "--quick", "--mjcf", "double.xml", *more])
    except SystemExit as stop:
        status = stop.code
    out, err = capsys.readouterr()
    assert (status, out) == (2, "") and says in err


def test_a_file_shadows_no_package_and_finds_what_is_beside_it(folder):
    (folder / "numpy.py").write_text("import numpy\nfrom numbers_beside import g\npi = numpy.pi\n")
    assert own_object("numpy.py:").g == 9.81
    import numpy

    assert own_object("numpy.py:pi") == numpy.pi and "numpy.py" not in numpy.__file__
    path = list(sys.path)
    with pytest.raises(OwnFileError):
        own_object("broken.py:")
    assert sys.path == path


# what explains a difference


@pytest.mark.parametrize("asked, joints, says", [
    ("mine.py:", "-hip,knee", "--joints=hip,knee"), ("mine.py:", "knee,hip", "--joints=hip,knee"),
    ("mine.py:swapped", None, "--joints=knee,hip"), ("mine.py:swapped", "-knee,hip", "--joints=knee,hip"),
])  # fmt: skip
def test_joints_are_to_be_stated_in_place_of_what_was_stated(folder, asked, joints, says):
    run = examined(folder, asked, ["diagnosis"], joints=joints)
    # the mirror image of a double pendulum is the same
    mirrored = "--joints=" + ",".join(f"-{name}" for name in says.removeprefix("--joints=").split(","))
    assert any(f"(state it by {says})" in text or f"(state it by {mirrored})" in text for text in texts(run))
    stated = says.removeprefix("--joints=")
    assert not failed(examined(folder, asked, ["diagnosis"], joints=stated))


def texts(run):
    return [cause["text"] for cause in run.causes]


def test_what_is_no_number_is_not_explained(folder):
    run = examined(folder, "mine.py:nan", ["diagnosis"])
    notes = run.sections[0].result.notes
    assert any("Not all values are numbers" in note for note in notes)
    assert not any("nothing to explain" in note.lower() for note in notes)
    assert failed(run)[0].quantity == "bias gives what it should"


def test_slow_equations_are_explained_without_what_takes_long(folder):
    run = examined(folder, "mine.py:slow_sign", ["diagnosis"])
    assert failed(run) and run.causes
    assert "your equations are too slow for that" in " ".join(run.sections[0].result.notes)
