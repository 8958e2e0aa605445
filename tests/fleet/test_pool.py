"""The pool: whatever a piece does, it gets an outcome, and the others theirs."""

import math
import os
import platform
import subprocess
import sys
import tempfile
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import faults
import pytest
import toy_pieces as toy
from processes import gone_soon, notes
from runs import ENVIRONMENT, ROOT

from compare.fleet.calls import door_opened
from compare.fleet.piece import Piece, outcomes
from compare.fleet.pool import Pool
from compare.process import interrupt

SOME = ("for ever", "raises", "SIGKILL", "SIGKILL once", "eats", "prints", "asked with a lock", "shares", "last")


def test_what_becomes_of_a_piece(tmp_path):
    with closing(Pool(2, faults.LIMIT, faults.MEMORY)) as pool:
        faults.check_all(pool, tmp_path, SOME)
    (pids,) = notes(tmp_path / "for ever")
    assert len(pids) == 2 and gone_soon(*pids)  # with all that it has started


@pytest.mark.slow
def test_what_becomes_of_a_piece_in_any_way(tmp_path):
    with closing(Pool(2, faults.LIMIT, faults.MEMORY)) as pool:
        faults.check_all(pool, tmp_path)


def test_nothing_runs_beside_what_is_timed(tmp_path):
    places = {timed: tmp_path / str(timed) for timed in (True, False)}
    for folder in places.values():
        folder.mkdir()
    asked = [Piece("", toy.in_time, (str(places[k % 3 == 0]), 0.05), timed=k % 3 == 0, rank=k % 2) for k in range(12)]
    with closing(Pool(2, 60.0)) as pool:
        assert not any(found.broke for found in outcomes(pool, asked))
    timed, others = ([tuple(map(int, note)) for note in sorted(notes(places[kind]))] for kind in (True, False))
    assert (len(timed), len(others)) == (4, 8)
    assert all(end <= begin for (_, end), (begin, _) in pairwise(timed))
    for begin, end in timed:
        assert not any(other < end and begin < other_end for other, other_end in others)


def test_nothing_is_left_of_a_pool_that_is_closed(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    for name in ("temporary", "notes"):
        (tmp_path / name).mkdir()
    before = list(interrupt.undo)
    with closing(Pool(2, limit=60.0)) as pool:
        for _ in range(3):
            pool.submit(Piece("", toy.for_ever, (str(tmp_path / "notes"),)))
        pids = [pid for note in notes(tmp_path / "notes", 2) for pid in note]
    assert len(pids) == 4 and gone_soon(*pids)
    assert not list((tmp_path / "temporary").iterdir()) and interrupt.undo == before


def test_calls_have_their_outcomes_in_order_and_none_is_lost_with_another():
    ended = []
    with door_opened(None, 1) as door:
        found = door.outcomes(math.sqrt, [4.0, -1.0, 9.0], progress=ended.append)
    assert [found[0].returned, found[2].returned] == [2.0, 3.0] and ended == [1, 2, 3]
    assert found[1].broke.startswith("ValueError") and found[0].machine == platform.node()
    with door_opened(None, None) as door:
        assert door is None


def test_a_process_that_is_killed_between_two_pieces_costs_no_try(tmp_path):
    with closing(Pool(1, 60.0)) as pool:
        (found,) = outcomes(pool, [Piece("", toy.own_process)])
        os.kill(found.returned, 9)
        assert gone_soon(found.returned)
        (found,) = outcomes(pool, [Piece("", toy.killed, (9, 3, str(tmp_path)))])
    assert found.returned == "at last" and len(list(tmp_path.iterdir())) == 4


OWNER = """
import time
import toy_pieces as toy
from compare.fleet.piece import Piece
from compare.fleet.pool import Pool

pool = Pool(2, 60.0)
for _ in range(2):
    pool.submit(Piece("", toy.for_ever, ({notes!r},)))
time.sleep(60)
"""


@pytest.mark.slow
def test_a_process_leaves_nothing_when_its_owner_is_killed(tmp_path):
    for name in ("notes", "temporary"):
        (tmp_path / name).mkdir()
    environment = ENVIRONMENT | {"TMPDIR": str(tmp_path / "temporary"), "PYTHONPATH": f"{ROOT}:{Path(__file__).parent}"}
    owner = subprocess.Popen([sys.executable, "-c", OWNER.format(notes=str(tmp_path / "notes"))], env=environment)
    try:
        pids = [pid for note in notes(tmp_path / "notes", 2) for pid in note]
    finally:
        owner.kill()
        owner.wait()
    assert len(pids) == 4 and gone_soon(*pids)
    assert not list((tmp_path / "temporary").iterdir())
