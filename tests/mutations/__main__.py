"""python -m tests.mutations: make the judge wrong in some 430 ways, and list those that no test notices.

Each edit is made in a copy of the project, and meets the tests of the default stage, those first that name what is edited.
"""

import argparse
import os
import signal
import sys
from contextlib import closing
from pathlib import Path

from rich.console import Console

from .campaign import fail_without_an_edit, tried_edits
from .edit import DoesNotApply, applied
from .edits import EDITS

PROJECT = Path(__file__).resolve().parents[2]
STATUS = """exit status: 0 no edit survives but those declared harmless; 1 some do; 2 an edit does not apply to the sources, or
a test that caught one fails without it too"""


def main(arguments=None, project=PROJECT, edits=EDITS) -> int:
    """Run the command line; the exit status."""
    parser = argparse.ArgumentParser("python -m tests.mutations", description=__doc__, epilog=STATUS)
    parser.add_argument("words", nargs="*", metavar="WORD", help="only edits that have one of these in their name")
    parser.add_argument("--list", action="store_true", help="list the edits, run nothing")
    some = min(2, os.cpu_count() or 1)
    parser.add_argument("--jobs", type=int, default=some, metavar="N", help="runs side by side (%(default)s)")
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
    signals = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = [signal.signal(number, signal.default_int_handler) for number in signals]
    try:
        with closing(tried_edits(project, places, options.jobs)) as tried:
            status, tests = campaign(console, tried)
        if failed := fail_without_an_edit(project, tests):
            console.print(f"fails without an edit: {failed}")
            return 2
        return status
    except KeyboardInterrupt:
        console.print("interrupted")
        return 2
    finally:
        for number, handler in zip(signals, before):
            signal.signal(number, handler)


def campaign(console, tried) -> tuple[int, list[str]]:
    """A line for each edit that was tried, then the survivors; the exit status, and the tests that caught one."""
    survivors, count, tests = [], 0, set()
    for one in tried:
        count += 1
        survivors += [] if one.caught else [one]
        tests |= {one.caught.split("[")[0]} if one.caught.startswith("tests") else set()
        outcome = f"caught by {one.caught}" if one.caught else "harmless" if one.edit.harmless else "SURVIVED"
        console.print(f"{one.seconds:5.1f} s  {one.edit.name}: {outcome}")
    for one in sorted(survivors, key=lambda one: bool(one.edit.harmless)):
        harmless = f" (harmless: {one.edit.harmless})" if one.edit.harmless else ""
        console.print(f"\nsurvived: {one.edit.name}{harmless}\n{one.diff}")
    harmful = sum(not one.edit.harmless for one in survivors)
    console.print(f"\n{count} edits: {count - len(survivors)} caught, {len(survivors) - harmful} declared harmless, "
                  f"{harmful} survived")  # fmt: skip
    return (1 if harmful else 0), sorted(tests)


if __name__ == "__main__":
    sys.exit(main())
