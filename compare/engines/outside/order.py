"""Coordinates of an engine beside those of the Tree: where joints begin, how rotations are stated, the axes of speeds.

Of the Tree: quaternions w x y z; of a free joint the velocity of the body's origin in the world and the
angular velocity in body axes. With S and c of a state, the engine's speeds are S v, its accelerations S a +
c.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from tmt.derivation.coordinates import Joint

from .. import Array
from .file import File

Starts = Mapping[int, tuple[int, int]]


class Code(NamedTuple):
    """How an engine states the position of a joint."""

    size: int  # numbers of the engine
    encode: Callable[[Array], Array]  # from the Tree's numbers
    decode: Callable[[Array], Array]


def rotation(wxyz: Array) -> Rotation:
    return Rotation.from_quat(np.roll(wxyz, -1))


def quaternion(turn: Rotation) -> Array:
    return np.roll(turn.as_quat(), 1)


NUMBER = Code(1, np.array, np.array)
CIRCLE = Code(2, lambda q: np.r_[np.cos(q), np.sin(q)], lambda x: np.arctan2(x[1:], x[:1]))
WXYZ = Code(4, np.array, lambda x: x / np.linalg.norm(x))
XYZW = Code(4, lambda q: np.roll(q, -1), lambda x: np.roll(x, 1) / np.linalg.norm(x))
ANGLES = Code(3, lambda q: rotation(q).as_euler("xyz"), lambda x: quaternion(Rotation.from_euler("xyz", x)))


class State(NamedTuple):
    """A state of the Tree in an engine's coordinates."""

    x: Array  # positions of the engine
    u: Array  # its speeds
    S: Array  # (nv, nv)
    c: Array  # (nv,)

    def force(self, force: Array) -> Array:
        """Generalized forces of the Tree as the engine has them."""
        return np.asarray(np.linalg.solve(self.S.T, force))


def of_free(ball: int, linear: tuple[int, int], rotation: tuple[int, int]) -> Starts:
    """Where the joints of a free joint begin, by the number of its ball: (q, v) of its slides and of the ball."""
    slides = {ball - 3 + i: (linear[0] + i, linear[1] + i) for i in range(3)}
    return slides | {ball: rotation}


@dataclass(frozen=True)
class Order:
    """The coordinates of an engine. starts: where its q and v of each joint of the Tree begin, by the number of the joint."""

    file: File
    starts: Starts
    free: Code = WXYZ  # the rotation of a free joint
    ball: Code = WXYZ
    linear_in_world: bool = True  # the speeds of a free joint
    angular_in_world: bool = False
    balls_in_parent: bool = False  # a ball's angular velocity is in the axes of the body that carries it
    circles: tuple[int, ...] = ()  # joints whose angle is stated by its cosine and sine
    # (nq,): the Tree's positions where those of hinges and slides are 0 in the engine
    reference: Array | float = 0.0
    # of free joints, by the number of the ball: the point of the body whose velocity the engine has
    points: Mapping[int, Array] = field(default_factory=dict)

    @property
    def joints(self) -> tuple[Joint, ...]:
        return self.file.coordinates.places.joints

    @cached_property
    def parts(self) -> list[tuple[slice, slice, Code]]:
        """The numbers of positions in the Tree, those in the engine, and how these are stated."""
        parts = []
        for k, (start, _) in self.starts.items():
            code = CIRCLE if k in self.circles else NUMBER
            if self.joints[k].kind == "ball":
                code = self.free if self.file.is_free(k) else self.ball
            parts.append((self.joints[k].q, slice(start, start + code.size), code))
        return parts

    @cached_property
    def v(self) -> Array:
        """The place in the Tree's v of each of the engine's speeds, (nv,)."""
        places = np.empty(self.file.coordinates.nv, int)
        for k, (_, start) in self.starts.items():
            speeds = self.joints[k].speeds
            places[start : start + len(speeds)] = speeds
        return places

    @cached_property
    def of_free(self) -> Array:
        """Whether a speed of the Tree is that of a free joint, (nv,)."""
        free = np.zeros(self.file.coordinates.nv, bool)
        for k, joint in enumerate(self.joints):
            if self.file.is_free(k):
                free[joint.qd.start - 3 : joint.qd.stop] = True
        return free

    @cached_property
    def of_ball(self) -> Array:
        """Whether a speed of the Tree is that of a ball, a free joint's too, (nv,)."""
        return np.array(self.file.coordinates.kinds_of_speeds) == "ball"

    def tree_state(self, x: Array, u: Array) -> tuple[Array, Array]:
        """q and v of the Tree."""
        q = np.empty(self.file.coordinates.nq)
        for place, part, code in self.parts:
            q[place] = code.decode(x[part])
        q += self.reference
        return q, np.linalg.solve(self.state(q).S, u)

    def tree_numbers(self, values: Array) -> Array:
        """Numbers of the engine's speeds, (nv,), in the Tree's order; axes are left as they are."""
        placed = np.empty(len(values))
        placed[self.v] = values
        return placed

    def state(self, q: Array, v: Array | None = None) -> State:
        """A state; at rest by default."""
        v = np.zeros(self.file.coordinates.nv) if v is None else v
        x, moved = np.empty(max(part.stop for _, part, _ in self.parts)), q - self.reference
        for place, part, code in self.parts:
            x[part] = code.encode(moved[place])
        S, c = np.eye(len(self.v))[self.v], np.zeros(len(self.v))
        for k, (_, start) in self.starts.items():
            joint, rows = self.joints[k], slice(start, start + 3)
            if joint.kind != "ball":
                continue
            R, is_free = rotation(q[joint.q]).as_matrix(), self.file.is_free(k)
            is_outside = self.angular_in_world if is_free else self.balls_in_parent
            S[rows, joint.qd] = R if is_outside else np.eye(3)
            if not is_free:
                continue
            first = self.starts[k - 3][1]
            linear, of_origin = slice(first, first + 3), slice(joint.qd.start - 3, joint.qd.start)
            in_linear = np.eye(3) if self.linear_in_world else R.T
            point, w = R @ self.points.get(k, np.zeros(3)), R @ v[joint.qd]
            S[linear, of_origin] = in_linear
            S[linear, joint.qd] = in_linear @ np.cross(R, point[:, None], axis=0)
            c[linear] = in_linear @ np.cross(w, np.cross(w, point))
            if not self.linear_in_world:  # the axes turn
                c[linear] -= in_linear @ np.cross(w, v[of_origin] + np.cross(w, point))
        return State(x, S @ v, S, c)
