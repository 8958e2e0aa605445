"""Postures and scenes, as small records: what is held or let go, from where, for how long."""

from dataclasses import dataclass

import numpy as np

import tmt

POSTURES = {  # deg, (alpha, beta, gamma); the assignment's named postures
    "zero": (0, 0, 0),
    "hanging": (0, 0, 90),
    "upright": (180, 0, 90),
    "ball catch": (-70, 70, -30),
    "bent": (30, 20, 60),
}


def posture(name) -> np.ndarray:
    """Hinge angles of a named posture, rad, shape (3,)."""
    return np.radians(np.array(POSTURES[name], dtype=float))


@dataclass(frozen=True)
class Scene:
    """A motion from rest under constant torque."""

    name: str
    posture: str
    torque: str  # "free": none; "hold": TMT's gravity balance at the start, given to both engines
    duration: float = 5.0  # s
    judged: float = 5.0  # s, for how long the band of rounding must stay narrow enough to judge by

    @property
    def start(self) -> np.ndarray:
        """Hinge angles at t = 0, rad."""
        return posture(self.posture)

    @property
    def tau(self) -> np.ndarray:
        """Torque at the hinges, N m."""
        return tmt.gravity_balance(self.start) if self.torque == "hold" else np.zeros(3)


SCENES = (
    Scene("zero, free", "zero", "free"),
    Scene("ball catch, free", "ball catch", "free"),
    Scene("bent, free", "bent", "free"),
    Scene("ball catch, held", "ball catch", "hold", judged=2.5),  # unstable: rounding grows e^7.5 a second
    Scene("bent, held", "bent", "hold"),
)
