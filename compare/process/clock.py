"""How long each task takes: what the processor did for it itself, and when it ended."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Clock:
    """Which task is under way, and what each has taken.

    A task's own seconds are those of the processor, in this process and in others that compute for it (see workers); what it
    waits for others is not in them, and on two cores they can be more than what a watch shows.
    """

    def __init__(self):
        self.started = time.perf_counter()
        self.task = ""  # for which something is done
        self.under_way = ""
        self.ended = {}  # s from the start, of each task that has ended
        self.taken = []  # (task, seconds of the processor)

    @property
    def elapsed(self) -> float:
        """Seconds from the start, by a watch."""
        return time.perf_counter() - self.started

    @contextmanager
    def of(self, task: str) -> Iterator[None]:
        """What is done in this block, and what is asked of other processes in it, is done for this task."""
        before, self.task = self.task, task
        began = time.process_time()
        try:
            yield
        finally:
            self.task = before
            self.add(task, time.process_time() - began)

    def add(self, task: str, seconds: float) -> None:
        """A task has taken so many seconds of the processor."""
        self.taken.append((task, seconds))

    def begins(self, task: str) -> None:
        """A task is under way."""
        self.under_way = task

    def ends(self, task: str) -> None:
        """A task has come to its end."""
        self.under_way = ""
        self.ended[task] = self.elapsed

    def seconds_of(self, task: str) -> float:
        """Seconds of the processor of a task, so far."""
        return sum(seconds for name, seconds in list(self.taken) if name == task)
