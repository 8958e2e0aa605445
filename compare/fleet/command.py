"""python -m compare fleet: many files, on this machine or on a cluster, in one table."""

import argparse
import os
import shlex
import time
from collections.abc import Sequence
from pathlib import Path

from tmt.cores import cores

from ..command_line import PROGRAM, Parser, expected, in_lines, not_empty
from ..experiments import EXPERIMENTS
from ..report.remaining import in_words
from ..report.terminal import Terminal

WORD = "fleet"
LIMIT = 600.0  # s, that a piece may take
TEXT = "\n\n".join(
    in_lines(text)
    for text in (
        "Compare every model that is found with tmt's equations for it, each with a report of its own, and list what needs a "
        "look first: `index.html` and `fleet.csv` in the folder of the fleet.",
        "PATH: a file, a folder (all its MJCF, at any depth), a pattern, or @LIST, a file with a path in each line. Files that "
        "are only parts of others are left out.",
        "What was computed is kept in that folder: the same command goes on where it was stopped, and computes what is new or "
        "has changed, a file, what it includes, the program, MuJoCo.",
    )
)
EPILOG = """examples:
  python -m compare fleet models              every model below models
  python -m compare fleet models --only mass,stability
  python -m compare fleet @release.txt --since reports/last_release
  python -m compare fleet models --dask tcp://10.0.0.5:8786

a piece that ends its process runs again, at most three times; a fleet without
--dask has a process for each core, and timed experiments run alone at its end

exit status: 0 no file differs or broke off; 1 one does; 2 the request could
not be carried out, for the reason in one line
"""


def parser() -> Parser:
    made = Parser(
        prog=f"{PROGRAM} {WORD}", usage=f"{PROGRAM} {WORD} PATH... [options]", description=TEXT, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter, add_help=False,
    )  # fmt: skip
    made.add_argument("paths", nargs="*", type=not_empty, metavar="PATH", help=argparse.SUPPRESS)
    made.add_argument("-h", "--help", action="store_true", help="this text")
    made.add_argument(
        "--out",
        type=not_empty,
        default=f"reports/{WORD}",
        metavar="DIR",
        help="where the fleet goes (default: %(default)s)",
    )
    made.add_argument("--full", action="store_true", help="each file as by `all`, not by `all --quick`")
    made.add_argument("--only", type=not_empty, metavar="LIST", help="some experiments: mass,stability (default: all)")
    made.add_argument(
        "--workers", type=count, metavar="N", help="processes on this machine (default: one for each core)"
    )
    made.add_argument(
        "--dask", type=not_empty, metavar="ADDRESS", help="the scheduler of a Dask cluster, whose workers do the work"
    )
    made.add_argument(
        "--limit",
        type=seconds,
        default=LIMIT,
        metavar="S",
        help="seconds that a piece, an experiment of a file, may take (default: %(default)g)",
    )
    made.add_argument(
        "--since",
        type=not_empty,
        metavar="DIR",
        help="an earlier fleet: say which verdicts have changed, and which limits of the step by more than 1 %%",
    )
    return made


def count(text: str) -> int:
    if not text.isdecimal() or not 0 < int(text) <= 1024:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of processes; 1 or more are expected")
    return int(text)


def seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is no time; seconds above 0 are expected")
    return value


def experiments_of(made: Parser, only: str | None) -> tuple[str, ...]:
    """The experiments that are asked for, in their order."""
    if only is None:
        return tuple(EXPERIMENTS)
    names = [name.strip() for name in only.split(",") if name.strip()]
    for name in names:
        if name not in EXPERIMENTS:
            choices = f"{', '.join(EXPERIMENTS)}"
            made.error(f"--only: {name!r} is no experiment; {expected(name, {n: n for n in EXPERIMENTS}, choices)}")
    if not names:
        made.error("--only names no experiment")
    return tuple(name for name in EXPERIMENTS if name in names)


def fleet(arguments: Sequence[str]) -> int:
    """Run the command; the exit status. SystemExit for help, and with one line for what is mistyped. FleetError, one line."""
    made = parser()
    options = made.parse_args(arguments)
    if options.help:
        made.print_help()
        raise SystemExit(0)
    if not options.paths:
        made.error("no file is named; a file, a folder, a pattern or @LIST is expected")
    if options.dask and options.workers:
        made.error("--workers is for processes on this machine; a cluster has its own (--dask)")
    names = experiments_of(made, options.only)
    return carry_out(options, names, shlex.join(["python", "-m", "compare", WORD, *arguments]))


def carry_out(options: argparse.Namespace, names: tuple[str, ...], command: str) -> int:
    started = time.perf_counter()
    from .cluster import Cluster  # what is imported takes its time
    from .file_pieces import Asked
    from .kept import Kept
    from .models import found_models
    from .pool import Pool
    from .run import Run
    from .since import changes, earlier
    from .table import write_table

    terminal, out = Terminal(), Path(options.out)
    before = earlier(options.since) if options.since else None
    found = found_models(options.paths)
    kept = Kept(out)
    try:
        door = Cluster(options.dask, options.limit) if options.dask else Pool(options.workers or cores(), options.limit)
        try:
            run = Run(found.models, Asked(names, not options.full), door, kept, out)
            for name, why in found.left_out:
                terminal.say(f"left out: {name}, {why}")
            workers = door.workers()
            terminal.tell(lambda: how_far(run, workers))
            with terminal.progress(""):
                run.carry_out(lambda: say_new(terminal, run))
        finally:
            door.close()
        changed = None if before is None else changes(before, run.rows)
        took = time.perf_counter() - started
        said = write_table(out, run, found.left_out, changed, command, took, workers)
        kept.forget_others()
    finally:
        kept.close()
    terminal.say()
    terminal.say(said[0], "bold green" if run.is_good else "bold red")
    for line in said[1:]:
        terminal.say(line)
    for line in changed or ():
        terminal.say(f"changed: {line}")
    if changed == []:
        terminal.say(f"nothing has changed since {options.since}")
    terminal.say(f"Fleet: {os.path.join(options.out, 'index.html')} ({took:.1f} s)")
    return 0 if run.is_good else 1


def how_far(run, workers: int) -> list[str]:
    """How far a fleet is: files, pieces, the verdicts so far, how long still."""
    verdicts = ", ".join(f"{many} {verdict}" for verdict, many in sorted(run.verdicts().items()))
    left = run.seconds_left(workers)
    parts = [f"{run.files_done} of {len(run.tasks)} files", f"{run.pieces_done} of {run.pieces_known} pieces", verdicts]
    return [part for part in [*parts, f"about {in_words(left)} left" if left else ""] if part]


def say_new(terminal: Terminal, run) -> None:
    """A line for each file that has ended since the last call."""
    for row in run.take_new():
        ratio = "" if row["worst_ratio"] is None else f"{100.0 * row['worst_ratio']:.2g} % of tolerance"
        unstable = "its own step is not stable" if row["stable_at_file_dt"] is False else ""
        text = row["reason"] or ", ".join(filter(None, (ratio, unstable)))
        bad = row["verdict"] in ("differ", "broke")
        terminal.say(f"{row['verdict']:<8} {row['file']}: {text}  {row['seconds']:.1f} s", "red" if bad else "")
