"""Two worker processes of a run, for figures and scenes."""

import importlib
import logging
import os
import shutil
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process

from . import interrupt
from .clock import Clock
from .crash import place


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
            value, error, seconds = self.processes.submit(timed, *call).result()
        except (BrokenProcessPool, RuntimeError):  # RuntimeError: shut down
            raise WorkerEnded("a worker process was killed; the earlier report is unchanged") from None
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


# in a worker


def begin() -> None:
    logging.getLogger("tmt").setLevel(logging.ERROR)  # the main process has the same warnings
    end_with_parent()


def end_with_parent(folder: str | None = None) -> None:
    """From now on this process ends when its parent does, and deletes a folder."""

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
