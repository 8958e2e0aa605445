"""The pool: processes on this machine, one for each worker. A process that ends is replaced, and its piece runs again."""

import shutil
import tempfile
import threading
import time
from bisect import insort_right
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue

from ..process import interrupt
from ..process.crash import described
from .child import SHARE, Child, memory_of_machine
from .piece import MOST_TRIES, NOTHING_NEW, Outcome, Piece

ATTEMPTS = 20  # to delete the folder of processes that are about to end and still write


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
        self.waiting, self.running, self.under_way = {}, {}, 0  # waiting: by rank, by group
        self.ended, self.closed = SimpleQueue(), False
        self.change, self.children = threading.Condition(), {}
        with interrupt.postponed():
            self.scratch = Path(tempfile.mkdtemp(prefix="fleet-"))
            interrupt.undo.append(self.stop)
        self.threads = [threading.Thread(target=self.work, args=(k,), daemon=True) for k in range(count)]
        for thread in self.threads:
            thread.start()

    def submit(self, piece: Piece) -> None:
        self.under_way += 1
        with self.change:
            groups = self.waiting.setdefault(piece.rank, {})
            insort_right(groups.setdefault(piece.group, []), piece, key=lambda each: -each.weight)
            self.change.notify_all()

    def next(self) -> tuple[Piece, Outcome] | None:
        try:
            done = self.ended.get(timeout=NOTHING_NEW)
        except Empty:
            return None
        self.under_way -= 1
        return done

    def no_timing(self) -> str | None:
        return None

    def workers(self) -> int:
        return self.count

    def close(self) -> None:
        with interrupt.postponed():
            self.stop()
            with suppress(ValueError):  # it is closed already
                interrupt.undo.remove(self.stop)
        with self.change:
            self.change.notify_all()
        for thread in self.threads:
            thread.join()

    def stop(self) -> None:
        """End all processes. It waits for nobody: whoever else is at work here may stand still already."""
        self.closed = True
        for child in list(self.children.values()):
            child.kill()
        for _ in range(ATTEMPTS):
            shutil.rmtree(self.scratch, ignore_errors=True)
            if not self.scratch.exists():
                return
            time.sleep(0.01)

    # in the thread of a worker

    def work(self, number: int) -> None:
        """Take pieces and have them carried out, until the pool is closed."""
        group = ""
        while (piece := self.take(number, group)) is not None:
            group = piece.group
            for times in range(1, MOST_TRIES + 1):
                outcome = self.carried_out(number, piece).tried(times)
                if self.closed or not outcome.ended or outcome.is_late:
                    break
            with self.change:
                del self.running[number]
                self.change.notify_all()
            self.ended.put((piece, outcome))
        if number in self.children:
            self.children.pop(number).close()

    def take(self, number: int, group: str) -> Piece | None:
        """The next piece, as soon as one may begin; None: the pool is closed."""
        with self.change:
            while not self.closed:
                piece = self.choice(group)
                if piece is not None:
                    self.running[number] = piece
                    return piece
                self.change.wait()
        return None

    def choice(self, group: str) -> Piece | None:
        """What begins now, of those that wait; it waits no longer."""
        running = self.running.values()
        if not self.waiting or any(piece.timed for piece in running):
            return None
        least, others = min(self.waiting), {piece.group for piece in running}
        groups = self.waiting[least]
        name = min(groups, key=lambda name: (name != group, name in others, -groups[name][0].weight))
        if groups[name][0].timed and running:
            return None
        found = groups[name].pop(0)
        if not groups[name]:
            del groups[name]
        if not groups:
            del self.waiting[least]
        return found

    def carried_out(self, number: int, piece: Piece) -> Outcome:
        try:
            call = piece.call
        except Exception as error:  # it cannot be sent
            return Outcome(error=described(error))
        try:
            child = self.child(number)
        except OSError as error:
            return Outcome(error=f"cannot start a process: {error.strerror}")
        if child is None:
            return Outcome(ended="the pool is closed")
        outcome = child.ask(call, piece.shared, self.limit)
        if child.is_spent(outcome):
            del self.children[number]
            child.close()
        return outcome

    def child(self, number: int) -> Child | None:
        """The process of a worker, a new one where it has none that lives; None: the pool is closed."""
        with interrupt.turn:  # an early end waits, and ends it too
            if self.closed:
                return None
            if number in self.children and not self.children[number].alive:  # it was ended between two pieces
                self.children.pop(number).close()
            if number not in self.children:
                self.children[number] = Child(self.scratch, self.memory)
            return self.children[number]
