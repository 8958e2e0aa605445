"""The actuators of a robot.

The law of an actuator is MuJoCo's: force = (g0 + g1 l + g2 ldot) u + b0 + b1 l + b2 ldot, along the length l
of its transmission, with u its control, or its activation. MuJoCo documentation, computation, actuation
model.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

Range = tuple[float, float]  # (low, high)
Posture = str | tuple[float, ...]  # its name, or numbers


@dataclass(frozen=True)
class Actuator:
    """An actuator at a joint, a tendon or another transmission of MuJoCo.

    moment: dl/dq, (nv,), if it is the same at every posture (a hinge, a slide, a fixed tendon), else None:
    then MuJoCo computes it. Forces are N or N m, times the gear.
    """

    name: str
    joint: str  # the first joint on which it acts; "": none
    moment: tuple[float, ...] | None
    gain: tuple[float, ...] = (0.0, 0.0, 0.0)  # g0, g1, g2
    bias: tuple[float, ...] = (0.0, 0.0, 0.0)  # b0, b1, b2
    dynamics: str = "none"  # or integrator, filter, filterexact: then u is the activation
    control_range: Range | None = None
    activation_range: Range | None = None
    off: str = ""  # why it exerts no force; "": it does
    refused: str = ""  # why its law is not supported; "": it is

    @property
    def feeds_back(self) -> bool:
        """Whether its force depends on length or speed."""
        return any(self.gain[1:]) or any(self.bias[1:])

    def balancing(self, length: float) -> float:
        """The u for which a servo has force 0 at this length; other actuators: 0."""
        gain = self.gain[0] + self.gain[1] * length
        return -(self.bias[0] + self.bias[1] * length) / gain if self.bias[1] and gain else 0.0

    def target(self, length: float) -> float:
        """The same, within its range."""
        return self.clamped(self.balancing(length))

    def clamped(self, u: float) -> float:
        """u within the ranges of the control and of the activation."""
        for limits in (self.control_range, self.activation_range if self.dynamics != "none" else None):
            if limits is not None:
                u = min(max(u, limits[0]), limits[1])
        return float(u)

    def force(self, u: float, length: float, speed: float = 0.0) -> float:
        gain = self.gain[0] + self.gain[1] * length + self.gain[2] * speed
        return gain * u + self.bias[0] + self.bias[1] * length + self.bias[2] * speed

    def stiffness(self, u: float) -> float:
        """-d force/dl."""
        return -(self.gain[1] * u + self.bias[1])

    def damping(self, u: float) -> float:
        """-d force/dldot."""
        return -(self.gain[2] * u + self.bias[2])


@dataclass(frozen=True)
class Drive:
    """The actuators of a robot. controls: by posture, u of each actuator in its keyframe, or None."""

    actuators: tuple[Actuator, ...] = ()
    controls: Mapping[str, tuple[float | None, ...]] = field(default_factory=dict)

    @property
    def feeds_back(self) -> bool:
        """Whether an actuator force depends on position or speed; if none does, there is no step limit."""
        return any(each.feeds_back and not (each.off or each.refused) for each in self.actuators)

    def control(self, posture: str, lengths: Sequence[float]) -> np.ndarray:
        """u of each actuator at a posture, within its range: the keyframe's, else the target is the posture.

        lengths: of the transmissions there.
        """
        stated = self.controls.get(posture, (None,) * len(self.actuators))
        controls = []
        for actuator, u, length in zip(self.actuators, stated, lengths):
            controls.append(actuator.target(length) if u is None else actuator.clamped(u))
        return np.array(controls)


class Controller(NamedTuple):
    """Actuators with constant controls: generalized force torque - position_gain @ q - speed_gain @ qd."""

    controls: tuple[float | None, ...]  # u of each actuator; None: left out
    left_out: dict[str, str]  # by name, why
    torque: np.ndarray  # (nv,) N m or N
    position_gain: np.ndarray  # (nv, nv) N m/rad
    speed_gain: np.ndarray  # (nv, nv) N m s/rad


def reason(actuator: Actuator, u: float) -> str:
    """Why an actuator is left out of a Controller; "" if it is not."""
    if actuator.off or actuator.refused:
        return actuator.off or actuator.refused
    if actuator.moment is None:
        return "its moment depends on the posture"
    if not any(actuator.moment):
        return "it moves no joint"
    # with negative stiffness MuJoCo's `discrete` uses another scheme
    return "it pushes away from its target" if actuator.stiffness(u) < 0.0 else ""


def controller(
    drive: Drive, posture: Posture, q: np.ndarray, targets: np.ndarray | float = 0.0
) -> Controller:
    """The controller at a posture: sum of J' ((g0 u + b0) + (g1 u + b1) J q + (g2 u + b2) J qd), l = J q.

    The controls are those of the keyframe, else the targets are the posture. posture: its name, or numbers;
    q: (nv,) rad or m, of a ball any numbers; targets: (nv,) rad or m: the target length of a servo is moved
    by |J| @ targets.
    """
    moved, n = np.broadcast_to(targets, len(q)), len(q)
    moments = [np.array(actuator.moment or (0.0,) * n) for actuator in drive.actuators]
    lengths = [moment @ q for moment in moments]
    stated = drive.control(posture if isinstance(posture, str) else "", lengths)
    torque, position_gain, speed_gain = np.zeros(n), np.zeros((n, n)), np.zeros((n, n))
    controls: dict[str, float | None] = dict.fromkeys(actuator.name for actuator in drive.actuators)
    left_out = {}
    for actuator, moment, u in zip(drive.actuators, moments, stated.tolist()):
        if why := reason(actuator, u):
            left_out[actuator.name] = why
            continue
        by = float(np.abs(moment) @ moved)
        if by and actuator.stiffness(u):
            u = actuator.balancing(actuator.force(u, 0.0) / actuator.stiffness(u) + by)
        controls[actuator.name] = u
        torque += moment * actuator.force(u, 0.0)
        position_gain += np.outer(moment, moment) * actuator.stiffness(u)
        speed_gain += np.outer(moment, moment) * actuator.damping(u)
    return Controller(tuple(controls.values()), left_out, torque, position_gain, speed_gain)
