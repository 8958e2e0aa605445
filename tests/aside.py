"""Tests that mostly wait for other processes: where all tests are run, these run in a further pytest beside the others.

What it reports of each is reported here, in its turn, at the end.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
WAITING = HERE / "fleet"  # the folder of these tests
REPORTS = "REPORTS_OF_TESTS"  # the environment's name for the file of reports
BEGINS = 4  # it begins when one in so many of the other tests has begun


class Aside:
    """The further pytest. It begins when a part of the other tests has begun: at first there is enough to do beside them."""

    def __init__(self, config, items, folder):
        self.config, self.items, self.file = config, [item for item in items if is_waiting(item)], folder / "reports"
        self.left, self.process = (len(items) - len(self.items)) // BEGINS, None

    def one_begins(self):
        """A test begins here."""
        self.left -= 1
        if self.left <= 0 and not self.process:
            self.begin()

    def begin(self):
        self.file.touch()
        words = [sys.executable, "-m", "pytest", "-q", "-p", "aside", str(WAITING)]
        paths = [str(HERE), *filter(None, [os.environ.get("PYTHONPATH")])]
        environment = os.environ | {REPORTS: str(self.file), "PYTHONPATH": os.pathsep.join(paths)}
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen(words, cwd=HERE.parent, env=environment, **quiet)

    def reports(self, item):
        """What is reported of a test, as soon as it has ended there."""
        if not self.process:
            self.begin()
        while True:
            ended = self.process.poll() is not None
            lines = [json.loads(line) for line in self.file.read_text(encoding="utf-8").split("\n")[:-1]]
            found = [line for line in lines if line["nodeid"] == item.nodeid]
            if any(line["when"] == "teardown" for line in found):
                return [
                    self.config.hook.pytest_report_from_serializable(config=self.config, data=line) for line in found
                ]
            if ended:
                raise RuntimeError(
                    f"the further pytest has ended, with status {self.process.returncode}, without {item.nodeid}"
                )
            time.sleep(0.1)

    def end(self):
        if self.process:
            self.process.kill()
            self.process.wait()


def is_waiting(item) -> bool:
    return item.path.is_relative_to(WAITING)


# in the further pytest, which loads this module as a plugin


def pytest_runtest_logreport(report):
    if REPORTS in os.environ:
        line = json.dumps(CONFIG[0].hook.pytest_report_to_serializable(config=CONFIG[0], report=report))
        with open(os.environ[REPORTS], "a", encoding="utf-8") as file:
            file.write(line + "\n")


CONFIG = []


def pytest_configure(config):
    CONFIG.append(config)
