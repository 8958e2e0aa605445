"""python -m compare: compare the two models and write a report."""

import os
from collections.abc import Sequence

from .process import interrupt, streams

if __name__ == "__main__":
    streams.prepare()
    interrupt.listen()  # before anything that takes its time
    os.environ.setdefault("MUJOCO_GL", "disabled")  # nothing is rendered: no further process looks for a display
    # the matrices are small: threads of a product would only wait for each other, beside processes that compute too
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import shlex
import sys
import time
from contextlib import suppress

from .experiments import EXPERIMENTS, skipped
from .process.crash import described
from .process.streams import in_one_line

PROGRAM = "python -m compare"
ANSWERING_STEPS = "stability"  # the experiment of --dt and --integrator
GROWING = "speed"  # the experiment of --growth
LONGEST_ASKED = 5.0  # s, that can be asked about
FOLLOWING_SCENES = ("trajectory", "speed", "reduction")
EXAMPLES = """examples:
  python -m compare all                          every experiment, report in reports/latest
  python -m compare all --quick                  the same with fewer states, in seconds
  python -m compare mass --out /tmp/mass         one experiment, report elsewhere
  python -m compare all --mjcf my_arm.xml        your MJCF of the arm compared with the stated numbers
  python -m compare all --mjcf robot.xml         any robot compared with tmt's equations for its compiled model
  python -m compare stability --mjcf robot.xml --integrator Euler --dt 0.001
                                                 whether that step is stable under the robot's own servos
  python -m compare speed --growth               what a chain costs as it grows from 1 joint to 64
  python -m compare all --reference my.py:arm    your equations compared with MuJoCo, which runs the arm
  python -m compare speed --scenes my.toml       your own scenes beside those of the arm

exit status: 0 all checks pass; 1 a check failed; 2 the request could not be carried out
"""


class Parser(argparse.ArgumentParser):
    def error(self, message):
        self.exit(2, f"{self.prog}: {in_one_line(' '.join(message.split()))}\n")


def not_empty(text: str) -> str:
    if not text:
        raise argparse.ArgumentTypeError("it is empty; a name is expected")
    return text


def with_minus(arguments: Sequence[str]) -> list[str]:
    """The arguments, a list of joints that begins with a minus as part of its option: it is none itself."""
    given = list(arguments)
    for k in range(len(given) - 1, 0, -1):
        if given[k - 1] == "--joints" and given[k].startswith("-") and not given[k].startswith("--"):
            given[k - 1 : k + 1] = [f"--joints={given[k]}"]
    return given


def step_in_seconds(text: str) -> float:
    """A step that is asked about, s."""
    try:
        dt = float(text)
    except ValueError:
        dt = 0.0
    if not 0.0 < dt <= LONGEST_ASKED:
        raise argparse.ArgumentTypeError(
            f"{text!r} is no step; seconds above 0 and at most {LONGEST_ASKED:g} are expected"
        )
    return dt


