"""Every code block of the README and of the experiments' help: Python runs in a fresh folder, commands are parsed, what is shown
is what is printed."""

import csv
import json
import os
import re
import shlex
import shutil
import sys
import tomllib
import traceback
from pathlib import Path

import numpy as np
import pytest
from models import PATHS
from shown import BLOCKS, README, ROOT, blocks, commands, indented

from compare.__main__ import main
from compare.command_line import help_of
from compare.engines.mujoco import reading
from compare.engines.mujoco.flags import INTEGRATORS
from compare.experiments.stability.servos import full_at
from compare.experiments.stability.servos.circumstances import circumstances
from compare.experiments.stability.servos.predicted import limit_rows, predicted_at
from compare.experiments.stability.servos.sentences import at_the_top
from compare.reference import compared_with
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.scene_file import read_scenes

PENDULUM = """<mujoco><worldbody><body><joint name="hip" axis="0 1 0"/><inertial pos="0 0 -1" mass="1" diaginertia="1 1 1"/>
<body><joint name="knee" axis="1 0 0"/><inertial pos="0 0 -1" mass="1" diaginertia="1 1 1"/></body></body></worldbody></mujoco>"""
NUMBER = re.compile(r"(?<![\w])[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


def run(text, folder, monkeypatch):
    """The names that a Python block defines, run in a folder that has nothing but what its tests read."""
    monkeypatch.chdir(folder)
    names = {"__name__": "readme"}
    exec(compile(text, "what is shown", "exec"), names)
    return names


def test_every_block_says_what_it_is():
    assert BLOCKS and {language for language, _ in BLOCKS} <= {"python", "sh", "text", "toml"}
    assert len(BLOCKS) == README.count("\n```") / 2


def test_it_is_short_and_what_it_shows_is_there():
    assert len(README.splitlines()) <= 150
    linked = re.findall(r"\]\(([^)]+)\)", README)
    assert len([name for name in linked if name.endswith((".png", ".gif"))]) == 5
    assert all((ROOT / name).exists() for name in linked)


EXAMPLE = ROOT / "reports" / "example"


def table(name):
    with open(EXAMPLE / "tables" / f"{name}.csv", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def largest(rows, **where):
    """The largest difference in the rows of a table with these values."""
    return max(float(row["largest_difference"]) for row in rows if where.items() <= row.items())


def test_its_results_are_those_of_the_example():
    """Of the command that stands beside them."""
    results = json.loads((EXAMPLE / "results.json").read_text(encoding="utf-8"))
    assert results["provenance"]["command"].endswith("-m compare all --out reports/example") and results["passed"]
    at_random = {"scene": "random states"}
    limits = [
        float(row["observed_dt_s"]) / float(row["predicted_dt_s"]) - 1.0
        for row in table("stability")
        if row["predicted_dt_s"] and row["observed_dt_s"]
    ]
    worst = re.search(r"(\d+ %) of it", (EXAMPLE / "report.md").read_text(encoding="utf-8"))[1]
    runs = [row for row in table("trajectory") if row["scene"].endswith(", free") and row["level"] == "open loop"]
    runs = [
        row for row in runs if row["engine_integrator"] == "RK4" and row["dt_s"] == "0.078125" and row["unit"] == "rad"
    ]
    followed = [
        row for row in table("speed") if (row["engine"], row["method"], row["dt_s"]) == ("mujoco", "RK4", "0.078125")
    ]
    (error,) = [float(row["worst_error_rad"]) for row in followed if row["scene"] == "ball catch, free"]
    for text in (
        f"All {len(results['checks'])} checks pass:",
        f"at most {largest(table('mass'), quantity='Mbar', **at_random):.1e} kg m2 apart",
        f"accelerations {largest(table('acceleration'), quantity='qdd', **at_random):.1e} rad/s2",
        f"no difference exceeds {worst} of its rounding tolerance",
        f"agree within {largest(runs):.1e} rad in the scenes that are let go",
        f"both are {error:.2g} rad from the true motion after ball catch",
        f"All {len(limits)} step limits,",
    ):
        assert text in " ".join(README.split()), text
    assert max(map(abs, limits)) <= 1e-4 and "agree with runs within 0.01 %" in README
    for row in table("what_should_i_use"):
        said = f"| {row['scene']}: {float(row['target_rad']):.0e} rad |"
        if said in README:
            assert f"{said} {cheapest(row)} |" in README


def cheapest(row):
    """A row of what_should_i_use.csv as the README has it."""
    mujoco, by_tmt = row["mujoco"].removeprefix("mujoco "), row["tmt"].removeprefix("tmt ")
    slow, fast = (
        f"{time:.0f}" if time >= 100.0 else f"{time:.2g}" for time in map(float, (row["mujoco_ms"], row["tmt_ms"]))
    )
    ratio = f"{float(row['ratio']):.0f}"
    return f"{mujoco} (dt {float(row['mujoco_dt_s']):.2g} s) | {slow} | {by_tmt} | {fast} | {ratio}"


def test_a_class_is_judged_as_it_says(tmp_path, monkeypatch, capsys):
    (line,) = [shlex.split(line)[3:] for line in commands() if "reports/class" in line]
    monkeypatch.chdir(tmp_path)
    text = ARM.mjcf.read_text(encoding="utf-8")
    Path("submissions").mkdir()
    Path("submissions/right.xml").write_text(text, encoding="utf-8")
    Path("submissions/wrong.xml").write_text(text.replace('pos="0.15 0 0"', 'pos="0.151 0 0"'), encoding="utf-8")
    assert main([*line, "--only", "parameters"]) == 1
    with open("reports/class/fleet.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    cause = "com x of forearm: stated 0.15 m, compiled 0.151 m"
    assert [(row["file"], row["verdict"], row["reason"]) for row in rows] == [
        ("submissions/wrong.xml", "differ", cause),
        ("submissions/right.xml", "agree", ""),
    ]
    assert cause in capsys.readouterr().out and cause in " ".join(README.split())
    assert all(Path(f"reports/class/files/{row['file']}/index.html").exists() for row in rows)


def test_a_help_has_blocks_of_every_kind():
    found = {
        name: [language for language, _ in indented(help_of(name))]
        for name in ("parameters", "trajectory", "diagnosis")
    }
    assert found == {"parameters": ["text", "sh"], "trajectory": ["toml", "sh"], "diagnosis": ["python", "sh"]}


@pytest.mark.parametrize("text", blocks("python"), ids=lambda text: text.splitlines()[0])
def test_python_runs_as_it_is_printed(text, tmp_path, monkeypatch):
    """A block of the README that fails does so with the message that the next block shows."""
    following = ([block for at, block in enumerate(BLOCKS) if at and BLOCKS[at - 1][1] == text] or [("", "")])[0]
    try:
        names = run(text, tmp_path, monkeypatch)
    except AssertionError as error:
        printed = "".join(traceback.format_exception_only(error))
        assert following[0] == "text"
        assert same(printed, following[1]), printed
        return
    assert not following[1].startswith("AssertionError")
    assert os.listdir() == []
    for name, function in names.items():
        if name.startswith("test_"):
            (tmp_path / "robot.xml").write_text(PENDULUM)
            q = np.random.default_rng(1).uniform(-1.0, 1.0, (10, 2))
            right = compared_with("model", "robot.xml")
            M = right.mujoco.of(right.robot.case()).mass_matrix(q)
            np.savetxt("export.csv", np.column_stack([q, M.reshape(10, 4)]), delimiter=",")
            function()
            np.savetxt("export.csv", np.column_stack([q, 1.01 * M.reshape(10, 4)]), delimiter=",")
            with pytest.raises(AssertionError, match="mass_matrix: mismatched entries"):
                function()


def same(printed, shown):
    """The same words, and the same numbers but for their last digits."""
    one, other = ([line.rstrip() for line in text.strip().splitlines()] for text in (printed, shown))
    numbers = [list(map(float, NUMBER.findall("\n".join(lines)))) for lines in (one, other)]
    words = [NUMBER.sub("#", "\n".join(lines)) for lines in (one, other)]
    return words[0] == words[1] and len(numbers[0]) == len(numbers[1]) and np.allclose(*numbers, rtol=1e-9)


def test_what_is_shown_is_compared_by_words_and_by_numbers():
    assert same("a: 1.5 \n b 2e+3", "a: 1.5000000000001\n b 2000")
    assert not same("a: 1.5", "a: 1.501") and not same("a: 1.5", "b: 1.5") and not same("a 1", "a 1 1")


def test_the_example_is_ten_lines():
    assert sum(bool(line.strip()) for line in blocks("python")[0].splitlines()) == 10


@pytest.mark.parametrize("line", commands())
def test_commands_can_be_given(line, capsys, tmp_path, monkeypatch):
    """They are parsed; what sets up an environment is left out."""
    if line.startswith("python3 -m venv"):
        assert re.search(r"-m (compare all|pytest)$", line)
        return
    program, *arguments = shlex.split(line)
    if program == ".venv/bin/dask":
        assert shutil.which(Path(sys.executable).with_name("dask"))
        return
    assert program == ".venv/bin/python" and arguments[0] == "-m"
    assert arguments[1] == "compare"
    with pytest.raises(SystemExit) as ended:
        main([*arguments[2:], "--help"])
    assert (
        ended.value.code == 0
        and f"usage: python -m compare {'EXPERIMENT|all' if 'all' in arguments else arguments[2]} "
        in capsys.readouterr().out
    )


def test_inline_commands_can_be_given(capsys):
    inline = re.findall(r"`(?:\.venv/bin/)?python -m compare ([^`\n]+)`", README)
    assert len(inline) >= 3
    for text in inline:
        with pytest.raises(SystemExit) as ended:
            main([*shlex.split(text), "--help"])
        assert ended.value.code == 0, text
    capsys.readouterr()


def test_the_first_line_of_the_output_is_the_one_that_is_shown(tmp_path, monkeypatch):
    (shown,) = (text.strip() for text in blocks("text") if text.startswith("reference:"))
    monkeypatch.chdir(tmp_path)
    Path("robot.xml").write_text(PENDULUM)
    assert compared_with(None, "robot.xml").reference.lines[0] == shown


def test_the_answer_for_a_step_is_the_one_that_is_shown():
    """Its sentence about a file of the tests, from the same rows."""
    (shown,) = (text.strip() for text in blocks("text") if text.startswith("Stable at its own"))
    found = reading.read(PATHS["arm7"])
    robot = robot_of(found, "arm7.xml")
    predicted = [predicted_at(robot, name, found) for name in robot.positions]
    full = [row for one in predicted for row in full_at(one, list(INTEGRATORS), found)]
    rows = limit_rows(predicted, found.dt, found.integrator)
    assert at_the_top(rows, full, True, circumstances(predicted)) == shown


@pytest.mark.parametrize("text", blocks("toml"))
def test_scenes_are_read(text, tmp_path):
    path = tmp_path / "my.toml"
    path.write_text(text)
    assert tomllib.loads(text)["scene"][0]["name"] == read_scenes(path, ARM)[0].name


def test_own_equations_on_the_command_line_run_as_the_readme_has_them(tmp_path, monkeypatch, capsys):
    """Its line and that of the help of diagnosis, with the two pendulums of its example and quick."""
    text = blocks("python")[0].rsplit("\n\n", 1)[0]
    assert "assert_agrees" not in text
    (tmp_path / "my_equations.py").write_text(text + "\n")
    names = run(text, tmp_path, monkeypatch)
    (tmp_path / "robot.xml").write_text(names["mjcf"])
    lines = [shlex.split(line)[3:] for line in commands() if "--reference my_equations.py:" in line]
    assert [line[0] for line in lines] == ["all", "mass", "diagnosis"]
    assert main([*lines[2], "--quick", "--out", "out"]) == 1
    assert "coefficient of knee'^2" in Path("out/report.md").read_text(encoding="utf-8")
    assert Path("out/figures/diagnosis_nearest.png").stat().st_size > 5000  # the picture beside it
    assert sorted(os.listdir()) == ["my_equations.py", "out", "robot.xml"]
    capsys.readouterr()
