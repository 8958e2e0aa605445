"""Who integrates: a method of TMT or an integrator of MuJoCo, as one value with one way to run."""

from dataclasses import dataclass

import numpy as np

import tmt
from tmt.methods import METHODS, AdaptiveRungeKutta

from .engine import INTEGRATORS
from .motion import TWINS


@dataclass(frozen=True)
class Party:
    """A method of TMT (engine "TMT") or an integrator of MuJoCo (engine "MuJoCo")."""

    engine: str
    method: str

    @property
    def scheme(self) -> str:
        """The method of tmt that is the same scheme."""
        return TWINS[self.method] if self.engine == "MuJoCo" else self.method

    @property
    def label(self) -> str:
        return f"{self.engine} {self.method}"

    def run(self, mujoco, model, q, qd, tau, dt, steps) -> tuple[np.ndarray, np.ndarray]:
        """q and qd (..., steps + 1, n) under constant torque, NaN from where the run has diverged.

        mujoco: an Engine of the same arm; model: the Tree, whose joint damping (the same on every hinge) both get.
        """
        if self.engine == "TMT":
            return tmt.simulate(q, qd, tau, dt, steps, self.method, model)[1:]
        return mujoco.variant(damping=model.damping[0]).trajectory(q, qd, tau, dt, steps, self.method)[1:]


TMT_METHODS = tuple(name for name, stepping in METHODS.items() if not isinstance(stepping, AdaptiveRungeKutta))
PARTIES = tuple(Party("TMT", name) for name in TMT_METHODS) + tuple(Party("MuJoCo", name) for name in INTEGRATORS)
FEW = tuple(Party("TMT", name) for name in ("rk4", "explicit_euler", "semi_implicit_euler", "implicit_midpoint")) + (
    Party("MuJoCo", "Euler"),
    Party("MuJoCo", "RK4"),
)  # of a quick run


def farthest(q, start) -> float:
    """The largest deviation of any hinge from where it started, rad; inf if the run diverged."""
    away = np.abs(q - start).max()
    return float(away) if np.isfinite(away) else np.inf


def finite(number) -> float | None:
    """A number for a table: None if it is not finite."""
    return float(number) if np.isfinite(number) else None


def value(number) -> float:
    """A number from a table: NaN, which leaves a gap in a figure and fails a check, where there is none."""
    return np.nan if number is None else number
