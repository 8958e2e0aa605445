"""A Dask cluster of real processes: tasks get the outcomes that the pool gives them, whatever becomes of the workers."""

import json
import os
import signal
import subprocess
import sys
import threading
from contextlib import closing, suppress
from pathlib import Path

import pytest
import runs
import toy_tasks as toy
from toy_tasks import gone_soon, notes, soon

pytest.importorskip("distributed")

from compare.fleet import cluster as module
from compare.fleet.cluster import Cluster
from compare.fleet.tasks import FleetError, Task, outcomes
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

    def start(self, what, *options):
        """One of Dask's commands, in a session of its own."""
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (runs.ROOT, HERE)))}
        words = [sys.executable, "-m", "dask", what, *options, "--scheduler-file", str(self.file)]
        streams = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
        run = subprocess.Popen(words, cwd=self.folder, env=environment, start_new_session=True, **streams)
        self.processes.append(run)
        return run

    def worker(self, *options, threads=1):
        """One more worker, without a nanny where that is not tasks for."""
        local = self.folder / f"local-{len(self.processes)}"
        local.mkdir()
        options = [*(options or ["--no-nanny"]), "--nthreads", str(threads), "--local-directory", str(local)]
        return self.start("worker", *options, "--no-dashboard", "--memory-limit", "1111111112")

    def kill(self, process):
        """End one of them, with what it has started."""
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@pytest.fixture
def machines(tmp_path):
    (tmp_path / "machines").mkdir()
    made = Machines(tmp_path / "machines")
    yield made
    for process in made.processes:
        made.kill(process)


def with_workers(cluster, count):
    """The cluster, as soon as it has this number of workers."""

    def there():
        cluster.refreshed_at = -module.REFRESH
        return len(cluster.worker_infos()) == count

    assert soon(there)
    return cluster


@pytest.mark.slow
def test_outcomes_and_timed_tasks_go_to_the_worker_for_them(machines, tmp_path):
    timing, _ = machines.worker("--no-nanny", "--resources", "timing=1"), machines.worker("--nanny")
    for name in ("timed", "ended"):
        (tmp_path / name).mkdir()
    with closing(with_workers(Cluster(machines.address, toy.LIMIT), 2)) as cluster:
        toy.check_all(cluster, tmp_path)
        tasks = [Task("", toy.waits, (str(tmp_path / "timed"), os.devnull), timed=True) for _ in range(4)]
        tasks += [Task("", abs, (k,)) for k in range(8)]
        assert cluster.no_timing() is None and not any(found.broke for found in outcomes(cluster, tasks))
        assert [int(owner) for _, owner in notes(tmp_path / "timed", 4)] == [timing.pid] * 4
        cluster.submit(
            Task("", toy.for_ever, (str(tmp_path / "ended"),))
        )  # a fleet that is ended is ended on the workers
        (pids,) = notes(tmp_path / "ended")
    assert gone_soon(*pids) and cluster.close not in interrupt.undo


@pytest.mark.slow
def test_a_worker_is_killed_with_all_that_it_had(machines, tmp_path):
    """Its task runs on another one, with what it shares with others, and its process does not live on."""
    workers, folder, opened = [machines.worker("--nanny"), machines.worker()], tmp_path / "notes", tmp_path / "opened"
    folder.mkdir()

    def kill():
        at_work = notes(folder, 2)
        machines.kill(workers[0])
        (left,) = [pid for pid, owner in at_work if int(owner) != workers[1].pid]
        assert gone_soon(left)
        opened.write_text("")

    with closing(with_workers(Cluster(machines.address, 60.0), 2)) as cluster:
        thread = threading.Thread(target=kill)
        thread.start()
        tasks = [Task("", toy.waits, (str(folder), str(opened)), shared=b"s" * 10**7) for _ in range(4)]
        assert [found.returned for found in outcomes(cluster, tasks)] == [10**7] * 4
        thread.join()
        assert len(list(folder.iterdir())) == 5
        machines.kill(workers[1])  # now there is none: the next task waits until one comes
        thread = threading.Timer(1.5, machines.worker)
        thread.start()
        assert outcomes(cluster, [Task("", abs, (-4,))])[0].returned == 4
        thread.join()


@pytest.mark.slow
def test_workers_that_do_not_come_back_and_a_scheduler_that_is_gone_end_a_fleet(machines):
    timing, plain = machines.worker("--no-nanny", "--resources", "timing=1"), machines.worker()
    with closing(with_workers(Cluster(machines.address, 0.5), 2)) as cluster:
        machines.kill(timing)
        with_workers(cluster, 1)
        found = outcomes(cluster, [Task("", abs, (2,), timed=k < 5) for k in range(6)])
        assert ["timing" in each.broke for each in found] == [True] * 5 + [False]
        machines.kill(plain)
        with pytest.raises(FleetError, match=f"{machines.address} has no worker"):
            outcomes(cluster, [Task("", abs, (2,))])
        machines.kill(machines.scheduler)
        with pytest.raises(FleetError, match=f"lost .* {machines.address}"):
            outcomes(cluster, [Task("", abs, (2,))])


@pytest.mark.slow
def test_a_worker_with_another_program_is_refused(machines, monkeypatch):
    machines.worker("--no-nanny", "--resources", "timing=1", threads=2)
    with closing(with_workers(Cluster(machines.address, 60.0), 1)) as cluster:
        assert "2 threads" in cluster.no_timing() and cluster.workers() == 2
        monkeypatch.setattr(module, "program", os.getpid)  # which is another one there
        with pytest.raises(FleetError, match="different version"):
            outcomes(cluster, [Task("", abs, (2,))])
    with pytest.raises(FleetError, match="different version"):
        Cluster(machines.address, 60.0)


def test_an_address_that_is_none(monkeypatch, capfd):
    monkeypatch.setattr(module, "CONNECTING", 0.5)
    with pytest.raises(FleetError, match=r"^[^\n]* tcp://x:99999: [^\n]*$"):
        Cluster("tcp://x:99999", 60.0)
    assert capfd.readouterr() == ("", "")
