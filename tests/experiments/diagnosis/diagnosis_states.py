"""States for tests of the diagnosis."""

import numpy as np


def two_states(tree, count=2):
    return np.random.default_rng(7).uniform(-3.0, 3.0, (2, count, len(tree.axis)))
