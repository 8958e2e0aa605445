"""Small runs that take long: functions that return what they find, so that they can be computed in a further process.

The tests run one after the other. Where all of them are run, `Beside` computes these at the same time, on the other core.
"""

from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

from crane import crane
from model_edits import EDITS, failing

from compare import experiment
from compare.engines.mujoco import load, parse
from compare.experiments import EXPERIMENTS, module, skipped
from compare.report import files, verdict
from compare.robots.arm import ARM


def of_arm(name):
    """The result of an experiment on the arm, every path with few states and steps."""
    return module(name).rows(experiment.Setup.small(ARM, experiment.engines(load(ARM.mjcf, ARM.tree))))


def on_the_moon(name):
    """The same, with gravity 1.62 in the file; and the captions of its figures."""
    text = ARM.mjcf.read_text(encoding="utf-8").replace("0 0 -9.81", "0 0 -1.62")
    result = module(name).rows(experiment.Setup.small(ARM, experiment.engines(parse(text, ARM.tree))))
    return result, [draw()[2] for draw in module(name).figures(result, ARM)]


class Here:
    """Workers that do what they are asked in this process, at once."""

    def submit(self, function, *arguments):
        value = function(*arguments)
        return SimpleNamespace(result=lambda: value)


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
        reasons = {name: reason for name in EXPERIMENTS if (reason := skipped(name, robot))}
        sections, causes, _ = experiment.examine(
            [n for n in EXPERIMENTS if n not in reasons], setup, folder, lines, Here()
        )
        words = verdict.verdict(sections, len(EXPERIMENTS), causes)
        report = verdict.Report(sections, robot, {"command": "c"}, words, causes, list(reasons.items()))
        files.write(folder, report)
        texts = {name: (folder / name).read_text(encoding="utf-8") for name in ("report.md", "results.json")}
        sizes = {path.stem: path.stat().st_size for path in (folder / "figures").iterdir()}
    for section in sections:
        section.result.curves = {}  # which need not be sent
    return SimpleNamespace(sections=sections, reasons=reasons, lines=lines, texts=texts, sizes=sizes)


JOBS = (  # in the order in which the tests ask for them
    *((of_arm, name) for name in ("reduction", "stability")),
    (on_the_moon, "stability"),
    *((of_arm, name) for name in EXPERIMENTS if name not in ("reduction", "stability")),
    (of_crane,),
    *((failing, old, new) for old, new, _ in EDITS.values()),
)


class Beside:
    """A further process, or none: then what is asked for is computed at once."""

    def __init__(self, jobs):
        self.pool = get_context("spawn").Pool(1) if jobs else None
        self.under_way = {job: self.pool.apply_async(job[0], job[1:]) for job in jobs}

    def result(self, *job):
        """What a function returns for its arguments."""
        return self.under_way[job].get() if job in self.under_way else job[0](*job[1:])

    def end(self):
        if self.pool:
            self.pool.terminate()
            self.pool.join()
