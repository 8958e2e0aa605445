"""States of the pendulum at which equations of one's own are compared."""

import numpy as np
import pytest
from helpers.own_agreement import READING, RIGHT, ROBOT

from compare.engines.mujoco import engine


@pytest.fixture(name="given")
def given_states():
    """States, and MuJoCo's values of every quantity."""
    q, qd, tau = np.random.default_rng(2019).uniform(-2.0, 2.0, (3, 12, 2))
    theirs = engine(READING).of(ROBOT.case())
    values = [theirs.mass_matrix(q), theirs.bias(q, qd), theirs.gravity_balance(q)]
    values.append(theirs.acceleration(q, qd, tau))
    return {"q": q, "qd": qd, "tau": tau}, dict(zip(RIGHT, values))
