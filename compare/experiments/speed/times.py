"""The seconds of speed's runs: all settings of a scene in turns, long runs of MuJoCo over a part of their steps."""

from collections.abc import Sequence

import numpy as np

from ...engines import Method, Setting
from ...judge import timing
from ..setup import Setup

FIRST_STEPS = 4096  # of a run of MuJoCo that has more


def prepared(rows: list[dict], setup: Setup) -> list[tuple]:
    """(call, how many times as long its run takes) of the rows of one scene, ready to be timed."""
    runs = []
    for case, method, setting in (row["run"] for row in rows):
        dynamics, part = setup.engines[method.engine].of(case), timed_part(method, setting)
        run, _ = dynamics.prepare(*case.start, case.tau, part, method.name)
        runs.append((run, setting.duration / part.duration))
    return runs


def take_times(runs: Sequence[tuple], setup: Setup) -> list[list[float]]:
    """Seconds of the runs of one scene, see `prepared`, all in turns."""
    times = timing.in_turns([run for run, _ in runs], rounds=setup.of(5, 2, 2))
    return [[longer * seconds for seconds in taken] for (_, longer), taken in zip(runs, times)]


def timed_part(method: Method, setting: Setting) -> Setting:
    """What of a run is timed: of many steps of MuJoCo, each of which costs the same, the first FIRST_STEPS; else all."""
    if method.engine != "mujoco" or setting.steps <= FIRST_STEPS:
        return setting
    return Setting(setting.duration * FIRST_STEPS / setting.steps, FIRST_STEPS)


def fill_in(rows: list[dict], times: Sequence[Sequence[float]]) -> list[float]:
    """Give each row the least of its times; of those that have more than one, the median over the least."""
    for row, of_row in zip(rows, times):
        row["seconds"] = min(of_row)
    return [float(np.median(of_row)) / min(of_row) for of_row in times if len(of_row) > 1]


def spread_in_words(spread: Sequence[float]) -> list[str]:
    """How the times of one setting differ, in words."""
    first = f" A run of MuJoCo with more than {FIRST_STEPS} steps is timed over the first {FIRST_STEPS}: each costs the same."
    if not spread:
        return [f"Each time is that of one run.{first}"]
    return [
        f"Each time is the least of several runs (one, if it takes longer than {timing.ONCE:g} s), in turns with all of its "
        f"scene; where there are more than one, their median is {np.median(spread) - 1:.1%} above the least, for one setting "
        f"in ten more than {np.quantile(spread, 0.9) - 1:.0%}.{first} Errors come from runs of their own."
    ]
