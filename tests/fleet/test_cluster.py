"""A Dask cluster of real processes: pieces get the outcomes that the pool gives them, whatever becomes of the workers."""

import gc
import os
import shutil
import signal
import threading
from types import SimpleNamespace

import faults
import pytest
import toy_pieces as toy
from processes import gone_soon, notes, soon
from runs import ROOT

pytest.importorskip("distributed")

from dask_cluster import machines

from compare.fleet import cluster as module
from compare.fleet.cluster import Cluster
from compare.fleet.piece import FleetError, Piece, outcomes
from compare.fleet.worker import memory_of
from compare.process import interrupt


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A scheduler with two workers: one takes timed pieces, the other has a nanny."""
    with machines(tmp_path_factory.mktemp("machines")) as made:
        made.timing = made.worker("--no-nanny", "--resources", "timing=1")
        made.other = made.worker("--nanny")
        yield made


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """A scheduler whose workers come and go."""
    with machines(tmp_path_factory.mktemp("bare")) as made:
        yield made


@pytest.fixture
def ways():
    """Clusters that are closed in the end, also when a test fails."""
    made = []
    yield made
    for cluster in made:
        cluster.close()


def with_workers(cluster, count):
    """The cluster, as soon as it has so many workers."""

    def there():
        cluster.seen_at = -module.FRESH
        return len(cluster.known()) == count

    assert soon(there)
    return cluster


@pytest.fixture
def cluster(place, ways):
    ways.append(Cluster(place.address, 60.0))
    return with_workers(ways[0], 2)


@pytest.fixture(scope="module")
def tried(place, tmp_path_factory):
    folder, made = tmp_path_factory.mktemp("notes"), Cluster(place.address, faults.LIMIT)
    try:
        yield faults.tried(with_workers(made, 2), folder), folder
    finally:
        made.close()


@pytest.mark.parametrize("name", [*faults.VALUES, *faults.ENDS])
def test_what_becomes_of_a_piece(tried, name):
    found, folder = tried
    faults.check(found[name], name, folder)


def test_what_takes_too_long_ends_with_all_that_it_has_started(tried):
    (pids,) = notes(tried[1] / "for_ever")
    assert len(pids) == 2 and gone_soon(*pids)


def test_a_process_that_is_killed_between_two_pieces_costs_no_try(cluster, tmp_path):
    idle = {found.returned for found in outcomes(cluster, [Piece("", toy.own_process)] * 12)}
    for pid in idle:
        os.kill(pid, signal.SIGKILL)
    assert gone_soon(*idle)
    found = outcomes(cluster, [Piece("", toy.killed, (signal.SIGKILL, str(tmp_path)))])
    assert found[0].broke == "ended by SIGKILL, 4 times" and len(list(tmp_path.iterdir())) == 4


def test_what_is_timed_goes_to_the_worker_for_it(cluster, place, tmp_path):
    asked = [Piece("", toy.waits, (str(tmp_path), os.devnull), timed=True) for _ in range(4)]
    asked += [Piece("", toy.twice, (k,)) for k in range(8)]
    assert cluster.no_timing() is None
    assert not any(found.broke for found in outcomes(cluster, asked))
    assert [int(owner) for _, owner in notes(tmp_path, 4)] == [place.timing.pid] * 4


def test_what_is_shared_is_sent_in_silence_and_not_kept(place, ways, capfd, recwarn):
    ways.append(Cluster(place.address, 60.0))
    asked = [Piece("", toy.length, shared=b"z" * 3 * 10**7) for _ in range(6)]
    assert [found.returned for found in outcomes(ways[0], asked)] == [3 * 10**7] * 6
    assert soon(lambda: not ways[0].client.who_has())
    assert (*capfd.readouterr(), len(recwarn)) == ("", "", 0)


def test_a_fleet_that_was_ended_is_ended_on_the_workers(cluster, tmp_path):
    before = [act for act in interrupt.undo if act != cluster.close]
    for _ in range(3):
        cluster.submit(Piece("", toy.for_ever, (str(tmp_path),)))
    pids = [pid for note in notes(tmp_path, 2) for pid in note]
    cluster.close()
    assert len(pids) == 4 and gone_soon(*pids) and interrupt.undo == before


def test_a_worker_is_killed_with_all_that_it_had(bare, ways, tmp_path):
    """Its piece runs on another one, with what it shares with others, and its process does not live on."""
    workers = [bare.worker("--nanny"), bare.worker()]
    ways.append(with_workers(Cluster(bare.address, 60.0), 2))
    folder, opened = tmp_path / "notes", tmp_path / "opened"
    folder.mkdir()

    def kill():
        at_work = notes(folder, 2)
        bare.kill(workers[0])
        (left,) = [pid for pid, owner in at_work if int(owner) != workers[1].pid]
        assert gone_soon(left)
        opened.write_text("")

    thread = threading.Thread(target=kill)
    thread.start()
    asked = [Piece("", toy.waits_with, (str(folder), str(opened)), shared=b"s" * 10**7) for _ in range(4)]
    found = outcomes(ways[0], asked)
    thread.join()
    assert [each.returned for each in found] == [10**7] * 4
    assert len(list(folder.iterdir())) == 5
    bare.kill(workers[1])
    # now there is none: the next piece waits until one comes
    thread = threading.Timer(1.5, lambda: workers.append(bare.worker("--nanny")))
    thread.start()
    (found,) = outcomes(ways[0], [Piece("", toy.twice, (2,))])
    thread.join()
    assert found.returned == 4
    # what takes its worker down breaks, and nothing else
    workers.append(bare.worker("--nanny"))
    with_workers(ways[0], 2)
    (tmp_path / "down").mkdir()
    asked = [Piece("", toy.takes_worker_down, (str(tmp_path / "down"),), rank=-1)]
    found = outcomes(ways[0], asked + [Piece("", toy.twice, (k,)) for k in range(20)])
    assert found[0].broke.startswith("its workers were lost, the last one tcp://127.0.0.1:")
    assert [each.returned for each in found[1:]] == list(range(0, 40, 2))
    assert len(list((tmp_path / "down").iterdir())) == 4
    for worker in workers:
        bare.kill(worker)


def test_workers_that_do_not_come_back_end_a_fleet(bare, ways, tmp_path):
    worker = bare.worker("--no-nanny", "--resources", "timing=1")
    ways.append(with_workers(Cluster(bare.address, 0.5), 1))
    plain = bare.worker()
    with_workers(ways[0], 2)
    bare.kill(worker)
    with_workers(ways[0], 1)
    asked = [Piece("", toy.twice, (2,), timed=k < 5) for k in range(6)]
    found = outcomes(ways[0], asked)
    assert [each.broke[:50] for each in found[:5]] == ["no worker of the cluster has the resource timing ("] * 5
    assert found[5].returned == 4
    bare.kill(plain)
    with pytest.raises(FleetError, match=r"^the scheduler tcp://\S+ has no worker any more; what is done is kept$"):
        outcomes(ways[0], asked[5:])


def test_who_may_time(bare, ways):
    workers = [bare.worker("--no-nanny", "--resources", "timing=1", threads=2)]
    ways.append(with_workers(Cluster(bare.address, 60.0), 1))
    assert ways[0].no_timing() == "a worker with the resource timing has 2 threads; one, which times alone, is expected"
    assert ways[0].workers() == 2
    workers.append(bare.worker())
    bare.kill(workers[0])
    assert soon(lambda: ways[0].workers() == 1)
    assert ways[0].no_timing().startswith("no worker of the cluster has the resource timing (dask worker ")
    # one with another program comes late
    copy = bare.folder / "copy"
    for name in ("compare", "mjcf", "tmt"):
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    with (copy / "tmt" / "__init__.py").open("a") as file:
        file.write("# changed\n")
    workers.append(bare.worker(root=copy))
    with_workers(ways[0], 2)
    bare.kill(workers[1])
    expected = (
        "the worker tcp://.* has not the same program and MuJoCo as this machine; the same is expected everywhere"
    )
    with pytest.raises(FleetError, match=f"^{expected}; what is done is kept$"):
        outcomes(ways[0], [Piece("", toy.twice, (2,))])
    with pytest.raises(FleetError, match=f"^{expected}$"):
        Cluster(bare.address, 60.0)
    bare.kill(workers[2])


@pytest.mark.parametrize(
    "allowed, threads, memory", [(10**10, 1, 9 * 10**9), (10**10, 3, 3 * 10**9), (None, 2, 9 * 10**8)]
)
def test_the_threads_of_a_worker_share_its_memory(allowed, threads, memory, monkeypatch):
    monkeypatch.setattr("compare.fleet.worker.memory_of_machine", lambda: 2 * 10**9)
    manager, state = SimpleNamespace(memory_limit=allowed), SimpleNamespace(nthreads=threads)
    assert memory_of(SimpleNamespace(memory_manager=manager, state=state)) == memory


def test_a_scheduler_without_workers(bare, ways, monkeypatch):
    monkeypatch.setattr(module, "CONNECTING", 2.0)
    with pytest.raises(FleetError, match=r"^the scheduler tcp://\S+ has no worker$"):
        ways.append(Cluster(bare.address, 60.0))


@pytest.mark.parametrize("address", ["foo", "127.0.0.1", "http://127.0.0.1:80", "tcp://", " ", "tcp://x:99999"])
def test_an_address_that_is_none(address, monkeypatch, capfd):
    monkeypatch.setattr(module, "CONNECTING", 0.5)
    before = list(interrupt.undo)
    with pytest.raises(FleetError, match=f"^no scheduler answers at {address}: [^\n]*$") as raised:
        Cluster(address, 60.0)
    raised.value.__context__ = None
    gc.collect()  # Dask's client, while no other one is being made
    assert capfd.readouterr() == ("", "") and interrupt.undo == before
