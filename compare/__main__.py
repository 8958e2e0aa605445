"""python -m compare: compare the two models and write a report.

Every experiment is the module of its name: `rows(setup)` computes, `figures(result)` draws.
"""

import os

from . import interrupt, streams

if __name__ == "__main__":
    streams.prepare()
    interrupt.answer()  # before anything that takes its time
    os.environ.setdefault("MUJOCO_GL", "disabled")  # nothing is rendered: no further process looks for a display

import argparse
import importlib
import shlex
import sys
import time
from contextlib import suppress

from .crash import described
from .streams import readable

SHOWN = 5  # checks of an experiment that fail, on the terminal

EXPERIMENTS = {
    "parameters": "MuJoCo's compiled model read back beside the stated numbers",
    "published": "every number that the assignment prints",
    "kinematics": "positions, angular velocities, Jacobians, convective terms",
    "mass": "the mass matrix",
    "gravity": "the torque that holds the arm",
    "acceleration": "bias in motion, forward and inverse dynamics, energy, power",
    "trajectory": "five seconds of motion, the same scheme in tmt for every integrator",
    "speed": "time against error: every method, every step, and what to use",
    "stability": "step limits, departure from unstable postures, where each method fails",
    "reduction": "what each scene needs of the model, and what the rest costs",
}
EXAMPLES = """examples:
  python -m compare all                          every experiment, report in reports/latest
  python -m compare all --quick                  the same with fewer states, in seconds
  python -m compare mass --out /tmp/mass         one experiment, report elsewhere
  python -m compare all --mjcf my_arm.xml        your MJCF against the stated arm

exit status: 0 all checks pass; 1 a check failed; 2 the request could not be carried out
"""


class Parser(argparse.ArgumentParser):
    def error(self, message):
        self.exit(2, f"{self.prog}: {' '.join(readable(message).split())}\n")


def not_empty(text):
    if not text:
        raise argparse.ArgumentTypeError("it is empty; a name is expected")
    return text


