"""The README: its figures are those of reports/example, its Python runs, its output is what is printed."""

import csv
import json
import os
import re
import traceback
from itertools import pairwise

import numpy as np
import pytest
from helpers.shown import BLOCKS, README, ROOT, blocks

from compare.run.reference import compared_with

EXAMPLE = ROOT / "reports" / "example"
PENDULUM = """<mujoco><worldbody><body><joint name="hip" axis="0 1 0"/><inertial pos="0 0 -1" mass="1" diaginertia="1 1 1"/>
<body><joint name="knee" axis="1 0 0"/><inertial pos="0 0 -1" mass="1" diaginertia="1 1 1"/></body></body></worldbody></mujoco>"""
NUMBER = re.compile(r"(?<![\w])[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


def test_it_is_short_and_has_all_that_it_links():
    assert BLOCKS and {language for language, _ in BLOCKS} <= {"python", "sh", "text", "toml"}
    assert len(BLOCKS) == README.count("\n```") / 2 and len(README.splitlines()) <= 160
    linked = re.findall(r"\]\(([^)]+)\)", README)
    pictures = [ROOT / name for name in linked if name.endswith((".png", ".gif"))]
    assert len(pictures) == 2 and (ROOT / "reports" / "page.png").stat().st_size < 150_000
    assert all((ROOT / name).exists() for name in linked)
    prose = re.sub(r"(?ms)^```.*?^```$", "", README)
    assert len(re.findall(r"\S*\w\S*", prose)) <= 900


def test_the_example_workflow_runs_what_the_readme_shows():
    text = (ROOT / ".github" / "example" / "models.yml").read_text(encoding="utf-8")
    assert re.findall(r"run: (python -m compare .*)", text) == re.findall(
        r"(?m)^python -m compare all .*urdf .*$", README
    )


def table(name):
    with open(EXAMPLE / "tables" / f"{name}.csv", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def largest(rows, **where):
    return max(float(row["largest_difference"]) for row in rows if where.items() <= row.items())


def test_its_figures_are_those_of_the_example():
    results = json.loads((EXAMPLE / "results.json").read_text(encoding="utf-8"))
    command = results["provenance"]["command"]
    assert results["passed"] and command.endswith("-m compare all --out reports/example")
    rows = [row for row in table("stability") if row["predicted_dt_s"] and row["observed_dt_s"]]
    off = [float(row["observed_dt_s"]) / float(row["predicted_dt_s"]) - 1.0 for row in rows]
    text = (EXAMPLE / "report.md").read_text(encoding="utf-8")
    worst = re.search(r"rounding tolerance(?:: | is .*?, )(\d+ %)", text)[1]
    of_free = {"engine_integrator": "RK4", "dt_s": "0.078125", "unit": "rad", "level": "open loop"}
    free = [row for row in table("trajectory") if row["scene"].endswith(", free")]
    followed = {"engine": "mujoco", "method": "RK4", "dt_s": "0.078125", "scene": "ball catch, free"}
    (error,) = [float(row["worst_error_rad"]) for row in table("speed") if followed.items() <= row.items()]
    text = " ".join(README.partition("## The arm, the assignment")[2].split())
    for figure in (
        f"{len(results['checks'])} checks", f"{largest(table('mass'), quantity='Mbar', scene='random states'):.1e} kg m2",
        f"{largest(table('acceleration'), quantity='qdd', scene='random states'):.1e} rad/s2", worst,
        f"{largest(free, **of_free):.1e} rad", f"{error:.2g} rad", f"{len(off)} step limits",
        f"{100.0 * max(map(abs, off)):.2g} %",
    ):  # fmt: skip
        assert figure in text, figure
    rows = [row for row in table("evaluations") if row["quantity"] == "forward_dynamics"]
    times = [(row["implementation"], float(row["ns_per_state"] or "inf")) for row in rows]
    mujoco = min(time for name, time in times if name == "MuJoCo, mj_forward")
    compiled = min(time for name, time in times if name == "compiled")
    assert f"is {mujoco / compiled:.0f} times as fast as mj_forward per evaluation" in README
    for target in ("0.001", "1e-09"):
        uses = [
            row
            for row in table("what_should_i_use")
            if (row["scene"], row["target_rad"]) == ("bent, free", target)
        ]
        mujoco, by_tmt = (
            next(row for row in uses if row["engine"] == engine) for engine in ("mujoco", "tmt")
        )
        assert f"{cheapest(mujoco)} | {cheapest(by_tmt)} | {float(mujoco['over_cheapest']):.0f} |" in README


def cheapest(row):
    """A row of what_should_i_use.csv as the README has it."""
    time = float(row["ms"])
    return f"{row['method']}, {row['steps']} steps | {f'{time:.0f}' if time >= 10.0 else f'{time:.2g}'}"


@pytest.mark.parametrize("text", blocks("python"), ids=lambda text: text.splitlines()[0])
def test_python_runs_as_it_is_printed(text, tmp_path, monkeypatch):
    """A block that fails does so with the message that the next block shows."""
    following = next((after for block, after in pairwise(BLOCKS) if block[1] == text), ("", ""))
    names = {"__name__": "readme"}
    monkeypatch.chdir(tmp_path)  # which has nothing but what the block's tests read
    try:
        exec(compile(text, "what is shown", "exec"), names)
    except AssertionError as error:
        printed = "".join(traceback.format_exception_only(error))
        assert following[0] == "text" and same(printed, following[1]), printed
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
    """The same words, and the same numbers except for their last digits."""
    one, other = ([line.rstrip() for line in text.strip().splitlines()] for text in (printed, shown))
    numbers = [list(map(float, NUMBER.findall("\n".join(lines)))) for lines in (one, other)]
    words = [NUMBER.sub("#", "\n".join(lines)) for lines in (one, other)]
    return words[0] == words[1] and len(numbers[0]) == len(numbers[1]) and np.allclose(*numbers, rtol=1e-9)
