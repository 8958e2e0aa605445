"""A Dask cluster: its workers carry out the pieces (see worker)."""

import hashlib
import heapq
import logging
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from queue import Empty, SimpleQueue
from typing import NamedTuple

from ..process import interrupt
from ..process.crash import described
from .piece import MOST_TRIES, NOTHING_NEW, FleetError, Outcome, Piece
from .program import program
from .worker import as_it_is, on_worker

CONNECTING = 10.0  # s in which a scheduler answers, and its first worker is there
FRESH = 1.0  # s for which the list of the workers is taken as it was
TIMING = "timing"  # the resource of a worker that takes timed pieces, of one thread
AHEAD = 3  # pieces that a worker is handed beforehand, for each of its threads
BEGUN = "fleet-{}"  # under which the scheduler is told of each piece that begins; {}: whose pieces
LOGGERS = ("distributed", "distributed.client", "distributed.core", "tornado", "tornado.application", "asyncio")
EXTRA = "the extra `fleet` is needed for a cluster: python -m pip install -e '.[fleet]'"
OTHER = "the worker {} has not the same program and MuJoCo as this machine; the same is expected everywhere"
GONE = "the scheduler {} is gone; what is done is kept, and the same command goes on from there"


class Handed(NamedTuple):
    """A piece that was handed to the scheduler."""

    piece: Piece
    times: int  # how often, this one among them
    future: object
    shared: object  # what it needs too, for as long as it does


