"""Calls of one function by an executor, for an experiment with a long list of its own."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from ..process.child import Outcome
from ..process.workers import WorkerEnded
from .tasks import DEFAULT_LIMIT, Executor, FleetError, Task, outcomes


class Calls:
    """An executor as an experiment uses it."""

    def __init__(self, executor: Executor):
        self.executor = executor

    def no_timing(self) -> str | None:
        """Why timed tasks cannot run, or None."""
        return self.executor.no_timing()

    def outcomes(
        self,
        function: Callable,
        items: Sequence,
        timed: bool = False,
        progress: Callable[[int], object] = lambda done: None,
    ) -> list[Outcome]:
        """The outcomes of a function of a module for each item, in their order.

        timed: each call has a worker for itself; progress: called with the number that have ended. WorkerEnded: the
        executor has failed.
        """
        tasks = [Task(function.__name__, function, (item,), timed=timed) for item in items]
        try:
            return outcomes(self.executor, tasks, progress)
        except FleetError as error:
            raise WorkerEnded(f"{str(error).partition(';')[0]}; the earlier report is unchanged") from None


@contextmanager
def door_opened(address: str | None, workers: int | None) -> Iterator[Calls | None]:
    """Yields an executor: the Dask cluster of a scheduler's address, or a pool of this number of processes; None: neither.

    FleetError: the cluster cannot be used.
    """
    if not (address or workers):
        yield None
        return
    from .cluster import Cluster  # imported only where it is used
    from .pool import Pool

    executor = Cluster(address, DEFAULT_LIMIT) if address else Pool(workers, DEFAULT_LIMIT)
    try:
        yield Calls(executor)
    finally:
        executor.close()
