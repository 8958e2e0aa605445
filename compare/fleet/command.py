"""python -m compare fleet: many files, on this machine or on a cluster, in one table."""

import argparse
import os
import shlex
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from tmt.compiled.cores import cores

from ..cli import command_line as cli
from ..cli.command_line import FLEET
from ..core import options as kinds
from ..core.errors import Refused
from ..core.options import Option
from ..core.text import block
from ..core.words import in_one_line
from ..experiments import EXPERIMENTS, TIMED
from ..experiments.options import stated_reference
from ..process.streams import PROGRAM
from ..report.terminal import Terminal

if TYPE_CHECKING:
    from .models import Model


def fleet_reference(text: str) -> str:
    if ":" in text:
        why = f"{text!r} is not a reference of a fleet; expected arm, model or FILE.xml"
        raise argparse.ArgumentTypeError(why)
    return stated_reference(text)


FLEET_OPTIONS = {
    "--out": Option(metavar="DIR", default=f"reports/{FLEET}"),
    "--full": Option(None),
    "--reference": Option(fleet_reference, "WHAT"),
    "--only": Option(metavar="LIST"),
    "--workers": Option(kinds.process_count, "N"),
    "--dask": Option(metavar="ADDRESS"),
    "--limit": Option(kinds.seconds(1e6), "S", 1800.0),
}


def fleet_parser() -> cli.Parser:
    made = cli.command_parser(FLEET, "PATH...", FLEET, FLEET_OPTIONS)
    made.add_argument("paths", nargs="*", type=kinds.not_empty, metavar="PATH", help=argparse.SUPPRESS)
    return made


def experiments_of(made: cli.Parser, options: argparse.Namespace) -> tuple[str, ...]:
    """Those of --only, else all that measure no times; with a reference, and without --full, those that compare two models."""
    able = {name: name for name in EXPERIMENTS if name not in TIMED}
    if options.only is None:
        is_short = options.reference and options.reference != "model" and not options.full
        return tuple(name for name in able if not (is_short and EXPERIMENTS[name].runs_file))
    names = options.only.replace(" ", "").split(",")
    for name in names:
        if name in TIMED:
            made.error(f"--only: {name} measures times, which a fleet does not: {PROGRAM} {name}")
        if name not in able:
            near = kinds.expected(name, able, ", ".join(able))
            made.error(f"--only: {name!r} is not an experiment; {near}")
    return tuple(name for name in able if name in names)


def fleet_status(arguments: Sequence[str]) -> int:
    """Run the command; the exit status. SystemExit: help, wrong arguments. Refused: it cannot be done."""
    made = fleet_parser()
    options, unknown = made.parse_known_intermixed_args(arguments)
    if unknown:
        made.refuse_option(unknown[0], [*FLEET_OPTIONS, "--help"])
    if options.help:
        made.print_help()
        raise SystemExit(0)
    if not options.paths:
        made.error(f"no PATH given; expected a file, a folder, a pattern or @LIST: {PROGRAM} {FLEET} models")
    if options.workers and options.dask:
        made.error("--workers cannot be combined with --dask")
    names = experiments_of(made, options)
    started = time.perf_counter()
    from .cache import locked  # imports are slow
    from .executors import Cluster, Executor, Pool
    from .models import found_models
    from .run import Run
    from .table import write_table
    from .task import FleetOptions

    terminal, out = Terminal(), Path(options.out)
    models, left_out = found_models(options.paths)
    solution = solution_of(options.reference)
    path = os.path.abspath(solution.path) if solution else ""
    command = shlex.join(["python", "-m", "compare", FLEET, *arguments])
    file_options = FleetOptions(names, not options.full, options.reference, path)
    with locked(out), ExitStack() as stack:
        if options.dask:
            executor: Executor = Cluster(options.dask, options.limit)
        else:
            executor = Pool(options.workers or cores(), options.limit, loaded=["compare.fleet.loaded"])
        stack.callback(executor.close)
        run = Run(models, file_options, executor, out, solution)
        terminal.how_far = run.progress
        with terminal.progress(""):
            for row in run.carried_out():
                terminal.say(block("fleet", "line", row=row), "red" if row.is_bad else "")
        summary = write_table(out, run.rows, left_out, command)
    terminal.say()
    terminal.say_lines(summary, "bold green" if run.is_good else "bold red")
    page, seconds = in_one_line(os.path.join(options.out, "index.html")), time.perf_counter() - started
    terminal.say(f"Fleet: {page} ({seconds:.1f} s)")
    return 0 if run.is_good else 1


def solution_of(reference: str | None) -> "Model | None":
    """The reference of a fleet, if it is a solution. Refused if that cannot be read."""
    from ..engines.mujoco import ModelError, read  # imports are slow
    from ..process.files import needed_by
    from ..run.reference import is_solution
    from .models import Model

    if not reference or not is_solution(reference):
        return None
    path = Path(reference)
    try:
        read(path)
    except ModelError as error:
        raise Refused(f"--reference: {error}") from None
    return Model(path, needed_by(path))
