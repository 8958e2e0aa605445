"""For tests of whole runs: the command line without its further processes, which take 2.5 s to start; small runs of the arm."""

from concurrent.futures import Future
from contextlib import contextmanager, nullcontext
from functools import cache

import pytest

from compare.__main__ import main
from compare.engines.mujoco import parse
from compare.experiments import functions
from compare.process.workers import Clock
from compare.robots.arm import ARM
from compare.run import command
from compare.run.examine import Setup, engines


class InProcess:
    """Workers that compute and draw in this process, at once; see process.workers."""

    def __init__(self):
        self.clock = Clock()

    def submit(self, function, /, *arguments, **named):
        future = Future()
        try:
            future.set_result(function(*arguments, **named))
        except Exception as error:
            future.set_exception(error)
        return future

    def map(self, function, *arguments):
        return iter([function(*each) for each in zip(*arguments)])

    def quiet(self):
        """Nothing is under way."""


@contextmanager
def without_workers():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(command, "start_workers", lambda: nullcontext(InProcess()))
        yield


def answered(arguments, capsys) -> tuple[int, str, str]:
    """Exit status, stdout and stderr of a command line."""
    try:
        status = main(arguments)
    except SystemExit as stop:
        status = stop.code
    return status, *capsys.readouterr()


@cache
def of_arm(name):
    """The result of an experiment on the arm, every path with few states and steps."""
    return functions(name).rows(Setup.small(ARM, engines(parse(ARM.mjcf, ARM.tree))))


class Lines(list):
    """A terminal that keeps what is said."""

    def say(self, text="", style=""):
        self.append(text)
