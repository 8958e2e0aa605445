import numpy as np
import pytest
from hypothesis import settings
from small_runs import Beside, jobs, of_arm

from compare import experiment
from compare.engines.mujoco import load
from compare.robots.arm import ARM

# no example database in the checkout; the same examples in every run
settings.register_profile("project", database=None, derandomize=True, deadline=None, max_examples=50)
settings.load_profile("project")


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
    files, folder = {item.path.name for item in request.session.items}, tmp_path_factory.mktemp("beside")
    all_run = {"test_agreement.py", "test_second_robot.py", "test_judge_check.py"} <= files
    beside = Beside(folder, jobs(folder) if all_run else ())
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
