import importlib
from functools import cache

import numpy as np
import pytest
from hypothesis import settings

from compare.agreement import Setup
from compare.engine_file import load

# no example database in the checkout; the same examples in every run
settings.register_profile("project", database=None, derandomize=True, deadline=None, max_examples=50)
settings.load_profile("project")


@pytest.fixture(scope="session")
def engine():
    return load()


@pytest.fixture(scope="session")
def small(engine):
    """small(name): the result of an experiment in a small run, every path with few states and steps; made once."""
    return cache(lambda name: importlib.import_module(f"compare.{name}").rows(Setup.small(engine)))


@pytest.fixture
def setup(engine):
    """A setup with few states, enough to see any error that is not rounding."""
    return Setup(engine, states=200, exact_states=5, steps=(64,), size="quick")


@pytest.fixture
def rng():
    return np.random.default_rng(2019)
