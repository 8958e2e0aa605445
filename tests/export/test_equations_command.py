"""python -m compare equations: what is written is run and judged; the outcome stands in the files and decides the status."""

import re
import shutil
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from itertools import product

import numpy as np
import pytest
from helpers.in_process import answered
from models import PATHS

import tmt
from compare.__main__ import main
from compare.experiments.quantities import QUANTITIES as COMPARED
from compare.export import checks
from compare.export.checks import with_sites
from compare.export.command import FILES, identifier
from compare.export.programs import PROGRAMS, NotRun, Program, PythonProgram, WrongProgram
from compare.robots.arm import ARM
from compare.run.reference import compared_with
from tmt.derivation.quantities import QUANTITIES

HAS_C, HAS_OCTAVE = (bool(shutil.which(name)) for name in ("gcc", "octave-cli"))
NEEDS = {"c": HAS_C, "matlab": HAS_OCTAVE, "python": True, "latex": True}
NEEDS |= {name: find_spec(name) is not None for name in ("casadi", "jax")}
COUNT = 20


@pytest.mark.parametrize("language, options", [
    ("c", []), ("c", ["--float"]), ("python", []), ("casadi", []), ("jax", []),
    ("python", ["--quantity", "mass_matrix,bias,gravity_balance,derivatives"]),  # an entry of dtau/dqd is zero
    ("matlab", ["--quantity", "mass_matrix,bias,jacobians,derivatives"]),
])  # fmt: skip
def test_the_arm_in_a_language(language, options, tmp_path, capsys):
    if not NEEDS[language]:
        pytest.skip("no program runs it")
    out = tmp_path / "new" / "folder"
    assert main(["equations", "--to", language, *options, "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert {path.name for path in out.iterdir()} == {f"arm{ending}" for ending in FILES[language]}
    for path in out.iterdir():
        text = path.read_text(encoding="utf-8")
        assert "Checked at 1,000 random states" in text and "alpha, hinge, 0, 0" in text
        assert len(re.findall(r"largest difference from MuJoCo", text)) >= 3
        assert ("float out[3]" in text) == ("--float" in options)
    parts = QUANTITIES["derivatives"].parts if "derivatives" in "".join(options) else ()
    assert all(name in shown for name in ("mass_matrix", "bias", str(out), *parts))


def outcome_of(make, *quantities, compared=None, single=False):
    """What is said of a program; compared: with the arm, where it is None."""
    return checks.checked(compared or compared_with(None, None), make, quantities, COUNT, single)[0]


class Altered(Program):
    """tmt's own values, of which one entry of the last state is off by a multiple of its tolerance."""

    def __init__(self, tree, quantity, share, eps=2.0**-52):
        self.tree, self.quantity, self.share, self.eps, self.chosen = tree, quantity, share, eps, None

    def start(self):
        """Nothing to do."""

    def values(self, quantity, states):
        found = getattr(tmt, quantity)(self.tree, *states[: len(QUANTITIES[quantity].takes)])
        found = np.stack(found, axis=1) if isinstance(found, tuple) else found
        if quantity == self.quantity:
            scales = checks.Entries(self.tree, states[0], states[1])
            scale = getattr(scales, quantity)
            scale = scale(scales.force(states[2]), found) if quantity == "acceleration" else scale
            found[-1, ..., 1] += self.share * 64 * self.eps * scale[-1, ..., 1]
        return found


@pytest.mark.parametrize("quantity", ["mass_matrix", "bias", "acceleration"])
@pytest.mark.parametrize(("share", "passes"), [(0.7, True), (1.3, False), (np.nan, False)])
@pytest.mark.parametrize("single", [False, True])
def test_a_difference_is_judged_by_the_tolerance_of_its_entry(quantity, share, passes, single):
    make = partial(Altered, tmt.ARM, quantity, share, 2.0 ** (-23 if single else -52))
    outcome = outcome_of(make, quantity, "gravity_balance", single=single)
    assert [row.passed for row in outcome.rows] == [passes, True] and outcome.passed is passes


@pytest.mark.parametrize("language", [name for name in NEEDS if NEEDS[name]])
def test_what_is_judged_is_what_was_written(language, tmp_path):
    """A wrong number in the text is found in the language's own values; and only in what it changes."""
    quantities = ["mass_matrix", "gravity_balance"]
    for ending, kind in FILES[language].items():
        text = tmt.equations(replace(tmt.ARM, gravity=(0.0, 0.0, -9.8100001)), kind, quantities, name="arm")
        (tmp_path / f"arm{ending}").write_text(text, encoding="utf-8")
    program = partial(PROGRAMS[language], tmp_path, "arm", tmt.ARM, quantities, False)
    outcome = outcome_of(program, *quantities)
    assert [row.passed for row in outcome.rows] == [True, False] and outcome.rows[0].operations > 10


@pytest.mark.parametrize("name", sorted({quantity.function for quantity in COMPARED.values()}))
def test_each_quantity_has_a_counterpart_in_mujoco(name):
    compared = compared_with("model", str(PATHS["mixed"]))
    outcome = outcome_of(partial(Altered, compared.robot.tree, "", 0.0), name, compared=compared)
    assert outcome.passed and len(outcome.rows) == max(1, len(QUANTITIES[name].parts))


def test_a_wrong_value_is_a_failed_check_with_status_1_and_stands_in_the_file(tmp_path, monkeypatch, capsys):
    def start(self):
        text = (self.folder / "arm.py").read_text(encoding="utf-8")
        (self.folder / "arm.py").write_text(text.replace("9.81", "9.8100001"), encoding="utf-8")
        started(self)

    started = PythonProgram.start
    monkeypatch.setattr(PythonProgram, "start", start)
    assert main(["equations", "--to", "python", "--out", str(tmp_path / "out")]) == 1
    head = (tmp_path / "out" / "arm.py").read_text(encoding="utf-8")[:400]
    assert "Failed at 1,000 random states" in head and "bias" in head and "acceleration" in head
    assert "Checked" not in head + capsys.readouterr().out


@pytest.mark.parametrize("error, status, said", [(NotRun, 0, "Not checked"), (WrongProgram, 1, "Failed")])
def test_what_cannot_be_run_is_written_and_says_so(error, status, said, tmp_path, monkeypatch):
    def start(self):
        raise error("no such thing")

    monkeypatch.setattr(PythonProgram, "start", start)
    assert main(["equations", "--to", "python", "--out", str(tmp_path / "out")]) == status
    assert f"{said}: no such thing" in (tmp_path / "out" / "arm.py").read_text(encoding="utf-8")


def test_without_a_compiler_the_files_are_not_checked(tmp_path, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler -O1")
    assert main(["equations", "--out", str(tmp_path / "out")]) == 0
    assert "Not checked: no C compiler" in (tmp_path / "out" / "arm.h").read_text(encoding="utf-8")


@pytest.mark.skipif(not HAS_C, reason="no C compiler")
def test_a_text_that_does_not_compile_has_failed(tmp_path):
    (tmp_path / "arm.h").write_text("void arm_bias(const double q[3], const double qd[3], double out[3]);")
    (tmp_path / "arm.c").write_text("void arm_bias(const float q[3], const double qd[3], double out[3]) {}")
    with pytest.raises(WrongProgram, match="arm_bias"):
        PROGRAMS["c"](tmp_path, "arm", tmt.ARM, ["bias"], False)


@pytest.mark.parametrize(("words", "why"), [
    ("--to fortran --out new", "fortran"), ("--to c --to c --out new", "--to is stated twice"),
    ("--to pyton --out new", "did you mean python"), ("--name 2nd --out new", "2nd"),
    ("--name double --out new", "double"), ("--name bias --out new", "bias"), ("--quantity mass --out new", "mass"),
    ("--quantity frame_pose:nose --out new", "nose"), ("--out file/below", "file is not a folder"),
    ("--to python --float --out new", "single precision"), ("--out .", "exists"), ("", "--out"), ("--outt x", "--outt"),
    ("--mjcf missing.xml --out new", "missing.xml"), ("more --out new", "more"),
])  # fmt: skip
def test_a_wrong_request_gets_one_line_and_status_2(words, why, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    status, _, error = answered(["equations", *words.split()], capsys)
    assert status == 2 and why in error and error.count("\n") == 1 and not (tmp_path / "new").exists()


@pytest.mark.parametrize(("stem", "name"), [
    ("arm", "arm"), ("my robot-2", "my_robot_2"), ("2dof", "robot_2dof"), ("ü", "robot"), ("for", "robot_for"),
])  # fmt: skip
def test_the_name_of_a_file_becomes_an_identifier(stem, name):
    assert identifier(stem) == name


@pytest.mark.parametrize("from_mujoco", [True, False])
def test_values_are_compared_with_mujoco_and_with_the_exact_value(from_mujoco, tmp_path):
    heavy = tmp_path / "heavy.xml"
    text = ARM.mjcf.read_text(encoding="utf-8")
    heavy.write_text(text.replace('mass="1.5"', 'mass="1.6"'), encoding="utf-8")
    compared = compared_with("arm", str(heavy))  # the stated numbers, and MuJoCo with another mass
    tree = compared.robot.tree if from_mujoco else compared_with("model", str(heavy)).robot.tree
    (row,) = outcome_of(partial(Altered, tree, "", 0.0), "mass_matrix", compared=compared).rows
    assert not row.passed and (row.of_mujoco > 1.0, row.of_exact > 1.0) == (from_mujoco, not from_mujoco)


@pytest.mark.parametrize("language", [name for name in ("c", "python", "matlab") if NEEDS[name]])
def test_parameters_are_compared_with_the_file_that_has_other_values(language, tmp_path, capsys):
    """And what MuJoCo has not, with the exact values alone."""
    words = ["--parameters", "payload,rod,gravity", "--quantity", "bias,inverse_dynamics,frame_pose:rod"]
    file = tmp_path / "swing.xml"
    file.write_text(SWING, encoding="utf-8")
    words += ["--mjcf", str(file), "--to", language, "--out", str(tmp_path / "out")]
    assert main(["equations", *words]) == 0
    shown = capsys.readouterr().out
    assert all(text in shown for text in ("bias (p)", "frame_pose:rod (p)", "not compared"))
    text = next((tmp_path / "out").glob("swing.[hpm]*")).read_text(encoding="utf-8")
    assert "payload_inertia" in text and "centre of mass of payload in the frame of rod" in text


@pytest.mark.parametrize("quantity, name", [
    *product(("inverse_mass_matrix", "inverse_dynamics", "inverse_dynamics_derivatives", "derivatives", "frame_pose:",
              "frame_jacobian:", "frame_convective:"), ("pendulum_ball", "arm")),
    ("derivatives", "gripper"), ("step_derivatives:rk4", "arm"),
])  # fmt: skip
def test_what_mujoco_has_not_is_judged_by_exact_values_and_the_scale_of_each_entry(quantity, name, tmp_path):
    """What is written passes; with 1e-8 of the largest entry it does not."""
    compared = with_sites(compared_with("model", str(PATHS.get(name, ARM.mjcf))))
    tree = compared.robot.tree
    quantity += tree.body_names[-1] if quantity.endswith(":") else ""
    (tmp_path / "x.py").write_text(tmt.equations(tree, "python", [quantity], name="x"))

    class Off(PythonProgram):
        def values(self, quantity, states):
            values = super().values(quantity, states)
            at = np.unravel_index(np.argmax(np.abs(values)), values.shape)
            values[at] *= 1.0 + self.by
            return values

    for by, passes in ((0.0, True), (1e-8, False)):
        Off.by = by
        outcome = outcome_of(partial(Off, tmp_path, "x", tree, [quantity]), quantity, compared=compared)
        assert outcome.passed is passes and all(row.from_mujoco is None for row in outcome.rows)
        assert all(row.of_exact < 1.0 for row in outcome.rows) is passes


SWING = """<mujoco><worldbody><body name="frame" pos="0 0 1" euler="20 0 10"><joint name="a" axis="0 1 0"/>
<geom type="capsule" size="0.05" fromto="0 0 0 0.3 0 0"/><body name="rod" pos="0.3 0 0" euler="0 30 40">
<joint name="b" axis="1 0 0"/><geom type="capsule" size="0.04" fromto="0 0 0 0 0.1 -0.3"/></body></body></worldbody></mujoco>"""
