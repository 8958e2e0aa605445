"""The coordinates of a model's joints: positions, movements and speeds, and what is done with them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tmt import Tree
from tmt.equations.composite import mass_matrix_and_bias
from tmt.model import coordinates


class Coordinates(NamedTuple):
    """The coordinates of a model's joints: positions q, nq numbers, and movements and speeds, nv numbers.

    A hinge has an angle in rad, a slide a length in m, a ball a quaternion (w, x, y, z) and three speeds in its own axes.
    """

    names: tuple[str, ...]  # of the joints
    kinds: tuple[str, ...] = ()  # of each "hinge", "slide" or "ball"; (): all are hinges

    @property
    def places(self) -> coordinates.Coordinates:
        """Where each joint stands in q and v, as tmt has it."""
        return coordinates.coordinates_of(self.all_kinds)

    @property
    def all_kinds(self) -> tuple[str, ...]:
        return self.kinds or ("hinge",) * len(self.names)

    @property
    def nq(self) -> int:
        return self.places.nq

    @property
    def nv(self) -> int:
        return self.places.nv

    @property
    def has_balls(self) -> bool:
        return self.nq > self.nv

    @property
    def units(self) -> tuple[str, ...]:
        """Of the movements, (nv,); those of the speeds are the same per s."""
        return tuple(
            unit for kind in self.all_kinds for unit in {"slide": ("m",), "ball": ("rad",) * 3}.get(kind, ("rad",))
        )

    @property
    def speeds(self) -> tuple[str, ...]:
        """A name for each movement and speed: that of the joint, of a ball with its axis."""
        return self._named("xyz")

    @property
    def positions(self) -> tuple[str, ...]:
        """A name for each number of a position: that of the joint, of a ball with the part of its quaternion."""
        return self._named("wxyz")

    def _named(self, parts):
        pairs = zip(self.names, self.all_kinds)
        return tuple(
            name + part for name, kind in pairs for part in ([f" {p}" for p in parts] if kind == "ball" else [""])
        )

    def difference(self, q1: np.ndarray, q0: np.ndarray) -> np.ndarray:
        """From q0 to q1 as a movement, (..., nq) -> (..., nv); of a ball the shortest, in its own axes."""
        if not self.has_balls:
            return np.subtract(q1, q0)
        q1, q0 = np.broadcast_arrays(q1, q0)
        return np.stack(self.places.difference(*([q[..., i] for i in range(self.nq)] for q in (q1, q0))), axis=-1)

    def move(self, q: np.ndarray, dv: np.ndarray) -> np.ndarray:
        """The position after a movement, (..., nq)."""
        if not self.has_balls:
            return np.add(q, dv)
        batch = np.broadcast_shapes(np.shape(q)[:-1], np.shape(dv)[:-1])
        q, dv = np.broadcast_to(q, (*batch, self.nq)), np.broadcast_to(dv, (*batch, self.nv))
        moved = self.places.move([q[..., i] for i in range(self.nq)], [dv[..., i] for i in range(self.nv)])
        return np.stack(moved, axis=-1)

    def random(self, rng: np.random.Generator, count: int, ranges: Sequence = ()) -> np.ndarray:
        """Random positions, (count, nq): within the range of each joint, (low, high) or None.

        Without a range a whole turn of a hinge, 1 m of a slide; of a ball any turn.
        """
        if not ranges and set(self.all_kinds) == {"hinge"}:
            return rng.uniform(-np.pi, np.pi, (count, self.nq))
        q = np.empty((count, self.nq))
        for (kind, at, _), known in zip(self.places.joints, ranges or (None,) * len(self.names)):
            if kind == "ball":
                turns = rng.normal(size=(count, 4))
                q[:, at] = turns / np.linalg.norm(turns, axis=1, keepdims=True)
            else:
                q[:, at.start] = rng.uniform(*(known or {"hinge": (-np.pi, np.pi), "slide": (-0.5, 0.5)}[kind]), count)
        return q

    def from_degrees(self, values: ArrayLike, positions: bool) -> np.ndarray:
        """Positions (nq,) or speeds (nv,) with angles in deg, as they are given in scenes, in rad; else as they are."""
        values = np.array(values, dtype=float)
        for kind, at, by in self.places.joints:
            if kind == "hinge" or (kind == "ball" and not positions):
                place = at if positions else by
                values[place] = np.radians(values[place])
        return values


def rates_at(tree: Tree, q: np.ndarray) -> tuple[float, float]:
    """The fastest rates of decay by damping and of a swing by springs at positions q (nq,), 1/s."""
    inertia, _ = mass_matrix_and_bias(tree, q.tolist(), [0.0] * tree.coordinates.nv)
    return fastest_rates(tree, np.linalg.pinv(np.array(inertia), hermitian=True))


def fastest_rates(tree: Tree, inverse: np.ndarray, added: tuple = ()) -> tuple[float, float]:
    """The fastest rate of decay by the joints' own damping and what is added, and that of a swing by the springs, 1/s.

    inverse: of Mbar, (nv, nv).
    """
    of_speeds = [k for kind, k in zip(tree.kind, tree.stiffness) for _ in range(3 if kind == "ball" else 1)]
    damped, stiff = np.diag(np.add(tree.damping, added or 0.0)), np.diag(of_speeds)
    if tree.has_gains:
        damped, stiff = (
            part + (gain or 0.0) for part, gain in ((damped, tree.speed_gain), (stiff, tree.position_gain))
        )
    decay, square = (np.abs(np.linalg.eigvals(inverse @ part)).max() for part in (damped, stiff))
    return float(decay), float(np.sqrt(square))
