"""Processor time and end of each task of a run."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Clock:
    """The processor time of each task, in this process and in workers, and when each ended."""

    def __init__(self):
        self.started = time.perf_counter()
        self.task = ""  # to which processor time is assigned
        self.under_way = ""
        self.ended = {}  # s from the start, of each task that has ended
        self.taken = []  # (task, processor time); threads append to it

    @contextmanager
    def of(self, task: str) -> Iterator[None]:
        """Assign the processor time of this block, and of calls of workers in it, to a task."""
        before, self.task, began = self.task, task, time.process_time()
        try:
            yield
        finally:
            self.task = before
            self.taken.append((task, time.process_time() - began))

    def ends(self, task: str) -> None:
        self.under_way = ""
        self.ended[task] = time.perf_counter() - self.started

    def seconds_of(self, task: str) -> float:
        """The processor time of a task so far, s."""
        return sum(seconds for name, seconds in list(self.taken) if name == task)
