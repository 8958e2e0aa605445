"""The pool: whatever a piece does, it gets an outcome, and the others theirs."""

import os
import resource
import signal
import subprocess
import sys
import tempfile
import threading
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import faults
import pytest
import toy_pieces as toy
from processes import SOON, gone_soon, notes
from runs import ENVIRONMENT, ROOT

from compare.fleet.child import LARGEST_FILE, OUT_OF_MEMORY, Child
from compare.fleet.piece import Outcome, Piece, outcomes
from compare.fleet.pool import Pool
from compare.process import interrupt


@pytest.fixture
def pool():
    made = Pool(2, limit=60.0)
    yield made
    made.close()


@pytest.fixture(scope="module")
def tried(tmp_path_factory):
    """What becomes of all that can happen to a piece, and where they took notes."""
    folder, made = tmp_path_factory.mktemp("notes"), Pool(2, faults.LIMIT, faults.MEMORY)
    try:
        yield faults.tried(made, folder), folder
    finally:
        made.close()


@pytest.mark.parametrize("name", [*faults.VALUES, *faults.ENDS])
def test_what_becomes_of_a_piece(tried, name):
    found, folder = tried
    faults.check(found[name], name, folder)


def test_what_was_ended_has_taken_its_time_too(tried):
    assert faults.LIMIT <= tried[0]["for ever"].wall < 60.0 and tried[0]["exits"].wall > 0.0


def test_every_fault_is_tried(tried):
    assert set(tried[0]) == {*faults.VALUES, *faults.ENDS}


def test_what_takes_too_long_ends_with_all_that_it_has_started(tried):
    (pids,) = notes(tried[1] / "for_ever")
    assert len(pids) == 2 and gone_soon(*pids)


def test_a_process_that_is_killed_between_two_pieces_costs_no_try(pool, tmp_path):
    for number in (signal.SIGKILL, signal.SIGSEGV):
        idle = {found.returned for found in outcomes(pool, [Piece("", toy.own_process)] * 4)}
        for pid in idle:
            os.kill(pid, number)
        assert gone_soon(*idle)
    (tmp_path / "notes").mkdir()
    (found,) = outcomes(pool, [Piece("", toy.killed, (signal.SIGKILL, str(tmp_path / "notes")))])
    assert found.broke == "ended by SIGKILL, 4 times" and len(list((tmp_path / "notes").iterdir())) == 4


def test_nothing_runs_beside_what_is_timed(pool, tmp_path):
    places = {timed: tmp_path / str(timed) for timed in (True, False)}
    for folder in places.values():
        folder.mkdir()
    asked = [Piece("", toy.in_time, (str(places[k % 3 == 0]), 0.05), timed=k % 3 == 0, rank=k % 2) for k in range(12)]
    assert not any(found.broke for found in outcomes(pool, asked))

    def times(timed):
        return sorted(tuple(map(int, note)) for note in notes(places[timed]))

    assert len(times(True)) == 4 and len(times(False)) == 8
    assert all(end <= begin for (_, end), (begin, _) in pairwise(times(True)))
    for begin, end in times(True):
        assert not any(other < end and begin < other_end for other, other_end in times(False))


def test_a_process_keeps_to_its_group_and_heavy_groups_begin_first(tmp_path):
    pool = Pool(1, limit=60.0)
    try:
        for k, (group, rank, weight) in enumerate(
            [("a", 1, 1.0), ("b", 1, 2.0), ("a", 1, 1.0), ("b", 1, 2.0), ("c", 0, 0.0), ("a", 2, 9.0)]
        ):
            with pool.change:  # all are there before one begins
                pool.running[-1] = Piece("", None, timed=True)
            pool.submit(Piece(f"{k}{group}{rank}", toy.twice, (k,), group=group, rank=rank, weight=weight))
        with pool.change:
            del pool.running[-1]
            pool.change.notify_all()
        order = []
        while pool.under_way:
            if done := pool.next():
                order.append(done[0].name)
    finally:
        pool.close()
    assert order == ["4c0", "1b1", "3b1", "0a1", "2a1", "5a2"]