def main(arguments=None) -> int:
    """Run the command line; the exit status."""
    parser = Parser(
        prog="python -m compare",
        description="Compare the TMT method with MuJoCo on a human arm, and write a report.",
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
    parser.add_argument(
        "--mjcf",
        type=not_empty,
        metavar="FILE",
        help="another model of the same three hinges, compared with the stated arm",
    )
    options = parser.parse_args(arguments)
    command = "python -m compare " + shlex.join(sys.argv[1:] if arguments is None else arguments)
    try:
        return run(options, command)
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
    with suppress(OSError, ValueError, AttributeError):  # nobody may be there to read it
        print(" ".join(f"{parser.prog}: {readable(line)}".split()), file=sys.stderr, flush=True)
    return 2


class Refused(ValueError):
    """A request that cannot be carried out; the message is one line."""


def run(options, command) -> int:
    """Compute, draw, write; the exit status."""
    started = time.perf_counter()
    from .engine_file import ARM_XML, ModelError, load
    from .folder import FolderError, made_by, new_report
    from .terminal import Terminal
    from .workers import WorkerEnded, start_workers  # imports are here, so that --help and a wrong word answer at once

    terminal = Terminal()
    path = options.mjcf or ARM_XML
    names = list(EXPERIMENTS) if options.experiment == "all" else [options.experiment]
    try:
        engine = load(path)
        before = made_by(options.out)
        with new_report(options.out) as folder:
            with start_workers() as workers, terminal.progress("imports"):
                from . import report, verdict
                from .agreement import Setup

                origin = report.provenance(command, path)  # of the model as it was read
                of_run = {"map": workers.map, "quiet": workers.quiet, "tell": terminal.show}
                setup = (Setup.quick if options.quick else Setup)(engine, **of_run)
                sections, causes = examine(names, setup, folder, terminal, workers)
            words = verdict.verdict(sections, len(EXPERIMENTS), causes)
            origin["seconds"] = round(time.perf_counter() - started, 1)
            report.write(folder, sections, origin, words, causes)
    except (ModelError, FolderError, WorkerEnded) as error:
        raise Refused(error) from None
    terminal.say()
    terminal.say(words, "bold green" if verdict.passed(sections) else "bold red")
    place = f" in place of that of `{before}`" if before not in (None, origin["command"]) else ""
    terminal.say(f"Report: {os.path.join(options.out, 'index.html')}{place} ({time.perf_counter() - started:.1f} s)")
    return 0 if verdict.passed(sections) else 1


def examine(names, setup, folder, terminal, workers) -> tuple[list, list]:
    """The section of each experiment, its figures drawn, and the causes of what fails.

    An experiment that raises is one failed check; the others go on.
    """
    from .verdict import Section, failures
    from .workers import draw

    (folder / "figures").mkdir()
    sections, drawings, causes = [], [], []
    modules = {name: importlib.import_module(f".{name}", __package__) for name in names}
    crashed = {
        name: attempt(name, module.begin, setup)[1] for name, module in modules.items() if hasattr(module, "begin")
    }
    for name, module in modules.items():
        setup.tell(f"{len(sections) + 1} of {len(names)}, {name}: {EXPERIMENTS[name]}")
        started = time.perf_counter()
        result, crash = (None, crashed[name]) if crashed.get(name) else attempt(name, module.rows, setup)
        sections.append(Section(name, module.TITLE, module.CLAIM, module.BAR, crash or result))
        drawings.append(None if crash else workers.submit(draw, name, result, folder / "figures"))
        new = find_causes(setup) if failures(sections[-1:])[0] and not failures(sections[:-1])[0] else []
        causes += new
        tell(terminal, sections[-1], time.perf_counter() - started, new)
    setup.tell("figures")
    for section, drawing in zip(sections, drawings):
        if drawing is not None:
            take_figures(terminal, section, drawing)
    return sections, causes


def find_causes(setup) -> list:
    """What of the model explains that checks fail: each number, as stated and as compiled; the gravest first."""
    from . import parameters

    result, _ = attempt("parameters", parameters.rows, setup)
    return result.curves["causes"] if result else []


def attempt(name, act, setup) -> tuple:
    """What an experiment's function returns, and None; if it raises, None and a Result with one failed check."""
    from .agreement import ENDS, Result
    from .workers import WorkerEnded

    try:
        return act(setup), None
    except WorkerEnded:
        raise
    except Exception as error:
        result = Result(name, shown=[])
        result.check("", ENDS, None, 0.0, "", described(error), rule="equal")
        return None, result


def take_figures(terminal, section, drawing) -> None:
    """Wait for a section's figures. One that could not be drawn is a failed check; an error of the disk is raised."""
    from .agreement import DRAWN
    from .workers import WorkerEnded

    try:
        section.figures, failed = drawing.result()
    except (WorkerEnded, OSError):
        raise
    except Exception as error:  # the result cannot be sent to where it is drawn
        failed = [("number 1", described(error))]
    for name, line in failed:
        quantity = f"{DRAWN} {name} is drawn"
        terminal.say(f"  FAIL {section.result.check('', quantity, None, 0.0, '', line, rule='equal')}", "red")


def tell(terminal, section, seconds, causes) -> None:
    """One line for an experiment; of one in which checks fail the causes, where they are new, and the first checks."""
    checks = section.result.checks
    failed = [check for check in checks if not check.passed]
    used = [check.over_bar for check in checks if check.over_bar is not None]
    most = f"uses {max(used):.2g} of a tolerance" if any(used) and not failed else ""
    word = f"{len(failed)} FAILED" if failed else "ok"
    many = f"{len(checks):>3} check{'s' if len(checks) != 1 else ' '}"
    terminal.say(f"{section.name:<13} {word:<10} {many}  {most:<26} {seconds:5.1f} s", "red" if failed else "")
    lines = [f"  CAUSE {cause['text']}" for cause in causes]
    if not (causes and section.name == "parameters"):  # there the causes are the checks
        lines += [f"  FAIL {check}" for check in failed]
    for line in lines[:SHOWN]:
        terminal.say(line, "red")
    if len(lines) > SHOWN:
        terminal.say(f"  and {len(lines) - SHOWN} more: in the report", "red")


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
