"""The cores of this machine, and work that is spread over them: compiled code, which lets others run beside it."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

SHARED = 5_000  # states times speeds from which several cores share them
TOGETHER = 32  # states that are not parted


def cores() -> int:
    """Of the machine, those that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def side_by_side(work: Callable, count: int, speeds: int) -> list:
    """work(slice) of parts of many states, in threads where each has enough to do."""
    threads = max(1, min(cores(), count * speeds // SHARED))
    ends = [count * k // threads // TOGETHER * TOGETHER for k in range(threads)] + [count]
    slices = [slice(*pair) for pair in pairwise(ends)]
    return [work(slices[0])] if threads == 1 else in_threads(work, [(part,) for part in slices], threads)


def in_threads(work: Callable, parts: list[tuple], threads: int) -> list:
    """work(*part) of all parts, in this number of threads; one after the other where none can be started any more."""
    with ThreadPoolExecutor(threads) as pool:
        try:
            found = [pool.submit(work, *part) for part in parts]
        except RuntimeError:  # the interpreter ends, or there are too many
            found = None
    return [work(*part) for part in parts] if found is None else [one.result() for one in found]
