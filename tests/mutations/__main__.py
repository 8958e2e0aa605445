"""python -m tests.mutations: make the judge wrong in a hundred ways, and list those that no test notices.

Each edit is made in a copy of the project; the tests of the judge run first, and all others only if they pass.
"""

import argparse
import os
import signal
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from .campaign import Campaign, CannotStart
from .edit import DoesNotApply, applied
from .edits import EDITS
from .stages import stages

PROJECT = Path(__file__).resolve().parents[2]
STATUS = """exit status: 0 no edit survives but those declared harmless; 1 some do; 2 an edit does not apply to the sources, or
the tests do not pass without any"""


def main(arguments=None, project=PROJECT, edits=EDITS, stages=stages) -> int:
    """Run the command line; the exit status."""
    parser = argparse.ArgumentParser("python -m tests.mutations", description=__doc__, epilog=STATUS)
    parser.add_argument("words", nargs="*", metavar="WORD", help="only edits that have one of these in their name")
    parser.add_argument("--list", action="store_true", help="list the edits, run nothing")
    parser.add_argument("--judge-only", action="store_true", help="only the fast tests of the judge")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1), help="runs side by side (%(default)s)")
    options = parser.parse_args(arguments)
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
    if lost or not chosen or options.jobs < 1:
        console.print(f"{len(lost)} of {len(chosen)} edits do not apply" if lost else "nothing to do")
        return 2
    if options.list:
        for edit in chosen:
            console.print(edit.name + (f" (harmless: {edit.harmless})" if edit.harmless else ""))
        return 0
    signals = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
    before = [signal.signal(number, signal.default_int_handler) for number in signals]
    try:
        return campaign(console, project, places, stages(project)[: 1 if options.judge_only else None], options.jobs)
    except KeyboardInterrupt:
        console.print("interrupted")
        return 2
    finally:
        for number, handler in zip(signals, before):
            signal.signal(number, handler)


def campaign(console, project, places, stages, jobs) -> int:
    """Try the edits, a line for each, then the survivors; the exit status."""
    columns = BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}")
    survivors = []
    with (
        Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as progress,
        Campaign(project, stages, jobs) as run,
    ):
        task = progress.add_task("the unedited copy", total=len(places))
        try:
            for tried in run.tried(places):
                progress.update(task, advance=1, description="")
                console.print(line(tried))
                survivors += [] if tried.caught else [tried]
        except CannotStart as error:
            console.print(f"the tests do not pass without an edit: {error}")
            return 2
    harmful = [tried for tried in survivors if not tried.edit.harmless]
    for tried in sorted(survivors, key=lambda tried: bool(tried.edit.harmless)):
        harmless = f" (harmless: {tried.edit.harmless})" if tried.edit.harmless else ""
        console.print(f"\nsurvived: {tried.edit.name}{harmless}\n{tried.diff}")
    declared = len(survivors) - len(harmful)
    console.print(f"\n{len(places)} edits: {len(places) - len(survivors)} caught, {declared} declared harmless, "
                  f"{len(harmful)} survived")  # fmt: skip
    return 1 if harmful else 0


def line(tried) -> str:
    """One line for an edit."""
    outcome = f"caught by {tried.caught}" if tried.caught else "SURVIVED" if not tried.edit.harmless else "harmless"
    return f"{tried.seconds:5.1f} s  {tried.edit.name}: {outcome}"


if __name__ == "__main__":
    sys.exit(main())
