"""python -m compare.experiments.speed.remake: the committed table of runs with many digits, of the arm's scenes, made again."""

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

from ...case import Case
from ...robots.arm import ARM
from ...truth import reference
from .settings import scenes_of


def main(cases: Sequence[Case] | None = None) -> None:
    """Remake the table."""
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        tables = reference.remade(scenes_of(ARM) if cases is None else cases, pool.map, partial(print, file=sys.stderr))
    reference.write_table(reference.TABLE, [row for rows in tables for row in rows])
    for rows in tables:
        print(f"{rows[0]['scene']}: {rows[0]['steps']} steps, {rows[0]['halving_difference']} from half as many")


if __name__ == "__main__":
    sys.exit(main())
