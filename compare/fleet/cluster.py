"""A Dask cluster: its workers run the tasks, each in a process that may crash (see process.child)."""

import hashlib
import logging
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import NamedTuple

from ..process import interrupt
from ..process.child import SHARE, Child, Outcome, memory_of_machine
from ..process.crash import described
from .cache import RESUME, program
from .tasks import MAX_TRIES, POLLING, FleetError, Task

CONNECTING = 10.0  # s, time limit for the scheduler and its first worker to answer
REFRESH = 1.0  # s between two requests for the list of workers
TIMING = "timing"  # resource of a worker with one thread that runs timed tasks
LOGGERS = ("distributed", "distributed.client", "distributed.core", "tornado", "tornado.application", "asyncio")
EXTRA = "a cluster needs the extra `fleet`: python -m pip install -e '.[fleet]'"
OTHER_VERSION = (
    "worker {} runs a different version of compare or MuJoCo; all workers need the same version as this machine"
)
DISCONNECTED = "lost the connection to the scheduler {}; {}"

idle, lock = [], threading.Lock()  # of a worker: processes without a task


class Submitted(NamedTuple):
    """A task at the scheduler."""

    task: Task
    tries: int  # this one included
    future: object
    shared: object  # future of the shared argument, kept as long as the task needs it


class Cluster:
    """The workers of a scheduler; see tasks.Executor. limit: s for each task.

    FleetError: there is no scheduler or no worker, or a worker runs another version; later, from any method: the scheduler is
    gone, or there has been no worker for longer than the limit.
    """

    times_alone = False

    def __init__(self, address: str, limit: float):
        try:
            import distributed
        except ImportError:
            raise FleetError(EXTRA) from None
        for name in LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # errors are reported here, in one line
        warnings.filterwarnings("ignore", module="distributed")
        self.address, self.limit, self.under_way = address, limit, 0
        self.running, self.ended, self.finished = {}, SimpleQueue(), []
        self.infos, self.refreshed_at = {}, -REFRESH
        self.none_since = {False: None, True: None}  # time at which no worker was left, by `timed`
        try:
            self.client = distributed.Client(address, timeout=CONNECTING, set_as_default=False, name="fleet")
        except Exception as error:
            why = " ".join(str(error).split()) or type(error).__name__
            raise FleetError(f"no answer from the scheduler {address}: {why}") from None
        interrupt.undo.append(self.close)
        try:
            self.check_workers()
        except BaseException:
            self.close()
            raise

    def check_workers(self) -> None:
        with suppress(TimeoutError):
            self.client.wait_for_workers(1, timeout=CONNECTING)
        if not self.worker_infos():
            raise FleetError(f"the scheduler {self.address} has no worker")
        for worker, version in self.client.run(program, on_error="return").items():
            if version != program() and not isinstance(version, OSError):  # OSError: the worker has gone meanwhile
                raise FleetError(OTHER_VERSION.format(worker))

    @contextmanager
    def connected(self) -> Iterator[None]:
        """FleetError if the scheduler does not answer in this block."""
        try:
            yield
        except Exception:
            raise FleetError(DISCONNECTED.format(self.address, RESUME)) from None

    def worker_infos(self) -> dict:
        """The workers by address, at most REFRESH s old."""
        if time.monotonic() - self.refreshed_at > REFRESH:
            with self.connected():
                self.infos = self.client.scheduler_info(n_workers=-1)["workers"]
            self.refreshed_at = time.monotonic()
        return self.infos

    def workers(self) -> int:
        return sum(worker["nthreads"] for worker in self.worker_infos().values())

    def timing_workers(self) -> list[dict]:
        return [worker for worker in self.worker_infos().values() if worker["resources"].get(TIMING, 0) >= 1]

    def no_timing(self) -> str | None:
        able = self.timing_workers()
        if not able:
            return f"no worker has the resource {TIMING} (dask worker ... --nthreads 1 --resources '{TIMING}=1')"
        threads = max(worker["nthreads"] for worker in able)
        if threads > 1:
            return f"a worker with the resource {TIMING} has {threads} threads; expected 1"
        return None

    def submit(self, task: Task) -> None:
        self.under_way += 1
        self.send(task, 1)

    def send(self, task: Task, tries: int) -> None:
        try:
            call = task.call
        except Exception as error:  # it cannot be pickled
            self.finished.append((task, Outcome(error=described(error))))
            return
        with self.connected():
            shared = task.shared
            if shared:  # a Dask task of its own, which is repeated if its worker is lost
                key = f"shared-{hashlib.sha256(shared).hexdigest()}"
                shared = self.client.submit(identity, shared, key=key, pure=True)
            future = self.client.submit(
                run_on_worker, call, shared, self.limit, program(), pure=False, retries=0,
                priority=0 if task.timed else -task.rank, resources={TIMING: 1} if task.timed else None,
            )  # fmt: skip
            self.running[future.key] = Submitted(task, tries, future, shared)
            future.add_done_callback(self.ended.put)

    def next(self) -> tuple[Task, Outcome] | None:
        if not self.finished:
            try:
                future = self.ended.get(timeout=POLLING)
            except Empty:
                self.check_connection()
            else:
                if future.key in self.running:
                    self.receive(self.running.pop(future.key))
        if not self.finished:
            return None
        self.under_way -= 1
        return self.finished.pop(0)

    def receive(self, submitted: Submitted) -> None:
        """A task has come back: it is finished, or runs again."""
        outcome = self.outcome_of(submitted.future)
        if outcome.ended and not outcome.is_late and submitted.tries < MAX_TRIES:
            self.send(submitted.task, submitted.tries + 1)
        else:
            self.finished.append((submitted.task, outcome.tried(submitted.tries)))

    def outcome_of(self, future) -> Outcome:
        """The outcome of a future that is done. Dask has repeated a task on three more workers if its worker was lost."""
        error = None
        if future.status not in ("finished", "error"):
            self.check_connection()
        with suppress(Exception):
            if future.status == "finished":
                worker, outcome = future.result(timeout=CONNECTING)
                if outcome is not None:
                    return outcome
                error = OTHER_VERSION.format(worker)
            elif future.status == "error":
                error = future.exception(timeout=CONNECTING)
        if isinstance(error, ImportError | AttributeError):
            error = f"a worker runs a different version of compare: {described(error)}"
        if isinstance(error, str):
            raise FleetError(f"{error}; {RESUME}")
        if type(error).__name__ == "KilledWorker":
            return Outcome(error=f"{MAX_TRIES} workers lost, the last one {error.last_worker.address}")
        return Outcome(error=described(error)) if error else Outcome(ended="result lost")

    def check_connection(self) -> None:
        """FleetError: the scheduler is gone, or there are no workers for longer than the limit. Timed tasks may fail alone."""
        if self.client.status != "running":
            raise FleetError(DISCONNECTED.format(self.address, RESUME))
        now = time.monotonic()
        for timed, able in ((False, self.workers()), (True, len(self.timing_workers()))):
            keys = [key for key, submitted in self.running.items() if submitted.task.timed == timed]
            if able or not keys:
                self.none_since[timed] = None
                continue
            self.none_since[timed] = self.none_since[timed] or now
            if now - self.none_since[timed] <= self.limit:
                continue
            if not timed:
                raise FleetError(f"the scheduler {self.address} has no worker any more; {RESUME}")
            self.finished += [(self.running.pop(key).task, Outcome(error=self.no_timing())) for key in keys]

    def close(self) -> None:
        with suppress(ValueError):  # closed before
            interrupt.undo.remove(self.close)
        with suppress(Exception):
            self.client.close(timeout=1)


