"""Processes that make calls: those of a run, of an engine, of a fleet; and the clock of a run."""

import ctypes
import logging
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing import active_children, get_context
from typing import Any, ParamSpec, TypeVar

from pebble import ProcessExpired, ProcessPool

from ..core.errors import how_ended, place
from . import interrupt

try:
    import resource
except ImportError:  # Windows: no memory limit
    resource = None  # type: ignore[assignment]  # a module, or none

P = ParamSpec("P")
T = TypeVar("T")
Answer = tuple[Any, BaseException | None, float]  # what a call has returned or raised, its processor time, s
KILLED, LEFT = -9, 120  # exit codes: after SIGKILL; of a process that ends in a call with the status 0
LONGEST_PATH = 70  # bytes, of the folder of the forkserver's socket, whose whole path may have 107


class Clock:
    """The processor time of each task, in this process and in workers, and when each ended."""

    def __init__(self) -> None:
        self.started = time.perf_counter()
        self.task = ""  # to which processor time is assigned
        self.under_way = ""
        self.ended: dict[str, float] = {}  # s from the start, of each task that has ended
        self.taken: list[tuple[str, float]] = []  # task, processor time; threads append to it

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


class Current:
    clock = Clock()  # of the run that this process makes, and of all of its workers


class WorkerEnded(RuntimeError):
    """The process of a call ended before its answer. how: killed by SIGKILL."""

    def __init__(self, how: str):
        super().__init__("a worker process was killed")
        self.how = how


def begin(
    environment: tuple[tuple[str, str], ...] = (), is_silent: bool = False, memory: int | None = None,
    folder: str | None = None,
) -> None:  # fmt: skip
    """What a process does before its first call. It ends with its parent, and then deletes the folder.

    is_silent: what it prints is lost, that of its libraries of C too. memory: limit, bytes.
    """
    logging.getLogger("tmt").setLevel(logging.ERROR)  # the main process has the same warnings
    interrupt.end_with_parent(partial(shutil.rmtree, folder, ignore_errors=True) if folder else None)
    os.environ.update(environment)
    for stream in (1, 2) if is_silent else ():
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    if resource and memory:
        with suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))


class Workers:
    """Processes that make calls at the same time; one that ends, or takes too long, is replaced.

    limit: s for a call. retries: of a call whose process is killed by SIGKILL (no memory, an operator).
    is_fresh: each call has a process of its own. beginning: see `begin`.
    """

    def __init__(
        self, count: int, limit: float | None = None, retries: int = 0, is_fresh: bool = False,
        **beginning: Any,
    ):  # fmt: skip
        self.limit, self.retries = limit, retries
        is_forked = hasattr(os, "fork") and len(os.fsencode(tempfile.gettempdir())) <= LONGEST_PATH
        context = get_context("forkserver" if is_fresh and is_forked else "spawn")
        first = partial(begin, **beginning)
        # its processes start with its first call
        self.new_pool = partial(ProcessPool, count, int(is_fresh), first, context=context)
        self.pool: ProcessPool = self.new_pool()
        self.pending: set[Future[Any]] = set()
        interrupt.at_end.callback(self.close)

    @property
    def clock(self) -> Clock:
        return Current.clock

    def submit(self, function: Callable[P, T], /, *arguments: P.args, **named: P.kwargs) -> "Future[T]":
        """The future of a call; it raises what the function raises, TimeoutError or WorkerEnded."""
        answer: Future[T] = Future()
        self.pending.add(answer)
        self.start(partial(function, *arguments, **named), Current.clock.task, answer)
        return answer

    def map(self, function: Callable[..., T], *arguments: Iterable[Any]) -> Iterator[T]:
        """The values of a function in their order; all calls are submitted at once."""
        futures = [self.submit(function, *values) for values in zip(*arguments)]
        return (future.result() for future in futures)

    def quiet(self) -> None:
        """Wait until all calls are done, before times are measured."""
        wait(self.pending.copy())

    def start(self, call: Callable[[], T], task: str, answer: "Future[T]", tries: int = 1) -> None:
        if not self.pool.active:  # its processes have ended while they were idle
            self.pool = self.new_pool()

        def finish(scheduled: "Future[Answer]") -> None:
            """Hand on the answer, or make the call again; in a thread of the pool."""
            value, error = None, scheduled.exception()  # TimeoutError; what cannot be sent
            if error is None:
                value, error, seconds = scheduled.result()
                Current.clock.taken.append((task, seconds))
            elif isinstance(error, ProcessExpired):
                is_killed = error.exitcode == KILLED
                if is_killed and tries <= self.retries:
                    self.start(call, task, answer, tries + 1)
                    return
                times = f", {tries} times" if is_killed and self.retries else ""
                error = WorkerEnded(how_ended(error.exitcode) + times)
            elif isinstance(error, BrokenProcessPool):
                error = WorkerEnded("its process ended")
            self.pending.discard(answer)
            if error is None:
                answer.set_result(value)  # type: ignore[arg-type]  # without an error it is a T
            else:
                answer.set_exception(error)

        self.pool.schedule(timed, (call,), timeout=self.limit).add_done_callback(finish)

    def close(self, at_once: bool = True) -> None:
        """End the processes; at once: in the middle of their calls, and those of other workers too."""
        self.retries = 0
        self.pool.stop()
        if at_once:
            kill_children()
        self.pool.join()


def kill_children() -> None:
    for process in active_children():
        process.kill()


@contextmanager
def start_workers() -> Iterator[Workers]:
    """The two workers of a run, for figures and scenes; its clock begins."""
    Current.clock, workers = Clock(), Workers(2)
    try:
        yield workers
    finally:
        workers.close()


def timed(function: Callable[[], Any]) -> Answer:
    """The answer to a call. Pebble does not notice a process that ends in it with status 0."""
    value, raised, began, leave = None, None, time.process_time(), os._exit
    os._exit = lambda status: leave(status or LEFT)
    try:
        value = function()
    except BaseException as error:
        error.place = place(error)  # type: ignore[attr-defined]  # it is sent without its traceback
        raised = error
    os._exit = leave
    give_back_memory()
    return value, raised, time.process_time() - began


def give_back_memory() -> None:
    """Give free memory back to the system where the C library can: it keeps that of meshes and of compilers."""
    with suppress(AttributeError, OSError, TypeError):  # musl, macOS, Windows
        ctypes.CDLL(None).malloc_trim(0)
