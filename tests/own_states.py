"""States at which equations of one's own are asked, and functions of one state as a user writes them."""

import numpy as np

from compare.engines.own import ARGUMENTS
from compare.robots.arm import ARM

COORDINATES = ARM.coordinates
NAMES = {"gravity": "gravity_balance"}


def single(function):
    """The function of one state alone: as a user writes it."""

    def of_one(*state):
        assert all(part.ndim == 1 for part in state)
        return function(*state)

    return of_one


def as_lists(function):
    """The same with lists and plain numbers for arrays."""
    return single(lambda *state: np.array(function(*state)).tolist())


def states(rng, count=6, n=3):
    return rng.uniform(-2.0, 2.0, (3, count, n))


def asked(own, name, state):
    return getattr(own, NAMES.get(name, name))(*state[: ARGUMENTS[name]])


def values(own, state):
    """Every quantity at states."""
    found = {name: asked(own, name, state) for name in ARGUMENTS if name != "jacobians"}
    return found | dict(zip("TB", own.jacobians(state[0])))
