"""A Dask cluster of this machine, started with Dask's own commands; for test_cluster.py and test_interrupted.py."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

from runs import ROOT

HERE = Path(__file__).resolve().parent


class Machines:
    """A scheduler and workers. folder: for what they write."""

    def __init__(self, folder):
        self.folder, self.processes, self.file = folder, [], folder / "scheduler.json"
        self.scheduler = self.start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        while not (address := address_in(self.file)):
            assert self.scheduler.poll() is None
            time.sleep(0.02)
        self.address = address

    def start(self, what, *options, root=ROOT):
        """One of Dask's commands, in a session of its own."""
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (root, HERE)))}
        words = [sys.executable, "-m", "dask", what, *options, "--scheduler-file", str(self.file)]
        with (self.folder / f"{what}-{len(self.processes)}.log").open("wb") as log:
            streams = {"stdin": subprocess.DEVNULL, "stdout": log, "stderr": log}
            self.processes.append(
                subprocess.Popen(words, cwd=self.folder, env=environment, start_new_session=True, **streams)
            )
        return self.processes[-1]

    def worker(self, *options, threads=1, root=ROOT):
        """One more worker, without a nanny where that is not asked for."""
        local = self.folder / f"local-{len(self.processes)}"
        local.mkdir()
        options = [*(options or ["--no-nanny"]), "--nthreads", str(threads), "--local-directory", str(local)]
        return self.start("worker", *options, "--no-dashboard", "--memory-limit", "1111111112", root=root)

    def kill(self, process):
        """End one of them, with what it has started."""
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def address_in(file):
    """What a scheduler has written, as soon as that is whole."""
    with suppress(OSError, ValueError):
        return json.loads(file.read_text())["address"]


@contextmanager
def machines(folder):
    made = Machines(folder)
    try:
        yield made
    finally:
        for process in made.processes:
            made.kill(process)
