"""python -m compare fleet: many files, on this machine or on a cluster, in one table."""

import argparse
import os
import shlex
import time
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from tmt.compiled.cores import cores

from ..cli import command_line as cli
from ..cli.command_line import FLEET, Option
from ..core.errors import Refused
from ..core.text import block
from ..core.words import in_one_line
from ..experiments import EXPERIMENTS, TIMED
from ..process.streams import PROGRAM
from ..report.terminal import Terminal

if TYPE_CHECKING:
    from .executors import Executor
    from .table import FileRow

SENT = "reference of the fleet"  # folder of the solution in a bundle
TIMING = "timing"  # resource of Dask's workers on which nothing else runs
PERIOD = 10.0  # s between two lines of the progress where it cannot be shown


def fleet_reference(text: str) -> str:
    if ":" in text:
        why = f"{text!r} is not a reference of a fleet; expected arm, model or FILE.xml"
        raise argparse.ArgumentTypeError(why)
    return cli.stated_reference(text)


FLEET_OPTIONS = {
    "--out": Option(metavar="DIR", default=f"reports/{FLEET}"),
    "--full": Option(None),
    "--timing": Option(None),
    "--reference": Option(fleet_reference, "WHAT"),
    "--only": Option(metavar="LIST"),
    "--workers": Option(cli.process_count, "N"),
    "--dask": Option(metavar="ADDRESS"),
    "--limit": Option(cli.seconds(1e6), "S", 1800.0),
    "--since": Option(metavar="DIR"),
    "--rubric": Option(metavar="FILE"),
}


def fleet_parser() -> cli.Parser:
    made = cli.command_parser(FLEET, "PATH...", FLEET, FLEET_OPTIONS)
    made.add_argument("paths", nargs="*", type=cli.not_empty, metavar="PATH", help=argparse.SUPPRESS)
    return made


def experiments_of(made: cli.Parser, only: str | None, timing: bool = False) -> tuple[str, ...]:
    """The experiments of --only, in their order; None: all that may run."""
    if only is None:
        return tuple(name for name in EXPERIMENTS if timing or name not in TIMED)
    names = only.replace(" ", "").split(",")
    for name in names:
        if name not in EXPERIMENTS:
            near = cli.expected(name, {known: known for known in EXPERIMENTS}, ", ".join(EXPERIMENTS))
            made.error(f"--only: {name!r} is not an experiment; {near}")
        if name in TIMED and not timing:
            made.error(f"--only: {name} measures time; add --timing")
    return tuple(name for name in EXPERIMENTS if name in names)


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
    if options.workers and (options.dask or options.timing):
        made.error("--workers cannot be combined with --dask or --timing")
    names = experiments_of(made, options.only, options.timing)
    return run_fleet(options, names, shlex.join(["python", "-m", "compare", FLEET, *arguments]))


def run_fleet(options: argparse.Namespace, names: tuple[str, ...], command: str) -> int:
    """Compare all files and write the table; the exit status."""
    started = time.perf_counter()
    from .cache import locked  # imports are slow
    from .models import found_models
    from .rubric import read_rubric
    from .run import Run
    from .table import changes, earlier, write_table
    from .task import FleetOptions

    terminal, out = Terminal(), Path(options.out)
    before = earlier(options.since) if options.since else None
    rubric = read_rubric(options.rubric, names) if options.rubric else None
    models, left_out = found_models(options.paths)
    sent = solution_files(options.reference)
    file_options = FleetOptions(names, not options.full, options.reference, next(iter(sent), ""))
    with locked(out), closing(executor_of(options)) as executor:
        run = Run(models, file_options, executor, out, sent)
        terminal.how_far = run.progress
        with terminal.progress("", PERIOD):
            run.carry_out(lambda rows: say_rows(terminal, rows))
        changed, most = None if before is None else changes(before, run.rows), None
        if rubric:
            rubric.award(run.rows, out)
            most = rubric.total
        summary = write_table(out, run.rows, left_out, changed, command, most)
    terminal.say()
    terminal.say_lines(summary, "bold green" if run.is_good else "bold red")
    if changed is not None:
        since = f"since {in_one_line(options.since)}: "
        terminal.say_lines(since + line for line in changed or ["no changes"])
    page, seconds = in_one_line(os.path.join(options.out, "index.html")), time.perf_counter() - started
    terminal.say(f"Fleet: {page} ({seconds:.1f} s)")
    return 0 if run.is_good else 1


def executor_of(options: argparse.Namespace) -> "Executor":
    from .executors import Cluster, Pool  # imports are slow

    if options.dask:
        return Cluster(options.dask, options.limit, TIMING if options.timing else None)
    return Pool(1 if options.timing else options.workers or cores(), options.limit)


def solution_files(reference: str | None) -> dict[str, bytes]:
    """The files of a reference that is a solution, itself first, else {}. Refused if they cannot be read."""
    from ..engines.mujoco import ModelError, read  # imports are slow
    from ..process.parts import needed_by
    from ..run.reference import is_solution
    from .models import Model, bundle

    if not reference or not is_solution(reference):
        return {}
    path = Path(reference)
    try:
        read(path)
    except ModelError as error:
        raise Refused(f"--reference: {error}") from None
    return {f"{SENT}/{name}": content for name, content in bundle(Model(path, needed_by(path))).items()}


def say_rows(terminal: Terminal, rows: Sequence["FileRow"]) -> None:
    for row in rows:
        terminal.say(block("fleet", "line", row=row), "red" if row.is_bad else "")
