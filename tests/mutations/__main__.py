"""python -m tests.mutations: make the judge wrong in a hundred ways, and list those that no test notices.

Each edit is made in a copy of the project; the tests of the judge run first, and all others only if they pass. The copies are in
processes on this machine or, with --dask, on the workers of a cluster, to which the project is sent.
"""

import argparse
import os
import signal
import sys
from contextlib import closing
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from compare.fleet.cluster import Cluster
from compare.fleet.piece import FleetError
from compare.fleet.pool import Pool

from .campaign import CannotStart, longest, tried_edits
from .edit import DoesNotApply, applied
from .edits import EDITS
from .stages import stages

PROJECT = Path(__file__).resolve().parents[2]
STATUS = """exit status: 0 no edit survives but those declared harmless; 1 some do; 2 an edit does not apply to the sources, or
could not be tried, or the tests do not pass without any"""


def main(arguments=None, project=PROJECT, edits=EDITS, stages=stages) -> int:
    """Run the command line; the exit status."""
    parser = argparse.ArgumentParser("python -m tests.mutations", description=__doc__, epilog=STATUS)
    parser.add_argument("words", nargs="*", metavar="WORD", help="only edits that have one of these in their name")
    parser.add_argument("--list", action="store_true", help="list the edits, run nothing")
    parser.add_argument("--judge-only", action="store_true", help="only the fast tests of the judge")
    some = min(2, os.cpu_count() or 1)
    parser.add_argument("--jobs", type=int, metavar="N", help=f"runs side by side on this machine ({some})")
    parser.add_argument(
        "--dask", metavar="ADDRESS", help="the scheduler of a Dask cluster, whose workers run the tests"
    )
    options = parser.parse_args(arguments)
    if options.dask and options.jobs is not None:
        parser.error("--jobs is for runs on this machine; a cluster has its own workers (--dask)")
    jobs = some if options.jobs is None else options.jobs
    console = Console(soft_wrap=True, highlight=False, markup=False, emoji=False)
    chosen = [edit for edit in edits if not options.words or any(word in edit.name for word in options.words)]
    places, lost = {}, []
    for edit in chosen:
        try:
            places[edit] = applied(project, edit)
        except DoesNotApply as error:
            lost.append(str(error))
    for text in lost:
        console.print(f"does not apply: {text}")
    if lost or not chosen or jobs < 1:
        console.print(f"{len(lost)} of {len(chosen)} edits do not apply" if lost else "nothing to do")
        return 2
    if options.list:
        for edit in chosen:
            console.print(edit.name + (f" (harmless: {edit.harmless})" if edit.harmless else ""))
        return 0
    signals = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
    before = [signal.signal(number, signal.default_int_handler) for number in signals]
    try:
        chosen = stages(project)[: 1 if options.judge_only else None]
        door = Cluster(options.dask, longest(chosen)) if options.dask else Pool(jobs, longest(chosen))
        with closing(door):
            return campaign(console, project, places, chosen, door)
    except FleetError as error:
        console.print(str(error))
        return 2
    except KeyboardInterrupt:
        console.print("interrupted")
        return 2
    finally:
        for number, handler in zip(signals, before):
            signal.signal(number, handler)


def campaign(console, project, places, stages, door) -> int:
    """Try the edits, a line for each, then the survivors; the exit status."""
    columns = BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}")
    survivors, lost = [], 0
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as progress:
        task = progress.add_task("the unedited copy", total=len(places))
        try:
            for tried in tried_edits(door, project, stages, places):
                progress.update(task, advance=1, description="")
                console.print(line(tried))
                survivors += [] if tried.caught or tried.lost else [tried]
                lost += bool(tried.lost)
        except CannotStart as error:
            console.print(f"the tests do not pass without an edit: {error}")
            return 2
    harmful = [tried for tried in survivors if not tried.edit.harmless]
    for tried in sorted(survivors, key=lambda tried: bool(tried.edit.harmless)):
        harmless = f" (harmless: {tried.edit.harmless})" if tried.edit.harmless else ""
        console.print(f"\nsurvived: {tried.edit.name}{harmless}\n{tried.diff}")
    declared = len(survivors) - len(harmful)
    caught = len(places) - len(survivors) - lost
    console.print(f"\n{len(places)} edits: {caught} caught, {declared} declared harmless, {len(harmful)} survived"
                  + f", {lost} could not be tried" * bool(lost))  # fmt: skip
    return 1 if harmful else 2 if lost else 0


def line(tried) -> str:
    """One line for an edit."""
    outcome = f"caught by {tried.caught}" if tried.caught else "SURVIVED" if not tried.edit.harmless else "harmless"
    outcome = f"could not be tried: {tried.lost}" if tried.lost else outcome
    return f"{tried.seconds:5.1f} s  {tried.edit.name}: {outcome}"


if __name__ == "__main__":
    sys.exit(main())
