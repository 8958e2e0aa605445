"""python -m compare fleet: many files, on this machine or on a cluster, in one table."""

import argparse
import os
import shlex
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tmt.compiled.cores import cores

from ..cli.command_line import FLEET, PROGRAM, Parser, expected, in_lines, not_empty, process_count
from ..experiments import EXPERIMENTS
from ..process.streams import in_one_line
from ..report.remaining import in_words
from ..report.terminal import Terminal
from .piece import LONGEST_PIECE, FleetError

if TYPE_CHECKING:
    from .file_pieces import Asked
    from .run import Run

MOST_SAID = 20  # lines of one kind, on the terminal
SENT = "reference of the fleet"  # the folder of a solution among the files that are sent
BETWEEN = 0.3  # s, after which it is said anew how far it is
FLEET_TEXT = "\n\n".join(
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
  python -m compare fleet class --reference solution.xml
  python -m compare fleet @release.txt --since reports/last_release
  python -m compare fleet models --dask tcp://10.0.0.5:8786

a piece that ends its process runs again, at most three times; a fleet without
--dask has a process for each core, and timed experiments run alone at its end

verdicts: agree (with stated numbers, or a solution), self-consistent (compared
with its own compiled model only), differ, broke, refused, unconfirmed (the
models agree, a prediction is not confirmed by runs)

exit status: 0 no file differs, broke off or is unconfirmed; 1 one is; 2 the
request could not be carried out, for the reason in one line
"""


def duration(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is no time; seconds above 0 are expected")
    return value


def fleet_reference(text: str) -> str:
    if text in ("arm", "model") or text.lower().endswith((".xml", ".mjcf")):
        return text
    raise argparse.ArgumentTypeError(f"{text!r} is no reference of a fleet; arm or FILE.xml is expected")


FLEET_OPTIONS = {
    "--out": {
        "type": not_empty, "default": f"reports/{FLEET}", "metavar": "DIR",
        "help": "where the fleet goes (default: %(default)s)",
    },
    "--full": {"action": "store_true", "help": "each file as by `all`, not by `all --quick`"},
    "--reference": {
        "type": fleet_reference, "metavar": "WHAT",
        "help": "what all files are compared with: arm, the stated numbers, or FILE.xml, a solution; joints are matched by name, "
        "else by place, axis and type (default: the arm where a file has exactly its hinges, else itself as compiled)",
    },
    "--only": {"type": not_empty, "metavar": "LIST", "help": "some experiments: mass,stability (default: all)"},
    "--workers": {
        "type": process_count, "metavar": "N", "help": "processes on this machine (default: one for each core)",
    },
    "--dask": {
        "type": not_empty, "metavar": "ADDRESS", "help": "the scheduler of a Dask cluster, whose workers do the work",
    },
    "--limit": {
        "type": duration, "default": LONGEST_PIECE, "metavar": "S",
        "help": "seconds that a piece, an experiment of a file, may take (default: %(default)g)",
    },
    "--since": {
        "type": not_empty, "metavar": "DIR",
        "help": "an earlier fleet: say which verdicts have changed, and which limits of the step by more than 1 %%",
    },
}  # fmt: skip


def fleet_parser() -> Parser:
    made = Parser(
        prog=f"{PROGRAM} {FLEET}", usage=f"{PROGRAM} {FLEET} PATH... [options]", description=FLEET_TEXT, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter, add_help=False,
    )  # fmt: skip
    for name, how in FLEET_OPTIONS.items():
        made.add_argument(name, **how)
    made.add_argument("paths", nargs="*", type=not_empty, metavar="PATH", help=argparse.SUPPRESS)
    made.add_argument("-h", "--help", action="store_true", help="this text")
    return made


def experiments_of(made: Parser, only: str | None) -> tuple[str, ...]:
    """The experiments that are asked for, in their order."""
    if only is None:
        return tuple(EXPERIMENTS)
    names = [name.strip() for name in only.split(",") if name.strip()]
    for name in names:
        if name not in EXPERIMENTS:
            near = expected(name, {known: known for known in EXPERIMENTS}, ", ".join(EXPERIMENTS))
            made.error(f"--only: {name!r} is no experiment; {near}")
    if not names:
        made.error("--only names no experiment")
    return tuple(name for name in EXPERIMENTS if name in names)


def fleet_status(arguments: Sequence[str]) -> int:
    """Run the command; the exit status. SystemExit for help, and with one line for what is mistyped. FleetError, one line."""
    made = fleet_parser()
    options, unknown = made.parse_known_intermixed_args(arguments)
    for word in unknown:
        name = word.split("=")[0]
        known = {option.strip("-"): option for option in (*FLEET_OPTIONS, "--help")}
        made.error(f"{word!r} is no option; {expected(name.strip('-'), known, ' '.join(FLEET_OPTIONS))}")
    if options.help:
        made.print_help()
        raise SystemExit(0)
    if not options.paths:
        made.error(
            f"no file is named; a file, a folder, a pattern or @LIST is expected, as in {PROGRAM} {FLEET} models"
        )
    if options.dask and options.workers:
        made.error("--workers is for processes on this machine; a cluster has its own (--dask)")
    names = experiments_of(made, options.only)
    return run_fleet(options, names, shlex.join(["python", "-m", "compare", FLEET, *arguments]))


def run_fleet(options: argparse.Namespace, names: tuple[str, ...], command: str) -> int:
    """Find, compute, write; the exit status."""
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
    asked, sent = with_reference(Asked(names, not options.full), options.reference)
    kept = Kept(out)
    try:
        door = Cluster(options.dask, options.limit) if options.dask else Pool(options.workers or cores(), options.limit)
        try:
            run, words = Run(found.models, asked, door, kept, out, sent), []
            say_some(terminal, [f"left out: {name}, {why}" for name, why in found.left_out])
            terminal.tell(lambda: words)

            said_at = 0.0

            def progress() -> None:
                nonlocal said_at
                say_new(terminal, run)
                if time.perf_counter() - said_at > BETWEEN:  # of many files there is much to count
                    words[:], said_at = how_far_it_is(run), time.perf_counter()

            with terminal.progress(""):
                run.carry_out(progress)
            say_some(terminal, [f"left out: {name}, {why}" for name, why in run.parts])
        finally:
            door.close()
        changed = None if before is None else changes(before, sorted(run.rows, key=lambda row: row["file"]))
        took = time.perf_counter() - started
        said = write_table(out, run, found.left_out, changed, command, took)
        kept.forget_others()
    finally:
        kept.close()
    terminal.say()
    terminal.say(said[0], "bold green" if run.is_good else "bold red")
    for line in said[1:]:
        terminal.say(line)
    say_some(terminal, [f"changed: {line}" for line in changed or ()])
    if changed == []:
        terminal.say(f"nothing has changed since {in_one_line(options.since)}")
    terminal.say(f"Fleet: {in_one_line(os.path.join(options.out, 'index.html'))} ({took:.1f} s)")
    return 0 if run.is_good else 1


def with_reference(asked: "Asked", reference: str | None) -> tuple["Asked", dict[str, bytes]]:
    """What is asked of each file with a reference, and the files of a solution. FleetError if that cannot be read."""
    from ..engines.mujoco import ModelError, read  # what is imported takes its time
    from ..run.reference import is_solution
    from .models import Model, bundle
    from .parts import needed_by

    if not is_solution(reference):
        return asked._replace(reference=reference), {}
    try:
        read(Path(reference))
        model = Model(Path(reference), needed_by(Path(reference)))
        files = {f"{SENT}/{name}": content for name, content in bundle(model).items()}
    except ModelError as error:
        raise FleetError(f"--reference: {error}") from None
    return asked._replace(reference=reference, solution=next(iter(files)), solution_hash=model.hash), files


def how_far_it_is(run: "Run") -> list[str]:
    """How far a fleet is: files, pieces, the verdicts so far, how long still."""
    from .times import seconds_left

    verdicts = ", ".join(f"{many} {verdict}" for verdict, many in sorted(run.verdicts().items()))
    so_far = sum(task.row is None and bool(task.differs) for task in run.tasks)
    verdicts = ", ".join(filter(None, (verdicts, f"{so_far} differ so far" * bool(so_far))))
    still = [(step, task.joints) for task, step in run.still()]
    left = seconds_left(run.took, still, run.workers, run.door.times_alone)
    parts = [
        f"{run.files_done} of {run.files} files",
        f"{run.pieces_done} of {run.pieces_done + len(still)} pieces",
    ]
    return [part for part in [*parts, verdicts, f"about {in_words(left)} left" if left else ""] if part]


def say_some(terminal: Terminal, lines: Sequence[str]) -> None:
    """The first of many lines; the page has them all."""
    more = len(lines) - MOST_SAID
    for line in [*lines[:MOST_SAID], *[f"and {more} more, in index.html"] * (more > 0)]:
        terminal.say(line)


def say_new(terminal: Terminal, run: "Run") -> None:
    """A line for each file that has ended since the last call, or is known to differ before it has."""
    from .row import BAD_VERDICTS, DIFFER, ITSELF

    for task in run.take_early():
        terminal.say(f"{DIFFER:<{len(ITSELF)}} {task.model.shown}: {task.differs}, so far", "red")
    for row in run.take_new():
        ratio = "" if row["worst_ratio"] is None else f"{100.0 * row['worst_ratio']:.2g} % of tolerance"
        bad = row["verdict"] in BAD_VERDICTS
        text = ": ".join(filter(None, (row["file"], row["reason"] or ratio)))
        terminal.say(f"{row['verdict']:<{len(ITSELF)}} {text}  {row['seconds']:.1f} s", "red" if bad else "")
