"""Seconds of the processor that each task takes: in this process and in those that compute for it, not what it waits for."""

import time

import pytest

from compare.process.workers import Clock, start_workers

LONG = 0.1  # s


def busy(seconds):
    """Use the processor for these seconds."""
    began = time.process_time()
    while time.process_time() - began < seconds:
        pass
    return seconds


def break_off():
    busy(LONG)
    raise ValueError("broken")


def test_waiting_is_nobodys_and_work_is_whose_it_is():
    clock = Clock()
    with clock.of("waits"):
        time.sleep(5 * LONG)
    with clock.of("works"):
        busy(LONG)
    clock.ends("works")
    busy(LONG)  # for nobody
    # the processor's time is that of all threads, and one of another test may be at its end
    assert clock.seconds_of("waits") < 2 * LONG and LONG <= clock.seconds_of("works") < 3 * LONG
    assert clock.ended["works"] >= 5 * LONG


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
