"""Coordinates of an engine that are those of the Tree in another order, with a free body's speeds in part in other axes."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from .model import File


class Order(NamedTuple):
    q: np.ndarray  # (nq,) the place in the Tree's q of each of the engine's numbers
    v: np.ndarray  # (nv,) the same in v
    turned: tuple[
        tuple[slice, slice], ...
    ]  # of each free body: speeds of the engine, the quaternion in the Tree's q
    in_world: (
        bool  # those speeds are in world axes where the Tree's are in body axes; False: the other way round
    )

    def engine(self, q: np.ndarray, *vectors: np.ndarray) -> list[np.ndarray]:
        """q, and vectors of speeds or forces at q, of the Tree as the engine has them."""
        vectors = [vector[self.v] for vector in vectors]
        for at, place in self.turned:
            turn = rotation(*q[place], self.in_world)
            for vector in vectors:
                vector[at] = turn @ vector[at]
        return [q[self.q], *vectors]

    def tree(self, q: np.ndarray, vector: np.ndarray) -> np.ndarray:
        """A vector of the engine, (nv,), or vectors as columns, at q of the Tree, as the Tree has it."""
        found = np.empty_like(vector)
        found[self.v] = vector
        for at, place in self.turned:
            found[self.v[at]] = rotation(*q[place], not self.in_world) @ vector[at]
        return found

    def tree_matrix(self, q: np.ndarray, matrix: np.ndarray) -> np.ndarray:
        return self.tree(q, self.tree(q, matrix).T)

    def tree_position(self, q: np.ndarray) -> np.ndarray:
        found = np.empty_like(q)
        found[self.q] = q
        return found

    def tree_states(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """States of the engine, (times, nq) and (times, nv), as those of the Tree, with quaternions of length 1."""
        states = np.empty((len(q), len(self.q) + len(self.v)))
        states[:, self.q] = q
        for _, place in self.turned:
            states[:, place] /= np.linalg.norm(states[:, place], axis=1, keepdims=True)
        states[:, len(self.q) :] = [self.tree(*row) for row in zip(states, v)]
        return states


def order_of(
    file: File, starts: Mapping[int, tuple[int, int]], free_q, free_v, ball_q, in_world: bool
) -> Order:
    """The order of an engine.

    starts: where the engine's q and v of a joint begin, by its number in the Tree, of a free joint by that of its ball; free_q,
    free_v, ball_q: of a free joint and of a ball, the Tree's numbers in the engine's order.
    """
    places = file.coordinates.places
    q, v, turned = np.zeros(places.nq, int), np.zeros(places.nv, int), []
    for k, (start_q, start_v) in starts.items():
        joint = places.joints[k]
        of_q, of_v = np.r_[joint.q], np.r_[joint.qd]
        if file.names[k].removesuffix(" turn") in file.free:
            turned.append((slice(start_v, start_v + 3), joint.q))
            of_q, of_v = of_q[0] - 3 + np.array(free_q), of_v[0] - 3 + np.array(free_v)
        elif len(of_q) == 4:
            of_q = of_q[list(ball_q)]
        q[start_q : start_q + len(of_q)], v[start_v : start_v + len(of_v)] = of_q, of_v
    return Order(q, v, tuple(turned), in_world)


def rotation(w: float, x: float, y: float, z: float, is_forward: bool) -> np.ndarray:
    """The matrix of a quaternion of any length, from body axes to world axes; not is_forward: its inverse."""
    s, w = 2.0 / (w * w + x * x + y * y + z * z), w if is_forward else -w
    return np.array([[1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
                     [s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)],
                     [s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)]])  # fmt: skip


def near(read: np.ndarray, stated: np.ndarray) -> np.ndarray:
    """Whether numbers that an engine has read are those stated, for each joint."""
    size = np.abs(stated).max(initial=0.0)
    return (np.abs(read - stated) <= 1e-13 * size).reshape(len(stated), -1).all(axis=1)


def wrong_masses(read: Mapping[str, np.ndarray], stated: Mapping[str, np.ndarray]) -> list[int]:
    """The joints with another mass or other moments. Where only com and inertia differ, bodies are at another place."""
    return np.flatnonzero(
        ~near(read["mass"], stated["mass"]) | ~near(read["moments"], stated["moments"])
    ).tolist()
