"""Two worker processes of a run, for figures and scenes, and the clock of its tasks."""

import importlib
import logging
import os
import shutil
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process

from ..core.errors import place
from . import interrupt


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


class WorkerEnded(RuntimeError):
    """A worker process was killed."""


class Workers(ThreadPoolExecutor):
    """At most two processes, started when the other is busy. Its clock records their processor times."""

    def __init__(self):
        super().__init__(2)
        self.clock, self.futures = Clock(), []
        self.processes = ProcessPoolExecutor(2, get_context("spawn"), initializer=begin)

    def submit(self, function, /, *arguments, **named):
        self.futures.append(super().submit(self.ask, self.clock.task, function, arguments, named))
        return self.futures[-1]

    def ask(self, task, *call):
        """The result or exception of a call in one of the processes."""
        try:
            with interrupt.postponed:  # a process that is half started would complain
                future = self.processes.submit(timed, *call)
            value, error, seconds = future.result()
        except RuntimeError:  # a broken pool, or shut down
            raise WorkerEnded("a worker process was killed; an earlier report is unchanged") from None
        self.clock.taken.append((task, seconds))
        if error:
            raise error
        return value

    def quiet(self):
        """Wait until all calls are done, before times are measured."""
        wait(self.futures)


def kill_children() -> None:
    for process in active_children():
        process.kill()


@contextmanager
def start_workers() -> Iterator[Workers]:
    workers = Workers()
    interrupt.undo.append(kill_children)
    try:
        yield workers
    finally:
        kill_children()
        workers.processes.shutdown(cancel_futures=True)
        workers.shutdown(cancel_futures=True)
        interrupt.undo.remove(kill_children)


def begin() -> None:  # in a worker
    logging.getLogger("tmt").setLevel(logging.ERROR)  # the main process has the same warnings
    end_with_parent()


def end_with_parent(folder: str | None = None) -> None:
    """From now on this process ends when its parent does, and deletes a folder."""
    if not interrupt.CAN_BLOCK:  # else the parent has blocked it here too
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch():
        parent_process().join()
        if folder:
            shutil.rmtree(folder, ignore_errors=True)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def load_modules(*modules: str) -> None:
    for name in modules:
        importlib.import_module(name)


def timed(function, arguments: tuple, named: dict) -> tuple:
    """The value of a call, the exception, and the processor time in s."""
    began, value, raised = time.process_time(), None, None
    try:
        value = function(*arguments, **named)
    except Exception as error:
        error.place, raised = place(error), error  # it is sent without its traceback
    return value, raised, time.process_time() - began
