"""The states at which engines are compared: named postures and random states."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

import tmt
from tmt.derivation.composite import mass_matrix_and_bias  # literal takes minutes for hundreds of joints
from tmt.model import singular

from ..core.finding import Finding
from .case import SEED, Robot

if TYPE_CHECKING:
    from tmt.exact.many import Pairs

MOST_SPEEDS = 120  # of a robot that has exact values
SHOWN_NUMBERS = 8  # maximum size of q in a sentence
MOST_NUMBERS = 2_000_000  # maximum size of T_b of all random states


@dataclass(eq=False)
class Sample:
    """States q (states, nq), qd, tau (states, nv), with exact values for the first `exact_states`."""

    tree: tmt.Tree
    name: str
    q: np.ndarray
    qd: np.ndarray
    tau: np.ndarray
    exact_states: int
    states: tuple[str, ...] = ()  # their names, if they have any
    notes: tuple[Finding, ...] = ()  # about what is left out
    # as far as they were asked for
    exact_values: dict[str, "Pairs"] = field(default_factory=dict, repr=False)

    def exact(self, function: str, part: int | None = None) -> "Pairs":
        """The exact values of a function of tmt, or of one of its arrays, at the first states."""
        from tmt.exact.many import exact_of_many  # loads the compiler

        if function not in self.exact_values:
            states = (values[: self.exact_states] for values in (self.q, self.qd, self.tau))
            self.exact_values[function] = exact_of_many(self.tree, function, *states)
        return self.exact_values[function].part(part)

    def describe(self, i: int) -> str:
        """The name of state i, or its q."""
        if self.states:
            return self.states[i]
        if len(self.q[i]) > SHOWN_NUMBERS:
            return f"state {i}"
        unit = " rad" if set(self.tree.kind) == {"hinge"} else ""
        return f"state {i}: q = ({', '.join(f'{a:.4f}' for a in self.q[i])}){unit}"

    def first(self, count: int) -> "Sample":
        """The first states, without exact values."""
        return self if count >= len(self.q) else self.part(np.arange(count), 0)

    def part(self, places: np.ndarray, exact_states: int) -> "Sample":
        """The states with these numbers, the first of which have exact values."""
        q, qd, tau = self.q[places], self.qd[places], self.tau[places]
        names = tuple(self.states[k] for k in places) if self.states else ()
        return Sample(self.tree, self.name, q, qd, tau, exact_states, names, self.notes)


def singular_positions(tree: tmt.Tree, q: np.ndarray) -> tuple[np.ndarray, str]:
    """At which of these positions (N, nq) Mbar is singular, and which joints move no mass at the first of them."""
    if tree.never_singular:
        return np.zeros(len(q), bool), ""
    moving = singular.found(tree, singular.mass_matrices(tree, q))
    at = np.asarray(moving.any(axis=1))
    return at, singular.reason(tree, moving[np.argmax(at)]) if at.any() else ""


def named(robot: Robot) -> Sample:
    """The named postures, or all joints at zero, with random speeds and torques."""
    rng, q = np.random.default_rng([SEED, 1]), np.array(list(robot.poses.values()))
    most = largest_speeds_and_torques(robot)[:, None]
    speeds, torques = rng.uniform(-most, most, (2, len(q), robot.coordinates.nv))
    name = "named postures" if robot.postures else "a posture"
    exact_states = len(q) if robot.coordinates.nv <= MOST_SPEEDS else 0
    return Sample(robot.tree, name, q, speeds, torques, exact_states, tuple(robot.poses))


def random(robot: Robot, states: int, exact_states: int, seed: int = SEED) -> Sample:
    """Random states within the ranges, see `largest_speeds_and_torques`; large robots have fewer."""
    rng, wanted, nv = np.random.default_rng(seed), states, robot.coordinates.nv
    states = min(wanted, max(1, MOST_NUMBERS // (3 * len(robot.tree.mass) * nv)))
    notes = []
    if states < wanted:
        values = {"count": states, "states": wanted, "seconds": None}
        notes.append(Finding("shared", "fewer_states", values))
    if nv > MOST_SPEEDS:
        exact_states = 0
        notes.append(Finding("shared", "no_exact_values", {"speeds": nv, "most": MOST_SPEEDS}))
    q = robot.coordinates.random(rng, states, robot.ranges)
    most = largest_speeds_and_torques(robot)[:, None]
    speeds, torques = rng.uniform(-most, most, (2, states, nv))
    exact_states = min(exact_states, states)
    return Sample(robot.tree, "random states", q, speeds, torques, exact_states, notes=tuple(notes))


def largest_speeds_and_torques(robot: Robot) -> np.ndarray:
    """The largest random speeds, rad/s, and torques, N m, (2, nv): 10 each for a robot without ranges.

    Else a speed passes the range of its joint in 1 s (a turn, 1 m without range), and a torque gives the
    joint 10 rad/s2 at q = 0 if the others are locked.
    """
    if not robot.ranges:
        return np.full((2, robot.coordinates.nv), 10.0)
    speeds: list[float] = []
    for joint, limits in zip(robot.coordinates.places.joints, robot.ranges):
        low, high = 0.0, 1.0 if joint.kind == "slide" else 2.0 * np.pi
        if limits and joint.kind != "ball":
            low, high = limits
        speeds += [high - low] * (joint.qd.stop - joint.qd.start)
    mass_matrix, _ = mass_matrix_and_bias(robot.tree, robot.tree.zero, [0.0] * robot.coordinates.nv)
    return np.array([speeds, 10.0 * np.diag(mass_matrix)])
