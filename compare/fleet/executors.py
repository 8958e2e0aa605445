"""Who runs the calls of a fleet: threads of this machine, or the workers of a Dask cluster.

Each call runs in a process of its own: if that crashes, hangs, exits or needs too much memory, this is the outcome of the call.
"""

import logging
import multiprocessing
import os
import shutil
import tempfile
import time
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cache, partial
from pathlib import Path

from pebble import ProcessExpired, ProcessPool

from ..core.errors import Refused, described, how_ended
from ..process import interrupt
from ..process.workers import end_with_parent
from .cache import RESUME, program

try:
    import resource
except ImportError:  # Windows: no memory limit
    resource = None

KILLED, RETRIES = (
    -9,
    3,
)  # exit code after SIGKILL, and how often the call is made again, as a Dask scheduler does
LONGEST_PATH = 70  # bytes, of the folder of the forkserver's socket, whose whole path may have 107
SHARE = 0.9  # of the machine's memory, for all its processes together
CONNECTING = 10.0  # s, time limit for the scheduler and its first worker to answer
ALONE = 60.0  # s without a worker or a connection after which a fleet ends
LOGGERS = (
    "distributed",
    "distributed.client",
    "distributed.core",
    "tornado",
    "tornado.application",
    "asyncio",
)


class OtherVersion(RuntimeError):
    """A worker runs a different version of compare or MuJoCo."""


@cache
def own_folder() -> str:
    """A folder for the temporary files of this process and those that it starts; deleted when the command ends."""
    tempfile.tempdir = tempfile.mkdtemp(prefix="fleet-")  # of the forkserver's socket too
    interrupt.undo.append(partial(shutil.rmtree, tempfile.tempdir, ignore_errors=True))
    return tempfile.tempdir


def guarded(
    function: Callable, arguments: tuple, limit: float, memory: int, place: str
) -> tuple[object, str]:
    """The value of a call and "", or None and why there is none.

    A process that is killed by SIGKILL (no memory, an operator) may have done nothing wrong: its call is made again.
    limit: s; memory: bytes; place: folder for temporary files, deleted if this process is killed.
    """
    multiprocessing.current_process().daemon = False  # else a worker of Dask may not start a process
    os.environ |= {"MUJOCO_GL": "disabled", "OPENBLAS_NUM_THREADS": "1"}
    is_forked = hasattr(os, "fork") and len(os.fsencode(tempfile.gettempdir())) <= LONGEST_PATH
    context = multiprocessing.get_context("forkserver" if is_forked else "spawn")
    if is_forked:
        context.set_forkserver_preload([__name__, function.__module__])
    for _ in range(1 + RETRIES):
        with tempfile.TemporaryDirectory(dir=place, ignore_cleanup_errors=True) as folder:
            pool = ProcessPool(1, context=context)
            try:
                with interrupt.postponed:  # a process that is just being started would complain
                    future = pool.schedule(alone, (function, arguments, folder, memory, place), timeout=limit)
                return future.result()
            except TimeoutError:
                return None, f"time limit of {limit:g} s exceeded"
            except ProcessExpired as error:
                if error.exitcode != KILLED:
                    return None, how_ended(error.exitcode)
            except Exception as error:  # the value cannot be sent
                return None, described(error)
            finally:
                pool.stop()
                pool.join()
    return None, f"killed by SIGKILL, {1 + RETRIES} times"


def alone(function: Callable, arguments: tuple, folder: str, memory: int, place: str) -> tuple[object, str]:
    """Make a call in this process, in a folder of its own."""
    end_with_parent(place)
    os.chdir(folder)
    for number in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), number)
    if resource:
        with suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    try:
        return function(*arguments), ""
    except MemoryError:
        return None, f"out of memory: limit {memory / 1e9:.2g} GB"
    except BaseException as error:  # SystemExit too
        return None, described(error)


