"""One comparison of the command line: compute, draw, write the report, print the verdict."""

import argparse
import os
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import Refused
from ..core.finding import Finding
from ..core.text import block, say
from ..engines.mujoco import ModelError
from ..engines.own import OwnError
from ..experiments import EXPERIMENTS, skipped
from ..process.streams import say_error
from ..process.workers import WorkerEnded, load_modules, start_workers
from ..report.folder import new_report
from ..report.terminal import Terminal
from ..robots import Robot
from ..robots.case import SEED
from ..robots.scene_file import SceneError, read_scenes
from ..robots.states import MOST_SPEEDS
from .reference import Compared, compared_with

if TYPE_CHECKING:  # they take long to load
    from ..report.verdict import Parts, Report
    from .examine import Examined

Written = tuple["Report", "Parts"]
COMPUTING = "compare.run.examine", "tmt.compiled.machine"  # modules that take long to load
DRAWING = "compare.report.style", *COMPUTING


def carry_out(options: argparse.Namespace, command: str) -> int:
    """Compare the models and write the report; the exit status. Refused: that is not possible."""
    started, terminal, is_alone = time.perf_counter(), Terminal(), options.experiment != "all"
    try:
        compared = compared_with(options.reference, options.mjcf, options.joints, floating=options.floating)
        if options.scenes:
            scenes = read_scenes(options.scenes, compared.robot)
            compared = compared._replace(robot=compared.robot.with_scenes(scenes))
        if is_alone and (reason := skipped(options.experiment, compared.robot, options.engines)):
            about = {"experiment": options.experiment, "robot": compared.robot.name, "reason": say(reason)}
            raise Refused(block("run", "does_not_apply", **about))
        with new_report(options.out) as folder:
            report, parts = compute(options, command, compared, folder, terminal)
    except (ModelError, OwnError, SceneError, WorkerEnded) as error:
        raise Refused(error) from None
    good = report.passed and not parts.broken
    terminal.say()
    terminal.say_lines(report.verdict.split("\n"), "bold green" if good else "bold red")
    for line in parts.lines:
        say_error(line)
    path, seconds = os.path.join(options.out, "index.html"), time.perf_counter() - started
    terminal.say(block("run", "report", path=path, seconds=seconds))
    terminal.say_lines(report.answer if is_alone else ())
    return 0 if good else 1


def compute(
    options: argparse.Namespace, command: str, compared: Compared, folder: Path, terminal: Terminal
) -> Written:
    """Run the experiments and write the report to a folder; see write_report."""
    is_alone, robot, started = options.experiment != "all", compared.robot, time.perf_counter()
    request = compared.request_of(options)
    terminal.say_lines(compared.reference.lines)
    if robot.coordinates.nv > MOST_SPEEDS:
        terminal.say(say(Finding("shared", "large", {"speeds": robot.coordinates.nv, "most": MOST_SPEEDS})))
    names, reasons = applying([options.experiment] if is_alone else [*EXPERIMENTS], robot, options.engines)
    with start_workers() as workers, terminal.progress("imports"):
        for modules in (DRAWING, COMPUTING)[: 1 if is_alone else 2]:  # in further processes at the same time
            workers.submit(load_modules, *modules)
        from ..report.provenance import durations, provenance
        from . import examine

        origin = provenance(command, robot.mjcf, compared.reference.file, SEED)  # of the model as it was read
        of_run: dict[str, Any] = {"map": workers.map, "quiet": workers.quiet, "progress": terminal.show}
        of_run["tell"] = terminal.say
        of_run |= {"alone": is_alone, "request": request, "command": command}
        setup = examine.setup_of(compared, options.quick, options.engines, **of_run)
        for name, reason in reasons.items():
            terminal.say(block("run", "skipped", name=name, reason=reason))
        terminal.how_far = partial(examine.progress, workers.clock, names)
        examined = examine.Run(names, setup, folder, terminal, workers, workers.clock).examined()
    origin |= {"seconds": round(time.perf_counter() - started, 1)} | durations(workers.clock)
    return write_report(folder, examined, reasons, origin, compared)


def applying(
    names: Sequence[str], robot: Robot, engines: str | None = None
) -> tuple[list[str], dict[str, str]]:
    """The experiments that apply to a robot, and of the others why they do not."""
    reasons = {name: say(reason) for name in names if (reason := skipped(name, robot, engines))}
    return [name for name in names if name not in reasons], reasons


def write_report(
    folder: Path, examined: "Examined", reasons: dict[str, str], origin: dict[str, Any], compared: Compared
) -> Written:
    """Write a report with its verdict to a folder that has its figures; what could not be made of it."""
    from ..report import files, verdict

    parts, (reference, robot, *_) = verdict.Parts(), compared
    sections, causes, needless = examined
    count, subject = len(EXPERIMENTS) - len(needless), block("run", "subject", kind=reference.kind)
    about = sections, count, causes, subject, robot.name
    words = parts.attempt("the verdict", "No verdict.", verdict.verdict, *about)
    left_out, named = list((reasons | needless).items()), {"kind": reference.kind, "name": reference.name}
    report = verdict.Report(sections, robot, origin, words, causes, left_out, named, reference.lines)
    return report, files.write(folder, report, parts)
