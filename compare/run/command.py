"""One comparison of the command line: compute, draw, write the report, print the verdict."""

import argparse
import os
import time
from functools import partial
from pathlib import Path

from ..core.errors import Refused
from ..core.finding import Finding
from ..core.text import say
from ..engines.mujoco import ModelError
from ..engines.own.own_file import OwnFileError
from ..experiments import EXPERIMENTS, skipped
from ..process.streams import say_error
from ..process.workers import WorkerEnded, load_modules, start_workers
from ..report.folder import FolderError, new_report
from ..report.terminal import Terminal
from ..robots.case import SEED
from ..robots.scene_file import SceneError, read_scenes
from ..robots.states import MOST_SPEEDS
from .reference import Compared, compared_with

COMPUTING = ("compare.run.examine", "tmt.compiled.machine")  # modules that take long to load
DRAWING = ("compare.report.style", *COMPUTING)


def carry_out(options: argparse.Namespace, command: str) -> int:
    """Compare the models and write the report; the exit status. Refused: the request cannot be carried out."""
    started, terminal = time.perf_counter(), Terminal()
    try:
        compared = compared_with(options.reference, options.mjcf, options.joints)
        if options.scenes:
            compared = compared._replace(
                robot=compared.robot.with_scenes(read_scenes(options.scenes, compared.robot))
            )
        if options.experiment != "all" and (reason := skipped(options.experiment, compared.robot)):
            raise Refused(f"{options.experiment} does not apply to {compared.robot.name}: {say(reason)}")
        with new_report(options.out) as folder:
            report, parts = compute(options, command, compared, folder, terminal)
    except (ModelError, OwnFileError, SceneError, FolderError, WorkerEnded) as error:
        raise Refused(error) from None
    from ..report.verdict import passed

    good = passed(report.sections) and not parts.broken
    terminal.say()
    for number, line in enumerate(report.verdict.split("\n")):
        terminal.say(line, "" if number else "bold green" if good else "bold red")
    for line in parts.lines:
        say_error(line)
    terminal.say(f"Report: {os.path.join(options.out, 'index.html')} ({time.perf_counter() - started:.1f} s)")
    for line in report.answer if options.experiment != "all" else ():
        terminal.say(line)
    return 0 if good else 1


def compute(options, command: str, compared: Compared, folder: Path, terminal: Terminal) -> tuple:
    """Run the experiments and write the report to a folder; see write_report."""
    is_alone, robot, started = options.experiment != "all", compared.robot, time.perf_counter()
    step = compared.integrator_step(options.dt, options.integrator)
    for line in compared.reference.lines:
        terminal.say(line)
    if robot.coordinates.nv > MOST_SPEEDS:
        terminal.say(say(Finding("shared", "large", {"speeds": robot.coordinates.nv, "most": MOST_SPEEDS})))
    names = [options.experiment] if is_alone else list(EXPERIMENTS)
    with start_workers() as workers, terminal.progress("imports"):
        for modules in (DRAWING, COMPUTING)[: len(names)]:  # in further processes at the same time
            workers.submit(load_modules, *modules)
        from ..report.provenance import durations, provenance
        from . import examine

        reasons = {name: say(reason) for name in names if (reason := skipped(name, robot))}
        names = [name for name in names if name not in reasons]
        origin = provenance(command, robot.mjcf, compared.reference.file, SEED)  # of the model as it was read
        more = {"map": workers.map, "quiet": workers.quiet, "progress": terminal.show}
        setup = examine.setup_of(compared, options.quick, alone=is_alone, step=step, **more)
        for name, reason in reasons.items():
            terminal.say(f"{name:<13} skipped: {reason}")
        terminal.tell(partial(examine.progress, workers.clock, names))
        outcome = examine.examine(names, setup, folder, terminal, workers, workers.clock)
    origin |= {"seconds": round(time.perf_counter() - started, 1)} | durations(workers.clock)
    return write_report(folder, *outcome, list(reasons.items()), origin, compared)


def write_report(
    folder: Path, sections, causes, needless, skipped, origin: dict, compared: Compared
) -> tuple:
    """Write a report with its verdict to a folder that has its figures: the verdict.Report and its Parts.

    sections, causes, needless: see examine; skipped, origin: see Report.
    """
    from ..report import files, verdict

    parts, count = verdict.Parts(), len(EXPERIMENTS) - len(needless)
    subjects = {"model": "TMT and MuJoCo", "own": "Your equations and MuJoCo"}
    of = subjects.get(compared.reference.kind, "The two models"), compared.robot.name
    words = parts.attempt("the verdict", "No verdict.", verdict.verdict, sections, count, causes, *of)
    skipped = [*skipped, *needless.items()]
    report = verdict.Report(sections, compared.robot, origin, words, causes, skipped, compared.reference)
    return report, files.write(folder, report, parts)
