"""The actuators of a robot under constant controls, as they act near a posture."""

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np

Posture = str | tuple[float, ...]  # its name, or numbers


class Controller(NamedTuple):
    """Actuators with constant controls: generalized force torque - position_gain @ q - speed_gain @ qd.

    Of a ball q may be any numbers: no position gain acts on it.
    """

    controls: tuple[float | None, ...]  # of each actuator, of an integrator its activation; None: left out
    left_out: tuple[str, ...]  # the names of actuators that have no such law
    torque: np.ndarray  # (nv,) N m or N
    position_gain: np.ndarray  # (nv, nv) N m/rad
    speed_gain: np.ndarray  # (nv, nv) N m s/rad


class Drive(Protocol):
    """The actuators of a robot, whose forces an engine measures."""

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def laws(self) -> Mapping[str, tuple[str, tuple[float, ...]]]:
        """Of each actuator by name: the first joint on which it acts, or "", and its numbers in the file."""

    @property
    def feeds_back(self) -> bool:
        """Whether the force of one that a Controller may have depends on positions or speeds."""

    def called(self, postures: Mapping[str, str]) -> "Drive":
        """The same with other names of the postures for which the file states controls."""

    def controller(self, posture: Posture, q: np.ndarray, targets: np.ndarray | float = 0.0) -> Controller:
        """The controller at a posture, by its name or numbers, q (nq,) rad, m and quaternions.

        Controls are those of the keyframe, else servos hold the posture. targets: (nv,) rad or m, by which
        the targets of the joints are moved.
        """
