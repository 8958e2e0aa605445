"""python -m compare: compare the two models and write a report."""

import os
from collections.abc import Sequence

from .process import interrupt, streams

if __name__ == "__main__":
    streams.prepare()
    os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker")  # it clears up after an interrupt
    os.environ.setdefault("MUJOCO_GL", "disabled")  # nothing is rendered: no further process looks for a display
    # the matrices are small, and other processes compute too: threads of a product would only wait for each other
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    interrupt.listen()  # before anything that takes its time

import shlex
import sys
from contextlib import suppress
from importlib import import_module

from .cli.command_line import FLEET, request
from .process.crash import Refused, described
from .process.streams import say_error


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status. SystemExit after help or a wrong word: see command_line.request."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments[:1] == [FLEET]:
        return answered("fleet.command", "fleet_status", arguments[1:])
    options = request(arguments)
    if options.version:
        from .report.provenance import OURS, installed  # what is imported takes its time

        with suppress(OSError, ValueError, AttributeError):  # nobody may be there to read it
            print(OURS, installed(OURS), flush=True)
        return 0
    return answered("run.command", "carry_out", options, shlex.join(["python", "-m", "compare", *arguments]))


def answered(module: str, function: str, *arguments: object) -> int:
    """The exit status of a request; 2, with a line, if it could not be carried out."""
    try:
        return getattr(import_module(f".{module}", __package__), function)(*arguments)  # imports are slow
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


def run_and_leave() -> None:
    """The command line as a process: nothing but `main` decides its exit status."""
    try:
        status = main()
    except SystemExit as stop:  # --help, or a wrong word
        status = stop.code
    interrupt.settle()
    interrupt.clear_up()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(status)  # what comes after this could end with another status


if __name__ == "__main__":
    run_and_leave()
