"""A robot of four hinges goes through every experiment that can serve it, and nothing in compare knows it."""

import json
import re

import pytest
from crane import TREE, crane
from small_runs import of_crane

from compare import experiment
from compare.engines.mujoco import load
from compare.experiments import EXPERIMENTS, skipped

STATIC = ("parameters", "kinematics", "mass", "gravity", "acceleration")


def test_all_experiments_of_single_states_pass_but_that_of_printed_numbers(tmp_path):
    robot = crane(tmp_path)
    assert [name for name in EXPERIMENTS if skipped(name, robot)] == ["published"]
    setup = experiment.Setup.small(robot, experiment.engines(load(robot.mjcf, robot.tree)))
    for name in STATIC:
        checks = experiment.module(name).rows(setup).checks
        assert checks and [str(check) for check in checks if not check.passed] == []


@pytest.mark.slow
def test_all_experiments_pass_and_draw_and_the_report_is_of_this_robot(shared):
    made = shared(of_crane)
    for section in made.sections:
        assert section.name == "diagnosis" or section.result.checks
        assert [str(check) for check in section.result.checks if not check.passed] == []
        for figure, caption in section.figures:
            assert made.sizes[figure] > 5000 and caption and "nan" not in caption.split()
    text, results = made.texts["report.md"], json.loads(made.texts["results.json"])
    assert not re.search(r"alpha|gamma|forearm|ball catch|assignment|α", text)
    assert all(joint in text for joint in TREE.hinge_names) and results["passed"]
