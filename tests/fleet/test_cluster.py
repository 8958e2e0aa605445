"""A Dask cluster of real processes: pieces get the outcomes that the pool gives them, whatever becomes of the workers."""

import gc
import os
import shutil
import threading
from contextlib import closing

import faults
import pytest
import toy_pieces as toy
from processes import gone_soon, notes, soon
from runs import ROOT

pytest.importorskip("distributed")

from dask_cluster import machines

from compare.experiments.diagnosis.fault_table import made_faults, rows_by_pieces, rows_in_parts
from compare.fleet import cluster as module
from compare.fleet.calls import door_opened
from compare.fleet.cluster import Cluster
from compare.fleet.piece import FleetError, Piece, outcomes
from compare.judge.check import Result
from compare.process import interrupt


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A scheduler with two workers: one takes timed pieces, the other has a nanny."""
    with machines(tmp_path_factory.mktemp("machines")) as made:
        made.timing = made.worker("--no-nanny", "--resources", "timing=1")
        made.worker("--nanny")
        yield made


@pytest.fixture
def bare(tmp_path):
    """A scheduler whose workers come and go."""
    (tmp_path / "bare").mkdir()
    with machines(tmp_path / "bare") as made:
        yield made


@pytest.fixture
def cluster(place):
    with closing(Cluster(place.address, faults.LIMIT)) as made:
        yield with_workers(made, 2)


def with_workers(cluster, count):
    """The cluster, as soon as it has this number of workers."""

    def there():
        cluster.seen_at = -module.FRESH
        return len(cluster.known()) == count

    assert soon(there)
    return cluster


@pytest.mark.slow
def test_what_becomes_of_a_piece(cluster, tmp_path):
    faults.check_all(cluster, tmp_path)
    (pids,) = notes(tmp_path / "for ever")
    assert len(pids) == 2 and gone_soon(*pids)


@pytest.mark.slow
def test_what_is_timed_goes_to_the_worker_for_it(cluster, place, tmp_path):
    asked = [Piece("", toy.waits, (str(tmp_path), os.devnull), timed=True) for _ in range(4)]
    asked += [Piece("", toy.twice, (k,)) for k in range(8)]
    assert cluster.no_timing() is None and not any(found.broke for found in outcomes(cluster, asked))
    assert [int(owner) for _, owner in notes(tmp_path, 4)] == [place.timing.pid] * 4


@pytest.mark.slow
def test_what_is_shared_is_sent_in_silence_and_not_kept(recwarn, cluster, capfd):
    asked = [Piece("", toy.length, shared=b"z" * 3 * 10**7) for _ in range(6)]
    assert [found.returned for found in outcomes(cluster, asked)] == [3 * 10**7] * 6
    assert soon(lambda: not cluster.client.who_has())
    assert capfd.readouterr() == ("", "") and [str(warning.message) for warning in recwarn] == []


@pytest.mark.slow
def test_a_fleet_that_was_ended_is_ended_on_the_workers(cluster, tmp_path):
    before = [act for act in interrupt.undo if act != cluster.close]
    for _ in range(3):
        cluster.submit(Piece("", toy.for_ever, (str(tmp_path),)))
    pids = [pid for note in notes(tmp_path, 2) for pid in note]
    cluster.close()
    assert len(pids) == 4 and gone_soon(*pids) and interrupt.undo == before


@pytest.mark.slow
def test_made_faults_have_the_same_rows(place):
    given, result = [fault for fault in made_faults() if fault.kind == "sign"][:3], Result("diagnosis")
    with door_opened(place.address, None) as door:
        tables = rows_by_pieces(result, given, door, lambda done: None), rows_in_parts(given, map, lambda done: None)
    first, second = ([row | {"seconds": 0.0} for row in table] for table in tables)
    assert first == second and not result.checks


@pytest.mark.slow
def test_a_worker_is_killed_with_all_that_it_had(bare, tmp_path):
    """Its piece runs on another one, with what it shares with others, and its process does not live on."""
    workers, folder, opened = [bare.worker("--nanny"), bare.worker()], tmp_path / "notes", tmp_path / "opened"
    folder.mkdir()

    def kill():
        at_work = notes(folder, 2)
        bare.kill(workers[0])
        (left,) = [pid for pid, owner in at_work if int(owner) != workers[1].pid]
        assert gone_soon(left)
        opened.write_text("")

    with closing(with_workers(Cluster(bare.address, 60.0), 2)) as cluster:
        thread = threading.Thread(target=kill)
        thread.start()
        asked = [Piece("", toy.waits, (str(folder), str(opened)), shared=b"s" * 10**7) for _ in range(4)]
        assert [found.returned for found in outcomes(cluster, asked)] == [10**7] * 4
        thread.join()
        assert len(list(folder.iterdir())) == 5
        bare.kill(workers[1])  # now there is none: the next piece waits until one comes
        thread = threading.Timer(1.5, lambda: bare.worker("--nanny"))
        thread.start()
        assert outcomes(cluster, [Piece("", toy.twice, (2,))])[0].returned == 4
        thread.join()
        bare.worker("--nanny")  # what takes its worker down breaks, and nothing else
        with_workers(cluster, 2)
        (tmp_path / "down").mkdir()
        asked = [Piece("", toy.takes_worker_down, (str(tmp_path / "down"),), rank=-1)]
        found = outcomes(cluster, asked + [Piece("", toy.twice, (k,)) for k in range(20)])
    assert "tcp://127.0.0.1:" in found[0].broke and len(list((tmp_path / "down").iterdir())) == 4
    assert [each.returned for each in found[1:]] == list(range(0, 40, 2))


@pytest.mark.slow
def test_workers_that_do_not_come_back_end_a_fleet(bare):
    timing, plain = bare.worker("--no-nanny", "--resources", "timing=1"), bare.worker()
    with closing(with_workers(Cluster(bare.address, 0.5), 2)) as cluster:
        bare.kill(timing)
        with_workers(cluster, 1)
        found = outcomes(cluster, [Piece("", toy.twice, (2,), timed=k < 5) for k in range(6)])
        assert ["timing" in each.broke for each in found] == [True] * 5 + [False]
        bare.kill(plain)
        with pytest.raises(FleetError, match=bare.address):
            outcomes(cluster, [Piece("", toy.twice, (2,))])


@pytest.mark.slow
def test_who_may_time_and_another_program_is_refused(bare, monkeypatch):
    monkeypatch.setattr(module, "CONNECTING", 5.0)
    with pytest.raises(FleetError, match=bare.address):  # without workers
        Cluster(bare.address, 60.0)
    worker = bare.worker("--no-nanny", "--resources", "timing=1", threads=2)
    with closing(with_workers(Cluster(bare.address, 60.0), 1)) as cluster:
        assert "2 threads" in cluster.no_timing() and cluster.workers() == 2
        bare.worker()
        bare.kill(worker)
        assert soon(lambda: cluster.workers() == 1) and "timing" in cluster.no_timing()
        copy = bare.folder / "copy"  # one with another program comes late
        for name in ("compare", "mjcf", "tmt"):
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        with (copy / "tmt" / "__init__.py").open("a") as file:
            file.write("# changed\n")
        bare.worker(root=copy)
        with_workers(cluster, 2)
        with pytest.raises(FleetError, match="same program"):
            outcomes(cluster, [Piece("", toy.twice, (2,))])
    with pytest.raises(FleetError, match="same program"):
        Cluster(bare.address, 60.0)


@pytest.mark.parametrize("address", ["foo", "http://127.0.0.1:80", "tcp://", " ", "tcp://x:99999"])
def test_an_address_that_is_none(address, monkeypatch, capfd):
    monkeypatch.setattr(module, "CONNECTING", 0.5)
    before = list(interrupt.undo)
    with pytest.raises(FleetError, match=f" {address}: ") as raised:
        Cluster(address, 60.0)
    assert len(str(raised.value).splitlines()) == 1
    raised.value.__context__ = None
    gc.collect()  # Dask's client, while no other one is being made
    assert capfd.readouterr() == ("", "") and interrupt.undo == before
