"""A robot of four hinges goes through every experiment that can serve it, with figures, and nothing in compare knows it."""

import json

import pytest
from crane import TREE
from small_runs import of_crane

from compare.experiments import EXPERIMENTS


@pytest.fixture(scope="module")
def made(beside):
    """A small run of everything."""
    return beside.result(of_crane)


def test_only_what_is_printed_of_the_arm_is_skipped_and_says_why(made):
    assert set(made.reasons) == {"published"} and "crane" in made.reasons["published"]


@pytest.mark.parametrize("name", [name for name in EXPERIMENTS if name not in ("published", "diagnosis")])
def test_the_experiment_passes_and_draws(made, name):
    section = next(section for section in made.sections if section.name == name)
    failed = [str(check) for check in section.result.checks if not check.passed]
    assert not failed and section.result.checks
    assert section.figures
    for figure, caption in section.figures:
        assert made.sizes[figure] > 5000
        assert caption and "nan" not in caption.split()


def test_the_report_speaks_of_this_robot(made):
    text = made.texts["report.md"]
    assert text.startswith("# TMT and MuJoCo compared on crane")
    assert "Crane, five rigid bodies on four hinges, modelled twice" in text and "| published |  | skipped | " in text
    for word in ("alpha", "gamma", "forearm", "ball catch", "assignment", "α"):
        assert word not in text, word
    assert all(joint in text for joint in TREE.hinge_names)
    results = json.loads(made.texts["results.json"])
    assert results["passed"] and [skip["experiment"] for skip in results["skipped"]] == ["published"]