class Cluster:
    """The workers of a scheduler; see piece.Door. limit: s that a piece may take.

    FleetError: there is no scheduler at the address, no worker, or one with another version of the program; later, from any
    method: the scheduler has gone, or for longer than the limit all workers.
    """

    times_alone = False

    def __init__(self, address: str, limit: float):
        try:
            import distributed
        except ImportError:
            raise FleetError(EXTRA) from None
        for name in LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # what they say is said here, in a line
        warnings.filterwarnings("ignore", module="distributed")
        self.address, self.limit, self.under_way = address, limit, 0
        self.waiting = {False: [], True: []}  # heaps, of pieces that are timed and of others
        self.running, self.ended, self.given_up = {}, SimpleQueue(), []
        self.seen, self.seen_at, self.number = {}, -FRESH, count()
        self.none_since = {False: None, True: None}  # s at which no worker was left, for timed pieces and for others
        try:
            self.client = distributed.Client(address, timeout=CONNECTING, set_as_default=False, name="fleet")
        except Exception as error:
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
            if found != program() and not isinstance(found, OSError):  # one that has gone meanwhile
                raise FleetError(OTHER.format(worker))

    @contextmanager
    def speaking(self) -> Iterator[None]:
        """FleetError where the scheduler does not answer in this block."""
        try:
            yield
        except Exception:
            raise FleetError(GONE.format(self.address)) from None

    def known(self) -> dict:
        """The workers, by their addresses, as the scheduler knows them, or did a second ago."""
        if time.monotonic() - self.seen_at > FRESH:
            with self.speaking():
                self.seen = self.client.scheduler_info(n_workers=-1)["workers"]
            self.seen_at = time.monotonic()
        return self.seen

    def workers(self) -> int:
        return sum(worker["nthreads"] for worker in self.known().values())

    def timing_workers(self) -> list[dict]:
        return [worker for worker in self.known().values() if worker["resources"].get(TIMING, 0) >= 1]

    def no_timing(self) -> str | None:
        able = self.timing_workers()
        if not able:
            return f"no worker of the cluster has the resource {TIMING} (dask worker ... --nthreads 1 --resources '{TIMING}=1')"
        threads = max(worker["nthreads"] for worker in able)
        if threads > 1:
            return f"a worker with the resource {TIMING} has {threads} threads; one, which times alone, is expected"
        return None

    def submit(self, piece: Piece) -> None:
        self.under_way += 1
        self.wait(piece, 1, None)
        self.hand_out()

    def wait(self, piece: Piece, times: int, avoided: str | None) -> None:
        """A piece waits here until it is handed out for the so-manieth time; avoided: the worker on which it ended."""
        order = piece.rank, times == 1, -piece.weight, next(self.number)
        heapq.heappush(self.waiting[piece.timed], (*order, piece, times, avoided))

    def hand_out(self) -> None:
        """Hand out as many pieces as keep the workers busy: what waits here costs the scheduler nothing."""
        if not any(self.waiting.values()):
            return
        for timed, able in ((True, len(self.timing_workers())), (False, self.workers())):
            room = AHEAD * able - sum(handed.piece.timed == timed for handed in self.running.values())
            for _ in range(min(room, len(self.waiting[timed]))):
                self.hand(*heapq.heappop(self.waiting[timed])[-3:])

    def hand(self, piece: Piece, times: int, avoided: str | None) -> None:
        try:
            call = piece.call
        except Exception as error:  # it cannot be sent
            self.given_up.append((piece, Outcome(error=described(error))))
            return
        others = [worker for worker in self.known() if worker != avoided] if avoided else []
        with self.speaking():
            shared = piece.shared
            if shared:  # a task of its own, that can be done again where its worker is lost
                key = f"shared-{hashlib.sha256(shared).hexdigest()}"
                shared = self.client.submit(as_it_is, shared, key=key, pure=True)
            future = self.client.submit(
                on_worker, piece.name, call, shared, self.limit, program(), BEGUN.format(self.client.id), pure=False,
                retries=0, priority=0 if piece.timed else -piece.rank, resources={TIMING: 1} if piece.timed else None,
                workers=others or None, allow_other_workers=bool(others),
            )  # fmt: skip
            self.running[future.key] = Handed(piece, times, future, shared)
            future.add_done_callback(self.ended.put)

    def next(self) -> tuple[Piece, Outcome] | None:
        if not self.given_up:
            try:
                future = self.ended.get(timeout=NOTHING_NEW)
            except Empty:
                self.look_after()
                self.hand_out()
            else:
                if future.key in self.running:
                    self.came(self.running.pop(future.key))
                    self.hand_out()
        if not self.given_up:
            return None
        self.under_way -= 1
        return self.given_up.pop(0)

    def came(self, handed: Handed) -> None:
        """A piece has come back: it is done, or runs again."""
        worker, outcome = self.outcome_of(handed)
        if outcome is None:
            self.wait(handed.piece, handed.times, None)
        elif outcome.ended and not outcome.is_late and handed.times < MOST_TRIES:
            self.wait(handed.piece, handed.times + 1, worker)
        else:
            self.given_up.append((handed.piece, outcome.tried(handed.times)))

    def outcome_of(self, handed: Handed) -> tuple[str | None, Outcome | None]:
        """The outcome of a future that is done, and the worker that is to be avoided then.

        None: it only waited on workers that others took down; Dask does not know them apart.
        """
        status, error = handed.future.status, None
        if status not in ("finished", "error"):
            self.look_after()
        with suppress(Exception):
            if status == "finished":
                worker, outcome = handed.future.result(timeout=CONNECTING)
                if outcome is None:
                    error = OTHER.format(worker)
                else:
                    return worker, outcome
            elif status == "error":
                error = handed.future.exception(timeout=CONNECTING)
        if isinstance(error, ImportError | AttributeError):
            error = f"a worker has not the same program as this machine, {described(error)}"
        if isinstance(error, str):
            raise FleetError(f"{error}; what is done is kept")
        if type(error).__name__ != "KilledWorker":
            return None, Outcome(error=described(error)) if error else Outcome(ended="its result was lost")
        why = f"its workers were lost, the last one {error.last_worker.address}"
        return None, Outcome(error=why) if self.begun(handed.piece) >= MOST_TRIES else None

    def begun(self, piece: Piece) -> int:
        """How many times a piece has begun on a worker."""
        with self.speaking():
            return [name for _, name in self.client.get_events(BEGUN.format(self.client.id))].count(piece.name)

    def look_after(self) -> None:
        """FleetError: the scheduler has gone, or its last worker, and with it hope. Timed pieces may be without hope alone."""
        if self.client.status != "running":
            raise FleetError(GONE.format(self.address))
        now = time.monotonic()
        for timed, able in ((False, self.workers()), (True, len(self.timing_workers()))):
            mine = [key for key, handed in self.running.items() if handed.piece.timed == timed]
            if able or not (mine or self.waiting[timed]):
                self.none_since[timed] = None
                continue
            self.none_since[timed] = self.none_since[timed] or now
            if now - self.none_since[timed] <= self.limit:
                continue
            if not timed:
                raise FleetError(f"the scheduler {self.address} has no worker any more; what is done is kept")
            pieces = [self.running.pop(key).piece for key in mine] + [entry[-3] for entry in self.waiting[timed]]
            self.waiting[timed].clear()
            self.given_up += [(piece, Outcome(error=self.no_timing())) for piece in pieces]

    def close(self) -> None:
        with suppress(ValueError):  # it is closed already
            interrupt.undo.remove(self.close)
        with suppress(Exception):
            self.client.close(timeout=1)
