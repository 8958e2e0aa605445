"""Small runs, for the fixture `small` of conftest.py; a terminal for tests that look at what is said."""

from functools import cache

from in_process import InProcess as InProcess

from compare.engines.mujoco import parse
from compare.experiments import module
from compare.robots.arm import ARM
from compare.run.examine import Setup, engines


@cache
def of_arm(name):
    """The result of an experiment on the arm, every path with few states and steps."""
    return module(name).rows(Setup.small(ARM, engines(parse(ARM.mjcf, ARM.tree))))


class Lines(list):
    """A terminal that keeps what is said."""

    def say(self, text="", style=""):
        self.append(text)
