"""The help of the command line; every command line that the README and a help show is parsed, and run where that is asked for."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from helpers import own_equations
from helpers.in_process import answered
from helpers.runs import ENVIRONMENT
from helpers.shown import blocks, command_lines

from compare.__main__ import main
from compare.cli.command_line import LINE_WIDTH, command_parser, request
from compare.core.options import options_in
from compare.experiments import EXPERIMENTS, skipped
from compare.experiments.options import AllOptions, Options, StabilityOptions, options_of
from compare.export.command import OPTIONS as OF_EQUATIONS
from compare.fleet.command import experiments_of, fleet_parser
from compare.report.provenance import OURS, installed
from compare.robots.arm import ARM
from compare.robots.scene_file import read_scenes

POSITIONS = """

def com_positions(q):
    hip, knee = q[0], q[0] + q[1]
    upper = np.array([-np.sin(hip), 0.0, -np.cos(hip)])
    return np.array([upper / 2, upper + np.array([-np.sin(knee), 0.0, -np.cos(knee)]) / 2])
"""


@pytest.mark.parametrize("arguments, expected", [
    ([], [f"  {name} " for name in (*EXPERIMENTS, "all", "fleet", "equations", "--version")]),
    (["all", "--help"], [f"  {word} " for word in (*options_in(Options), "--engines", "--write")]),
    (["stability", "--help"], [f"  {word} " for word in options_in(StabilityOptions)]),
    *((([name, "--help"], ["Examples:"])) for name in EXPERIMENTS if name not in ("diagnosis", "stability")),
])  # fmt: skip
def test_help_has_every_experiment_and_option(arguments, expected, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    status, text, err = answered(arguments, capsys)
    assert (status, err) == (0, "") and all(part in text for part in expected)
    assert max(map(len, text.splitlines())) <= LINE_WIDTH


def test_an_experiments_help_has_its_own_options_alone(capsys):
    every = {word for name in EXPERIMENTS for word in options_in(options_of(name))}
    for name in ("mass", "stability", "reduction", "all"):
        _, text, _ = answered([name, "--help"], capsys)
        shown = {word for word in every if f"  {word} " in text}
        assert shown == {*options_in(AllOptions if name == "all" else options_of(name))}, name


def test_the_version_is_that_of_a_report(capsys):
    assert main(["--version"]) == 0
    assert tuple(capsys.readouterr()) == (f"{OURS} {installed(OURS)}\n", "")
    assert re.fullmatch(r"\d+(\.\d+)+", installed(OURS))


@pytest.mark.parametrize("program, modules", [
    ("from compare import assert_agrees, differences", {"mujoco", "llvmlite", "scipy", "pandas", "matplotlib"}),
    ("from compare.__main__ import main\ntry: main(['speed', '--help'])\nexcept SystemExit: pass",
     {"numpy", "mujoco", "tmt", "rich", "compare.experiments.speed"}),
])  # fmt: skip
def test_import_and_help_load_nothing_heavy(program, modules, tmp_path):
    command = [sys.executable, "-c", f"import sys\n{program}\nprint({modules} & set(sys.modules))"]
    run = subprocess.run(command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True)
    assert run.stdout.splitlines()[-1] == "set()", run.stderr


@pytest.mark.parametrize("line", command_lines())
def test_a_command_line_that_is_shown_can_be_given(line, capsys):
    words = shlex.split(line)
    if words[:1] == ["fleet"]:
        made = fleet_parser()
        options = made.parse_intermixed_args(words[1:])
        assert options.help or (options.paths and experiments_of(made, options))
    elif words[:1] == ["equations"] and "--help" not in words:
        assert command_parser("", "", "export", OF_EQUATIONS).parse_args(words[1:]).out
    elif "--help" in words or not words:
        assert answered(words, capsys)[0] == 0
    else:
        assert request(words)[0] == words[0]


FILES_OF_ARM = ["my_arm.xml", "my_robot.xml", "solution.xml"]
FILES_OF_ARM += ["models/a.xml", "class/a.xml", "submissions/a.xml"]
IN_SECONDS = "equations --out arm_c", "mass --out /tmp/mass", "parameters --mjcf my_arm.xml --reference arm"


def lines_to_run():
    """Those that no cluster and no earlier fleet is needed for; most of them take long."""
    for line in command_lines():
        words = line.split()
        is_run_elsewhere = (
            line in ("", "all", "all --quick") or "reports/" in line
        )  # test_command_line has their like
        if not is_run_elsewhere and not {"--dask", "--help"} & {*words}:
            yield pytest.param(line, marks=[] if line in IN_SECONDS else pytest.mark.slow)


@pytest.mark.parametrize("line", list(lines_to_run()))
def test_a_command_line_that_is_shown_runs(inside, line, tmp_path, monkeypatch, capsys):
    """With few states, on a small robot with a servo; a fleet has the arm's file and a wrong one."""
    monkeypatch.chdir(tmp_path)
    own_equations.write(tmp_path)
    servo = '<actuator><position name="hip" joint="hip" kp="20" kv="1"/></actuator></mujoco>'
    mine, arm = (path.read_text(encoding="utf-8") for path in (Path("mine.py"), ARM.mjcf))
    files = dict.fromkeys(FILES_OF_ARM, arm) | {"submissions/b.xml": arm.replace('mass="1.5"', 'mass="1.6"')}
    files |= {"robot.xml": own_equations.XML.replace("</mujoco>", servo), "my_equations.py": mine + POSITIONS}
    files["robot.urdf"] = own_equations.XML
    files |= {"release.txt": "models/a.xml\n", "recorded.csv": "time,hip\n0,0\n0.5,0.1\n1,0\n"}
    for name, text in (files | {"my.toml": blocks("toml")[0]}).items():
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_text(text, encoding="utf-8")
    assert read_scenes("my.toml", ARM)[0].name in blocks("toml")[0]
    words = shlex.split(line.replace("/tmp/mass", "mass"))
    quick = [] if words[0] in ("fleet", "equations") or "--quick" in words else ["--quick"]
    status = main([*words, *quick])
    is_absent = words[0] == "engines" and skipped("engines", ARM)  # none is installed
    assert status == (1 if "submissions" in words else 2 if is_absent else 0), capsys.readouterr()
