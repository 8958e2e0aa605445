"""python -m compare: hold the two models against each other and write a report.

Every experiment is the module of its name: `rows(setup)` computes, `figures(result)` draws.
"""

import argparse
import importlib
import os
import shlex
import signal
import sys
import time

EXPERIMENTS = {
    "parameters": "MuJoCo's compiled model read back beside the stated numbers",
    "published": "every number that the assignment prints",
    "kinematics": "positions, angular velocities, Jacobians, convective terms",
    "mass": "the mass matrix",
    "gravity": "the torque that holds the arm",
    "acceleration": "bias in motion, forward and inverse dynamics, energy, power",
    "trajectory": "five seconds of motion, a twin for every integrator",
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
        self.exit(2, f"{self.prog}: {message}\n")


def not_empty(text):
    if not text:
        raise argparse.ArgumentTypeError("it is empty; a name is expected")
    return text


def main(arguments=None) -> int:
    """Run the command line; the exit status."""
    parser = Parser(
        prog="python -m compare",
        description="Hold the TMT method and MuJoCo against each other on a human arm, and write a report.",
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
        help="another model of the same three hinges, held against the stated arm",
    )
    options = parser.parse_args(arguments)
    command = "python -m compare " + shlex.join(sys.argv[1:] if arguments is None else arguments)
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return run(options, command)
    except KeyboardInterrupt:
        print("interrupted; a report that was there is unchanged", file=sys.stderr)
    except Refused as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
    except OSError as error:
        print(f"{parser.prog}: cannot go on: {' '.join(str(error).split())}", file=sys.stderr)
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    return 2


class Refused(ValueError):
    """A request that cannot be carried out; the message is one line."""


def run(options, command) -> int:
    """Compute, draw, write; the exit status."""
    started = time.perf_counter()
    from concurrent.futures import BrokenExecutor

    from .engine_file import ARM_XML, ModelError, load
    from .folder import FolderError, new_report
    from .terminal import Terminal
    from .workers import start_workers  # imports are here, so that --help and a wrong word answer at once

    terminal, progress = Terminal(), Terminal(stderr=True)
    path = options.mjcf or ARM_XML
    names = list(EXPERIMENTS) if options.experiment == "all" else [options.experiment]
    try:
        engine = load(path)
        with new_report(options.out) as folder:
            with start_workers() as workers, progress.status("imports") as status:
                from . import report, verdict
                from .agreement import Setup

                of_run = {"map": workers.map, "quiet": workers.quiet, "tell": status.update}
                setup = (Setup.quick if options.quick else Setup)(engine, **of_run)
                sections = examine(names, setup, folder, terminal, workers, status)
            words = verdict.verdict(sections, len(EXPERIMENTS))
            seconds = time.perf_counter() - started
            report.write(folder, sections, report.provenance(command, path, seconds), words)
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # from here on the new report is there
    except (ModelError, FolderError) as error:
        raise Refused(error) from None
    except BrokenExecutor:
        raise Refused("a process that draws figures was ended from outside; the old report is unchanged") from None
    terminal.line("")
    terminal.line(words, "bold green" if verdict.passed(sections) else "bold red")
    terminal.line(f"Report: {os.path.join(options.out, 'index.html')} ({time.perf_counter() - started:.1f} s)")
    return 0 if verdict.passed(sections) else 1


def examine(names, setup, folder, terminal, workers, status) -> list:
    """The section of each experiment, its figures drawn."""
    from .verdict import Section
    from .workers import draw

    (folder / "figures").mkdir()
    sections, drawings = [], []
    modules = {name: importlib.import_module(f".{name}", __package__) for name in names}
    for module in modules.values():
        if hasattr(module, "begin"):
            module.begin(setup)
    for name, module in modules.items():
        setup.tell(f"{name}: {EXPERIMENTS[name]} ({len(sections) + 1} of {len(names)})")
        started = time.perf_counter()
        result = module.rows(setup)
        sections.append(Section(name, module.TITLE, module.CLAIM, module.BAR, result))
        drawings.append(workers.submit(draw, name, result, folder / "figures"))
        status.stop()
        tell(terminal, sections[-1], time.perf_counter() - started)
        status.start()
    setup.tell("figures")
    for section, drawn in zip(sections, drawings):
        section.figures = drawn.result()
    return sections


def tell(terminal, section, seconds):
    """One line for an experiment, one more for each check that failed."""
    checks = section.result.checks
    failed = [check for check in checks if not check.passed]
    used = [check.over_bar for check in checks if check.over_bar is not None]
    most = f"worst {max(used):.2g} of its bar" if used else ""
    word = f"{len(failed)} FAILED" if failed else "ok"
    terminal.line(
        f"{section.name:<13} {word:<10} {len(checks):>3} checks  {most:<26} {seconds:5.1f} s",
        "red" if failed else "",
    )
    for check in failed:
        terminal.line(f"  FAIL {check}", "red")


if __name__ == "__main__":
    status = main()
    if status == 2:  # sys.exit would end by the signal, not with 2, if Ctrl-C came inside an exec()
        sys.stderr.flush()
        os._exit(2)
    sys.exit(status)