def stated_reference(text: str) -> str:
    """What a model is compared with: what has a colon is read later."""
    if text in ("arm", "model") or ":" in text:
        return text
    forms = "arm, model, FILE.py:OBJECT, MODULE:OBJECT"
    hint = f"; a colon is missing: {text}:OBJECT, or {text}: for the file itself" if text.endswith(".py") else ""
    raise argparse.ArgumentTypeError(f"invalid choice: {text!r} (choose from {forms}){hint}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status."""
    parser = Parser(
        prog=PROGRAM,
        description="Compare the TMT method with MuJoCo, on a human arm or on your robot, and write a report.",
        epilog="experiments:\n" + "".join(f"  {k:<13} {v}\n" for k, v in EXPERIMENTS.items()) + "\n" + EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "experiment", choices=[*EXPERIMENTS, "all"], metavar="EXPERIMENT", help="one of those below, or all"
    )
    parser.add_argument(
        "--out",
        type=not_empty,
        default="reports/latest",
        metavar="DIR",
        help="where the report goes (default: %(default)s)",
    )
    parser.add_argument("--quick", action="store_true", help="fewer states, in seconds")
    parser.add_argument("--mjcf", type=not_empty, metavar="FILE", help="your model, an MJCF file")
    parser.add_argument(
        "--reference",
        type=stated_reference,
        metavar="WHAT",
        help="what it is compared with: arm, the stated numbers (default for a file with exactly the arm's hinges); model, "
        "tmt's equations for the model as MuJoCo compiled it (default for any other); or your own equations, FILE.py:OBJECT "
        "or MODULE:OBJECT, with mass_matrix(q) and bias(q, qd) (nothing after the colon: the module itself)",
    )
    parser.add_argument(
        "--joints",
        type=not_empty,
        metavar="LIST",
        help="the joints as your own equations take them, in their order: first,-second,third+90deg",
    )
    parser.add_argument(
        "--scenes",
        type=not_empty,
        metavar="FILE",
        help="scenes of your own (TOML), beside those of the robot in trajectory, speed and reduction",
    )
    parser.add_argument(
        "--dt",
        type=step_in_seconds,
        metavar="S",
        help=f"{ANSWERING_STEPS}: whether this step, s, is stable under the robot's own servos (default: the file's)",
    )
    parser.add_argument(
        "--integrator",
        type=not_empty,
        metavar="NAME",
        help=f"{ANSWERING_STEPS}: the same with this integrator of MuJoCo (default: the file's)",
    )
    parser.add_argument(
        "--growth",
        action="store_true",
        help=f"{GROWING}: what a chain costs as it grows to 64 joints, not to 8 as in a whole run for the arm",
    )
    options = parser.parse_args(with_minus(sys.argv[1:] if arguments is None else arguments))
    if options.scenes and options.experiment not in (*FOLLOWING_SCENES, "all"):
        parser.error(f"--scenes is for {', '.join(FOLLOWING_SCENES)} and all; {options.experiment} follows no scene")
    if options.joints and ":" not in (options.reference or ""):
        parser.error("--joints is for equations of your own (--reference FILE.py:OBJECT or MODULE:OBJECT)")
    if (options.dt, options.integrator) != (None, None) and options.experiment != ANSWERING_STEPS:
        parser.error(f"--dt and --integrator are for {ANSWERING_STEPS}; {options.experiment} answers for no other step")
    if options.growth and options.experiment != GROWING:
        parser.error(f"--growth is for {GROWING}; it does not go with {options.experiment}")
    command = "python -m compare " + shlex.join(sys.argv[1:] if arguments is None else arguments)
    try:
        return carry_out(options, command)
    except Refused as error:
        line = str(error)
    except OSError as error:
        name = "" if error.filename is None else f"{error.filename}: "
        line = f"cannot go on: {name}{error.strerror or error}"
    except ModuleNotFoundError as error:
        line = f"the package {error.name} is not installed; `python -m pip install -e .` brings what is needed"
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
    from .engines.mujoco import ModelError
    from .own_file import OwnFileError
    from .process.workers import WorkerEnded, start_workers
    from .reference import compared_with  # imports are here, so that --help and a wrong word answer at once
    from .report.folder import FolderError, made_by, new_report
    from .report.terminal import Terminal
    from .scene_file import SceneError, read_scenes

    terminal = Terminal()
    names = list(EXPERIMENTS) if options.experiment == "all" else [options.experiment]
    try:
        compared, robot, mujoco, reading = known = compared_with(options.reference, options.mjcf, options.joints)
        if options.scenes:
            robot = robot.with_scenes(read_scenes(options.scenes, robot))
        if options.experiment != "all" and (reason := skipped(options.experiment, robot)):
            raise Refused(f"{options.experiment} cannot serve {robot.name}: {reason}")
        asked = known.asked_step(options.dt, options.integrator)
        before = made_by(options.out)
        with new_report(options.out) as folder:
            for line in compared.lines:
                terminal.say(line)
            with start_workers() as workers, terminal.progress("imports"):
                from . import experiment
                from .case import SEED
                from .report import files, provenance, verdict
                from .report.parts import Parts
                from .setup import Setup, engines

                workers.submit(experiment.warm_up)
                reasons = {name: reason for name in names if (reason := skipped(name, robot))}
                origin = provenance.provenance(command, robot.mjcf, compared.file, SEED)  # of the model as it was read
                of_run = {"map": workers.map, "quiet": workers.quiet, "progress": terminal.show, "reading": reading}
                of_run["faults"] = options.experiment == "diagnosis" and not options.mjcf and not options.reference
                of_run |= {"alone": options.experiment != "all", "asked": asked, "growth": options.growth}
                make = Setup.quick if options.quick else Setup
                setup = make(robot, engines(mujoco, compared.own), **of_run)
                for name, reason in reasons.items():
                    terminal.say(f"{name:<13} skipped: {reason}")
                asked = [name for name in names if name not in reasons]
                sections, causes, needless = experiment.examine(asked, setup, folder, terminal, workers)
            parts, unknown = Parts(), "No verdict could be made."
            outcome = sections, len(EXPERIMENTS) - len(needless), causes, compared.compared, robot.name
            words = parts.made("the verdict", unknown, verdict.verdict, *outcome)
            reasons |= needless
            origin["seconds"] = round(time.perf_counter() - started, 1)
            report = verdict.Report(sections, robot, origin, words, causes, list(reasons.items()), compared)
            files.write(folder, report, parts)
    except (ModelError, OwnFileError, SceneError, FolderError, WorkerEnded) as error:
        raise Refused(error) from None
    terminal.say()
    good = verdict.passed(sections) and not parts.broken
    terminal.say(words, "bold green" if good else "bold red")
    for line in report.top:
        terminal.say(line)
    for line in parts.lines:
        say_error(line)
    place = f" in place of that of `{before}`" if before not in (None, origin["command"]) else ""
    terminal.say(f"Report: {os.path.join(options.out, 'index.html')}{place} ({time.perf_counter() - started:.1f} s)")
    return 0 if good else 1


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
