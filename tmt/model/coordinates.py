"""Where the position and the speeds of each joint stand in q and qd, and how positions move; over any scalar.

A hinge has an angle and its rate, a slide a length and its rate. A ball has a quaternion (w, x, y, z), which turns components
in its own frame to components in that of its parent, and three speeds: its angular velocity in its own frame. So q has nq
numbers and qd has nv. A movement u is as a speed that acts for a unit of time: nv numbers.

For a ball the position after a movement is p o exp(u / 2), o being the product of quaternions. Along a motion that starts at
p, u changes by ud = dexp^-1(u) omega (Hairer, Lubich, Wanner, Geometric Numerical Integration, IV.8), here for u that turns
with the body: omega + u x omega / 2 + c u x (u x omega), c = (1 - (s / 2) cot(s / 2)) / s^2, s = |u|.
"""

from functools import lru_cache
from typing import NamedTuple

from tmt.derivation.vectors import Vector, arctan, cos, sin, sqrt

KINDS = {"hinge": (1, 1), "slide": (1, 1), "ball": (4, 3)}  # how many numbers of q and of qd
TINY = 1e-300  # under a root: its own square root is far below any rounding, and no direction is undefined


class Joint(NamedTuple):
    """One joint's place in q and qd."""

    kind: str
    q: slice
    qd: slice


class Coordinates(NamedTuple):
    """The places of all joints."""

    joints: tuple[Joint, ...]
    nq: int
    nv: int

    @property
    def balls(self) -> list[Joint]:
        return [joint for joint in self.joints if joint.kind == "ball"]

    @property
    def first_positions(self) -> list[int]:
        """For each speed (nv,) the number in q of its joint's first position: of a hinge or slide its only one."""
        return [joint.q.start for joint in self.joints for _ in range(joint.qd.start, joint.qd.stop)]

    def move(self, q, u) -> list:
        """The position after a movement u from q, quaternions of length 1."""
        moved = []
        for joint in self.joints:
            if joint.kind == "ball":
                moved += normalized(product(q[joint.q], exponential(u[joint.qd])))
            else:
                moved.append(q[joint.q.start] + u[joint.qd.start])
        return moved

    def difference(self, q1, q0) -> list:
        """The movement from q0 to q1, (nv,): of a ball the shortest."""
        return [
            value
            for joint in self.joints
            for value in (
                self.logarithm(product(conjugate(q0[joint.q]), q1[joint.q]))
                if joint.kind == "ball"
                else [q1[joint.q.start] - q0[joint.q.start]]
            )
        ]

    @staticmethod
    def logarithm(p) -> list:
        """Of a quaternion, see below."""
        return logarithm(p)

    def tangent(self, q, dq) -> list:
        """The movement that changes q by small dq, linear in dq."""
        return [
            value
            for joint in self.joints
            for value in (
                [2.0 * x for x in product(conjugate(q[joint.q]), dq[joint.q])[1:]]
                if joint.kind == "ball"
                else [dq[joint.q.start]]
            )
        ]

    def component_rates(self, q, qd) -> list:
        """dq/dt at speeds qd, (nq,): of a ball p o (0, omega) / 2."""
        return [
            value
            for joint in self.joints
            for value in (
                [0.5 * x for x in product(q[joint.q], [0.0, *qd[joint.qd]])]
                if joint.kind == "ball"
                else [qd[joint.qd.start]]
            )
        ]

    def rates(self, u, qd) -> list:
        """du/dt at speeds qd, of a motion that has moved by u."""
        return [
            value
            for joint in self.joints
            for value in (
                inverse_derivative(u[joint.qd], qd[joint.qd])
                if joint.kind == "ball"
                else [qd[joint.qd.start]]
            )
        ]


class Flat:
    """Coordinates of any number of joints none of which is a ball: positions move like numbers, and speeds are their rates."""

    balls = ()

    def move(self, q, u) -> list:
        return [x + y for x, y in zip(q, u)]

    def tangent(self, q, dq) -> list:
        return dq

    def component_rates(self, q, qd) -> list:
        return list(qd)

    def rates(self, u, qd) -> list:
        return qd


FLAT = Flat()


@lru_cache(maxsize=256)
def coordinates_of(kinds: tuple) -> Coordinates:
    """The coordinates of joints of these kinds."""
    joints, nq, nv = [], 0, 0
    for kind in kinds:
        more_q, more_v = KINDS[kind]
        joints.append(Joint(kind, slice(nq, nq + more_q), slice(nv, nv + more_v)))
        nq, nv = nq + more_q, nv + more_v
    return Coordinates(tuple(joints), nq, nv)


def product(p, r) -> list:
    """The product p o r of two quaternions: the turn r, then p."""
    (a, x, y, z), (b, u, v, w) = p, r
    return [
        a * b - x * u - y * v - z * w,
        a * u + x * b + y * w - z * v,
        a * v + y * b + z * u - x * w,
        a * w + z * b + x * v - y * u,
    ]


def conjugate(p) -> list:
    """The inverse of a quaternion of length 1."""
    return [p[0], *(x * -1.0 for x in p[1:])]


def normalized(p) -> list:
    """The quaternion at length 1."""
    length = sqrt(sum((x * x for x in p[1:]), p[0] * p[0]))
    return [x / length for x in p]


def exponential(u) -> list:
    """The quaternion that turns by |u| rad about u."""
    x, y, z = u
    half = sqrt(x * x + y * y + z * z + TINY) * 0.5
    share = sin(half) / half * 0.5
    return [cos(half), x * share, y * share, z * share]


def logarithm(p) -> list:
    """The movement u, |u| at most pi rad, with exponential(u) = p or -p; |p| = 1."""
    w, x, y, z = p
    size, length = sqrt(w * w + TINY), sqrt(x * x + y * y + z * z + TINY)
    share = arctan(length / (1.0 + size)) * 4.0 / length * (w / size)
    return [x * share, y * share, z * share]


def inverse_derivative(u, omega) -> list:
    """dexp^-1(u) omega, see above."""
    u, omega = Vector(*u), Vector(*omega)
    half = sqrt(u.dot(u) + TINY) * 0.5
    share = (1.0 - half * cos(half) / sin(half)) / (half * half) * 0.25
    once = u.cross(omega)
    return list(omega + once * 0.5 + u.cross(once) * share)
