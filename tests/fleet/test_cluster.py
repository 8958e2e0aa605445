"""A Dask cluster of real processes: pieces get the outcomes that the pool gives them, whatever becomes of the workers."""

import gc
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import pytest
import runs
import toy_pieces as toy
from toy_pieces import gone_soon, notes, soon

pytest.importorskip("distributed")

from compare.fleet import cluster as module
from compare.fleet.cluster import Cluster
from compare.fleet.piece import FleetError, Piece, outcomes
from compare.process import interrupt

HERE = Path(__file__).resolve().parent


class Machines:
    """A scheduler and workers, started with Dask's own commands. folder: for what they write."""

    def __init__(self, folder):
        self.folder, self.processes, self.file = folder, [], folder / "scheduler.json"
        self.scheduler = self.start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        self.address = soon(self.answer)

    def answer(self):
        """The address that the scheduler has written, as soon as that is whole."""
        assert self.scheduler.poll() is None
        with suppress(OSError, ValueError):
            return json.loads(self.file.read_text())["address"]

    def start(self, what, *options, root=runs.ROOT):
        """One of Dask's commands, in a session of its own."""
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (root, HERE)))}
        words = [sys.executable, "-m", "dask", what, *options, "--scheduler-file", str(self.file)]
        streams = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
        run = subprocess.Popen(words, cwd=self.folder, env=environment, start_new_session=True, **streams)
        self.processes.append(run)
        return run

    def worker(self, *options, threads=1, root=runs.ROOT):
        """One more worker, without a nanny where that is not asked for."""
        local = self.folder / f"local-{len(self.processes)}"
        local.mkdir()
        options = [*(options or ["--no-nanny"]), "--nthreads", str(threads), "--local-directory", str(local)]
        return self.start("worker", *options, "--no-dashboard", "--memory-limit", "1111111112", root=root)

    def timing(self, threads=1):
        return self.worker("--no-nanny", "--resources", "timing=1", threads=threads)

    def kill(self, process):
        """End one of them, with what it has started."""
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@contextmanager
def machines(folder):
    made = Machines(folder)
    try:
        yield made
    finally:
        for process in made.processes:
            made.kill(process)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A scheduler with two workers: one takes timed pieces, the other has a nanny."""
    with machines(tmp_path_factory.mktemp("machines")) as made:
        made.for_timing = made.timing()
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
    with closing(Cluster(place.address, toy.LIMIT)) as made:
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
    toy.check_all(cluster, tmp_path, toy.ALL)


@pytest.mark.slow
def test_what_is_timed_goes_to_the_worker_for_it(cluster, place, tmp_path):
    asked = [Piece("", toy.waits, (str(tmp_path), os.devnull), timed=True) for _ in range(4)]
    asked += [Piece("", abs, (k,)) for k in range(8)]
    assert cluster.no_timing() is None and not any(found.broke for found in outcomes(cluster, asked))
    assert [int(owner) for _, owner in notes(tmp_path, 4)] == [place.for_timing.pid] * 4


@pytest.mark.slow
def test_what_is_shared_is_sent_in_silence_and_not_kept(recwarn, cluster, capfd):
    asked = [Piece("", len, shared=b"z" * 3 * 10**7) for _ in range(6)]
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
        assert outcomes(cluster, [Piece("", abs, (-4,))])[0].returned == 4
        thread.join()
        bare.worker("--nanny")  # what takes its worker down breaks, and nothing else
        with_workers(cluster, 2)
        (tmp_path / "down").mkdir()
        asked = [Piece("", toy.takes_worker_down, (str(tmp_path / "down"),), rank=-1)]
        found = outcomes(cluster, asked + [Piece("", abs, (k,)) for k in range(20)])
    assert "tcp://127.0.0.1:" in found[0].broke and len(list((tmp_path / "down").iterdir())) == 4
    assert [each.returned for each in found[1:]] == list(range(20))


@pytest.mark.slow
def test_workers_that_do_not_come_back_end_a_fleet(bare):
    timing, plain = bare.timing(), bare.worker()
    with closing(with_workers(Cluster(bare.address, 0.5), 2)) as cluster:
        bare.kill(timing)
        with_workers(cluster, 1)
        found = outcomes(cluster, [Piece("", abs, (2,), timed=k < 5) for k in range(6)])
        assert ["timing" in each.broke for each in found] == [True] * 5 + [False]
        bare.kill(plain)
        with pytest.raises(FleetError, match=bare.address):
            outcomes(cluster, [Piece("", abs, (2,))])


@pytest.mark.slow
def test_who_may_time_and_another_program_is_refused(bare, monkeypatch):
    monkeypatch.setattr(module, "CONNECTING", 5.0)
    with pytest.raises(FleetError, match=bare.address):  # without workers
        Cluster(bare.address, 60.0)
    worker = bare.timing(threads=2)
    with closing(with_workers(Cluster(bare.address, 60.0), 1)) as cluster:
        assert "2 threads" in cluster.no_timing() and cluster.workers() == 2
        bare.worker()
        bare.kill(worker)
        assert soon(lambda: cluster.workers() == 1) and "timing" in cluster.no_timing()
        copy = bare.folder / "copy"  # one with another program comes late
        for name in ("compare", "mjcf", "tmt"):
            shutil.copytree(runs.ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        with (copy / "tmt" / "__init__.py").open("a") as file:
            file.write("# changed\n")
        bare.worker(root=copy)
        with_workers(cluster, 2)
        with pytest.raises(FleetError, match="same program"):
            outcomes(cluster, [Piece("", abs, (2,))])
    with pytest.raises(FleetError, match="same program"):
        Cluster(bare.address, 60.0)


@pytest.mark.slow
def test_a_scheduler_that_is_killed_ends_the_command_in_one_line(bare, tmp_path):
    bare.worker()
    model = runs.ROOT / "tests" / "models" / "free_body.xml"
    words = runs.command("fleet", model, "--only", "parameters", "--out", "out", "--dask", bare.address)
    run = runs.started(*words, cwd=tmp_path)
    assert soon(lambda: list((tmp_path / "out" / "kept").glob("*/[!.]*")))
    bare.kill(bare.scheduler)
    output, errors = run.communicate(timeout=60)
    assert run.returncode == 2 and len(errors.splitlines()) == 1 and bare.address in errors, output


@pytest.mark.parametrize("address", ["foo", "tcp://x:99999"])
def test_an_address_that_is_none(address, monkeypatch, capfd):
    monkeypatch.setattr(module, "CONNECTING", 0.5)
    before = list(interrupt.undo)
    with pytest.raises(FleetError, match=f" {address}: ") as raised:
        Cluster(address, 60.0)
    assert len(str(raised.value).splitlines()) == 1
    raised.value.__context__ = None
    gc.collect()  # Dask's client, while no other one is being made
    assert capfd.readouterr() == ("", "") and interrupt.undo == before
