"""The equations of motion linearized about a posture that is held: its modes, and one step of a method there."""

from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg import eig

import tmt

from ..robots import Robot
from ..robots.case import SEED, Case
from ..robots.coordinates import floats

LONGEST_STEP = 1e3  # s, to which a limit is sought
LEAST, EXPLICIT, SCANNED = (
    0.01,
    10.0,
    121,
)  # times the fastest rate: where it begins, what explicit methods bear; steps
NEUTRAL = 1e-9  # growth in a step that can be rounding
NEGLIGIBLE = 1e-6  # relative to the fastest mode: a rate below is zero
SLOWEST = 1e-6  # 1/s: a rate below is zero
AT_ONE = (1e-7, 1e-3)  # least and largest distance from 1 of the growth of a mode without stiffness
MOVED = 1e-3  # rad or m: of the second difference of the holding torque


class Equilibrium:
    """A posture at rest under its holding torque."""

    def __init__(self, case: Case) -> None:
        self.case, self.tree, self.q, self.tau = case, case.tree, case.q, case.tau
        self.nv, self.name = len(case.tau), str(case.scene.posture)
        self.damping = float(np.max(case.scene.damping))  # added to all joints, N m s/rad
        self.mass_matrix = tmt.mass_matrix(self.tree, self.q)

    def moved(self, by: np.ndarray) -> np.ndarray:
        """The positions after movements from the posture, (..., nv) -> (..., nq)."""
        return self.case.coordinates.move(self.q, by)

    @property
    def sizes(self) -> np.ndarray:
        """The numbers whose last digit limits the accuracy of movements, (nv,): q, and 1 for a quaternion."""
        joints = self.tree.coordinates.joints
        return np.concatenate([np.ones(3) if kind == "ball" else self.q[q] for kind, q, _ in joints])

    @cached_property
    def matrix(self) -> np.ndarray:
        """d(qd, qdd)/d(movement, qd), (2nv, 2nv)."""
        by = tmt.derivatives(self.tree, self.q, np.zeros(self.nv), self.tau)
        above = np.eye(2 * self.nv)[self.nv :]
        return np.vstack([above, np.hstack([by.dqdd_dq, by.dqdd_dqd])])

    @cached_property
    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues, 1/s, of `matrix`, the largest real part first, and their eigenvectors in columns."""
        values, vectors = np.linalg.eig(self.matrix)
        values, vectors = values.astype(complex), vectors.astype(complex)
        order = np.lexsort([-values.imag, -np.abs(values.imag), -values.real.round(9)])
        return values[order], vectors[:, order]

    @property
    def small(self) -> float:
        """Below this a rate is zero, 1/s."""
        return max(NEGLIGIBLE * np.abs(self.modes[0]).max(), SLOWEST)

    @property
    def without_stiffness(self) -> np.ndarray:
        """Which eigenvalues are zero, (2nv,)."""
        return np.abs(self.modes[0]) <= self.small

    @property
    def shapes(self) -> np.ndarray:
        """The modes with a rate, (2nv, modes), each with a largest angle of 1 rad."""
        vectors = self.modes[1][:, ~self.without_stiffness]
        return vectors / vectors[np.argmax(np.abs(vectors[: self.nv]), axis=0), np.arange(vectors.shape[1])]

    @cached_property
    def measures(self) -> np.ndarray:
        """Left eigenvectors: measures @ deviation (2nv,) is the share of each mode with a rate, as in `shapes`."""
        if not self.without_stiffness.any():
            return np.linalg.inv(self.shapes)
        # modes without a rate may have a common eigenvector, and have no measure
        values, left = eig(self.matrix, left=True, right=False)
        left = left[:, np.abs(values) > self.small].conj().T
        return np.linalg.solve(left @ self.shapes, left)

    @property
    def kind(self) -> str:
        """saddle: a mode grows; marginal: a mode has the rate zero; centre: all modes swing or decay."""
        if self.modes[0].real.max() > self.small:
            return "saddle"
        return "marginal" if self.without_stiffness.any() else "centre"

    @cached_property
    def stays(self) -> bool:
        """Whether a small deviation stays small: no mode grows, no torque acts along movements without stiffness.

        That torque is of second order: its second difference along such a movement.
        """
        if self.kind != "marginal":
            return self.kind == "centre"
        by_movement = self.matrix[self.nv :, : self.nv]
        _, sizes, rows = np.linalg.svd(by_movement)
        soft = rows[sizes <= max(NEGLIGIBLE**2 * sizes.max(), SLOWEST**2)].T
        along = soft @ np.random.default_rng(SEED).normal(size=soft.shape[1])
        q, rest = self.moved(MOVED * np.array([-1.0, 0.0, 1.0])[:, None] * along), np.zeros((3, self.nv))
        torques = tmt.inverse_dynamics(self.tree, q, rest, rest)
        push = (torques[0] - 2.0 * torques[1] + torques[2]) / MOVED**2 @ soft
        return bool(
            np.abs(push).max(initial=0.0) <= NEGLIGIBLE * np.abs(self.mass_matrix @ by_movement).max()
        )

    def step(self, name: str, dt: np.ndarray | float) -> np.ndarray:
        """The amplification of a step of a method of tmt, (..., 2nv, 2nv) for dt, s, (...)."""
        shape, still = np.shape(dt), np.zeros(self.nv)
        q, qd, tau = (np.broadcast_to(x, (*shape, len(x))) for x in (self.q, still, self.tau))
        return tmt.step_derivatives(self.tree, q, qd, tau, dt, name)[0]

    def growth(self, name: str, dt: np.ndarray | float) -> np.ndarray:
        """The spectral radius of `step`, (...); that of a mode without stiffness is 1. inf: beyond any double."""
        try:
            steps = self.step(name, dt)
        except ValueError:  # one of them
            if not np.shape(dt):
                return np.array(np.inf)
            return np.array([self.growth(name, each) for each in np.ravel(dt)]).reshape(np.shape(dt))
        factors = np.linalg.eigvals(steps)
        if self.without_stiffness.any():
            near = np.clip(self.small * np.asarray(dt, float), *AT_ONE)[..., None]
            factors = np.where(np.abs(factors - 1.0) <= near, 1.0, factors)
        return np.asarray(np.abs(factors).max(axis=-1))

    def limit(self, name: str) -> tuple[str, float | None]:
        """("finite", dt in s), ("never_fails", None) or ("always_fails", None): the largest step without growth.

        The first unstable step of a scan, then refined.
        """
        fastest = max(float(np.abs(self.modes[0]).max()), SLOWEST)
        is_first, low, high = True, LEAST / fastest, EXPLICIT / fastest
        while low < LONGEST_STEP:
            steps = np.geomspace(low, high, SCANNED)
            fails = self.growth(name, steps) > 1.0 + NEUTRAL
            first = int(np.argmax(fails))
            if fails.any() and first == 0 and is_first:
                return "always_fails", None
            if not fails.any():
                low, high, is_first = high, max(LONGEST_STEP, 1.1 * high), False
            elif steps[first] < steps[first - 1] * (1.0 + NEUTRAL):
                return "finite", float(steps[first - 1])
            else:
                low, high, is_first = steps[first - 1], steps[first], False
        return "never_fails", None

    def growing_rate(self, name: str, dt: float) -> float:
        """The rate |lambda|, 1/s, of the mode nearest to the one that a step lets grow fastest."""
        factors, growing = np.linalg.eig(self.step(name, dt))
        shape = growing[: self.nv, np.argmax(np.abs(factors))]
        values, vectors = self.modes
        angles = vectors[: self.nv] / np.linalg.norm(vectors[: self.nv], axis=0)
        overlap = np.abs(angles.conj().T @ shape) / np.linalg.norm(shape)
        return float(np.abs(values[overlap > overlap.max() - 1e-6]).max())


@lru_cache(maxsize=64)
def equilibrium(robot: Robot, posture: str, damping: float = 0.0) -> Equilibrium:
    """A named posture under TMT's holding torque, with added damping, N m s/rad; without gravity if it floats."""
    case = robot.case(
        f"{posture}, held", posture=posture, torque="hold", damping=damping, gravity=not floats(robot.tree)
    )
    return Equilibrium(case)
