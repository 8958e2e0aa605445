"""Processes on this machine, one for each worker. If a process crashes, its task runs again in a new one."""

import shutil
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue

from ..process import interrupt
from ..process.child import SHARE, Child, Outcome, memory_of_machine
from ..process.crash import described
from .tasks import MAX_TRIES, POLLING, Task

ATTEMPTS = 20  # to delete the folder while killed processes may still write


class Pool:
    """A number of processes; see tasks.Executor. limit: s for each task; memory: bytes, None: a share of the machine's.

    A timed task begins when no other task runs, and none begins before it ends. Within a rank a process prefers the group of
    its last task, then a group that no other process has.
    """

    times_alone = True

    def __init__(self, count: int, limit: float, memory: int | None = None):
        whole = memory_of_machine()
        self.count, self.limit = count, limit
        self.memory = memory or (int(SHARE * whole / count) if whole else None)
        self.waiting, self.running, self.under_way = [], {}, 0
        self.ended, self.closed = SimpleQueue(), False
        self.change, self.children = threading.Condition(), {}
        with interrupt.postponed():
            self.scratch = Path(tempfile.mkdtemp(prefix="fleet-"))
            interrupt.undo.append(self.stop)
        self.threads = [threading.Thread(target=self.work, args=(k,), daemon=True) for k in range(count)]
        for thread in self.threads:
            thread.start()

    def submit(self, task: Task) -> None:
        self.under_way += 1
        with self.change:
            self.waiting.append(task)
            self.change.notify_all()

    def next(self) -> tuple[Task, Outcome] | None:
        try:
            done = self.ended.get(timeout=POLLING)
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
            with suppress(ValueError):  # closed before
                interrupt.undo.remove(self.stop)
        with self.change:
            self.change.notify_all()
        for thread in self.threads:
            thread.join()

    def stop(self) -> None:
        """Kill all processes, without a lock: after an interrupt the other threads may be suspended."""
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
        group = ""
        while (task := self.take(number, group)) is not None:
            group = task.group
            for tries in range(1, MAX_TRIES + 1):
                outcome = self.outcome_of(number, task).tried(tries)
                if self.closed or not outcome.ended or outcome.is_late:
                    break
            with self.change:
                del self.running[number]
                self.change.notify_all()
            self.ended.put((task, outcome))
        if number in self.children:
            self.children.pop(number).close()

    def take(self, number: int, group: str) -> Task | None:
        """Wait for the next task; None: the pool is closed."""
        with self.change:
            while not self.closed:
                task = self.choice(group)
                if task is not None:
                    self.running[number] = task
                    return task
                self.change.wait()
        return None

    def choice(self, group: str) -> Task | None:
        """Remove a task from the queue if one may begin now."""
        running = self.running.values()
        if not self.waiting or any(task.timed for task in running):
            return None
        others = {task.group for task in running}
        costs = [(task.rank, task.group != group, task.group in others, -task.weight) for task in self.waiting]
        first = costs.index(min(costs))
        if self.waiting[first].timed and running:
            return None
        return self.waiting.pop(first)

    def outcome_of(self, number: int, task: Task) -> Outcome:
        try:
            call = task.call
        except Exception as error:  # it cannot be pickled
            return Outcome(error=described(error))
        try:
            child = self.child(number)
        except OSError as error:
            return Outcome(error=f"cannot start a process: {error.strerror}")
        if child is None:
            return Outcome(ended="the pool is closed")
        outcome = child.call(call, task.shared, self.limit)
        if child.is_spent(outcome):
            del self.children[number]
            child.close()
        return outcome

    def child(self, number: int) -> Child | None:
        """The process of a worker, a new one if it has none; None: the pool is closed."""
        with interrupt.turn:  # an interrupt waits, then kills this process too
            if self.closed:
                return None
            if number in self.children and not self.children[number].alive:  # killed between two tasks
                self.children.pop(number).close()
            if number not in self.children:
                self.children[number] = Child(self.scratch, self.memory)
            return self.children[number]
