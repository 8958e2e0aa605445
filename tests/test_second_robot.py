"""A robot of four hinges goes through every experiment that can serve it, with figures, and nothing in compare knows it."""

import json
from types import SimpleNamespace

import pytest
from crane import crane

from compare import experiment
from compare.engines.mujoco import load
from compare.experiments import EXPERIMENTS, skipped
from compare.report import files, verdict


class Here:
    """Workers that do what they are asked in this process, at once."""

    def submit(self, function, *arguments):
        value = function(*arguments)
        return SimpleNamespace(result=lambda: value)


class Lines(list):
    """A terminal that keeps what is said."""

    def say(self, text="", style=""):
        self.append(text)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Robot, sections, report folder and lines of a small run of everything."""
    folder, lines = tmp_path_factory.mktemp("report"), Lines()
    robot = crane(tmp_path_factory.mktemp("model"))
    setup = experiment.Setup.small(robot, experiment.engines(load(robot.mjcf, robot.tree)))
    reasons = {name: reason for name in EXPERIMENTS if (reason := skipped(name, robot))}
    sections, causes = experiment.examine([n for n in EXPERIMENTS if n not in reasons], setup, folder, lines, Here())
    words = verdict.verdict(sections, len(EXPERIMENTS), causes)
    files.write(folder, sections, robot, {"command": "c"}, words, causes, list(reasons.items()))
    return SimpleNamespace(robot=robot, sections=sections, folder=folder, lines=lines, reasons=reasons)


def test_only_what_is_printed_of_the_arm_is_skipped_and_says_why(made):
    assert set(made.reasons) == {"published"} and "crane" in made.reasons["published"]


@pytest.mark.parametrize("name", [name for name in EXPERIMENTS if name != "published"])
def test_the_experiment_passes_and_draws(made, name):
    section = next(section for section in made.sections if section.name == name)
    failed = [str(check) for check in section.result.checks if not check.passed]
    assert not failed and section.result.checks
    assert section.figures
    for figure, caption in section.figures:
        assert (made.folder / "figures" / f"{figure}.png").stat().st_size > 5000
        assert caption and "nan" not in caption.split()


def test_the_report_speaks_of_this_robot(made):
    text = (made.folder / "report.md").read_text(encoding="utf-8")
    assert text.startswith("# TMT and MuJoCo compared on crane")
    assert "Crane, five rigid bodies on four hinges, modelled twice" in text and "published: " in text
    for word in ("alpha", "gamma", "forearm", "ball catch", "assignment", "α"):
        assert word not in text, word
    for joint in made.robot.joints:
        assert joint in text
    results = json.loads((made.folder / "results.json").read_text(encoding="utf-8"))
    assert results["passed"] and [skip["experiment"] for skip in results["skipped"]] == ["published"]
