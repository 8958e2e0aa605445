"""Small deviations of a motion: the product of the derivatives of the steps along a run, beside that of finer steps."""

from typing import NamedTuple

import mujoco
import numpy as np

from ..engines.mujoco.step import Step

RUN_FOR = 4.0  # s: of the run that may break off
LASTS, LEAST_STEPS, MOST_STEPS = 0.5, 20, 500  # s: of the deviations, and between which numbers of steps
FINER = 8  # fold: of the steps that stand for the exact motion
FASTER = 1.5  # fold, and by at least FASTER_BY, 1/s: by the step alone
FASTER_BY = 1.0


class Motion(NamedTuple):
    """How fast deviations of a motion grow, 1/s, by its step and by fine steps, within `lasts`, s.

    failed_at: s, when a run of 4 s breaks off; None: it does not.
    """

    rate: float
    exact_rate: float
    lasts: float
    failed_at: float | None

    @property
    def is_stable(self) -> bool:
        return self.failed_at is None and self.rate <= max(
            FASTER * self.exact_rate, self.exact_rate + FASTER_BY
        )


def motion(model: mujoco.MjModel, state: np.ndarray, dt: float, integrator: str) -> Motion:
    """The growth along the run from a state with its speeds."""
    step, count = Step(model, dt, integrator), round(RUN_FOR / dt)
    lasted = sum(1 for _ in step.run(state, count))
    steps = min(int(np.clip(LASTS / dt, LEAST_STEPS, MOST_STEPS)), lasted)
    rate, exact = (
        growth_along(step, state, steps),
        growth_along(Step(model, dt / FINER, "RK4"), state, FINER * steps),
    )
    return Motion(rate, exact, steps * dt, lasted * dt if lasted < count else None)


def growth_along(step: Step, state: np.ndarray, steps: int) -> float:
    """The logarithm of the largest stretching of a deviation over the time of a run, 1/s.

    The product is scaled after each step, so that it stays a number.
    """
    product, logarithm = np.eye(step.size), 0.0
    for _ in range(steps):
        product = step.derivative(state) @ product
        size = float(np.linalg.norm(product, 2))
        if not np.isfinite(size):
            return np.inf
        product, logarithm = product / size, logarithm + float(np.log(size))
        state = step.next(state)
    return logarithm / (max(steps, 1) * step.dt)
