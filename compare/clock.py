"""Timing: what is compared is timed in turns, so that whatever slows the machine down slows all of them."""

import time
from collections.abc import Callable

ENOUGH = 0.02  # s: what has taken so long in all is timed no more than twice
LONG = 0.1  # s: what takes so long is timed once, without a call to warm up: both weigh little beside it


def in_turns(runs: list[Callable], rounds: int) -> list[list[float]]:
    """Seconds of each call of each function, at most so many rounds, after one to warm up."""
    times = [[] for _ in runs]
    for k in range(rounds + 1):
        for run, taken in zip(runs, times):
            if not taken or (len(taken) < 2 and taken[0] < LONG) or sum(taken) < ENOUGH:
                begin = time.perf_counter()
                run()
                taken.append(time.perf_counter() - begin)
                if k == 0 and taken[0] < LONG:
                    taken.clear()
    return times


def fastest(runs: dict[object, Callable], rounds: int) -> dict[object, float]:
    """Seconds of the fastest call of each function, by its name."""
    return {name: min(taken) for name, taken in zip(runs, in_turns(list(runs.values()), rounds))}
