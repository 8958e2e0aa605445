"""Coordinates of an engine that are those of the Tree in another order, with a free body's speeds in part in other axes."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from .. import Array
from .model import File

Places = Sequence[int]
Starts = Mapping[int, tuple[int, int]]


class Order(NamedTuple):
    q: Array  # the place in the Tree's q of each of the engine's numbers
    v: Array  # (nv,) the same in v
    # of each free body, and of balls where that is so: speeds of the engine, the quaternion in the Tree's q
    turned: tuple[tuple[slice, slice], ...]
    # those speeds are in world axes where the Tree's are in body axes; False: the other way round
    in_world: bool
    nq: int  # of the Tree

    def engine(self, q: Array, *vectors: Array) -> list[Array]:
        """q, and vectors of speeds or forces at q, of the Tree as the engine has them."""
        placed = [vector[self.v] for vector in vectors]
        for at, place in self.turned:
            turn = self.turn(q[place])
            for vector in placed:
                vector[at] = turn @ vector[at]
        return [q[self.q], *placed]

    def tree(self, q: Array, vector: Array) -> Array:
        """A vector of the engine, (nv,), or vectors as columns, at q of the Tree, as the Tree has it."""
        placed = np.empty_like(vector)
        placed[self.v] = vector
        for at, place in self.turned:
            placed[self.v[at]] = self.turn(q[place]).T @ vector[at]
        return placed

    def turn(self, quaternion: Array) -> Array:
        """The rotation (3, 3) from the Tree's axes to the engine's."""
        turn = Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()
        return turn if self.in_world else turn.T

    def positions(self, q: Array) -> Array:
        """Positions of the engine in the Tree's order, quaternions of length 1."""
        placed = np.ones(self.nq)
        placed[self.q] = q
        for _, place in self.turned:
            placed[place] /= np.linalg.norm(placed[place])
        return placed

    def tree_matrix(self, q: Array, matrix: Array) -> Array:
        return self.tree(q, self.tree(q, matrix).T)


def order_of(
    file: File, starts: Starts, free_q: Places, free_v: Places, in_world: bool, ball_q: Places = (0, 1, 2, 3),
    turned_balls: bool = False, turned_at: int = 0,
) -> Order:  # fmt: skip
    """The order of an engine.

    starts: where the engine's q and v of a joint begin, by its number in the Tree, of a free joint by that of its ball; free_q,
    free_v, ball_q: of a free joint and of a ball, the Tree's numbers in the engine's order; turned_balls: a ball's speeds are
    in the axes of the body that carries it; turned_at: the first of a free joint's speeds that are in other axes.
    """
    q: dict[int, int] = {}
    v: dict[int, int] = {}
    turned = []
    for k, (start_q, start_v) in starts.items():
        joint = file.coordinates.places.joints[k]
        of_q, of_v = np.r_[joint.q], np.r_[joint.qd]
        if file.is_free(k):
            turned.append((slice(start_v + turned_at, start_v + turned_at + 3), joint.q))
            of_q, of_v = of_q[0] - 3 + np.array(free_q), of_v[0] - 3 + np.array(free_v)
        elif joint.kind == "ball":
            of_q = of_q[list(ball_q)]
            turned += [(slice(start_v, start_v + 3), joint.q)] * turned_balls
        q |= enumerate(of_q, start_q)
        v |= enumerate(of_v, start_v)
    in_q, in_v = (np.array([place for _, place in sorted(places.items())], int) for places in (q, v))
    return Order(in_q, in_v, tuple(turned), in_world, file.coordinates.nq)
