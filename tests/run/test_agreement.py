"""Every experiment agrees with MuJoCo on the arm, and on a second robot, which nothing in compare knows.

How many it makes stands in the golden report, so that none is dropped unseen.
"""

import json
import re

import numpy as np
import pytest
from helpers.crane import crane
from helpers.in_process import InProcess, Lines

import tmt
from compare.core.text import say
from compare.engines.mujoco import parse
from compare.experiments import EXPERIMENTS, skipped
from compare.report import files, verdict
from compare.robots.arm import ARM
from compare.run.examine import Run, Setup, engines

NAMES = [name for name in EXPERIMENTS if not skipped(name, ARM)]


@pytest.mark.parametrize("experiment", NAMES)
def test_experiment_agrees(experiment, small):
    """With few states and steps. "parameters" ties the numbers of tmt/arm.py to those of mjcf/arm.xml."""
    result = small(experiment)
    assert result.checks
    assert [str(check) for check in result.checks if not check.passed] == []


def test_states_move_and_engines_do_not_have_the_same_bits(setup):
    """Were every difference zero, one engine would be compared with itself."""
    q, qd, tau = setup.random.q, setup.random.qd, setup.random.tau
    assert np.abs(tmt.acceleration(tmt.ARM, q, qd, tau)).mean() > 10.0
    assert np.abs(tmt.energy(tmt.ARM, q, qd)).mean() > 1.0
    ours, theirs = setup.compared().values()
    assert np.abs(ours.mass_matrix(q) - theirs.mass_matrix(q)).max() > 0.0
    assert np.abs(ours.bias(q, qd) - theirs.bias(q, qd)).max() > 0.0 and np.abs(ours.bias(q, qd)).mean() > 1.0


@pytest.mark.slow
def test_all_experiments_pass_and_draw_and_the_report_is_of_the_second_robot(tmp_path):
    robot = crane(tmp_path)
    reasons = {name: say(reason) for name in EXPERIMENTS if (reason := skipped(name, robot))}
    assert [name for name in reasons if name != "engines"] == ["published", "stability"]
    setup = Setup.small(robot, engines(parse(robot.mjcf, robot.tree)))
    names = [name for name in EXPERIMENTS if name not in reasons]
    run = Run(names, setup, tmp_path, Lines(), InProcess()).examined()
    words = verdict.verdict(run.sections, len(EXPERIMENTS), run.causes)
    report = verdict.Report(run.sections, robot, {"command": "c"}, words, run.causes, list(reasons.items()))
    files.write(tmp_path, report)
    figures = tmp_path.joinpath("figures").iterdir()
    sizes = {path.name.removesuffix(".png"): path.stat().st_size for path in figures}
    for section in run.sections:
        assert section.name == "diagnosis" or section.result.checks
        assert [str(check) for check in section.result.checks if not check.passed] == []
        assert all(sizes[figure] > 5000 and caption for figure, caption in section.figures)
    text, results = ((tmp_path / name).read_text(encoding="utf-8") for name in ("report.md", "results.json"))
    assert not re.search(r"alpha|gamma|forearm|ball catch|assignment|α", text)
    assert all(joint in text for joint in robot.joints) and json.loads(results)["passed"]
