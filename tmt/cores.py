"""The cores of this machine, and work that is spread over them: compiled code, which lets others run beside it."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

APART = 1e-3  # s of work from which a further core is worth a thread
TOGETHER = 32  # evaluations that are not parted


def cores() -> int:
    """Of the machine, those that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def side_by_side(work: Callable, count: int, each: float) -> list:
    """work(slice) of parts of so many evaluations, in threads where each has enough to do; each: s of an evaluation."""
    threads = max(1, min(cores(), int(count * each / APART)))
    ends = [count * k // threads // TOGETHER * TOGETHER for k in range(threads)] + [count]
    slices = [slice(*pair) for pair in pairwise(ends)]
    if threads == 1:
        return [work(slices[0])]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, slices))
