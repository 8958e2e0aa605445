"""reproduce.py of a report: plain MuJoCo and NumPy repeat its numbers, and a wrong one is found."""

import json
import re
import subprocess
import sys

import pandas as pd
import pytest
from helpers.in_process import without_workers
from helpers.runs import ROOT
from helpers.sections import GOOD, section
from models import PATHS

from compare.__main__ import main
from compare.report.reproduce import script
from compare.report.verdict import Report
from compare.robots.arm import ARM

# what the script may not need: this project, and all that it is built on but MuJoCo and NumPy
ALONE = """
import sys, runpy
class Blocked:
    def find_spec(self, name, *rest):
        if name.split(".")[0] in ("compare", "tmt", "mjcf", "scipy", "pandas", "jinja2", "matplotlib", "llvmlite"):
            raise ImportError(f"{name} is not installed")
sys.meta_path.insert(0, Blocked())
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
"""
ROD = '<inertial pos="0 0.02 -0.5" mass="1" fullinertia="0.1 0.11 0.02 0.001 0.002 0.003"/>'
SWING = f"""<mujoco><option integrator="Euler" gravity="0.5 0 -9.81"/><worldbody><body euler="10 20 30"><joint name="hip"
axis="0 1 0" damping="0.3" pos="0 0 0.1" armature="0.02"/>{ROD}<body pos="0 0.1 -1" euler="0 0 40"><joint name="knee"
axis="0 1 0" ref="20" stiffness="2" frictionloss="0.1"/>{ROD}<body pos="0 0 -1"><joint name="slide" type="slide" axis="1 0 1"
stiffness="50" damping="1"/>{ROD}<body name="ball" pos="0.1 0 0"><joint type="ball" damping="0.5"/>{ROD}</body></body></body>
</body></worldbody><actuator><position joint="hip" kp="500" kv="1"/></actuator></mujoco>"""
MASSLESS = f"""<mujoco><worldbody><body name="yoke"><joint name="a" axis="0 1 0"/><body><joint name="b" axis="1 0 0"/>{ROD}
</body></body></worldbody></mujoco>"""
STIFF = SWING.replace('ref="20" stiffness="2"', 'stiffness="900" damping="2"')
WRONG = """
from numpy import cos
def bias(q, qd): return [0.0, 0.0]
def mass_matrix(q): return [[1.7 + cos(q[1]), 0.35 + 0.5 * cos(q[1])], [0.35 + 0.5 * cos(q[1]), 0.36]]
"""
PENDULUM = """<mujoco><worldbody><body><joint name="hip" axis="0 1 0"/><inertial pos="0 0 -0.5" mass="1"
diaginertia="0.1 0.1 0.01"/><body pos="0 0 -1"><joint name="knee" axis="0 1 0"/><inertial pos="0 0 -0.5" mass="1"
diaginertia="0.1 0.1 0.01"/></body></body></worldbody></mujoco>"""


def repeated(script, *arguments, cwd=ROOT):
    """The exit status and the lines of a script, by an interpreter that has MuJoCo and NumPy alone."""
    command = [sys.executable, "-I", "-c", ALONE, str(script), *map(str, arguments)]
    run = subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=120, check=False)
    assert run.stderr == ""
    return run.returncode, run.stdout.splitlines()


def report_of(tmp_path, *words, status=0):
    out = tmp_path / "out"
    with without_workers():
        assert main([*words, "--quick", "--out", str(out)]) == status
    return out / "reproduce.py"


@pytest.mark.parametrize("name, experiment", [
    ("swing", "acceleration"), ("free_body", "gravity"), ("arm", "mass"), ("massless", "acceleration"),
])  # fmt: skip
def test_the_worst_states_of_any_joints_are_repeated(name, experiment, tmp_path, capsys):
    """With armature, springs, friction and servos that the equations do not have."""
    (tmp_path / "swing.xml").write_text(SWING)
    (tmp_path / "massless.xml").write_text(MASSLESS)
    given = [] if name == "arm" else ["--mjcf", str(PATHS.get(name, tmp_path / f"{name}.xml"))]
    script = report_of(tmp_path, experiment, *given)
    status, lines = repeated(script)
    quantities = {"mass": ["Mbar"], "gravity": ["holding torque"], "acceleration": ["bias", "qdd"]}
    assert status == 0 and all(line.endswith("; the same") for line in lines), lines
    assert [line.split(" [")[0] for line in lines[::2]] == quantities[experiment]


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The script of states, of a run that is stable up to some step, and of one with a smaller file."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "mass.xml").write_text(SWING)
    (folder / "reduction.xml").write_text(STIFF)
    (folder / "stability.xml").write_text(STIFF)
    scripts, write = {}, ["--error", "0.1", "--write", str(folder / "small.xml")]
    for name, more in {"mass": [], "stability": [], "reduction": write}.items():
        (folder / name).mkdir()
        scripts[name] = report_of(folder / name, name, "--mjcf", str(folder / f"{name}.xml"), *more)
    return scripts


