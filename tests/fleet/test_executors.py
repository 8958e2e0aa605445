"""Every call gets an outcome, on this machine and on a Dask cluster of real processes, whatever becomes of its workers."""

import json
import os
import signal
import subprocess
import sys
from contextlib import closing, suppress
from pathlib import Path

import pytest
from helpers import runs, toy
from helpers.toy import soon

from compare.core.errors import Refused
from compare.fleet import executors as module
from compare.fleet.executors import Cluster, Pool

TESTS = Path(__file__).resolve().parents[1]


@runs.posix
def test_outcomes_on_this_machine():
    with closing(Pool(2, toy.LIMIT)) as pool:
        toy.check_all(pool)


@runs.posix
@pytest.mark.parametrize("times, outcome", [(1, (4, "")), (9, (None, "killed by SIGKILL, 4 times"))])
def test_a_call_whose_process_is_killed_is_made_again_three_times(times, outcome, tmp_path):
    with closing(Pool(1, 60.0)) as pool:
        assert pool.outcome(pool.submit(toy.is_killed, str(tmp_path), times)) == outcome
    assert len(os.listdir(tmp_path)) == min(times + 1, 4)


class Machines:
    """A scheduler and workers, started with Dask's own commands. folder: for what they write."""

    def __init__(self, folder):
        self.folder, self.processes, self.file = folder, [], folder / "scheduler.json"
        self.scheduler = self.start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        self.address = soon(self.answer)

    def answer(self):
        with suppress(OSError, ValueError):
            return json.loads(self.file.read_text())["address"]

    def start(self, what, *options):
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (runs.ROOT, TESTS)))}
        words = [sys.executable, "-m", "dask", what, *options, "--scheduler-file", str(self.file)]
        streams = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
        run = subprocess.Popen(words, cwd=self.folder, env=environment, start_new_session=True, **streams)
        self.processes.append(run)
        return run

    def worker(self, *options):
        return self.start("worker", *(options or ["--no-nanny"]), "--nthreads", "1", "--no-dashboard")

    def kill(self, process):
        """End one of them, with what it has started."""
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@pytest.fixture
def machines(tmp_path):
    pytest.importorskip("distributed")
    if not runs.IS_POSIX:
        pytest.skip("needs process groups")
    (tmp_path / "machines").mkdir()
    made = Machines(tmp_path / "machines")
    yield made
    for process in made.processes:
        made.kill(process)


@pytest.mark.slow
def test_a_worker_and_a_scheduler_that_are_killed(machines, tmp_path, monkeypatch):
    workers, opened = [machines.worker("--nanny"), machines.worker()], tmp_path / "opened"
    (folder := tmp_path / "notes").mkdir()
    with closing(Cluster(machines.address, 60.0)) as cluster:
        assert soon(lambda: cluster.threads_now() == 2)
        futures = [cluster.submit(toy.waits, str(folder), str(opened)) for _ in range(2)]
        assert soon(lambda: len(list(folder.iterdir())) == 2)
        machines.kill(workers[0])
        opened.write_text("")
        assert [cluster.outcome(future) for future in futures if not future.exception()] == [(4, "")] * 2
        machines.kill(workers[1])
        assert soon(lambda: not cluster.threads_now())
        monkeypatch.setattr(module, "ALONE", 0.0)
        with pytest.raises(Refused, match=f"no worker .* {machines.address}"):
            cluster.check()
        machines.kill(machines.scheduler)
        assert soon(lambda: cluster.client.status != "running")
        with pytest.raises(Refused, match=f"no worker .* {machines.address}"):
            cluster.check()


@pytest.mark.slow
def test_a_call_costs_four_workers_at_most(machines):
    machines.worker("--nanny")
    with closing(Cluster(machines.address, 60.0)) as cluster:
        (future := cluster.submit(toy.kills_its_worker)).exception()
        assert "4 workers" in cluster.outcome(future)[1]


@pytest.mark.slow
def test_a_worker_with_another_program_is_refused(machines, monkeypatch):
    machines.worker()
    monkeypatch.setattr(module, "program", os.getpid)  # which is another one there
    with closing(Cluster(machines.address, 60.0)) as cluster:
        (future := cluster.submit(abs, 2)).exception()
        with pytest.raises(Refused, match="different version"):
            cluster.outcome(future)


def test_an_address_that_is_none(monkeypatch, capfd):
    pytest.importorskip("distributed")
    monkeypatch.setattr(module, "CONNECTING", 0.5)
    with pytest.raises(Refused, match=r"^[^\n]* tcp://x:99999: [^\n]*$"):
        Cluster("tcp://x:99999", 60.0)
    assert capfd.readouterr() == ("", "")
