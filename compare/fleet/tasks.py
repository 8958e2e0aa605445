"""Tasks for a pool or a cluster."""

import pickle
from collections.abc import Callable
from typing import NamedTuple, Protocol

from ..process.child import Outcome
from ..process.crash import Refused

MAX_TRIES = 4  # of a task whose process ended: three repetitions
DEFAULT_LIMIT = 600.0  # s
POLLING = 0.5  # s after which Executor.next returns None


class FleetError(Refused):
    """A fleet cannot run, or cannot continue; the message is one line."""


class Task(NamedTuple):
    """A call that any process can make: a function of a module and arguments that can be pickled."""

    name: str  # in a sentence: "mass of arm7.xml"
    function: Callable
    arguments: tuple = ()
    group: str = ""  # tasks of a group reuse what the process has in memory
    rank: int = 0  # lower ranks begin first
    weight: float = 0.0  # within a rank heavy groups begin first
    timed: bool = False  # measures time: nothing else runs on that worker
    shared: bytes = b""  # last argument of all tasks of a group; sent to each machine once

    @property
    def call(self) -> bytes:
        """Function and arguments, pickled. Raises what pickle raises."""
        return pickle.dumps((self.function, self.arguments))


class Executor(Protocol):
    """Runs tasks: the pool of this machine or a cluster."""

    times_alone: bool  # nothing else runs during a timed task
    under_way: int  # tasks submitted and not yet returned by next

    def submit(self, task: Task) -> None: ...
    def next(self) -> tuple[Task, Outcome] | None: ...  # None if no task ended within POLLING
    def no_timing(self) -> str | None: ...  # why timed tasks cannot run, or None
    def workers(self) -> int: ...  # number of tasks that run at the same time
    def close(self) -> None: ...


def outcomes(
    executor: Executor, tasks: list[Task], progress: Callable[[int], object] = lambda done: None
) -> list[Outcome]:
    """The outcomes of a list of tasks, in its order. progress: called with the number of tasks that have ended."""
    ended = {}
    for k, task in enumerate(tasks):
        executor.submit(task._replace(name=f"{k} {task.name}"))
    while executor.under_way:
        if done := executor.next():
            ended[int(done[0].name.split(" ", 1)[0])] = done[1]
            progress(len(ended))
    return [ended[k] for k in range(len(tasks))]