@pytest.mark.parametrize("name, count", [("stability", 2), ("reduction", 1)])
def test_the_runs_at_the_limits_and_the_error_of_a_written_file_are_repeated(name, count, runs):
    status, lines = repeated(runs[name])
    assert status == 0 and len(lines) == count and all(line.endswith("; the same") for line in lines), lines


def test_a_difference_of_equations_is_repeated(tmp_path, capsys):
    (tmp_path / "swing.xml").write_text(PENDULUM)
    (tmp_path / "own.py").write_text(WRONG)
    words = "--mjcf", str(tmp_path / "swing.xml"), "--reference", f"{tmp_path / 'own.py'}:"
    status, lines = repeated(report_of(tmp_path, "mass", *words, status=1))
    said = r"Mbar \[1, 1\], difference: 0\.01\d*; the report: 0\.01\d*; the same"
    assert status == 0 and len(lines) == 2 and re.fullmatch(said, lines[1])


@pytest.mark.parametrize("pattern", [
    r'"mujoco": (-?\d\.\d+)', r'"other": (-?\d+\.\d+)', r'"difference": (\S+),', r'"speed": (\S+),', r'"error": (\S+),'
])  # fmt: skip
def test_a_wrong_number_of_the_script_is_found(pattern, runs, tmp_path, capsys):
    """By 1 % of it; a difference by more than its tolerance."""
    kind = {"speed": "stability", "error": "reduction"}.get(pattern[1:].split('"')[0], "mass")
    script = runs[kind]
    text = script.read_text(encoding="utf-8")
    found = re.search(pattern, text)
    number = 1.01 * float(found[1]) + (1e-9 if "difference" in pattern else 0.0)
    changed = text[: found.start(1)] + repr(number) + text[found.end(1) :]
    (tmp_path / "changed.py").write_text(changed)
    status, lines = repeated(tmp_path / "changed.py")
    assert status == 1 and any("NOT THE SAME" in line for line in lines)


def test_the_state_of_a_quantity_has_the_largest_share_of_its_tolerance(runs):
    table = pd.read_csv(runs["mass"].with_name("tables") / "mass.csv")
    rows = table[table.quantity == "Mbar"]
    worst = rows.loc[rows.difference_over_bar.idxmax()]
    state = json.loads(re.search(r'"states": \[\s*(\{.*\})', runs["mass"].read_text(encoding="utf-8"))[1])
    assert len(rows) > 1 and rows.difference_over_bar.nunique() > 1
    share = pytest.approx(worst.difference_over_bar, rel=1e-9)
    assert state["quantity"] == "Mbar" and state["difference"] / state["tolerance"] == share
    checks = re.search(r'"checks": \[(.*?)\]', runs["mass"].read_text(encoding="utf-8"), re.DOTALL)[1]
    values = [json.loads(line.rstrip(","))["value"] for line in checks.split("\n") if line.strip()]
    assert values and {*values} == {state["difference"]}  # no others


@pytest.mark.parametrize("name", ["mass", "reduction"])
def test_a_wrong_number_of_the_report_is_found(name, runs):
    script = runs[name]
    path = script.with_name("results.json")
    text = path.read_text(encoding="utf-8")
    results = json.loads(text)
    told = re.findall(r'"value": (\S+),', script.read_text())
    said = [check for check in results["checks"] if check["value"] and repr(check["value"]) in told]
    assert said and repeated(script)[0] == 0
    said[-1]["value"] *= 1.001
    path.write_text(json.dumps(results), encoding="utf-8")
    status, lines = repeated(script)
    path.write_text(text, encoding="utf-8")
    assert status == 1 and sum("not in results.json" in line for line in lines) == 1


def test_rows_that_have_no_worst_state_are_left_out():
    """Those of another engine have quantities of the same names."""
    of = section("engines", GOOD, rows=[{"quantity": "Mbar", "worst_difference": 1.0, "worst_entry": "0"}])
    plain = {"why": "", "zero": None, "least": None}
    said = script(Report([of], ARM, {"command": "c"}, "", plain=plain))
    assert '"states": []' in said and compile(said, "reproduce.py", "exec")


def test_a_file_that_mujoco_alone_reads_otherwise_is_said(tmp_path, capsys):
    urdf = """<robot name="r"><link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0"
    iyz="0"/></inertial></link></robot>"""
    (tmp_path / "r.urdf").write_text(urdf)
    script = report_of(tmp_path, "mass", "--mjcf", str(tmp_path / "r.urdf"), "--floating")
    run = subprocess.run(
        [sys.executable, "-I", str(script)], capture_output=True, text=True, timeout=60, check=False
    )
    assert run.returncode == 1 and "floating" in run.stderr
