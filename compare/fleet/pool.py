"""The pool: processes on this machine, one for each worker. A process that ends is replaced, and its piece runs again."""

import shutil
import tempfile
import threading
from pathlib import Path
from queue import Empty, SimpleQueue

from ..process import interrupt
from .child import SHARE, Child, memory_of_machine
from .piece import TRIES, Outcome, Piece

PAUSE = 0.5  # s after which it is said that nothing has ended


class Pool:
    """So many processes; see piece.Door. limit: s that a piece may take; memory: bytes, None: a share of the machine's.

    A timed piece begins when nothing else is under way, and nothing begins before it ends. Of pieces of one rank a process takes
    those of the group that it had before, then those of a group that no other has.
    """

    times_alone = True

    def __init__(self, count: int, limit: float, memory: int | None = None):
        whole = memory_of_machine()
        self.count, self.limit = count, limit
        self.memory = memory or (int(SHARE * whole / count) if whole else None)
        self.scratch = Path(tempfile.mkdtemp(prefix="fleet-"))
        self.waiting, self.running, self.under_way = [], {}, 0
        self.ended, self.closed = SimpleQueue(), False
        self.change = threading.Condition()
        self.children = {}
        interrupt.undo.append(self.close)
        self.threads = [threading.Thread(target=self.work, args=(k,), daemon=True) for k in range(count)]
        for thread in self.threads:
            thread.start()

    def submit(self, piece: Piece) -> None:
        self.under_way += 1
        with self.change:
            self.waiting.append(piece)
            self.change.notify_all()

    def next(self) -> tuple[Piece, Outcome] | None:
        try:
            done = self.ended.get(timeout=PAUSE)
        except Empty:
            return None
        self.under_way -= 1
        return done

    def no_timing(self) -> str | None:
        return None

    def workers(self) -> int:
        return self.count

    def close(self) -> None:
        with self.change:
            self.closed = True
            self.change.notify_all()
        for child in list(self.children.values()):
            child.kill()
        shutil.rmtree(self.scratch, ignore_errors=True)
        if self.close in interrupt.undo:
            interrupt.undo.remove(self.close)

    # in the thread of a worker

    def work(self, number: int) -> None:
        """Take pieces and have them carried out, until the pool is closed."""
        group = ""
        while (piece := self.take(number, group)) is not None:
            group = piece.group
            for times in range(1, TRIES + 1):
                outcome = self.carried_out(number, piece).tried(times)
                if self.closed or not outcome.ended or outcome.is_late:
                    break
            with self.change:
                del self.running[number]
                self.change.notify_all()
            self.ended.put((piece, outcome))

    def take(self, number: int, group: str) -> Piece | None:
        """The next piece, as soon as one may begin; None: the pool is closed."""
        with self.change:
            while not self.closed:
                piece = self.choice(group)
                if piece is not None:
                    self.waiting.remove(piece)
                    self.running[number] = piece
                    return piece
                self.change.wait()
        return None

    def choice(self, group: str) -> Piece | None:
        """What may begin now, of those that wait."""
        running = list(self.running.values())
        if not self.waiting or any(piece.timed for piece in running):
            return None
        others = {piece.group for piece in running}
        least = min(piece.rank for piece in self.waiting)
        found = min(
            (piece for piece in self.waiting if piece.rank == least),
            key=lambda piece: (piece.group != group, piece.group in others, -piece.weight),
        )
        return None if found.timed and running else found

    def carried_out(self, number: int, piece: Piece) -> Outcome:
        child = self.children.get(number)
        if child is None:
            with interrupt.postponed():
                if self.closed:
                    return Outcome(ended="the pool is closed")
                child = self.children[number] = Child(self.scratch, self.memory)
        outcome = child.ask(piece, self.limit)
        if not child.alive or child.is_full(outcome) or outcome.error.startswith("out of memory"):
            del self.children[number]
            child.close()
        return outcome
