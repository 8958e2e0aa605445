"""The states at which engines are compared: the named postures, and random ones."""

from functools import cached_property

import numpy as np

from tmt.equations.composite import (
    mass_matrix_and_bias,  # the sum over bodies would take minutes for hundreds of joints
)
from tmt.exact.values import exact

from . import Robot
from .case import SEED

SECONDS_OF_EXACT = 5.0  # of all exact values of a report, about
SHOWN_NUMBERS = 8  # of a position, in a sentence
MOST_NUMBERS = 2_000_000  # in T_b of all random states together


class Sample:
    """States at which engines are compared, with the exact values of the first `exact_states`.

    tree: the stated numbers. q: (states, nq), qd, tau: (states, nv), rad, rad/s, N m. states: their names, if they have any.
    notes: sentences on what is left out.
    """

    def __init__(self, tree, name, q, qd, tau, exact_states, states=(), notes=()):
        self.tree, self.name, self.q, self.qd, self.tau = tree, name, q, qd, tau
        self.exact_states, self.states, self.notes = exact_states, states, notes

    @cached_property
    def truths(self) -> list:
        """A tmt.exact.values.Truth for each of the first states."""
        known = slice(self.exact_states)
        return [exact(self.tree, *state) for state in zip(self.q[known], self.qd[known], self.tau[known])]

    def truth(self, quantity: str) -> np.ndarray:
        """One of its fields, of mpmath numbers: (exact_states, ...)."""
        return np.array([getattr(truth, quantity) for truth in self.truths])

    def describe(self, i: int) -> str:
        """Where state i is, for a reader who wants to see it again."""
        if self.states:
            return self.states[i]
        if len(self.q[i]) > SHOWN_NUMBERS:  # all of them are in the table
            return f"state {i}"
        unit = " rad" if set(self.tree.kind) == {"hinge"} else ""
        return f"state {i}: q = ({', '.join(f'{a:.4f}' for a in self.q[i])}){unit}"

    def first(self, count: int) -> "Sample":
        """Its first states."""
        if count >= len(self.q):
            return self
        return Sample(self.tree, self.name, *(a[:count] for a in (self.q, self.qd, self.tau)), 0, self.states[:count])

    def each(self) -> list["Sample"]:
        """One sample for each state, by its own name."""
        singles = []
        for i, name in enumerate(self.states):
            known = int(i < self.exact_states)
            single = Sample(self.tree, name, *(a[i : i + 1] for a in (self.q, self.qd, self.tau)), known, (name,))
            single.truths = self.truths[i : i + 1]
            singles.append(single)
        return singles


def named(robot: Robot) -> Sample:
    """The named postures, or the reference if there are none; with random speeds and torques where those are asked for."""
    rng, q = np.random.default_rng([SEED, 1]), np.array(list(robot.poses.values()))
    most = largest_speeds_and_torques(robot)[:, None]
    speeds, torques = rng.uniform(-most, most, (2, len(q), robot.coordinates.nv))
    name = "named postures" if robot.postures or robot.positions else "a posture"
    known, notes = of_named(robot), ()
    if known < len(q):
        notes = (
            f"Exact values are known of {known} of the {len(q)} {name}: one of them takes about {seconds(robot):.1g} s.",
        )
    return Sample(robot.tree, name, q, speeds, torques, known, tuple(robot.poses), notes)


def random(robot: Robot, states: int, exact_states: int, seed: int = SEED) -> Sample:
    """Random states: positions within the joints' ranges, speeds and torques within `largest_speeds_and_torques`."""
    rng, asked, exact_asked = np.random.default_rng(seed), states, exact_states
    states = min(asked, max(1, MOST_NUMBERS // (3 * len(robot.tree.mass) * robot.coordinates.nv)))
    exact_states = min(exact_asked, states, affordable(robot) - of_named(robot))
    notes = [f"{states:,} random states in place of {asked:,}: so many bodies and joints take long."] * (states < asked)
    if exact_states < min(exact_asked, states):
        left = f"{exact_states} random states in place of {exact_asked}"
        notes.append(f"Exact values are known of {left}: one takes about {seconds(robot):.1g} s.")
    q = robot.coordinates.random(rng, states, robot.ranges)
    most = largest_speeds_and_torques(robot)[:, None]
    speeds, torques = rng.uniform(-most, most, (2, states, robot.coordinates.nv))
    return Sample(robot.tree, "random states", q, speeds, torques, exact_states, notes=tuple(notes))


def seconds(robot: Robot) -> float:
    """What one exact state takes, s, about: of 3 to 35 speeds it was within a third of this."""
    return 3e-3 + 3.4e-5 * robot.coordinates.nv**2 * len(robot.tree.mass)


def affordable(robot: Robot) -> int:
    """How many exact states there are time for."""
    return int(SECONDS_OF_EXACT / seconds(robot))


def of_named(robot: Robot) -> int:
    """How many of the named postures have exact values: all, or as many as half of the time allows."""
    return min(len(robot.poses), affordable(robot) // 2)


def largest_speeds_and_torques(robot: Robot) -> np.ndarray:
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
