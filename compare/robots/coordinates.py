"""The joints of a robot: their kinds and units, positions and speeds; what its Tree says of them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tmt import Tree
from tmt.derivation import coordinates
from tmt.derivation.composite import mass_matrix_and_bias
from tmt.derivation.coordinates import Joint


class Kind(NamedTuple):
    speeds: int  # number of speeds
    unit: str  # of a movement; speeds: per s
    force: str  # unit
    position_given: str  # unit in scenes
    speed_given: str
    movement_given: str
    random: tuple[float, float]  # random positions of a joint without a range


KINDS = {
    "hinge": Kind(1, "rad", "N m", "deg", "deg/s", "deg", (-np.pi, np.pi)),
    "slide": Kind(1, "m", "N", "m", "m/s", "m", (-0.5, 0.5)),
    "ball": Kind(3, "rad", "N m", "quaternions", "deg/s", "deg", (-np.pi, np.pi)),
}
FREE = ("slide", "slide", "slide", "ball")


class Coordinates(NamedTuple):
    """Positions q, nq numbers, and speeds, nv numbers, of a number of joints.

    A hinge has an angle in rad, a slide a length in m, a ball a quaternion (w, x, y, z) and three speeds in
    its own axes.
    """

    names: tuple[str, ...]  # of the joints
    kinds: tuple[str, ...] = ()  # "hinge", "slide" or "ball" for each joint; (): all are hinges

    @property
    def places(self) -> coordinates.Coordinates:
        """The places of all joints in q and v."""
        return coordinates.coordinates_of(self.all_kinds)

    @property
    def by_name(self) -> dict[str, Joint]:
        """The kind and the place of each joint."""
        return dict(zip(self.names, self.places.joints))

    @property
    def all_kinds(self) -> tuple[str, ...]:
        return self.kinds or ("hinge",) * len(self.names)

    @property
    def kinds_of_speeds(self) -> list[str]:
        """The kind of the joint of each speed, (nv,)."""
        return [kind for kind in self.all_kinds for _ in range(KINDS[kind].speeds)]

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
        """The units of a movement, (nv,); of the speeds: the same per s."""
        return tuple(KINDS[kind].unit for kind in self.kinds_of_speeds)

    @property
    def speeds(self) -> tuple[str, ...]:
        """The names of the speeds: the joint; for a ball "name x"."""
        return self._named("xyz")

    @property
    def positions(self) -> tuple[str, ...]:
        """The names of the numbers of a position: the joint; for a ball "name w"."""
        return self._named("wxyz")

    def _named(self, components: str) -> tuple[str, ...]:
        names: list[str] = []
        for name, kind in zip(self.names, self.all_kinds):
            names += [f"{name} {component}" for component in components] if kind == "ball" else [name]
        return tuple(names)

    def difference(self, q1: np.ndarray, q0: np.ndarray) -> np.ndarray:
        """The tangent vector from q0 to q1, (..., nv); for a ball the shortest rotation vector in its own axes."""
        if not self.has_balls:
            return np.subtract(q1, q0)
        end, start = (list(np.moveaxis(q, -1, 0)) for q in np.broadcast_arrays(q1, q0))
        return np.stack(self.places.difference(end, start), axis=-1)

    def move(self, q: np.ndarray, dv: np.ndarray) -> np.ndarray:
        """The position to which a tangent vector leads, (..., nq)."""
        if not self.has_balls:
            return np.add(q, dv)
        parts = np.broadcast_arrays(*np.moveaxis(q, -1, 0), *np.moveaxis(dv, -1, 0))
        return np.stack(self.places.move([*parts[: self.nq]], [*parts[self.nq :]]), axis=-1)

    def random(
        self, rng: np.random.Generator, count: int, ranges: Sequence[tuple[float, float] | None] = ()
    ) -> np.ndarray:
        """Random positions, (count, nq), within the range of each joint, (low, high) or None.

        Without a range: a full turn of a hinge, 1 m of a slide. A ball: uniform over all rotations.
        """
        if not ranges and set(self.all_kinds) == {"hinge"}:
            return rng.uniform(-np.pi, np.pi, (count, self.nq))
        q = np.empty((count, self.nq))
        for joint, limits in zip(self.places.joints, ranges or (None,) * len(self.names)):
            if joint.kind == "ball":
                turns = rng.normal(size=(count, 4))
                q[:, joint.q] = turns / np.linalg.norm(turns, axis=1, keepdims=True)
            else:
                q[:, joint.q.start] = rng.uniform(*(limits or KINDS[joint.kind].random), count)
        return q

    def from_degrees(self, values: ArrayLike, positions: bool) -> np.ndarray:
        """Positions (nq,) or speeds (nv,) in SI units; angles of scenes are in deg."""
        values = np.array(values, dtype=float)
        for joint in self.places.joints:
            if joint.kind == "hinge" or (joint.kind == "ball" and not positions):
                place = joint.q if positions else joint.qd
                values[place] = np.radians(values[place])
        return values


def point_inertia(place: np.ndarray, mass: float = 1.0) -> np.ndarray:
    """The inertia of a point mass, kg, at a place (3,) m, about the origin, (3, 3): m (c'c 1 - c c')."""
    return mass * (place @ place * np.eye(3) - np.outer(place, place))


def free_joints(tree: Tree) -> list[int]:
    """The first joint of each free joint: three slides and a ball, each at the one before."""
    free = []
    for i in range(len(tree.kind) - 3):
        in_place = all(tree.parent[k + 1] == k and not any(tree.offset[k + 1]) for k in range(i, i + 3))
        if tree.kind[i : i + 4] == FREE and in_place:
            free.append(i)
    return free


def rates_at(tree: Tree, q: np.ndarray) -> tuple[float, float]:
    """The fastest decay rate by damping and the fastest frequency by springs at q (nq,), 1/s."""
    inertia, _ = mass_matrix_and_bias(tree, q.tolist(), [0.0] * tree.coordinates.nv)
    return fastest_rates(tree, np.linalg.pinv(np.array(inertia), hermitian=True))


def fastest_rates(tree: Tree, inverse: np.ndarray, added: Sequence[float] = ()) -> tuple[float, float]:
    """The fastest decay rate by damping and the fastest frequency by springs, 1/s.

    inverse: of Mbar, (nv, nv); added: damping in addition to that of the joints.
    """
    stiffness = np.repeat(tree.stiffness, [KINDS[kind].speeds for kind in tree.kind])
    damped, stiff = np.diag(np.add(tree.damping, added or 0.0)), np.diag(stiffness)
    if tree.has_gains:
        damped, stiff = damped + (tree.speed_gain or 0.0), stiff + (tree.position_gain or 0.0)
    decay, square = (np.abs(np.linalg.eigvals(inverse @ part)).max() for part in (damped, stiff))
    return float(decay), float(np.sqrt(square))
