"""One comparison of the command line: compute, draw, write the report, print the answer."""

import importlib
import json
import os
import sys
import time
import webbrowser
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import Refused
from ..core.finding import Finding
from ..core.text import block, say
from ..engines.mujoco import ModelError
from ..engines.own import OwnError
from ..experiments import EXPERIMENTS, skipped
from ..experiments.options import Options
from ..process import interrupt
from ..process.streams import Stream
from ..process.workers import WorkerEnded, start_workers
from ..report.folder import UNCHANGED, exchange, has_report, new_report
from ..report.terminal import Terminal
from ..report.verdict import Report, failures
from ..robots import Robot
from ..robots.case import SEED
from ..robots.scene_file import SceneError, read_scenes
from ..robots.states import MOST_SPEEDS
from .reference import Compared, compared_with

if TYPE_CHECKING:  # they take long to load
    from .examine import Run

# modules that take long to load
DRAWING, COMPUTING = "compare.report.style", "tmt.compiled.machine"
INTERRUPTED = "interrupted"  # folder in that of an earlier report
MOST_BETWEEN = 5  # lines of a run of several between its first cause and its verdict without the cause
MOST_FAILING = 3  # checks on the first screen of one experiment


def carry_out(experiment: str, options: Options, command: str) -> int:
    """Compare the models and write the report; the exit status. Refused: that is not possible."""
    started, terminal, is_alone = time.perf_counter(), Terminal(options.json), experiment != "all"
    given, path = options.mjcf or "", os.path.abspath(options.mjcf) if options.mjcf else None
    out = Path(options.out).absolute()  # a user's own code may change the current folder
    options = options.absolute()
    try:
        asked = options.reference, path, options.get("joints"), given or None
        compared = compared_with(*asked, floating=options.floating)
        if scenes := options.get("scenes"):
            robot = compared.robot.with_scenes(read_scenes(scenes, compared.robot))
            compared = compared._replace(robot=robot)
        if is_alone and (reason := skipped(experiment, compared.robot, options.get("engines"))):
            about = {"experiment": experiment, "robot": compared.robot.name, "reason": say(reason)}
            raise Refused(block("run", "does_not_apply", **about))
        options = options.validated(compared.reading, compared.robot.name)
        names = [experiment] if is_alone else [*EXPERIMENTS]
        with new_report(out, options.out) as folder:
            report, mended = compute(names, options, command, compared, folder, terminal)
    except WorkerEnded as error:
        raise Refused(f"{error}; {interrupt.Now.outcome}") from None
    except (ModelError, OwnError, SceneError) as error:
        raise Refused(str(error).replace(str(path), given)) from None
    page, seconds = os.path.join(options.out, "index.html"), time.perf_counter() - started
    lines = first_screen(report, mended, is_alone)
    terminal.say()
    terminal.say_lines(lines, "bold green" if report.passed else "bold red")
    reference, runs_file = compared.reference, is_alone and EXPERIMENTS[experiment].runs_file
    for line in (*reference.to_know, *([reference.loop] if reference.loop and not runs_file else [])):
        terminal.say(line)
    program = "reproduce.py" if (out / "reproduce.py").exists() else ""
    terminal.say(block("run", "report", path=page, seconds=seconds, program=program))
    if options.json:
        printed = {"passed": report.passed, "verdict": report.verdict.split("\n"), "answer": report.answer}
        printed |= {"causes": [cause.record() for cause in report.causes], "report": page}
        print(json.dumps(printed, indent=1), file=Stream(sys.stdout), flush=True)
    if options.open:
        webbrowser.open((out / "index.html").as_uri())
    return 0 if report.passed else 1


def first_screen(report: Report, states: int, is_alone: bool) -> list[str]:
    """The last lines of a run: the answer to its question, else the verdict and what explains it; what else fails.

    states: at which M and h agree without the causes; 0: that is not known.
    """
    from .examine import SHOWN, lines_of

    failing = failures(report.sections)
    verdict = report.verdict.split("\n")[: 2 if failing["unstable"] else 1]
    if report.causes and failing["differing"]:  # what is not judged or confirmed follows from it
        failing = failing | {"not_judged": [], "unconfirmed": []}
    others = block("verdict", "others", failing=failing).splitlines()
    mended = [block("run", "mended", states=states)] if states else []
    if not is_alone:
        return [*verdict, *said_again(report), *mended, *others]
    causes = [line for cause in report.causes[:SHOWN] for line in lines_of(cause)]
    if report.answers_first:
        differs = [*verdict[-1:], *causes] if failing["differing"] or failing["broke"] else []
        return [*report.answer, *differs, *others]
    checks = [f"  {check}" for check in failing["differing"][:MOST_FAILING]] if not causes else []
    section = report.sections[0]
    has_number = section.result.headline and (section.record.compares or not causes)
    answer = report.answer if has_number or report.top else []
    return [*verdict, *causes, *checks, *mended, *answer, *others]