# on a worker


def identity(shared: bytes) -> bytes:
    return shared


def run_on_worker(call: bytes, shared: bytes, limit: float, expected: str) -> tuple[str, Outcome | None]:
    """The worker's address and the outcome of a task; None: this worker runs another version of the program."""
    from distributed import get_worker

    worker = get_worker()
    if program() != expected:
        return worker.address, None
    key = worker.get_current_task()
    with lock:
        child = idle.pop() if idle else None
    if child is not None and not child.alive:  # killed between two tasks
        child.close()
        child = None
    try:
        child = child or Child(Path(worker.local_directory), memory_of(worker))
    except OSError as error:
        return worker.address, Outcome(error=f"cannot start a process on {worker.address}: {error.strerror}")
    outcome = child.call(call, shared, limit, lambda: is_wanted(worker, key))
    if child.is_spent(outcome):
        child.close()
    else:
        with lock:
            idle.append(child)
    return worker.address, outcome


def is_wanted(worker, key: str) -> bool:
    """Whether the scheduler still waits for a task; it does not after the fleet was interrupted."""
    task = worker.state.tasks.get(key)
    return task is not None and task.state == "executing"


def memory_of(worker) -> int | None:
    """Memory limit of a task, bytes: that of the worker in Dask, or its share of the machine's."""
    limit = worker.memory_manager.memory_limit or memory_of_machine()
    return int(SHARE * limit / worker.state.nthreads) if limit else None
