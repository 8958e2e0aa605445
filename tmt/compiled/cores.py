"""The cores of this machine, and compiled work that is spread over them."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import TypeVar

Result = TypeVar("Result")


def cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_threads(
    work: Callable[[slice], Result], count: int, parts: int, block: int, threads: int,
    stop: Callable[[], None] | None = None,
) -> list[Result]:  # fmt: skip
    """work(slice) of parts of a number of states, cut at multiples of a block, in a number of threads.

    stop: ends the work where it is interrupted (Ctrl-C, which no compiled code sees); then it has a thread of
    its own.
    """
    ends = [count * k // parts // block * block for k in range(parts)] + [count]
    slices = [slice(*pair) for pair in pairwise(ends)]
    if min(threads, parts) == 1 and stop is None:
        return [work(part) for part in slices]
    with ThreadPoolExecutor(threads) as pool:
        try:
            futures = [pool.submit(work, part) for part in slices]
        except RuntimeError:  # the interpreter ends, or there are too many: one after the other
            return [work(part) for part in slices]
        try:
            return [future.result() for future in futures]
        except BaseException:
            if stop is not None:
                stop()
            raise
