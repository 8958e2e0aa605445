"""One comparison of the command line: compute, draw, write the report, print the verdict."""

import argparse
import importlib
import json
import os
import sys
import time
import webbrowser
from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import Refused
from ..core.finding import Finding
from ..core.text import block, say
from ..engines.mujoco import ModelError
from ..engines.own import OwnError
from ..experiments import EXPERIMENTS, skipped
from ..process import interrupt
from ..process.streams import Stream
from ..process.workers import WorkerEnded, start_workers
from ..report.folder import UNCHANGED, exchange, has_report, new_report
from ..report.terminal import Terminal
from ..robots import Robot
from ..robots.case import SEED
from ..robots.scene_file import SceneError, read_scenes
from ..robots.states import MOST_SPEEDS
from .reference import Compared, compared_with

if TYPE_CHECKING:  # they take long to load
    from ..report.verdict import Report
    from .examine import Examined, Run

# modules that take long to load
DRAWING, COMPUTING = "compare.report.style", "tmt.compiled.machine"
INTERRUPTED = "interrupted"  # folder in that of an earlier report


def carry_out(options: argparse.Namespace, command: str) -> int:
    """Compare the models and write the report; the exit status. Refused: that is not possible."""
    started, terminal, is_alone = time.perf_counter(), Terminal(options.json), options.experiment != "all"
    given, path = options.mjcf or "", os.path.abspath(options.mjcf) if options.mjcf else None
    out = Path(options.out).absolute()  # a user's own code may change the current folder
    for name in ("scenes", "controls", "write"):
        value = getattr(options, name)
        setattr(options, name, value and os.path.abspath(value))
    try:
        asked = options.reference, path, options.joints, given or None
        compared = compared_with(*asked, floating=options.floating)
        if options.scenes:
            scenes = read_scenes(options.scenes, compared.robot)
            compared = compared._replace(robot=compared.robot.with_scenes(scenes))
        if is_alone and (reason := skipped(options.experiment, compared.robot, options.engines)):
            about = {"experiment": options.experiment, "robot": compared.robot.name, "reason": say(reason)}
            raise Refused(block("run", "does_not_apply", **about))
        with new_report(out, options.out) as folder:
            report = compute(options, command, compared, folder, terminal)
    except WorkerEnded as error:
        raise Refused(f"{error}; {interrupt.Now.outcome}") from None
    except (ModelError, OwnError, SceneError) as error:
        raise Refused(str(error).replace(str(path), given)) from None
    page, seconds = os.path.join(options.out, "index.html"), time.perf_counter() - started
    outcome, answer = report.verdict.split("\n"), report.answer if is_alone else []
    parts = (answer, outcome) if report.answers_first else (outcome, answer)
    terminal.say()
    terminal.say_lines(
        [line for part in parts for line in part], "bold green" if report.passed else "bold red"
    )
    terminal.say(block("run", "report", path=page, seconds=seconds))
    if options.json:
        printed = {
            "passed": report.passed,
            "verdict": outcome,
            "answer": report.answer,
            "causes": [cause.record() for cause in report.causes],
            "report": page,
        }
        print(json.dumps(printed, indent=1), file=Stream(sys.stdout), flush=True)
    if options.open:
        webbrowser.open((out / "index.html").as_uri())
    return 0 if report.passed else 1


def compute(
    options: argparse.Namespace, command: str, compared: Compared, folder: Path, terminal: Terminal
) -> "Report":
    """Run the experiments and write the report to a folder; see write_report."""
    is_alone, robot, started = options.experiment != "all", compared.robot, time.perf_counter()
    request = compared.request_of(options)
    answers = is_alone and EXPERIMENTS[options.experiment].first_screen  # a question about the file as it is
    terminal.say_lines(compared.reference.warned if answers else compared.reference.lines)
    if robot.coordinates.nv > MOST_SPEEDS:
        terminal.say(say(Finding("shared", "large", {"speeds": robot.coordinates.nv, "most": MOST_SPEEDS})))
    names, reasons = applying([options.experiment] if is_alone else [*EXPERIMENTS], robot, options.engines)
    run: Run | None = None

    def written(is_complete: bool = True) -> "Report":
        assert run is not None
        found = run.examined() if is_complete else run.finished()
        times = {"seconds": round(time.perf_counter() - started, 1)} | durations(run.clock)
        return write_report(folder, found, reasons, origin | times, compared, names * (not is_complete))

    def write_finished() -> None:
        """After an interrupt: the experiments that are finished, beside an earlier report."""
        if run is None or not any(name in run.clock.ended for name in names):
            return
        is_beside = has_report(folder.parent)
        shown = Path(options.out, INTERRUPTED) if is_beside else Path(options.out)
        written(False)
        exchange(folder, folder.parent / INTERRUPTED if is_beside else folder.parent, shown)
        state = f"; {UNCHANGED}" if is_beside else ""
        interrupt.on_interrupt(f"the experiments that were finished are in {shown / 'index.html'}{state}")

    with ExitStack() as after, start_workers() as workers, terminal.progress("imports"):
        after.push(lambda kind, *_: write_finished() if kind is KeyboardInterrupt else None)
        for module in (DRAWING, COMPUTING)[: 1 if is_alone else 2]:  # in further processes at the same time
            workers.submit(importlib.import_module, module)
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
        run = examine.Run(names, setup, folder, terminal, workers, workers.clock)
        return written()


def applying(
    names: Sequence[str], robot: Robot, engines: str | None = None
) -> tuple[list[str], dict[str, str]]:
    """The experiments that apply to a robot, and of the others why they do not."""
    reasons = {name: say(reason) for name in names if (reason := skipped(name, robot, engines))}
    return [name for name in names if name not in reasons], reasons


def write_report(
    folder: Path, examined: "Examined", reasons: dict[str, str], origin: dict[str, Any], compared: Compared,
    interrupted: Sequence[str] = (),
) -> "Report":  # fmt: skip
    """Write a report with its verdict to a folder that has its figures.

    interrupted: the names of all experiments of a run that was ended, of which some are finished.
    """
    from ..report import files, verdict

    sections, causes, needless = examined
    reference, robot, *_ = compared
    count = len(interrupted or EXPERIMENTS) - len(needless)
    subject = block("run", "subject", kind=reference.kind)
    words = verdict.verdict(sections, count, causes, subject, robot.name)
    left_out = reasons | needless
    if interrupted:
        names = [section.name for section in sections]
        numbers = {"finished": len(names), "experiments": len(interrupted)}
        words = f"{block('verdict', 'interrupted', **numbers)}\n{words}"
        left_out |= {name: block("run", "interrupted") for name in interrupted if name not in names}
    named = {"kind": reference.kind, "name": reference.name}
    plain = compared.mujoco.plain(robot.case())
    about = words, causes, list(left_out.items()), named, reference.lines, plain, not interrupted
    report = verdict.Report(sections, robot, origin, *about)
    files.write(folder, report)
    return report
