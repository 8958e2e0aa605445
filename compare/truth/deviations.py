"""Small deviations from a posture at rest, M x'' + D x' + K x = 0: what becomes of them without any step."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

SYMMETRIC = 1e-7  # of the largest entry: what a matrix and its transpose may differ by, and what is nothing beside it
VANISHING = 1e-10  # of the largest stiffness or damping, in the units of M: nothing
# what K and D may be off where K is not symmetric: each entry of itself, as it may be a difference, and of the largest one
DOUBTED, ROUNDED_OFF = 1e-8, 1e-14
CREEPING = 1e-8  # 1/s2 and 1/s: and so is less than this


@dataclass(frozen=True)
class Deviations:
    """Small deviations from a posture at rest, all (nv, nv) but where it says otherwise."""

    names: tuple[str, ...]  # of the speeds
    M: np.ndarray
    K: np.ndarray
    D: np.ndarray
    damping: np.ndarray  # of D what Euler has implicit, (nv,): of joints; zeros where the file switches eulerdamp off
    uncut: np.ndarray  # of this implicitfast and implicit have implicit what is on one path, see servos.Slopes
    springs: np.ndarray  # what `discrete` has implicit, of K
    brakes: np.ndarray  # and of D
    on_path: np.ndarray  # whether two speeds are on one path to the root
    # of filters: the actuator, its time constant in s, and whether it is a filterexact
    poles: tuple[tuple[str, float, bool], ...] = ()
    base: tuple[int, ...] = ()  # the speeds of free bodies, which may drift

    def free(self, base: list[int]) -> "Deviations":
        """With a free base, (n,) numbers of speeds: those that nothing holds or brakes move so that momentum stays zero."""
        meets = [np.abs(matrix) > SYMMETRIC * np.abs(matrix).max(initial=0.0) for matrix in (self.K, self.D)]
        loose = [k for k in base if not any(one[k].any() or one[:, k].any() for one in meets)]
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
        """L^-1, once for all: for matrices so small SciPy's solution waits for its threads, for ms where cores are busy."""
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
        """Whether the closed form holds: K and D are symmetric, and D takes energy away. K may have any sign: see `drifts`."""
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
        """Whether a movement, other than of a free base, meets neither stiffness nor damping."""
        both = np.vstack([self.stiff / self.largest(self.stiff), self.damped / self.largest(self.damped)])
        of_base = self.root.T[:, list(self.base)]

        def loose(matrix) -> int:
            return int((np.linalg.svd(matrix, compute_uv=False) <= VANISHING).sum()) if matrix.size else 0

        return loose(both) > loose(both @ of_base)

    @staticmethod
    def largest(matrix: np.ndarray) -> float:
        """The largest entry, beside which what is below VANISHING is nothing; a matrix of nothing but rounding is nothing."""
        return max(np.abs(matrix).max(initial=0.0), CREEPING / VANISHING)

    @cached_property
    def growing(self) -> tuple[float, np.ndarray] | None:
        """The rate, 1/s, and the movement of the mode that grows fastest by itself, or None."""
        if not self.names:
            return None
        values, moves = self.modes
        if self.is_symmetric:
            lowest, shapes = np.linalg.eigh(0.5 * (self.stiff + self.stiff.T))
            if lowest[0] >= -VANISHING * self.largest(self.stiff):
                return None
            fastest = max(values.real.max(), 0.0)
            return float(fastest), moves[:, np.argmax(values.real)] if fastest else shapes[:, 0]
        known = np.flatnonzero(values.real > self.doubts)
        fastest = known[np.argmax(values[known].real)] if len(known) else None
        return None if fastest is None else (float(values[fastest].real), moves[:, fastest])

    @property
    def doubts(self) -> np.ndarray:
        """How far each of the eigenvalues of `modes` may be off, 1/s, (2nv,): much where two are one, as of what is loose."""
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
        """The rate, 1/s, at which something seems to grow by itself, but within `doubts`."""
        return 0.0 if self.growing else max(float(self.modes[0].real.max(initial=0.0)), 0.0)

    def joint_of(self, shape: np.ndarray) -> str:
        """The speed that has most of the kinetic energy of a movement."""
        x = self.unrooted.T @ shape
        return self.names[int(np.argmax(np.abs(x.conj() * (self.M @ x))))]
