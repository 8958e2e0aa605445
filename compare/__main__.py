"""python -m compare: compare the two models and write a report."""

import os
from collections.abc import Callable, Sequence

from .process import interrupt, streams

if __name__ == "__main__":
    streams.prepare()
    interrupt.listen()  # before anything that takes its time
    os.environ.setdefault("MUJOCO_GL", "disabled")  # nothing is rendered: no further process looks for a display
    # the matrices are small, and other processes compute too: threads of a product would only wait for each other
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import shlex
import sys
import time
from contextlib import suppress
from functools import partial
from pathlib import Path

from .cli.command_line import FLEET, PROGRAM, TEXT, request
from .experiments import EXPERIMENTS, skipped
from .process.crash import described
from .process.streams import in_one_line

COMPUTING = ("compare.run.examine", "scipy.optimize", "tmt.compiled.machine")  # modules that take long to load
DRAWING = ("compare.report.style", *COMPUTING)
LITTLE = 1_000_000  # bytes, by which the cache folder may grow without a message


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status. SystemExit after help or a wrong word: see command_line.request."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments[:1] == [FLEET]:
        return answered(partial(fleet, arguments[1:]))
    options = request(arguments)
    if options.version:
        from .report.version import OURS, own_version  # what is imported takes its time

        with suppress(OSError, ValueError, AttributeError):  # nobody may be there to read it
            print(OURS, own_version(), flush=True)
        return 0
    return answered(partial(carry_out, options, shlex.join(["python", "-m", "compare", *arguments])))


def fleet(arguments: Sequence[str]) -> int:
    """Compare many files; the exit status."""
    from .fleet import command  # what is imported takes its time
    from .fleet.tasks import FleetError

    try:
        return command.fleet_status(arguments)
    except FleetError as error:
        raise Refused(error) from None


def answered(act: Callable[[], int]) -> int:
    """The exit status of a request; 2, with a line, if it could not be carried out."""
    try:
        return act()
    except Refused as error:
        line = str(error)
    except OSError as error:
        name = "" if error.filename is None else f"{error.filename}: "
        line = f"cannot go on: {name}{error.strerror or error}"
    except ModuleNotFoundError as error:
        line = f"the package {error.name} is missing; install it with `python -m pip install -e .`"
    except Exception as error:
        line = f"cannot go on: {described(error)}"
    interrupt.settle()
    say_error(line)
    return 2


def say_error(line: str) -> None:
    """One line on stderr, if anybody is there to read it."""
    with suppress(OSError, ValueError, AttributeError):
        print(in_one_line(" ".join(f"{PROGRAM}: {line}".split())), file=sys.stderr, flush=True)


class Refused(ValueError):
    """A request that cannot be carried out; the message is one line."""


def carry_out(options: argparse.Namespace, command: str) -> int:
    """Compute, draw, write; the exit status."""
    started = time.perf_counter()
    from tmt.compiled.store import cache_folder, size_of_cache

    from .engines.mujoco import ModelError
    from .engines.own.own_file import OwnFileError
    from .process.workers import WorkerEnded, load_modules, start_workers
    from .report.folder import FolderError, made_by, new_report
    from .report.terminal import Terminal
    from .report.text import block, say
    from .robots.scene_file import SceneError, read_scenes
    from .run.reference import compared_with  # imports are here, so that --help and a wrong word answer at once

    terminal, kept = Terminal(), size_of_cache()
    names = list(EXPERIMENTS) if options.experiment == "all" else [options.experiment]
    try:
        compared, robot, mujoco, reading = known = compared_with(options.reference, options.mjcf, options.joints)
        if options.scenes:
            robot = robot.with_scenes(read_scenes(options.scenes, robot))
        if options.experiment != "all" and (reason := skipped(options.experiment, robot)):
            raise Refused(f"{options.experiment} does not apply to {robot.name}: {say(reason)}")
        step = known.integrator_step(options.dt, options.integrator)
        before = made_by(options.out)
        with new_report(options.out) as folder:
            for line in compared.lines:
                terminal.say(line)
            if options.experiment == "stability" and reading and not reading.drive.feeds_back:
                terminal.say(block(TEXT, "no_servo", robot=robot.name))
            with start_workers() as workers, terminal.progress("imports"):
                for needed in (DRAWING, COMPUTING)[: len(names)]:  # in further processes at the same time
                    workers.submit(load_modules, *needed)
                from .experiments.setup import Setup, engines
                from .report import files, provenance, verdict
                from .report.parts import Parts
                from .robots.case import SEED
                from .run import examine as experiment

                reasons = {name: say(reason) for name in names if (reason := skipped(name, robot))}
                origin = provenance.provenance(command, robot.mjcf, compared.file, SEED)  # of the model as it was read
                of_run = {"map": workers.map, "quiet": workers.quiet, "progress": terminal.show, "reading": reading}
                of_run |= {"alone": options.experiment != "all", "step": step}
                make = Setup.quick if options.quick else Setup
                setup = make(robot, engines(mujoco, compared.own), **of_run)
                for name, reason in reasons.items():
                    terminal.say(f"{name:<13} skipped: {reason}")
                names = [name for name in names if name not in reasons]
                terminal.tell(partial(experiment.progress, workers.clock, names))
                sections, causes, needless = experiment.examine(names, setup, folder, terminal, workers, workers.clock)
            parts = Parts()
            outcome = sections, len(EXPERIMENTS) - len(needless), causes, compared.compared, robot.name
            words = parts.attempt("the verdict", "No verdict.", verdict.verdict, *outcome)
            reasons |= needless
            origin["seconds"] = round(time.perf_counter() - started, 1)
            origin |= provenance.durations(workers.clock)
            report = verdict.Report(sections, robot, origin, words, causes, list(reasons.items()), compared)
            files.write(folder, report, parts)
    except (ModelError, OwnFileError, SceneError, FolderError, WorkerEnded) as error:
        raise Refused(error) from None
    terminal.say()
    good = verdict.passed(sections) and not parts.broken
    first, *more = words.split("\n")
    terminal.say(first, "bold green" if good else "bold red")
    for line in more + report.top:
        terminal.say(line)
    for line in parts.lines:
        say_error(line)
    place = f" in place of that of `{before}`" if before not in (None, origin["command"]) else ""
    terminal.say(f"Report: {os.path.join(options.out, 'index.html')}{place} ({time.perf_counter() - started:.1f} s)")
    if (size := size_of_cache()) > kept + LITTLE:
        terminal.say(block(TEXT, "cache", folder=in_home(cache_folder()), megabytes=size / 1e6))
    return 0 if good else 1


def in_home(path: Path) -> str:
    """A path with ~ for the user's folder."""
    with suppress(ValueError, RuntimeError):
        return str("~" / path.relative_to(Path.home()))
    return str(path)


def run_and_leave() -> None:
    """The command line as a process: nothing but `main` decides its exit status."""
    try:
        status = main()
    except SystemExit as stop:  # --help, or a wrong word
        status = stop.code
    interrupt.settle()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(status)  # what comes after this could end with another status


if __name__ == "__main__":
    run_and_leave()
