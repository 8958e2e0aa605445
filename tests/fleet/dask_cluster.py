"""A Dask cluster of this machine, started as a user starts one: with Dask's own commands."""

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

    def __init__(self, folder, root=ROOT):
        self.folder, self.root, self.processes = folder, root, []
        self.file = folder / "scheduler.json"
        self.scheduler = self.start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        while not (written := about_scheduler(self.file)):
            assert self.scheduler.poll() is None
            time.sleep(0.02)
        self.address = written["address"]

    def start(self, what, *options, root=None):
        """One of Dask's commands, in a session of its own."""
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(map(str, (root or self.root, HERE))),
        }
        log = (self.folder / f"{what}-{len(self.processes)}.log").open("wb")
        words = [sys.executable, "-m", "dask", what, *options, "--scheduler-file", str(self.file)]
        with log:
            self.processes.append(
                subprocess.Popen(
                    words, cwd=self.folder, env=environment, stdout=log, stderr=log, stdin=subprocess.DEVNULL,
                    start_new_session=True,
                )
            )  # fmt: skip
        return self.processes[-1]

    def worker(self, *options, threads=1, root=None):
        """One more worker, without a nanny where that is not asked for."""
        options = options or ("--no-nanny",)
        local = self.folder / f"local-{len(self.processes)}"
        local.mkdir()
        return self.start(
            "worker", *options, "--nthreads", str(threads), "--local-directory", str(local), "--no-dashboard",
            "--memory-limit", "1111111112", root=root,
        )  # fmt: skip

    def kill(self, process, number=signal.SIGKILL):
        """End one of them, with what it has started."""
        with suppress(ProcessLookupError):
            os.killpg(process.pid, number)
        process.wait()

    def end(self):
        for process in self.processes:
            self.kill(process)


def about_scheduler(file):
    """What a scheduler says of itself, as soon as it has said all."""
    with suppress(OSError, ValueError):
        return json.loads(file.read_text())


@contextmanager
def machines(folder):
    made = Machines(folder)
    try:
        yield made
    finally:
        made.end()
