"""Timing in turns, so that what slows the machine slows all functions alike; the processor's name."""

import platform
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

Call = Callable[[], Any]
Name = TypeVar("Name")
TIMED_ENOUGH = 0.015  # s: a function is called until as many calls as fast as its fastest take this long
WARM = 0.004  # s: a longer call needs no call before it to warm up
WIDTHS = (("avx512f", "AVX-512"), ("avx2", "AVX2"), ("asimd", "NEON"), ("sse2", "SSE2"))


def in_turns(runs: Sequence[Call], rounds: int) -> list[list[float]]:
    """Seconds of each call of each function, at most `rounds` calls, after one to warm up short functions."""
    times: list[list[float]] = [[] for _ in runs]
    for k in range(rounds + 1):
        for run, taken in zip(runs, times):
            if not taken or len(taken) * min(taken) < TIMED_ENOUGH:
                begin = time.perf_counter()
                run()
                taken.append(time.perf_counter() - begin)
                if k == 0 and taken[0] < WARM:
                    taken.clear()
    return times


def fastest(runs: Mapping[Name, Call], rounds: int) -> dict[Name, float]:
    return {name: min(taken) for name, taken in zip(runs, in_turns(list(runs.values()), rounds))}


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
