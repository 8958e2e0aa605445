import signal

import numpy as np
import pytest
from aside import Aside, is_waiting
from hypothesis import settings
from small_runs import Beside, jobs, of_arm

from compare import experiment
from compare.engines.mujoco import load
from compare.robots.arm import ARM

# what is started in the background or by nohup ignores these, and its children do too: tests that send them would wait
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

# no example database in the checkout; the same examples in every run
settings.register_profile("project", database=None, derandomize=True, deadline=None, max_examples=50)
settings.load_profile("project")


ALL_RUN = {"test_agreement.py", "test_second_robot.py", "test_judge_check.py"}  # where these run, all do


def are_all(items) -> bool:
    return {item.path.name for item in items} >= ALL_RUN


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    if are_all(items):
        items.sort(key=is_waiting)


def pytest_collection_finish(session):
    if are_all(session.items) and not session.config.option.collectonly:
        session.config.aside = Aside(session.config, session.items, session.config._tmp_path_factory.mktemp("aside"))


def pytest_runtest_protocol(item, nextitem):
    """Of a test that runs in the further pytest: what that reports; of any other: what pytest does."""
    aside = getattr(item.config, "aside", None)
    if aside is None:
        return None
    if not is_waiting(item):
        aside.one_begins()
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for report in aside.reports(item):
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def pytest_sessionfinish(session):
    if aside := getattr(session.config, "aside", None):
        aside.end()


@pytest.fixture(scope="session")
def mujoco():
    """MuJoCo with the arm's file."""
    return load(ARM.mjcf, ARM.tree)


@pytest.fixture(scope="session")
def engines(mujoco):
    return experiment.engines(mujoco)


@pytest.fixture(scope="session", autouse=True)
def beside(request, tmp_path_factory):
    """Where all tests are run, what takes long is computed beside them from the start."""
    folder = tmp_path_factory.mktemp("beside")
    beside = Beside(folder, jobs(folder) if are_all(request.session.items) else ())
    yield beside
    beside.end()


@pytest.fixture(scope="session")
def small(beside):
    """small(name): the result of an experiment in a small run, every path with few states and steps; made once."""
    return lambda name: beside.result(of_arm, name)


@pytest.fixture
def setup(engines):
    """A setup with few states, enough to see any error that is not rounding."""
    return experiment.Setup(ARM, engines, states=200, exact_states=5, finer=(1,), size="quick")


@pytest.fixture
def rng():
    return np.random.default_rng(2019)
