"""Timing in turns, so that what slows the machine slows all functions alike; the processor's name."""

import math
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

Call = Callable[[], Any]
Clock = Callable[[], float]  # s
Name = TypeVar("Name")
TIMED_ENOUGH = 0.015  # s: a function is called until as many calls as fast as its fastest take this long
WARM = 0.004  # s: a longer call needs no call before it to warm up
STEADY = 1.5  # ratio of its two fastest calls up to which a time is that of the function
LONG = 0.25  # s: a turn of another process, some 16 ms, does not change a call that takes longer
WIDTHS = (("avx512f", "AVX-512"), ("avx2", "AVX2"), ("asimd", "NEON"), ("sse2", "SSE2"))


def in_turns(runs: Sequence[Call], rounds: int, clock: Clock | None = None) -> list[list[float]]:
    """Seconds of each call of each function, at most `rounds` calls, after one to warm up short functions.

    A function is called again until `is_timed`: one call may have had to wait for another process.
    """
    now, times = clock or time.perf_counter, [list[float]() for _ in runs]
    for k in range(rounds + 1):
        for run, taken in zip(runs, times):
            if not is_timed(taken):
                begin = now()
                run()
                taken.append(now() - begin)
                if k == 0 and taken[0] < WARM:
                    taken.clear()
    return times


def is_timed(taken: Sequence[float]) -> bool:
    """Whether calls took long enough together, and the two fastest as long as each other, or very long."""
    if not taken or len(taken) * min(taken) < TIMED_ENOUGH:
        return False
    return min(taken) >= LONG or scatter(taken) <= STEADY


def scatter(taken: Sequence[float]) -> float:
    """The ratio of the two fastest calls; infinite of a single one that is not long."""
    if len(taken) < 2:
        return 1.0 if min(taken) >= LONG else math.inf
    fast, next_fast = sorted(taken)[:2]
    return next_fast / fast


def fastest(runs: Mapping[Name, Call], rounds: int, clock: Clock | None = None) -> dict[Name, float]:
    return {name: min(taken) for name, taken in zip(runs, in_turns(list(runs.values()), rounds, clock))}


def vectors() -> str:
    """The processor's name and its widest vectors, where the system reports them."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    fields = {name.strip(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
    flags = fields.get("flags", fields.get("Features", "")).split()
    width = next((name for flag, name in WIDTHS if flag in flags), "vector width unknown")
    return f"{fields.get('model name') or platform.processor() or 'unknown'}, {width}"
