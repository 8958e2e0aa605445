"""What drives a robot beside gravity and the springs of its joints: actuators, tendons, gravity compensation; plain numbers.

The law of an actuator is MuJoCo's: force = (g0 + g1 l + g2 ldot) u + b0 + b1 l + b2 ldot, along the length l of its transmission,
with u its control, or its activation. MuJoCo documentation, computation, actuation model.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

ON_EDGE = 1e-9  # m or rad: so near the end of a dead band a tendon is on its edge


@dataclass(frozen=True)
class Actuator:
    """One actuator, at a joint, a tendon, or whatever MuJoCo knows the length of.

    moment: what its force is multiplied with, (nv,), where that is dl/dq and the same at every posture (a joint of one number, a
    fixed tendon), else None: then both are asked of MuJoCo. Forces are N or N m, times the gear.
    """

    name: str
    joint: str  # at which it acts, the first of several; "": at none
    moment: tuple | None
    gain: tuple = (0.0, 0.0, 0.0)  # g0, g1, g2
    bias: tuple = (0.0, 0.0, 0.0)  # b0, b1, b2
    dynamics: str = "none"  # or integrator, filter, filterexact: then u is the activation, else the control
    time_constant: float = 0.0  # s, of a filter
    control_range: tuple | None = None  # (low, high)
    activation_range: tuple | None = None
    force_range: tuple | None = None  # N or N m
    tendon: int = -1  # along which it pulls, by its number in the model; -1: none
    off: str = ""  # why it exerts nothing; "": it does
    refused: str = ""  # why its law is not known here; "": it is

    @property
    def acts(self) -> bool:
        """Whether it exerts a force that is known."""
        return not (self.off or self.refused)

    @property
    def is_servo(self) -> bool:
        """Whether its force depends on the length: it has a target."""
        return self.acts and bool(self.bias[1] or self.gain[1])

    @property
    def holds_speed(self) -> bool:
        """Whether its control is a speed that it holds: one number is its gain of both."""
        return self.gain[0] == -self.bias[2] != 0.0 and not any((*self.gain[1:], *self.bias[:2]))

    def target(self, length: float) -> float:
        """The u at which a servo is without force at a length, in its range; of any other actuator 0, in its range."""
        gain = self.gain[0] + self.gain[1] * length
        wanted = -(self.bias[0] + self.bias[1] * length) / gain if self.bias[1] and gain else 0.0
        return self.clamped(wanted)

    def clamped(self, u: float) -> float:
        """The u that acts, by the range of the control, and of the activation."""
        for limits in (self.control_range, self.activation_range if self.dynamics != "none" else None):
            u = u if limits is None else min(max(u, limits[0]), limits[1])
        return float(u)

    def force(self, u: float, length: float) -> float:
        """At rest, before the force range cuts it."""
        return (self.gain[0] + self.gain[1] * length) * u + self.bias[0] + self.bias[1] * length

    def largest(self, u: float, length: float) -> float:
        """Of what the force is summed from: rounding is relative to it."""
        return max(abs(self.gain[0] * u), abs(self.gain[1] * length * u), abs(self.bias[0]), abs(self.bias[1] * length))

    def stiffness(self, u: float) -> float:
        """-d force/dl."""
        return -(self.gain[1] * u + self.bias[1])

    def damping(self, u: float) -> float:
        """-d force/dldot."""
        return -(self.gain[2] * u + self.bias[2])

    def is_cut(self, force: float) -> bool:
        """Whether the force range cuts a force: then it depends on nothing."""
        return self.force_range is not None and not self.force_range[0] < force < self.force_range[1]


@dataclass(frozen=True)
class Cut:
    """What ranges cut at a posture: it stays what it is there, N or N m."""

    forces: Mapping[int, float]  # of actuators by number
    sums: Mapping[int, float]  # of all actuators at a speed, by its number


UNCUT = Cut({}, {})


class Tendon(NamedTuple):
    """A tendon that pulls by itself: a spring that is without force from `low` to `high`, and a damper."""

    name: str
    number: int  # in the model
    moment: tuple | None  # (nv,), as an Actuator's
    stiffness: float  # N/m, or as its length is measured
    damping: float
    low: float
    high: float

    def force(self, length: float) -> float:
        return self.stiffness * (min(self.high - length, 0.0) + max(self.low - length, 0.0))

    def largest(self, length: float) -> float:
        """Of what the force is summed from."""
        return self.stiffness * max(abs(length), abs(self.low), abs(self.high)) if self.pulls(length) else 0.0

    def pulls(self, length: float) -> bool:
        """Whether its spring does something at a length; on the edge of its dead band it does, to one side."""
        return not self.low + ON_EDGE < length < self.high - ON_EDGE


class Rows(NamedTuple):
    """c constraints of MuJoCo near a posture at rest, J qdd + R f = aref, aref = -damping J qd - stiffness r + that at rest.

    jacobian: J (c, nv); forces: f at rest, (c,) N m or N, of which J' f acts on the speeds; damping (c,), 1/s; stiffness (c,),
    1/s2, of a further violation r, with what the change of R does to f; softness: R (c,); limits: the joints of the model at
    whose limits some of the rows are.
    """

    jacobian: np.ndarray
    forces: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    softness: np.ndarray
    limits: tuple[int, ...] = ()

    @property
    def springs(self) -> np.ndarray:
        """J' (-df/dr) J, (nv, nv): at rest they are springs."""
        return (self.jacobian.T * (self.stiffness / self.softness)) @ self.jacobian


