"""A Dask cluster: its workers carry out the pieces, each in a process of its own (see child)."""

import atexit
import hashlib
import logging
import shutil
import tempfile
import threading
import time
import warnings
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue

from ..process import interrupt
from ..process.crash import described
from .child import SHARE, Child, memory_of_machine
from .piece import TRIES, FleetError, Outcome, Piece
from .program import program

PAUSE = 0.5  # s after which it is said that nothing has ended
CONNECTING = 10.0  # s in which a scheduler answers, and its first worker is there
TIMING = "timing"  # the resource of a worker that takes timed pieces, of one thread
AHEAD = 3  # pieces that a worker is handed beforehand, for each of its threads
EXTRA = "the extra `fleet` is needed for a cluster: python -m pip install -e '.[fleet]'"
OTHER = "runs another version of the program or of MuJoCo"
GONE = "the scheduler {} is gone; what is done is kept, and the same command goes on from there"


class Cluster:
    """The workers of a scheduler; see piece.Door. limit: s that a piece may take.

    FleetError: there is no scheduler at the address, no worker, or workers with another version of the program.
    """

    times_alone = False

    def __init__(self, address: str, limit: float):
        try:
            import distributed
        except ImportError:
            raise FleetError(EXTRA) from None
        logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it says is said here, in a line
        warnings.filterwarnings("ignore", module="distributed")
        self.address, self.limit, self.under_way = address, limit, 0
        self.waiting, self.running, self.ended = [], {}, SimpleQueue()
        self.alone_since = None  # s at which no worker was left
        try:
            self.client = distributed.Client(address, timeout=CONNECTING, set_as_default=False, name="fleet")
        except (OSError, TimeoutError, ValueError, TypeError) as error:
            why = " ".join(str(error).split()) or type(error).__name__
            raise FleetError(f"no scheduler answers at {address}: {why}") from None
        interrupt.undo.append(self.close)
        try:
            self.check_workers()
        except BaseException:
            self.close()
            raise

    def check_workers(self) -> None:
        with suppress(TimeoutError):
            self.client.wait_for_workers(1, timeout=CONNECTING)
        if not self.known():
            raise FleetError(f"the scheduler {self.address} has no worker")
        for worker, found in self.client.run(program, on_error="return").items():
            if found != program():
                what = (
                    "has not this program"
                    if isinstance(found, Exception)
                    else "runs another version of the program or of MuJoCo"
                )
                raise FleetError(f"the worker {worker} {what}; the same is expected everywhere")

    def known(self) -> dict:
        """The workers, by their addresses, as the scheduler knows them."""
        return self.client.scheduler_info(n_workers=-1)["workers"]

    def workers(self) -> int:
        return sum(worker["nthreads"] for worker in self.known().values())

    def no_timing(self) -> str | None:
        able = [worker for worker in self.known().values() if worker["resources"].get(TIMING)]
        if any(worker["nthreads"] == 1 for worker in able):
            return None
        if able:
            return f"the worker with the resource {TIMING} has {able[0]['nthreads']} threads; one, which times alone, is expected"
        return f"no worker of the cluster has the resource {TIMING} (dask worker ... --nthreads 1 --resources '{TIMING}=1')"

    def submit(self, piece: Piece) -> None:
        self.under_way += 1
        self.waiting.append((piece, 1, None))
        self.hand_out()

    def hand_out(self) -> None:
        """Hand out as many pieces as keep the workers busy: what waits here costs the scheduler nothing."""
        threads = max(1, self.workers())
        self.waiting.sort(key=lambda entry: (entry[0].rank, -entry[0].weight))
        while self.waiting and len(self.running) < AHEAD * threads:
            self.hand(*self.waiting.pop(0))

    def hand(self, piece: Piece, times: int, avoided: str | None) -> None:
        """Hand a piece to the scheduler, for the so-manieth time; avoided: the worker on which it ended."""
        others = [worker for worker in self.known() if worker != avoided] if avoided else []
        shared = piece.shared
        if shared:  # a task of its own, that can be done again where its worker is lost
            key = f"shared-{hashlib.sha256(shared).hexdigest()}"
            shared = self.client.submit(as_it_is, shared, key=key, pure=True)
        future = self.client.submit(
            on_worker, piece._replace(shared=b""), shared, self.limit, program(), pure=False, retries=0, priority=-piece.rank,
            resources={TIMING: 1} if piece.timed else None, workers=others or None, allow_other_workers=bool(others),
        )  # fmt: skip
        self.running[future.key] = piece, times, future, shared
        future.add_done_callback(self.ended.put)

    def next(self) -> tuple[Piece, Outcome] | None:
        try:
            future = self.ended.get(timeout=PAUSE)
        except Empty:
            self.look_after()
            return None
        if future.key not in self.running:
            return None
        piece, times, _, _ = self.running.pop(future.key)
        worker, outcome = self.outcome_of(future)
        if outcome is None or (outcome.ended and not outcome.is_late and worker and times < TRIES):
            self.waiting.insert(0, (piece, times + (outcome is not None), worker))
            self.hand_out()
            return None
        self.hand_out()
        self.under_way -= 1
        return piece, outcome.tried(times)

    def outcome_of(self, future) -> tuple[str, Outcome | None]:
        """The worker and the outcome of a future that is done; None: it was lost, and is to be asked for again."""
        if future.status == "finished":
            with suppress(Exception):
                return future.result(timeout=CONNECTING)
            self.look_after()
            return "", None
        if future.status == "error":
            error = future.exception(timeout=CONNECTING)
            if type(error).__name__ == "KilledWorker":
                return "", Outcome(ended=f"its workers were lost, the last one {error.last_worker.address}")
            return "", Outcome(error=described(error))
        self.look_after()
        return "", None

    def look_after(self) -> None:
        """FleetError: the scheduler has gone, or its last worker, and with it hope."""
        if self.client.status != "running":
            raise FleetError(GONE.format(self.address))
        if self.known():
            self.alone_since = None
            self.hand_out()
            return
        self.alone_since = self.alone_since or time.perf_counter()
        if time.perf_counter() - self.alone_since > self.limit:
            raise FleetError(f"the scheduler {self.address} has no worker any more; what is done is kept")

    def close(self) -> None:
        if self.close in interrupt.undo:
            interrupt.undo.remove(self.close)
        with suppress(Exception):
            self.client.close(timeout=1)


