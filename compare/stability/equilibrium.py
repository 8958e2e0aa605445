"""The arm's equations of motion linearized about a posture that is held: its modes, and one step of a method there."""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

import tmt

from ..engines import Engine, Method, Motion
from ..robots import Robot
from ..robots.case import Case

LEAST, EXPLICIT, LONGEST_STEP = 0.01, 10.0, 1e3  # times the fastest rate, what explicit methods bear; s
SCANS, SCANNED = 6, 121  # for a limit, each between two steps of the last; steps
NEUTRAL = 1e-9  # growth in a step that can be rounding
NEGLIGIBLE = 1e-6  # relative to the fastest mode: a rate below is zero


class Equilibrium:
    """A posture at rest under its holding torque.

    matrix: d(qd, qdd)/d(q, qd), (2n, 2n). rates: its eigenvalues, 1/s, the largest real part first; vectors:
    their eigenvectors in columns, and shapes with a largest angle of 1 rad. small: below this a rate is zero,
    1/s.
    """

    def __init__(self, case: Case) -> None:
        self.case, self.tree, self.q, self.tau = case, case.tree, case.q, case.tau
        self.nv, self.name = len(case.tau), str(case.scene.posture)
        self.damping = float(np.max(case.scene.damping))  # added to all joints, N m s/rad
        self.mass_matrix = tmt.mass_matrix(self.tree, self.q)
        by = tmt.derivatives(self.tree, self.q, np.zeros(self.nv), self.tau)
        above = np.eye(2 * self.nv)[self.nv :]
        self.matrix = np.vstack([above, np.hstack([by.dqdd_dq, by.dqdd_dqd])])
        values, vectors = np.linalg.eig(self.matrix)
        values, vectors = values.astype(complex), vectors.astype(complex)
        order = np.lexsort([-values.imag, -np.abs(values.imag), -values.real.round(9)])
        self.rates, self.vectors = values[order], vectors[:, order]
        largest_angles = np.argmax(np.abs(self.vectors[: self.nv]), axis=0)
        self.shapes = self.vectors / self.vectors[largest_angles, np.arange(2 * self.nv)]
        self.fastest = float(np.abs(self.rates).max())
        self.small = NEGLIGIBLE * self.fastest

    @property
    def kind(self) -> str:
        """saddle: a mode grows; marginal: a mode has the rate zero; centre: all modes swing or decay."""
        if self.rates[0].real > self.small:
            return "saddle"
        return "marginal" if np.abs(self.rates).min() <= self.small else "centre"

    def run(
        self, method: Method, engines: Mapping[str, Engine], tau: np.ndarray, dt: float, steps: int,
        moved: np.ndarray | float = 0.0, v: np.ndarray | float = 0.0,
    ) -> Motion:  # fmt: skip
        """A run of a method from angles near the posture under constant torques, (..., n), at rest by default."""
        q, v = (np.broadcast_to(values, tau.shape) for values in (self.q + moved, v))
        with np.errstate(over="ignore", invalid="ignore"):
            return engines[method.engine].of(self.case).run(q, v, tau, dt, steps, method.name)

    def step(self, name: str, dt: np.ndarray | float) -> np.ndarray:
        """The amplification of a step of a method of tmt, (..., 2n, 2n); dt: s, (...)."""
        q, qd, tau = (np.broadcast_to(x, (*np.shape(dt), self.nv)) for x in (self.q, 0.0, self.tau))
        return tmt.step_derivatives(self.tree, q, qd, tau, dt, name)[0]

    def growth(self, name: str, dt: np.ndarray | float) -> np.ndarray:
        """The spectral radius of `step`, (...)."""
        return np.asarray(np.abs(np.linalg.eigvals(self.step(name, dt))).max(axis=-1))

    def limit(self, name: str) -> tuple[str, float | None]:
        """("finite", dt in s), ("never_fails", None) or ("always_fails", None): the first step with growth, by scans."""
        low, high = LEAST / self.fastest, EXPLICIT / self.fastest
        if (self.growth(name, np.geomspace(low, high, SCANNED)) <= 1.0 + NEUTRAL).all():
            low, high = high, LONGEST_STEP
        for _ in range(SCANS):
            steps = np.geomspace(low, high, SCANNED)
            fails = self.growth(name, steps) > 1.0 + NEUTRAL
            if fails[0] or not fails.any():
                return ("always_fails" if fails[0] else "never_fails"), None
            first = int(np.argmax(fails))
            low, high = steps[first - 1], steps[first]
        return "finite", float(low)

    def growing_rate(self, name: str, dt: float) -> float:
        """The rate |lambda|, 1/s, of the mode nearest to the one that a step lets grow fastest."""
        factors, growing = np.linalg.eig(self.step(name, dt))
        shape = growing[: self.nv, np.argmax(np.abs(factors))]
        angles = self.shapes[: self.nv] / np.linalg.norm(self.shapes[: self.nv], axis=0)
        overlap = np.abs(angles.conj().T @ shape) / np.linalg.norm(shape)
        return float(np.abs(self.rates[overlap > overlap.max() - 1e-6]).max())


@lru_cache(maxsize=64)
def equilibrium(robot: Robot, posture: str, damping: float = 0.0) -> Equilibrium:
    """A named posture under TMT's holding torque, with added damping, N m s/rad."""
    return Equilibrium(robot.case(f"{posture}, held", posture=posture, torque="hold", damping=damping))
