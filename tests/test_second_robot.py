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


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return crane(tmp_path_factory.mktemp("crane"))


@pytest.mark.parametrize("name", STATIC)
def test_an_experiment_of_single_states_passes(robot, name):
    setup = experiment.Setup.small(robot, experiment.engines(load(robot.mjcf, robot.tree)))
    checks = experiment.module(name).rows(setup).checks
    assert checks and [str(check) for check in checks if not check.passed] == []


def test_only_printed_numbers_are_of_the_arm_alone(robot):
    assert [name for name in EXPERIMENTS if skipped(name, robot)] == ["published"]


@pytest.mark.slow
def test_all_experiments_pass_and_draw_and_the_report_is_of_this_robot(shared):
    made = shared(of_crane)
    for section in made.sections:
        assert section.name == "diagnosis" or section.result.checks
        assert [str(check) for check in section.result.checks if not check.passed] == []
        for figure, caption in section.figures:
            assert made.sizes[figure] > 5000 and caption and "nan" not in caption.split()
    assert {section.name for section in made.sections if section.figures} >= {*EXPERIMENTS} - {"published", "diagnosis"}
    text = made.texts["report.md"]
    assert not re.search(r"alpha|gamma|forearm|ball catch|assignment|α", text)
    assert "crane" in text and all(joint in text for joint in TREE.hinge_names)
    results = json.loads(made.texts["results.json"])
    assert results["passed"] and [skip["experiment"] for skip in results["skipped"]] == ["published"]
