"""What is handed to a pool or a cluster: pieces of work, and what becomes of them."""

import pickle
from collections.abc import Callable
from typing import NamedTuple, Protocol

MOST_TRIES = 4  # of a piece whose process ended: it runs again at most three times
LONGEST_PIECE = 600.0  # s that a piece may take, where nothing else is asked for
NOTHING_NEW = 0.5  # s after which a door says that nothing has ended


class FleetError(ValueError):
    """A fleet that cannot be run, or not to its end; the message is one line."""


class Piece(NamedTuple):
    """A call that can be made in any process: the function is one of a module, the arguments can be sent."""

    name: str  # in a sentence: "mass of arm7.xml"
    function: Callable
    arguments: tuple = ()
    group: str = ""  # pieces of a group have much in common, which a process that had one of them still has
    rank: int = 0  # those of a lower rank begin first
    weight: float = 0.0  # of one rank those of a heavy group begin first
    timed: bool = False  # it measures time, and takes a worker for itself
    shared: bytes = b""  # the last argument of all pieces of a group, which is sent to a machine once

    @property
    def call(self) -> bytes:
        """What is sent of it, besides what is shared. Any exception if that cannot be sent."""
        return pickle.dumps((self.function, self.arguments))


class Outcome(NamedTuple):
    """What became of a piece."""

    value: bytes = b""  # what the function returned, pickled; see `returned`
    error: str = ""  # what it raised, in one line
    ended: str = ""  # how its process ended before it did: "ended by SIGKILL"
    is_late: bool = False  # it took longer than a piece may
    seconds: float = 0.0  # of the processor
    wall: float = 0.0  # s by a watch, of the function alone
    memory: int = 0  # bytes, the most that its process ever had
    machine: str = ""  # the name of the machine

    @property
    def broke(self) -> str:
        """Why there is no value, in a sentence; "" if there is one."""
        return self.error or self.ended

    @property
    def returned(self) -> object:
        """What the function returned. RuntimeError if it did not."""
        if self.broke:
            raise RuntimeError(self.broke)
        return pickle.loads(self.value)

    def tried(self, times: int) -> "Outcome":
        """The same, where it is the last of so many tries."""
        return self._replace(ended=f"{self.ended}, {times} times") if self.ended and times > 1 else self


class Door(Protocol):
    """Where pieces go: the pool of this machine, or a cluster."""

    times_alone: bool  # nothing else is under way while a timed piece runs
    under_way: int  # pieces that were submitted and have not been handed back

    def submit(self, piece: Piece) -> None: ...
    def next(self) -> tuple[Piece, Outcome] | None: ...  # None after half a second in which none ended
    def no_timing(self) -> str | None: ...  # why no timed piece can be run, or None
    def workers(self) -> int: ...  # how many pieces run side by side
    def close(self) -> None: ...


def outcomes(door: Door, pieces: list[Piece], progress: Callable[[int], object] = lambda done: None) -> list[Outcome]:
    """What becomes of a list of pieces, in its order. progress: gets to know how many have ended."""
    found = {}
    for k, piece in enumerate(pieces):
        door.submit(piece._replace(name=f"{k} {piece.name}"))
    while door.under_way:
        if done := door.next():
            found[int(done[0].name.split(" ", 1)[0])] = done[1]
            progress(len(found))
    return [found[k] for k in range(len(pieces))]