# on a worker

idle, lock = [], threading.Lock()  # processes that wait for a piece


def as_it_is(shared: bytes) -> bytes:
    return shared


def on_worker(piece: Piece, shared: bytes, limit: float, expected: str) -> tuple[str, Outcome]:
    """The worker's address, and what becomes of a piece in a process of its own."""
    from distributed import get_worker

    worker = get_worker()
    if program() != expected:
        return "", Outcome(error=f"the worker {worker.address} {OTHER}")
    with lock:
        child = idle.pop() if idle else None
    if child is None or not child.alive:
        child = Child(folder_of(worker), memory_of(worker))
    outcome = child.ask(piece._replace(shared=shared), limit)
    if child.alive and not child.is_full(outcome) and not outcome.error.startswith("out of memory"):
        with lock:
            idle.append(child)
    else:
        child.close()
    return worker.address, outcome


def folder_of(worker) -> Path:
    """A folder for the processes of a worker, which goes with it."""
    folder = Path(tempfile.mkdtemp(prefix="fleet-", dir=worker.local_directory))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def memory_of(worker) -> int | None:
    """Bytes that a piece may have: what Dask allows the worker, or its share of the machine's."""
    limit = worker.memory_manager.memory_limit or memory_of_machine()
    return int(SHARE * limit / worker.state.nthreads) if limit else None
