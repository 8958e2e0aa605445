"""Small deviations of a motion: the product of the derivatives of the steps along a run, beside that of finer steps."""

from dataclasses import dataclass

import numpy as np

from ..core.rows import Row, column
from ..engines.mujoco.step import Step
from .place import Place

RUN_FOR = 4.0  # s: of the run that may break off
LASTS, LEAST_STEPS, MOST_STEPS = 0.5, 20, 500  # s: of the deviations, and between which numbers of steps
FINER = 8  # fold: of the steps that stand for the exact motion
MOST_RATE = 700.0  # 1/s: so that a factor remains a number
FASTER, FASTER_BY = 1.5, 1.0  # fold, and by at least, 1/s: by the step alone


@dataclass(kw_only=True)
class MotionRow(Row):
    """How deviations grow along the run from a posture with its speeds, within `lasts`: motion_stability.csv.

    rate, exact_rate: by its step and by fine steps. failed_at: when a run of 4 s breaks off; None: it does not.
    """

    posture: str
    integrator: str
    dt: float = column("s", digits=4)
    rate: float = column("per_s")
    exact_rate: float = column("per_s")
    lasts: float = column("s")
    failed_at: float | None = column("s")
    passed: bool

    @property
    def factor(self) -> float:
        """By which a deviation grows in a second."""
        return float(np.exp(min(self.rate, MOST_RATE)))

    @property
    def exact_factor(self) -> float:
        return float(np.exp(min(self.exact_rate, MOST_RATE)))


def motion(place: Place, dt: float, integrator: str) -> MotionRow:
    """The growth along the run from a place's start with its speeds."""
    step, count = Step(place.model, dt, integrator), round(RUN_FOR / dt)
    lasted = sum(1 for _ in step.run(place.start, count))
    steps = min(int(np.clip(LASTS / dt, LEAST_STEPS, MOST_STEPS)), lasted)
    rate = growth_along(step, place.start, steps)
    exact = growth_along(Step(place.model, dt / FINER, "RK4"), place.start, FINER * steps)
    return MotionRow(
        posture=place.posture.name, integrator=integrator, dt=dt, rate=rate, exact_rate=exact, lasts=steps * dt,
        failed_at=lasted * dt if lasted < count else None,
        passed=lasted == count and rate <= max(FASTER * exact, exact + FASTER_BY),
    )  # fmt: skip


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
