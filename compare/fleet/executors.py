"""Who makes the calls of a fleet: processes of this machine, or the workers of a Dask cluster.

Each call has a process of its own: that it crashes, hangs, exits or needs too much memory is its outcome.
"""

import logging
import multiprocessing
import os
import shutil
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar, cast

from ..core.errors import Refused, described
from ..process import interrupt
from ..process.workers import WorkerEnded, Workers, kill_children
from .cache import RESUME, program

T = TypeVar("T")
Arguments = tuple[Any, ...]
ENVIRONMENT = {"MUJOCO_GL": "disabled", "OPENBLAS_NUM_THREADS": "1"}
RETRIES = 3  # of a call whose process is killed by SIGKILL, as a Dask scheduler does
SHARE = 0.9  # of the machine's memory, for all its processes together
CONNECTING = 10.0  # s, time limit for the scheduler and its first worker to answer
ALONE = 60.0  # s without a worker or a connection after which a fleet ends
LOGGERS = "distributed", "distributed.client", "distributed.core", "tornado", "tornado.application", "asyncio"


class OtherVersion(RuntimeError):
    """A worker runs a different version of compare or MuJoCo."""


class Outcome(NamedTuple, Generic[T]):
    """The value of a call and "", or None and why there is none."""

    value: T | None
    why: str


@cache
def own_folder() -> str:
    """A folder for temporary files of this process and its children, deleted when the command ends."""
    tempfile.tempdir = tempfile.mkdtemp(prefix="fleet-")  # of the forkserver's socket too
    interrupt.at_end.callback(shutil.rmtree, tempfile.tempdir, ignore_errors=True)
    return tempfile.tempdir


def memory_of_machine() -> int:
    """Memory of the machine or its container, bytes."""
    sizes = [2**33]  # if the system does not say it
    with suppress(OSError, ValueError, AttributeError):
        sizes = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
        sizes.append(int(Path("/sys/fs/cgroup/memory.max").read_text(encoding="ascii")))
    return min(sizes)


class Pool:
    """Processes of this machine.

    limit: s for a call; memory: bytes, by default its share; folder: for temporary files; loaded: modules
    that each process has from its beginning.
    """

    def __init__(
        self, workers: int, limit: float, memory: float | None = None, folder: str | None = None,
        loaded: Sequence[str] = (),
    ):  # fmt: skip
        self.workers, self.limit, self.folder, self.loaded = workers, limit, folder or own_folder(), loaded
        self.memory = int(SHARE * (memory or memory_of_machine() / workers))
        os.environ |= ENVIRONMENT
        of_process = {"is_silent": True, "memory": self.memory, "folder": self.folder}
        self.processes = Workers(workers, limit, RETRIES, is_fresh=True, **of_process)

    def submit(self, function: Callable[..., T], *arguments: Any) -> "Future[Outcome[T]]":
        if hasattr(os, "fork"):
            multiprocessing.set_forkserver_preload([__name__, function.__module__, *self.loaded])
        return self.processes.submit(alone, function, arguments, self.folder, self.memory)

    def outcome(self, future: "Future[Outcome[T]]") -> Outcome[T]:
        """That of a call that is done."""
        try:
            return future.result()
        except TimeoutError:
            return Outcome(None, f"time limit of {self.limit:g} s exceeded")
        except WorkerEnded as error:
            return Outcome(None, error.how)
        except Exception as error:  # the value cannot be sent
            return Outcome(None, described(error))

    def check(self) -> None:
        """Refused if there is nobody left to answer."""

    def close(self) -> None:
        self.processes.close()


def alone(function: Callable[..., T], arguments: Arguments, folder: str, memory: int) -> Outcome[T]:
    """Make a call in this process, in a folder of its own. What it has started ends with it."""
    with tempfile.TemporaryDirectory(dir=folder, ignore_cleanup_errors=True) as place:
        os.chdir(place)
        try:
            return Outcome(function(*arguments), "")
        except MemoryError:
            return Outcome(None, f"out of memory: limit {memory / 1e9:.2g} GB")
        except BaseException as error:  # SystemExit too
            return Outcome(None, described(error))
        finally:
            os.chdir(folder)
            kill_children()


class Cluster:
    """The workers of a Dask scheduler, on the same files. Refused: no scheduler, or no worker."""

    def __init__(self, address: str, limit: float):
        try:
            import distributed
        except ImportError:
            raise Refused("a cluster needs the extra `fleet`: python -m pip install -e '.[fleet]'") from None
        for name in LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # errors are reported here, in one line
        warnings.filterwarnings("ignore", module="distributed")
        self.address, self.limit, self.answered = address, limit, time.monotonic()
        try:
            self.client = distributed.Client(address, timeout=CONNECTING, set_as_default=False, name="fleet")
        except Exception as error:
            why = " ".join(str(error).split()) or type(error).__name__
            raise Refused(f"no answer from the scheduler {address}: {why}") from None
        with suppress(TimeoutError):
            self.client.wait_for_workers(1, timeout=CONNECTING)
        self.workers = self.threads_now()
        if not self.workers:
            self.close()
            raise Refused(f"the scheduler {address} has no worker")

    def threads_now(self) -> int:
        """Number of calls that the workers run at the same time; 0 without a connection."""
        with suppress(Exception):
            if self.client.status == "running":
                workers = self.client.scheduler_info()["workers"].values()
                return sum(worker["nthreads"] for worker in workers)
        return 0

    def submit(self, function: Callable[..., T], *arguments: Any) -> "Future[Outcome[T]]":
        call = on_worker, function, arguments, self.limit, program()
        return cast("Future[Outcome[T]]", self.client.submit(*call, pure=False))

    def outcome(self, future: Any) -> Outcome[Any]:
        if future.status == "finished":
            with suppress(Exception):  # if its worker is lost now, the call is made again
                return Outcome(*future.result(timeout=self.limit))
        if future.status != "error":
            raise Refused(f"lost the connection to the scheduler {self.address}; {RESUME}")
        error = future.exception(timeout=CONNECTING)
        if type(error).__name__ == "KilledWorker":
            lost = f"{1 + error.allowed_failures} workers lost"
            return Outcome(None, f"{lost}, the last one {error.last_worker.address}")
        if isinstance(error, OtherVersion | ImportError | AttributeError):
            raise Refused(f"a worker runs a different version of compare or MuJoCo: {error}; {RESUME}")
        return Outcome(None, described(error))

    def check(self) -> None:
        if self.threads_now():
            self.answered = time.monotonic()
        elif time.monotonic() - self.answered > ALONE:
            raise Refused(f"no worker of the scheduler {self.address} for {ALONE:g} s; {RESUME}")

    def close(self) -> None:
        with suppress(Exception):
            self.client.close(timeout=1)


# who makes `workers` calls at the same time; Refused where there is nobody who could
Executor = Pool | Cluster


def on_worker(function: Callable[..., T], arguments: Arguments, limit: float, version: str) -> Outcome[T]:
    from distributed import get_worker

    worker = get_worker()
    if program() != version:
        raise OtherVersion(f"worker {worker.address}; all workers need the version of this machine")
    multiprocessing.current_process().daemon = False  # else a worker of Dask may not start a process
    memory = (worker.memory_manager.memory_limit or memory_of_machine()) / worker.state.nthreads
    with tempfile.TemporaryDirectory(dir=worker.local_directory, ignore_cleanup_errors=True) as folder:
        pool = Pool(1, limit, memory, folder)
        try:
            return pool.outcome(pool.submit(function, *arguments))
        finally:
            pool.processes.close(at_once=False)
