"""Worker processes: what becomes of calls, and the processor time of the task for which a call is made."""

import os
import signal
import time
from contextlib import closing
from ctypes import CDLL
from pathlib import Path

import pytest

from compare.process.workers import WorkerEnded, Workers, start_workers

LONG = 0.1  # s
SOON = 60.0  # s, far more than anything here takes


def busy(seconds):
    began = time.process_time()
    while time.process_time() - began < seconds:
        pass
    return seconds


def break_off():
    busy(LONG)
    raise ValueError("broken")


def test_what_a_worker_does_is_for_the_task_that_asked():
    with start_workers() as workers:
        with workers.clock.of("first"):
            first = workers.submit(busy, 2 * LONG)
            mapped = workers.map(busy, [LONG, LONG])
        with workers.clock.of("second"):
            assert first.result() == 2 * LONG and list(mapped) == [LONG, LONG]  # waits for the first's
            broken = workers.submit(break_off)
        with pytest.raises(ValueError, match="broken"):
            broken.result()
        assert workers.clock.task == ""
        assert workers.clock.seconds_of("first") >= 4 * LONG
        assert LONG <= workers.clock.seconds_of("second") < 4 * LONG


def test_what_other_workers_do_counts_for_the_task_of_the_run():
    with start_workers() as workers, closing(Workers(1)) as engine:
        with workers.clock.of("engines"):
            engine.submit(busy, 2 * LONG).result(SOON)
        assert workers.clock.seconds_of("engines") >= 2 * LONG


def fill_memory():
    """Take 100 MB in small pieces, of which every tenth stays."""
    pieces = [bytearray(2000) for _ in range(50_000)]
    kept.extend(pieces[::10])


def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


kept: list[bytearray] = []


@pytest.mark.skipif(not hasattr(CDLL(None) if os.name == "posix" else None, "malloc_trim"), reason="no glibc")
def test_what_a_call_needs_no_more_is_given_back():
    with closing(Workers(1)) as workers:
        before = workers.submit(resident).result(SOON)
        workers.submit(fill_memory).result(SOON)
        assert workers.submit(resident).result(SOON) - before < 70e6


def leave():
    os._exit(0)


ENDS = {"killed by SIGKILL": (signal.raise_signal, signal.SIGKILL), "exit status": (leave,)}


@pytest.mark.parametrize("is_fresh", [False, True])
def test_a_process_that_ends_or_takes_too_long_is_replaced(is_fresh):
    with closing(Workers(1, limit=2.0, is_fresh=is_fresh)) as workers:
        first = workers.submit(os.getpid)
        assert (workers.submit(os.getpid).result(SOON) == first.result(SOON)) is not is_fresh
        with pytest.raises(TimeoutError, match=r"2\.0"):
            workers.submit(time.sleep, 600.0).result(SOON)
        for how, call in list(ENDS.items())[: 1 if is_fresh else 2]:
            with pytest.raises(WorkerEnded) as error:
                workers.submit(*call).result(SOON)
            assert error.value.how.startswith(how)
        workers.quiet()
        assert workers.submit(abs, -4).result(SOON) == 4


def test_a_process_that_is_killed_while_it_is_idle_is_replaced():
    with closing(Workers(1)) as workers:
        os.kill(workers.submit(os.getpid).result(SOON), signal.SIGKILL)
        time.sleep(5 * LONG)
        assert workers.submit(abs, -4).result(SOON) == 4
