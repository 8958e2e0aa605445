"""The states at which engines are compared: the named postures, and random ones."""

from functools import cached_property

import numpy as np

from tmt.reference import exact

from .case import SEED
from .robots import Robot


class Sample:
    """States at which engines are compared, with the exact values of the first `exact_states`.

    tree: the stated numbers. q, qd, tau: (states, n), rad, rad/s, N m. states: their names, if they have any.
    """

    def __init__(self, tree, name, q, qd, tau, exact_states, states=()):
        self.tree, self.name, self.q, self.qd, self.tau = tree, name, q, qd, tau
        self.exact_states, self.states = exact_states, states

    @cached_property
    def truths(self) -> list:
        """A tmt.reference.Truth for each of the first states."""
        known = slice(self.exact_states)
        return [exact(self.tree, *state) for state in zip(self.q[known], self.qd[known], self.tau[known])]

    def truth(self, quantity: str) -> np.ndarray:
        """One of its fields, of mpmath numbers: (exact_states, ...)."""
        return np.array([getattr(truth, quantity) for truth in self.truths])

    def describe(self, i: int) -> str:
        """Where state i is, for a reader who wants to see it again."""
        if self.states:
            return self.states[i]
        return f"state {i}: q = ({', '.join(f'{a:.4f}' for a in self.q[i])}) rad"

    def each(self) -> list["Sample"]:
        """One sample for each state, by its own name."""
        singles = []
        for i, name in enumerate(self.states):
            single = Sample(self.tree, name, *(a[i : i + 1] for a in (self.q, self.qd, self.tau)), 1, (name,))
            single.truths = self.truths[i : i + 1]
            singles.append(single)
        return singles


def named(robot: Robot) -> Sample:
    """The named postures, or all joints at zero if there are none; with random rates and torques where those are asked for."""
    rng, q = np.random.default_rng([SEED, 1]), np.array(list(robot.poses.values()))
    rates, torques = rng.uniform(-10.0, 10.0, (2, *q.shape))
    name = "named postures" if robot.postures else "a posture"
    return Sample(robot.tree, name, q, rates, torques, len(q), tuple(robot.poses))


def random(robot: Robot, states: int, exact_states: int) -> Sample:
    """Random states: angles within a turn, rates in [-10, 10] rad/s, torques in [-10, 10] N m."""
    rng = np.random.default_rng(SEED)
    q = robot.case().coordinates.random(rng, states)
    rates, torques = rng.uniform(-10.0, 10.0, (2, states, len(robot.joints)))
    return Sample(robot.tree, "random states", q, rates, torques, exact_states)
