"""Postures and scenes, as small records: what is held or let go, from where, for how long."""

import dataclasses
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
    """A motion under constant torque."""

    name: str
    posture: str
    torque: str  # "free": none; "hold": TMT's gravity balance at the start, given to both engines
    speed: tuple = (0.0, 0.0, 0.0)  # deg/s at the start
    damping: float = 0.0  # N m s/rad, of every hinge
    gravity: bool = True
    duration: float = 5.0  # s
    judged: float = 5.0  # s, for how long a run must be judged: its band of rounding stays narrow that long

    @property
    def model(self) -> tmt.Tree:
        """The arm with the scene's damping and gravity."""
        gravity = tmt.ARM.gravity if self.gravity else (0.0, 0.0, 0.0)
        return dataclasses.replace(tmt.ARM, damping=(self.damping,) * 3, gravity=gravity)

    @property
    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """Hinge angles and rates at t = 0, rad and rad/s."""
        return posture(self.posture), np.radians(np.array(self.speed, dtype=float))

    def required(self, twin, dt) -> float:
        """For how long a run must be judged, s: with the assignment's coarse step only RK4 is stable that long."""
        return self.judged if twin == "rk4" or dt < 0.01 else min(self.judged, 0.3)

    @property
    def tau(self) -> np.ndarray:
        """Torque at the hinges, N m."""
        return tmt.gravity_balance(posture(self.posture), self.model) if self.torque == "hold" else np.zeros(3)


SCENES = (
    Scene("zero, free", "zero", "free"),
    Scene("ball catch, free", "ball catch", "free"),
    Scene("bent, free", "bent", "free"),
    Scene("ball catch, held", "ball catch", "hold", judged=2.5),  # unstable: rounding grows e^7.5 a second
    Scene("bent, held", "bent", "hold"),
    Scene("bent, damped", "bent", "free", damping=0.5),
    Scene("thrown, no gravity", "bent", "free", speed=(100.0, 200.0, -150.0), gravity=False, judged=4.5),
)
