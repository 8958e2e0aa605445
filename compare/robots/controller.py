"""A robot's own actuators under constant controls, as the linear controller that a Tree has.

With the moment J of an actuator, its length l = J q and its law as in actuators.py, its torque is
J' ((g0 u + b0) + (g1 u + b1) J q + (g2 u + b2) J qd).
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .actuators import Actuator, Drive


class Controller(NamedTuple):
    """What acts: torque - position_gain @ q - speed_gain @ qd, q and qd of nv speeds each."""

    controls: tuple  # u of each of the robot's actuators; None: it is left out
    left_out: dict  # why, by name
    torque: np.ndarray  # (nv,) N m or N
    position_gain: np.ndarray  # (nv, nv) N m/rad
    speed_gain: np.ndarray  # (nv, nv) N m s/rad


def reason(actuator: Actuator, u: float) -> str:
    """Why an actuator takes no part under a control; "" if it does.

    One that pushes away from its target is left out, as MuJoCo's `discrete` then has another scheme.
    """
    known = actuator.off or actuator.refused
    if not known and actuator.moment is None:
        return "its lever turns with the posture"
    if not known and not any(actuator.moment):
        return "it moves nothing"
    return known or ("it pushes away from its target" if actuator.stiffness(u) < 0.0 else "")


def controller(drive: Drive, posture: object, q: np.ndarray, targets: np.ndarray | float = 0.0) -> Controller:
    """The controller at a posture, by what its keyframe states or by targets that are the posture.

    posture: its name, or the numbers of one without a name; q: (nv,) rad or m, of a ball anything; targets: (nv,) rad or m,
    by how much the servos' targets are moved: the length of each by the sum of |J| times that.
    """
    moved, n = np.broadcast_to(targets, len(q)), len(q)
    moments = [np.zeros(n) if one.moment is None else np.array(one.moment) for one in drive.actuators]
    stated = drive.control(posture if isinstance(posture, str) else "", [moment @ q for moment in moments])
    torque, position_gain, speed_gain, found = np.zeros(n), np.zeros((n, n)), np.zeros((n, n)), {}
    for one, moment, u in zip(drive.actuators, moments, stated):
        found[one.name] = None, reason(one, u)
        if found[one.name][1]:
            continue
        u = moved_target(one, float(u), float(np.abs(moment) @ moved))
        found[one.name] = u, ""
        torque += moment * one.force(u, 0.0)
        position_gain += np.outer(moment, moment) * one.stiffness(u)
        speed_gain += np.outer(moment, moment) * one.damping(u)
    controls, left_out = tuple(u for u, _ in found.values()), {name: why for name, (_, why) in found.items() if why}
    return Controller(controls, left_out, torque, position_gain, speed_gain)


def moved_target(one: Actuator, u: float, by: float) -> float:
    """The control at which a servo is without force at a length so much farther; of any other actuator u."""
    stiffness = one.stiffness(u)
    if not (by and stiffness):
        return u
    unlimited = replace(one, control_range=None, activation_range=None)
    return unlimited.target(one.force(u, 0.0) / stiffness + by)
