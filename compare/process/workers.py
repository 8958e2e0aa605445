"""Two further processes: they draw the figures of an experiment while the next one computes, and follow scenes."""

import importlib
import logging
import os
import pickle
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_context, parent_process, resource_tracker
from queue import SimpleQueue

from . import interrupt
from .clock import Clock
from .crash import described, place


class WorkerEnded(RuntimeError):
    """One of the processes is no longer there."""


class Workers(ThreadPoolExecutor):
    """At most so many processes, each started when the others are busy, and a thread for each that hands it its calls.

    Without multiprocessing's locks, which an early end would leave behind in the system. Its clock knows for which task a call
    was made, and what it took.
    """

    def __init__(self, count):
        super().__init__(count)
        self.clock = Clock()
        self.count, self.futures, self.processes, self.idle = count, [], [], SimpleQueue()
        interrupt.undo.append(self.kill)

    def start(self) -> None:
        """One more process."""
        context = get_context("spawn")
        with interrupt.postponed(), deaf():
            here, there = context.Pipe()
            self.processes.append(context.Process(target=serve, args=(there,), daemon=True))
            self.processes[-1].start()
            there.close()
            self.idle.put(here)

    def submit(self, function, /, *arguments, **named):
        under_way = sum(not future.done() for future in self.futures)
        if len(self.processes) < min(self.count, under_way + 1):
            self.start()
        self.futures.append(super().submit(self.ask, self.clock.task, function, arguments, named))
        return self.futures[-1]

    def ask(self, task, *call):
        """What a call for a task returns or raises in one of the processes."""
        connection = self.idle.get()
        try:
            connection.send(call)
            returned, value, seconds = connection.recv()
        except (EOFError, OSError):
            text = "a process that computes beside was ended from outside; a report that was there is unchanged"
            raise WorkerEnded(text) from None
        finally:
            self.idle.put(connection)
        self.clock.add(task, seconds)
        if returned:
            return value
        raise value

    def quiet(self):
        """Wait until all that was submitted is done: a timing needs the machine for itself."""
        wait(self.futures)

    def kill(self):
        for process in self.processes:
            process.kill()


@contextmanager
def start_workers() -> Iterator[Workers]:
    """Yields a pool of two processes."""
    pool = Workers(2)
    try:
        yield pool
    finally:
        pool.kill()
        pool.shutdown(cancel_futures=True)
        for process in pool.processes:
            process.join()
        interrupt.undo.remove(pool.kill)


@contextmanager
def deaf() -> Iterator[None]:
    """Processes that are started in this block hear no Ctrl-C: that is the business of the one that started them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, interrupt.NUMBERS)
    try:
        resource_tracker.ensure_running()  # a process too, whose start ends the blocking
        signal.pthread_sigmask(signal.SIG_BLOCK, interrupt.NUMBERS)
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# in a worker


def load_modules(*modules: str) -> None:
    """Load modules before they are needed."""
    for name in modules:
        importlib.import_module(name)


def serve(connection) -> None:
    """Answer one call after the other: whether it returned, its value or what it raised, seconds of the processor."""
    logging.getLogger("tmt").setLevel(logging.ERROR)  # what the main process says too
    threading.Thread(target=end_with_parent, daemon=True).start()
    while True:
        began = time.process_time()
        try:
            function, arguments, named = connection.recv()
            began = time.process_time()
            answer = True, function(*arguments, **named)
        except EOFError:
            return
        except Exception as error:
            answer = False, portable(error)
        taken = time.process_time() - began
        try:
            connection.send((*answer, taken))
        except BrokenPipeError:
            return
        except Exception as error:  # a value that cannot be sent
            connection.send((False, portable(error), taken))


def end_with_parent() -> None:
    """End with the main process, however that ends."""
    parent_process().join()
    os._exit(1)


def portable(error: Exception) -> Exception:
    """An exception that can be sent, and knows where it was raised."""
    error.place = place(error)
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        text, where = described(error, with_place=False), error.place
        error = RuntimeError(text)
        error.place = where
    return error
