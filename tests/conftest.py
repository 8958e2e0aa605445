"""Fixtures of all tests, and the budget: processor time of each folder, printed at the end of a run."""

import os
import pickle
import signal
import tempfile
from collections import defaultdict
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock
from helpers.in_process import of_arm, without_workers
from hypothesis import settings

from compare.engines.mujoco import parse
from compare.robots.arm import ARM
from compare.run import examine as experiment

# a process in the background, or under nohup, is started with these ignored, and so would be those that it starts
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

# no example database in the checkout; the same examples in every run
settings.register_profile("project", database=None, derandomize=True, deadline=None, max_examples=50)
settings.load_profile("project")

BUDGET = {  # s of processor time of the default run, for each folder, from an empty store
    "agreement": 28, "diagnosis": 28, "engines": 12, "experiments": 46, "export": 10, "fleet": 8, "house": 8, "judge": 2,
    "process": 18, "report": 14, "robots": 6, "run": 16, "stability": 32, "tmt": 38, "truth": 2,
}  # fmt: skip
LONGEST = 10  # tests that are listed


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item):
    item.begins = sum(os.times()[:4])
    return (yield)


@pytest.hookimpl(wrapper=True, trylast=True)
def pytest_runtest_teardown(item):
    result = yield
    item.user_properties.append(("processor_s", sum(os.times()[:4]) - item.begins))
    return result


def pytest_terminal_summary(terminalreporter):
    every = (report for reports in terminalreporter.stats.values() for report in reports)
    ended = [report for report in every if getattr(report, "when", "") == "teardown"]
    seconds = {report.nodeid: dict(report.user_properties).get("processor_s", 0.0) for report in ended}
    folders = defaultdict(float)
    for name, of_test in seconds.items():
        parts = Path(name.split("::")[0]).parts
        folders[parts[1] if len(parts) > 2 else "tests"] += of_test
    if len(seconds) > LONGEST:
        terminalreporter.section(f"processor time: {sum(seconds.values()):.0f} s")
        for name, of_folder in sorted(folders.items()):
            is_default = terminalreporter.config.option.markexpr == "not slow"
            allowed = f" of {BUDGET.get(name, 0):3} s" if is_default else ""
            terminalreporter.line(f"{of_folder:7.1f} s{allowed}  {name}")
        for name in sorted(seconds, key=seconds.get, reverse=True)[:LONGEST]:
            terminalreporter.line(f"{seconds[name]:7.1f} s  {name}")


@pytest.fixture(scope="session", autouse=True)
def common(tmp_path_factory, worker_id) -> Path:
    """A folder of all processes that run the tests."""
    own = tmp_path_factory.getbasetemp()
    tempfile.tempdir = str(own)  # a fleet leaves its folder there until its process ends
    return own if worker_id == "master" else own.parent


@pytest.fixture(scope="session")
def shared(common):
    """shared(function, *args): what a function of a module returns, computed once for all processes that run the tests."""

    def result(function, *args):
        name = "-".join([function.__module__, function.__name__, *map(str, args)])
        path = common / name.replace(os.sep, "_")[-200:]
        with FileLock(f"{path}.lock"):
            if not path.exists():
                path.write_bytes(pickle.dumps(function(*args)))
        return pickle.loads(path.read_bytes())

    return result


@pytest.fixture(scope="session")
def mujoco():
    """MuJoCo with the arm's file."""
    return parse(ARM.mjcf, ARM.tree)


@pytest.fixture(scope="session")
def engines(mujoco):
    return experiment.engines(mujoco)


@pytest.fixture(scope="session")
def small(shared):
    """small(name): the result of an experiment in a small run, every path with few states and steps."""
    return cache(partial(shared, of_arm))


@pytest.fixture
def inside():
    """A run of the command line starts no further processes."""
    with without_workers():
        yield


@pytest.fixture
def setup(engines):
    """A setup with few states, enough to see any error that is not rounding."""
    return experiment.Setup(ARM, engines, states=200, exact_states=5, finer=(1,), size="quick")


@pytest.fixture
def rng():
    return np.random.default_rng(2019)
