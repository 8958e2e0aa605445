"""The pool: every task gets an outcome, whatever the others do."""

import os
from contextlib import closing
from itertools import pairwise

import toy_tasks as toy

from compare.fleet.pool import Pool
from compare.fleet.tasks import Task, outcomes


def test_outcomes(tmp_path):
    with closing(Pool(2, toy.LIMIT, toy.MEMORY)) as pool:
        toy.check_all(pool, tmp_path)


def test_nothing_runs_beside_what_is_timed(tmp_path):
    places = {timed: tmp_path / str(timed) for timed in (True, False)}
    for folder in places.values():
        folder.mkdir()
    tasks = [
        Task("", toy.in_time, (str(places[k % 3 == 0]), 0.02 * (1 + k % 4)), timed=k % 3 == 0, rank=k % 2)
        for k in range(12)
    ]
    with closing(Pool(2, 60.0)) as pool:
        assert not any(found.broke for found in outcomes(pool, tasks))
    timed, others = ([tuple(map(int, note)) for note in toy.notes(places[kind])] for kind in (True, False))
    assert (len(timed), len(others)) == (4, 8)
    assert all(end <= begin for (_, end), (begin, _) in pairwise(timed))
    for begin, end in timed:
        assert not any(other < end and begin < other_end for other, other_end in others)

    with closing(Pool(1, 60.0)) as pool:
        (found,) = outcomes(pool, [Task("", os.getpid)])
        os.kill(found.returned, 9)
        assert toy.gone_soon(found.returned)
        (found,) = outcomes(pool, [Task("", toy.killed, (3, str(tmp_path)))])
    assert found.returned == "at last" and len(list(tmp_path.iterdir())) == 4