@dataclass(frozen=True)
class Drive:
    """All that drives a robot, see Actuator and Tendon.

    controls: by the name of a posture what its keyframe states: u of each actuator, or None. compensation: of each body of the
    Tree, what part of its weight is taken away; lifted: the speeds at which that is an actuator's force, unlifted: at which it is
    left out. damping: of each speed, by the actuators themselves. ranges: of the sum of the actuators' forces at a speed, and
    tendon_ranges: along a tendon, (low, high) by number. unknown: what else acts and is left out, and why, by name.
    """

    actuators: tuple[Actuator, ...] = ()
    tendons: tuple[Tendon, ...] = ()
    compensation: tuple[float, ...] = ()
    damping: tuple[float, ...] = ()
    controls: Mapping[str, tuple] = field(default_factory=dict)
    ranges: Mapping[int, tuple] = field(default_factory=dict)
    tendon_ranges: Mapping[int, tuple] = field(default_factory=dict)
    lifted: tuple[int, ...] = ()
    unlifted: tuple[int, ...] = ()
    unknown: Mapping[str, str] = field(default_factory=dict)
    # the file's solver is PGS, with which MuJoCo's discrete has springs and damping of joints implicit and no more (measured)
    joints_alone: bool = False
    explicit_damping: bool = False  # the file switches off that Euler has the damping of joints implicit

    @property
    def refused(self) -> dict[str, str]:
        """What is left out, by name, and why."""
        return {one.name: one.refused for one in self.actuators if one.refused} | dict(self.unknown)

    @property
    def feeds_back(self) -> bool:
        """Whether an actuator's force depends on position or speed; motors alone have no step of their own."""
        return any(one.acts and any((*one.bias[1:], *one.gain[1:])) for one in self.actuators)

    @property
    def servos(self) -> tuple[Actuator, ...]:
        """The actuators that have a target."""
        return tuple(one for one in self.actuators if one.is_servo)

    @property
    def without_ranges(self) -> "Drive":
        """With forces of any size."""
        actuators = tuple(replace(one, force_range=None) for one in self.actuators)
        return replace(self, actuators=actuators, ranges={}, tendon_ranges={})

    def control(self, posture: str, lengths: Sequence[float]) -> np.ndarray:
        """u of each actuator at a posture: what its keyframe states, else the targets that are the posture; in their ranges.

        lengths: of the transmissions there.
        """
        stated = self.controls.get(posture, (None,) * len(self.actuators))
        return np.array(
            [
                one.target(length) if u is None else one.clamped(u)
                for one, u, length in zip(self.actuators, stated, lengths)
            ]
        )
