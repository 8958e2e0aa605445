"""What a worker of a Dask cluster does with a piece: it has a process carry it out (see child), as the pool does."""

import threading
from contextlib import suppress
from pathlib import Path

from .child import SHARE, Child, memory_of_machine
from .piece import Outcome
from .program import program

TELLING = 10.0  # s in which the scheduler hears that a piece begins

idle, lock = [], threading.Lock()  # processes that wait for a piece


def as_it_is(shared: bytes) -> bytes:
    return shared


def on_worker(
    name: str, call: bytes, shared: bytes, limit: float, expected: str, topic: str
) -> tuple[str, Outcome | None]:
    """The worker's address, and what becomes of a piece in a process of its own; None: here is another program.

    topic: under which the scheduler is told that it begins.
    """
    from distributed import get_worker
    from distributed.utils import sync

    worker = get_worker()
    if program() != expected:
        return worker.address, None
    with suppress(Exception):  # the answer is waited for: the piece may take this worker down at once
        sync(worker.loop, worker.scheduler.log_event, topic=topic, msg=name, callback_timeout=TELLING)
    key = worker.get_current_task()
    with lock:
        child = idle.pop() if idle else None
    if child is not None and not child.alive:  # it was ended between two pieces
        child.close()
        child = None
    try:
        child = child or Child(Path(worker.local_directory), memory_of(worker))
    except OSError as error:
        return worker.address, Outcome(error=f"cannot start a process on {worker.address}: {error.strerror}")
    outcome = child.ask(call, shared, limit, lambda: is_wanted(worker, key))
    if child.is_spent(outcome):
        child.close()
    else:
        with lock:
            idle.append(child)
    return worker.address, outcome


def is_wanted(worker, key: str) -> bool:
    """Whether the scheduler still waits for a piece: it does not when the fleet was ended."""
    task = worker.state.tasks.get(key)
    return task is not None and task.state == "executing"


def memory_of(worker) -> int | None:
    """Bytes that a piece may have: what Dask allows the worker, or its share of the machine's."""
    limit = worker.memory_manager.memory_limit or memory_of_machine()
    return int(SHARE * limit / worker.state.nthreads) if limit else None