@pytest.mark.parametrize("way", ["close", "stop"])
def test_nothing_is_left_of_a_pool(tmp_path, way, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    (tmp_path / "notes").mkdir()
    before = list(interrupt.undo)
    pool = Pool(2, limit=60.0)
    for _ in range(4):
        pool.submit(Piece("", toy.for_ever, (str(tmp_path / "notes"),)))
    pids = [pid for note in notes(tmp_path / "notes", 2) for pid in note]
    if way == "stop":
        early = threading.Thread(target=pool.stop, daemon=True)
        with pool.change:  # an early end does not wait for who has this
            early.start()
            early.join(SOON)
            assert not early.is_alive()
    pool.close()
    assert len(pids) == 4 and gone_soon(*pids)
    assert not list((tmp_path / "temporary").iterdir()) and interrupt.undo == before


def test_a_process_leaves_nothing_when_its_owner_is_killed(tmp_path):
    text = (
        "import toy_pieces as toy; from compare.fleet.pool import Pool; from compare.fleet.piece import Piece; import time\n"
        f"pool = Pool(2, 60.0)\nfor _ in range(2): pool.submit(Piece('', toy.for_ever, ({str(tmp_path / 'notes')!r},)))\n"
        "time.sleep(60)"
    )
    for name in ("notes", "temporary"):
        (tmp_path / name).mkdir()
    environment = ENVIRONMENT | {"TMPDIR": str(tmp_path / "temporary"), "PYTHONPATH": f"{ROOT}:{Path(__file__).parent}"}
    owner = subprocess.Popen([sys.executable, "-c", text], env=environment)
    try:
        pids = [pid for note in notes(tmp_path / "notes", 2) for pid in note]
    finally:
        owner.kill()
        owner.wait()
    assert len(pids) == 4 and gone_soon(*pids)
    assert not list((tmp_path / "temporary").iterdir())


def test_a_folder_that_is_gone_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    pool = Pool(1, limit=60.0)
    try:
        pool.scratch.rmdir()
        (found,) = outcomes(pool, [Piece("", toy.twice, (1,))])
    finally:
        pool.close()
    assert found.broke == "cannot start a process: No such file or directory"


def test_processes_share_the_memory_of_the_machine_and_write_no_file_without_end(monkeypatch):
    monkeypatch.setattr("compare.fleet.pool.memory_of_machine", lambda: 4 * 10**10)
    pool = Pool(4, limit=60.0)
    try:
        asked = [Piece("", resource.getrlimit, (getattr(resource, name),)) for name in ("RLIMIT_DATA", "RLIMIT_FSIZE")]
        found = [outcome.returned for outcome in outcomes(pool, asked)]
    finally:
        pool.close()
    assert found == [(9 * 10**9,) * 2, (LARGEST_FILE,) * 2] and pool.memory == 9 * 10**9


@pytest.mark.parametrize("alive, memory, outcome, is_spent", [
    (True, 1000, Outcome(memory=500), False),
    (True, 1000, Outcome(memory=501), True),
    (True, None, Outcome(memory=501), False),
    (True, 1000, Outcome(error=f"{OUT_OF_MEMORY}: more"), True),
    (True, 1000, Outcome(error="ValueError: out of memory"), False),
    (False, 1000, Outcome(), True),
])  # fmt: skip
def test_a_process_that_has_ended_or_has_little_memory_left_gets_no_other_piece(alive, memory, outcome, is_spent):
    assert Child.is_spent(SimpleNamespace(alive=alive, memory=memory), outcome) == is_spent


def test_where_there_are_no_limits_of_resources():
    text = (
        "import sys; sys.modules['resource'] = None; from compare.fleet import child; assert child.most_memory() >= 0"
    )
    subprocess.run([sys.executable, "-c", text], env=ENVIRONMENT, check=True)
