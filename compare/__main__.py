"""python -m compare: compare the two models and write a report."""

import os
import shlex
import sys
from collections.abc import Sequence

from .core.errors import Refused, described
from .process import interrupt, streams

EQUATIONS, FLEET = "equations", "fleet"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status. SystemExit: see command_line.request."""
    try:
        return status_of(sys.argv[1:] if arguments is None else arguments)
    except BaseException as error:
        if isinstance(error, SystemExit) or interrupt.is_interrupt(error):
            raise
        if interrupt.Now.is_interrupted:  # of which a library that is imported, or draws, makes another error
            raise KeyboardInterrupt from error
        interrupt.settle()
        streams.say_error(str(error) if isinstance(error, Refused) else f"cannot go on: {described(error)}")
        return 2


def status_of(arguments: Sequence[str]) -> int:
    # imports are slow: only what the request needs
    command = shlex.join(["python", "-m", "compare", *arguments])
    if arguments[:1] == [FLEET]:
        from .fleet.command import fleet_status

        return fleet_status(arguments[1:])
    if arguments[:1] == [EQUATIONS]:
        from .export.command import equations_status

        return equations_status(arguments[1:], command)
    if arguments[:1] == ["--version"]:
        from .report.provenance import OURS, installed

        print(OURS, installed(OURS), file=streams.Stream(sys.stdout), flush=True)
        return 0
    from .cli.command_line import request

    experiment, options = request(arguments)
    from .run.command import carry_out

    return carry_out(experiment, options, command)


def run() -> int:
    """The command line of this process, to its end, with what it has begun."""
    try:
        status = main()
    except SystemExit as stop:  # --help, or a wrong word
        status = int(stop.code or 0)
    interrupt.settle()
    interrupt.at_end.close()
    return status


if __name__ == "__main__":
    streams.prepare()
    os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker")  # it clears up after an interrupt
    # nothing is rendered: no further process looks for a display
    os.environ.setdefault("MUJOCO_GL", "disabled")
    # the matrices are small, and other processes compute too: threads of a product would wait for each other
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from compare.__main__ import run  # by a name that the child finds

    has_own = any(":" in word for word in sys.argv[1:])  # perhaps a user's own equations
    interrupt.leave(interrupt.ended_by_signals(run, has_own))