def memory_of_machine() -> int:
    """Memory of the machine or its container, bytes."""
    sizes = [2**33]  # if the system does not say it
    with suppress(OSError, ValueError, AttributeError):
        sizes = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
        sizes.append(int(Path("/sys/fs/cgroup/memory.max").read_text(encoding="ascii")))
    return min(sizes)


class Pool:
    """This machine. limit: s for each call."""

    def __init__(self, workers: int, limit: float):
        self.workers, self.limit = workers, limit
        self.memory = int(SHARE * memory_of_machine() / workers)
        self.threads = ThreadPoolExecutor(workers)

    def submit(self, function: Callable, *arguments: object):
        return self.threads.submit(guarded, function, arguments, self.limit, self.memory, own_folder())

    def outcome(self, future) -> tuple[object, str]:
        """The value of a call that is done and "", or None and why there is none."""
        return future.result()

    def check(self) -> None:
        """Refused if there is nobody left to answer."""

    def close(self) -> None:
        self.threads.shutdown(wait=False, cancel_futures=True)


class Cluster:
    """The workers of a Dask scheduler; the methods are those of Pool. Refused: no scheduler, or no worker.

    resource: of the workers, 1 of which a call needs; None: a thread.
    """

    def __init__(self, address: str, limit: float, resource: str | None = None):
        try:
            import distributed
        except ImportError:
            raise Refused("a cluster needs the extra `fleet`: python -m pip install -e '.[fleet]'") from None
        for name in LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # errors are reported here, in one line
        warnings.filterwarnings("ignore", module="distributed")
        self.address, self.limit, self.resource, self.answered = address, limit, resource, time.monotonic()
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
            offers = f" with --resources {resource}=1" if resource else ""
            raise Refused(f"the scheduler {address} has no worker{offers}")

    def threads_now(self) -> int:
        """Number of calls that the workers run at the same time; 0 without a connection."""
        with suppress(Exception):
            if self.client.status == "running":
                workers = self.client.scheduler_info()["workers"].values()
                if self.resource:
                    return int(sum(worker["resources"].get(self.resource, 0) for worker in workers))
                return sum(worker["nthreads"] for worker in workers)
        return 0

    def submit(self, function: Callable, *arguments: object):
        resources = {self.resource: 1} if self.resource else None
        given = function, arguments, self.limit, program()
        return self.client.submit(on_worker, *given, pure=False, resources=resources)

    def outcome(self, future) -> tuple[object, str]:
        if future.status == "finished":
            with suppress(Exception):  # if its worker is lost now, the call is made again
                return future.result(timeout=self.limit)
        if future.status != "error":
            raise Refused(f"lost the connection to the scheduler {self.address}; {RESUME}")
        error = future.exception(timeout=CONNECTING)
        if type(error).__name__ == "KilledWorker":
            return (
                None,
                f"{1 + error.allowed_failures} workers lost, the last one {error.last_worker.address}",
            )
        if isinstance(error, OtherVersion | ImportError | AttributeError):
            raise Refused(f"a worker runs a different version of compare or MuJoCo: {error}; {RESUME}")
        return None, described(error)

    def check(self) -> None:
        if self.threads_now():
            self.answered = time.monotonic()
        elif time.monotonic() - self.answered > ALONE:
            raise Refused(f"no worker of the scheduler {self.address} for {ALONE:g} s; {RESUME}")

    def close(self) -> None:
        with suppress(Exception):
            self.client.close(timeout=1)


def on_worker(function: Callable, arguments: tuple, limit: float, expected: str) -> tuple[object, str]:
    from distributed import get_worker

    worker = get_worker()
    if program() != expected:
        raise OtherVersion(f"worker {worker.address}; all workers need the version of this machine")
    memory = worker.memory_manager.memory_limit or memory_of_machine()
    return guarded(
        function, arguments, limit, int(SHARE * memory / worker.state.nthreads), worker.local_directory
    )
