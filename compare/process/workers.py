"""Processes that make calls: those of a run, of an engine, of a fleet; and the clock of a run."""

import importlib
import logging
import os
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import active_children, parent_process
from multiprocessing import context as contexts
from multiprocessing.process import BaseProcess
from typing import Any, Generic, ParamSpec, TypeVar

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
KILLED, UNEXPECTED = -9, 256  # exit codes: after SIGKILL; of a lasting process that ends with the status 0
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


class WorkerEnded(RuntimeError):
    """The process of a call ended before its answer."""

    def __init__(self, how: str):
        super().__init__("a worker process was killed; an earlier report is unchanged")
        self.how = how  # killed by SIGKILL


@dataclass(frozen=True)
class Beginning:
    """What a process does before its first call. It ends with its parent, and then deletes the folder."""

    environment: tuple[tuple[str, str], ...] = ()
    is_silent: bool = False  # what it prints is lost, that of its libraries of C too
    memory: int | None = None  # limit, bytes
    folder: str | None = None

    def begin(self) -> None:
        logging.getLogger("tmt").setLevel(logging.ERROR)  # the main process has the same warnings
        threading.Thread(target=self.end_with_parent, daemon=True).start()
        os.environ.update(self.environment)
        for stream in (1, 2) if self.is_silent else ():
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
        if resource and self.memory:
            with suppress(OSError, ValueError):
                resource.setrlimit(resource.RLIMIT_DATA, (self.memory, self.memory))

    def end_with_parent(self) -> None:
        parent = parent_process()
        if parent is not None:
            parent.join()
        if self.folder:
            shutil.rmtree(self.folder, ignore_errors=True)
        os._exit(1)


class Whole(BaseProcess):
    """A process whose start is not interrupted, and whose end is noticed after what it has sent.

    One that is half started complains when its parent ends. Pebble loses a call if it sees that end first.
    """

    is_noticed = False

    def start(self) -> None:
        with interrupt.postponed:
            super().start()

    def terminate(self) -> None:
        self.is_noticed = True
        super().terminate()

    def is_alive(self) -> bool:
        """Whether it runs; True once more after it has failed, until Pebble asks again."""
        was_noticed, is_alive = self.is_noticed, super().is_alive()
        self.is_noticed = was_noticed or not is_alive
        return is_alive or not (was_noticed or self.exitcode == 0)


class Lasting(Whole, contexts.SpawnProcess):
    """A process that makes calls as long as it is asked."""

    @property
    def exitcode(self) -> int | None:
        """None, or how it ended, which is never as it should: Pebble does not notice the status 0."""
        code = super().exitcode
        return UNEXPECTED if code == 0 else code


if sys.platform != "win32":

    class Forked(Whole, contexts.ForkServerProcess):
        """A process that makes one call, forked from one that has loaded what the call needs."""


@dataclass
class Call(Generic[T]):
    """A call of workers. Its future has the answer, however often it is tried."""

    function: Callable[[], T]
    task: str  # of the clock
    future: "Future[T]" = field(default_factory=Future)
    tries: int = 0


@dataclass(eq=False)
class Workers:
    """Processes that make calls at the same time; one that ends, or takes too long, is replaced."""

    count: int
    beginning: Beginning
    limit: float | None = None  # s for a call
    retries: int = 0  # of a call whose process is killed by SIGKILL (no memory, an operator)
    is_fresh: bool = False  # each call has a process of its own
    clock: Clock = field(default_factory=Clock)  # of the calls
    pending: set["Future[Any]"] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.pool = self.new_pool()
        interrupt.undo.append(kill_children)

    def new_pool(self) -> ProcessPool:
        """A pool whose processes start with its first call."""
        kind: type[BaseProcess] = contexts.SpawnProcess if self.is_fresh else Lasting
        if self.is_fresh and hasattr(os, "fork") and len(os.fsencode(tempfile.gettempdir())) <= LONGEST_PATH:
            kind = Forked
        context = contexts.SpawnContext()
        context.Process = kind  # type: ignore[assignment,misc]  # a class of processes, which Pebble starts
        return ProcessPool(self.count, int(self.is_fresh), self.beginning.begin, context=context)

    def submit(self, function: Callable[P, T], /, *arguments: P.args, **named: P.kwargs) -> "Future[T]":
        """The future of a call; it raises what the function raises, TimeoutError or WorkerEnded."""
        call = Call(partial(function, *arguments, **named), self.clock.task)
        self.pending.add(call.future)
        self.start(call)
        return call.future

    def map(self, function: Callable[..., T], *arguments: Iterable[Any]) -> Iterator[T]:
        """The values of a function in their order; all calls are submitted at once."""
        futures = [self.submit(function, *values) for values in zip(*arguments)]
        return (future.result() for future in futures)

    def quiet(self) -> None:
        """Wait until all calls are done, before times are measured."""
        wait(self.pending.copy())

    def start(self, call: Call[T]) -> None:
        if not self.pool.active:  # its processes have ended while they were idle
            self.pool = self.new_pool()
        call.tries += 1
        scheduled = self.pool.schedule(timed, (call.function,), timeout=self.limit)
        scheduled.add_done_callback(partial(self.finish, call))

    def finish(self, call: Call[T], scheduled: "Future[Answer]") -> None:
        """Hand on the answer to a call, or make the call again; in a thread of the pool."""
        value, error = None, None
        try:
            value, error, seconds = scheduled.result()
            self.clock.taken.append((call.task, seconds))
        except ProcessExpired as expired:
            is_killed = expired.exitcode == KILLED
            if is_killed and call.tries <= self.retries:
                self.start(call)
                return
            times = f", {call.tries} times" if is_killed and self.retries else ""
            error = WorkerEnded(how_ended(expired.exitcode) + times)
        except BrokenProcessPool:
            error = WorkerEnded("its process ended")
        except Exception as reason:  # TimeoutError; arguments or a value that cannot be sent
            error = reason
        self.pending.discard(call.future)
        if error is None:
            call.future.set_result(value)  # type: ignore[arg-type]  # without an error it is a T
        else:
            call.future.set_exception(error)

    def close(self, at_once: bool = False) -> None:
        """End the processes; at once: in the middle of their calls, and those of other workers too."""
        self.retries = 0
        self.pool.stop()
        if at_once:
            kill_children()
        self.pool.join()
        interrupt.undo.remove(kill_children)


def kill_children() -> None:
    for process in active_children():
        process.kill()


@contextmanager
def start_workers() -> Iterator[Workers]:
    """The two workers of a run, for figures and scenes."""
    workers = Workers(2, Beginning())
    try:
        yield workers
    finally:
        workers.close(at_once=True)


def load_modules(*modules: str) -> None:
    for name in modules:
        importlib.import_module(name)


def timed(function: Callable[[], Any]) -> Answer:
    value, raised, began = None, None, time.process_time()
    try:
        value = function()
    except BaseException as error:
        error.place = place(error)  # type: ignore[attr-defined]  # it is sent without its traceback
        raised = error
    return value, raised, time.process_time() - began
