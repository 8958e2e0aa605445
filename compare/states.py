"""The states at which engines are compared: the named postures, and random ones."""

from functools import cached_property

import numpy as np

from tmt.composite import mass_matrix_and_bias  # the sum over bodies would take minutes for hundreds of joints
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
    """The named postures, or the reference if there are none; with random speeds and torques where those are asked for."""
    rng, q = np.random.default_rng([SEED, 1]), np.array(list(robot.poses.values()))
    most = sizes(robot)[:, None]
    speeds, torques = rng.uniform(-most, most, (2, len(q), robot.coordinates.nv))
    name = "named postures" if robot.postures or robot.positions else "a posture"
    return Sample(robot.tree, name, q, speeds, torques, len(q), tuple(robot.poses))


def random(robot: Robot, states: int, exact_states: int) -> Sample:
    """Random states: positions within the joints' ranges, speeds and torques within `sizes`."""
    rng = np.random.default_rng(SEED)
    q = robot.coordinates.random(rng, states, robot.ranges)
    most = sizes(robot)[:, None]
    speeds, torques = rng.uniform(-most, most, (2, states, robot.coordinates.nv))
    return Sample(robot.tree, "random states", q, speeds, torques, exact_states)


def sizes(robot: Robot) -> np.ndarray:
    """The largest random speeds, rad/s, and torques, N m, (2, nv).

    Without stated ranges 10 of each. Else a speed goes through the joint's range in 1 s (a turn, 1 m without one), and a torque
    gives the joint 10 rad/s2 at the reference, if the others are held.
    """
    if not robot.ranges:
        return np.full((2, robot.coordinates.nv), 10.0)
    speeds = []
    for (kind, _, by), known in zip(robot.coordinates.places.joints, robot.ranges):
        low, high = known if known and kind != "ball" else (0.0, 1.0 if kind == "slide" else 2.0 * np.pi)
        speeds += [high - low] * (by.stop - by.start)
    mass_matrix, _ = mass_matrix_and_bias(robot.tree, robot.tree.zero, [0.0] * robot.coordinates.nv)
    return np.array([speeds, 10.0 * np.diag(mass_matrix)])