def said_again(report: Report) -> list[str]:
    """The first cause, where it was said far above the verdict."""
    from .examine import SHOWN, lines_of

    lines = [line for cause in report.causes[:SHOWN] for line in lines_of(cause)]
    differ = [bool(failures([section])["differing"]) for section in report.sections]
    if not lines or True not in differ:
        return []
    between = len(lines) - 1 + len(differ) - 1 - differ.index(True)
    more = f" (and {len(lines) - 1} more above)" if len(lines) > 1 else ""
    return [f"{lines[0]}{more}"] if between > MOST_BETWEEN else []


def compute(
    names: Sequence[str], options: Options, command: str, compared: Compared, folder: Path, terminal: Terminal
) -> tuple[Report, int]:
    """Run the experiments and write the report to a folder; see write_report, and Run.mended."""
    is_alone, robot, started = len(names) == 1, compared.robot, time.perf_counter()
    if robot.coordinates.nv > MOST_SPEEDS and not is_alone:
        terminal.say(say(Finding("shared", "large", {"speeds": robot.coordinates.nv, "most": MOST_SPEEDS})))
    names, reasons = applying(names, robot, options.get("engines"))
    left_out = dict(reasons)
    run: Run | None = None

    def written(is_complete: bool = True) -> Report:
        assert run is not None
        ended = run.examined() if is_complete else run.finished()
        times = {"seconds": round(time.perf_counter() - started, 1)} | durations(run.clock)
        left_out.update({name: why for name, why in run.needless.items() if name != "diagnosis"})
        return write_report(folder, ended, reasons, origin | times, compared, [] if is_complete else names)

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
        of_run: dict[str, Any] = {"map": workers.map, "quiet": workers.quiet, "tell": terminal.say}
        of_run["progress"] = lambda text: terminal.show(text, examine.progress(workers.clock, names))
        setup = examine.setup_of(compared, options, alone=is_alone, command=command, **of_run)
        run = examine.Run(names, setup, folder, terminal, workers, workers.clock)
        report = written()
        if left_out:
            terminal.say(block("run", "left_out", reasons=left_out, own=robot.own))
        return report, run.mended


def applying(
    names: Sequence[str], robot: Robot, engines: str | None = None
) -> tuple[list[str], dict[str, str]]:
    """The experiments that apply to a robot, and of the others why they do not."""
    reasons = {name: say(reason) for name in names if (reason := skipped(name, robot, engines))}
    return [name for name in names if name not in reasons], reasons


def write_report(
    folder: Path, run: "Run", reasons: dict[str, str], origin: dict[str, Any], compared: Compared,
    interrupted: Sequence[str] = (),
) -> Report:  # fmt: skip
    """Write a report with its verdict to a folder that has its figures.

    interrupted: the names of all experiments of a run that was ended, of which some are finished.
    """
    from ..report import files, verdict

    sections, causes, left_out = run.sections, run.causes, reasons | run.needless
    reference, robot, *_ = compared
    count = len(interrupted or EXPERIMENTS) - len(run.needless)
    words = verdict.verdict(sections, count, causes, reference.subject, robot.name)
    if interrupted:
        names = [section.name for section in sections]
        numbers = {"finished": len(names), "experiments": len(interrupted)}
        words = f"{block('verdict', 'interrupted', **numbers)}\n{words}"
        left_out |= {name: block("run", "interrupted") for name in interrupted if name not in names}
    named = {"kind": reference.kind, "name": reference.name}
    has_states = not all(section.record.runs_file for section in sections)
    plain = compared.mujoco.plain(robot.case() if has_states else None)
    about = words, causes, list(left_out.items()), named, reference.lines, plain, not interrupted
    report = Report(sections, robot, origin, *about)
    files.write(folder, report)
    return report
