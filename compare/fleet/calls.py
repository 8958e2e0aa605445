"""Calls of one function that go through a door: what an experiment needs of it for a long list of its own."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from ..process.workers import WorkerEnded
from .piece import LONGEST_PIECE, Door, FleetError, Outcome, Piece, outcomes


class Calls:
    """A door as an experiment sees it."""

    def __init__(self, door: Door):
        self.door = door

    def no_timing(self) -> str | None:
        """Why nothing can be timed behind the door, or None."""
        return self.door.no_timing()

    def outcomes(
        self,
        function: Callable,
        items: Sequence,
        timed: bool = False,
        progress: Callable[[int], object] = lambda done: None,
    ) -> list[Outcome]:
        """What becomes of a function of a module for each item, in their order.

        timed: each call takes a worker for itself; progress: gets to know how many have ended. WorkerEnded: the door is gone.
        """
        pieces = [Piece(function.__name__, function, (item,), timed=timed) for item in items]
        try:
            return outcomes(self.door, pieces, progress)
        except FleetError as error:
            why = str(error).partition(";")[0]  # nothing of a list is kept
            raise WorkerEnded(f"{why}; a report that was there is unchanged") from None


@contextmanager
def door_opened(address: str | None, workers: int | None) -> Iterator[Calls | None]:
    """Yields the door that is asked for: a Dask cluster, by the address of its scheduler, or so many processes; None: neither.

    FleetError: there is no such cluster, or none that can be used.
    """
    if not (address or workers):
        yield None
        return
    from .cluster import Cluster  # imports are here, for a run that asks for neither
    from .pool import Pool

    door = Cluster(address, LONGEST_PIECE) if address else Pool(workers, LONGEST_PIECE)
    try:
        yield Calls(door)
    finally:
        door.close()
