"""Small runs that several tests look at, which the fixtures `shared` and `small` of conftest.py compute once."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

from crane import crane
from in_process import InProcess

from compare.core.text import say
from compare.engines.mujoco import load
from compare.experiments import EXPERIMENTS, module, skipped
from compare.report import files, verdict
from compare.robots.arm import ARM
from compare.run import examine as experiment


@cache
def of_arm(name):
    """The result of an experiment on the arm, every path with few states and steps."""
    return module(name).rows(experiment.Setup.small(ARM, experiment.engines(load(ARM.mjcf, ARM.tree))))


class Lines(list):
    """A terminal that keeps what is said."""

    def say(self, text="", style=""):
        self.append(text)


def of_crane():
    """Of the robot of four hinges: sections, reasons for what is skipped, lines, report.md, results.json, sizes of figures."""
    with TemporaryDirectory() as place:
        folder, lines = Path(place), Lines()
        robot = crane(folder)
        setup = experiment.Setup.small(robot, experiment.engines(load(robot.mjcf, robot.tree)))
        reasons = {name: say(reason) for name in EXPERIMENTS if (reason := skipped(name, robot))}
        names = [name for name in EXPERIMENTS if name not in reasons]
        sections, causes, _ = experiment.examine(names, setup, folder, lines, InProcess())
        words = verdict.verdict(sections, len(EXPERIMENTS), causes)
        report = verdict.Report(sections, robot, {"command": "c"}, words, causes, list(reasons.items()))
        files.write(folder, report)
        texts = {name: (folder / name).read_text(encoding="utf-8") for name in ("report.md", "results.json")}
        figures = (folder / "figures").iterdir()
        sizes = {path.name.removesuffix(".png"): path.stat().st_size for path in figures}
    return SimpleNamespace(sections=sections, reasons=reasons, lines=lines, texts=texts, sizes=sizes)
