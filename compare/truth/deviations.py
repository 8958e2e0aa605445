"""Small deviations from a posture at rest, M x'' + D x' + K x = 0: their modes, rates and growth."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

SYMMETRIC = (
    1e-7  # of the largest entry: the largest difference of a matrix from its transpose; entries below it are zero
)
VANISHING = 1e-10  # of the largest stiffness or damping, in the units of M: zero
# errors of K and D where K is not symmetric: of each entry, as it may be a finite difference, and of the largest one
DOUBTED, ROUNDED_OFF = 1e-8, 1e-14
CREEPING = 1e-8  # 1/s2 and 1/s: zero


@dataclass(frozen=True)
class Deviations:
    """The equation of small deviations; matrices are (nv, nv)."""

    names: tuple[str, ...]  # of the speeds
    M: np.ndarray
    K: np.ndarray
    D: np.ndarray
    damping: np.ndarray  # (nv,), joint damping, implicit in Euler; zeros where the file disables eulerdamp
    uncut: np.ndarray  # damping, implicit in implicitfast and implicit between speeds on one path, see servos.Slopes
    springs: np.ndarray  # the part of K that is implicit in discrete
    brakes: np.ndarray  # the part of D that is implicit in discrete
    on_path: np.ndarray  # whether two speeds are on one path to the root
    # filters: the actuator, its time constant in s, whether it is a filterexact
    poles: tuple[tuple[str, float, bool], ...] = ()
    base: tuple[int, ...] = ()  # the speeds of free bodies, which may drift

    def free(self, base: list[int]) -> "Deviations":
        """With a free base, given by its speeds: those without stiffness and damping keep the momentum at zero."""
        nonzero = [np.abs(matrix) > SYMMETRIC * np.abs(matrix).max(initial=0.0) for matrix in (self.K, self.D)]
        loose = [k for k in base if not any(matrix[k].any() or matrix[:, k].any() for matrix in nonzero)]
        kept, rest = self.locked(loose), [k for k in range(len(self.M)) if k not in loose]
        across = np.linalg.solve(self.M[np.ix_(loose, loose)], self.M[np.ix_(loose, rest)])
        M = kept.M - self.M[np.ix_(rest, loose)] @ across
        held = tuple(i for i, k in enumerate(rest) if k in base)
        return replace(kept, M=0.5 * (M + M.T), base=held)

    def locked(self, base: list[int]) -> "Deviations":
        """With these speeds locked."""
        rest = [k for k in range(len(self.M)) if k not in base]
        square = {
            name: getattr(self, name)[np.ix_(rest, rest)]
            for name in ("M", "K", "D", "uncut", "springs", "brakes", "on_path")
        }
        return replace(self, names=tuple(self.names[k] for k in rest), damping=self.damping[rest], **square)

    def __getstate__(self) -> dict:
        return dict(self.__dict__)  # a copy: a thread may pickle it while more is computed of it

    # in the units of M, where it is the identity

    @cached_property
    def root(self) -> np.ndarray:
        """L of M = L L'."""
        return np.linalg.cholesky(self.M)

    @cached_property
    def unrooted(self) -> np.ndarray:
        """L^-1, computed once: for small matrices SciPy's triangular solver waits ms for its threads on a busy machine."""
        return np.linalg.inv(self.root)

    def scaled(self, matrix: np.ndarray) -> np.ndarray:
        """L^-1 matrix L'^-1."""
        return self.unrooted @ matrix @ self.unrooted.T

    @cached_property
    def stiff(self) -> np.ndarray:
        return self.scaled(self.K)

    @cached_property
    def damped(self) -> np.ndarray:
        return self.scaled(self.D)

    @cached_property
    def is_symmetric(self) -> bool:
        """Whether the closed form applies: K and D are symmetric, and D dissipates. K may have any sign."""
        halves = [np.abs(matrix - matrix.T).max() <= SYMMETRIC * np.abs(matrix).max() for matrix in (self.K, self.D)]
        lowest = np.linalg.eigvalsh(self.damped).min()
        return all(halves) and lowest >= -10.0 * ROUNDED_OFF * np.abs(self.damped).max()

    @cached_property
    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues of the equations of motion, 1/s, (2nv,), and the movements of their modes in the units of M, (nv, 2nv)."""
        n = len(self.M)
        values, vectors = np.linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)], [-self.stiff, -self.damped]]))
        moves = vectors[:n].astype(complex)
        return values.astype(complex), moves / np.maximum(np.linalg.norm(moves, axis=0), 1e-300)

    @cached_property
    def drifts(self) -> bool:
        """Whether a movement other than of a free base has neither stiffness nor damping."""
        both = np.vstack([self.stiff / self.largest(self.stiff), self.damped / self.largest(self.damped)])
        of_base = self.root.T[:, list(self.base)]

        def loose(matrix) -> int:
            return int((np.linalg.svd(matrix, compute_uv=False) <= VANISHING).sum()) if matrix.size else 0

        return loose(both) > loose(both @ of_base)

    @staticmethod
    def largest(matrix: np.ndarray) -> float:
        """The largest entry, to which VANISHING is relative; a matrix of rounding errors counts as zero."""
        return max(np.abs(matrix).max(initial=0.0), CREEPING / VANISHING)

    @cached_property
    def growing(self) -> tuple[float, np.ndarray] | None:
        """The rate, 1/s, and the movement of the fastest growing mode of the equations of motion, or None."""
        if not self.names:
            return None
        values, moves = self.modes
        if self.is_symmetric:
            lowest, shapes = np.linalg.eigh(0.5 * (self.stiff + self.stiff.T))
            if lowest[0] >= -VANISHING * self.largest(self.stiff):
                return None
            fastest = max(values.real.max(), 0.0)
            return float(fastest), moves[:, np.argmax(values.real)] if fastest else shapes[:, 0]
        certain = np.flatnonzero(values.real > self.doubts)
        fastest = certain[np.argmax(values[certain].real)] if len(certain) else None
        return None if fastest is None else (float(values[fastest].real), moves[:, fastest])

    @property
    def doubts(self) -> np.ndarray:
        """The error bound of each eigenvalue of `modes`, 1/s, (2nv,): large for double eigenvalues."""
        n, size = len(self.M), max(np.sqrt(np.abs(self.stiff).max(initial=0.0)), 1.0)
        balanced = np.block([[np.zeros((n, n)), size * np.eye(n)], [-self.stiff / size, -self.damped]])
        values, right = np.linalg.eig(balanced)
        others, left = np.linalg.eig(balanced.T)
        pairs = [np.argmin(np.abs(others - value)) for value in values]
        left, along = np.abs(left[:, pairs]), np.abs((left[:, pairs] * right).sum(axis=0))
        off = DOUBTED * (left * (np.abs(balanced) @ np.abs(right))).sum(axis=0) + ROUNDED_OFF * np.linalg.norm(balanced)
        off = off / np.maximum(along, 1e-300)
        return off[[np.argmin(np.abs(values - value)) for value in self.modes[0]]]

    @cached_property
    def neutral(self) -> float:
        """The largest growth rate, 1/s, that is within `doubts`."""
        return 0.0 if self.growing else max(float(self.modes[0].real.max(initial=0.0)), 0.0)

    def joint_of(self, shape: np.ndarray) -> str:
        """The speed with most of the kinetic energy of a movement."""
        x = self.unrooted.T @ shape
        return self.names[int(np.argmax(np.abs(x.conj() * (self.M @ x))))]
