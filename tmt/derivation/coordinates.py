"""Where the position and the speeds of each joint stand in q and qd, and how positions move; over any scalar.

A hinge has an angle and its rate, a slide a length and its rate. A ball has a quaternion (w, x, y, z), which
turns components in its own frame to components in that of its parent, and three speeds: its angular velocity
in its own frame. So q has nq numbers and qd has nv. A tangent vector u is as a speed that acts for a unit of
time: nv numbers.

For a ball the position after a tangent is p o exp(u / 2), o being the product of quaternions. Along a motion
that starts at p, u changes by ud = dexp^-1(u) omega (Hairer, Lubich, Wanner, Geometric Numerical Integration,
IV.8), here for u that turns with the body: omega + u x omega / 2 + c u x (u x omega), c = (1 - (s / 2) cot(s
/ 2)) / s^2, s = |u|.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

from .vectors import Scalars, Values, Vector, cos, minus, plus, sign, sin, sqrt

KINDS = {"hinge": (1, 1), "slide": (1, 1), "ball": (4, 3)}  # how many numbers of q and of qd
HALVINGS = 4  # of a turn of at most pi rad: then the sine of its half is below 0.1
TERMS = 17  # of the series of the arc sine, after the first: the next is below 1e-37
TINY = 1e-300  # under a root: its own square root is far below any rounding, and no direction is undefined

Rule = Callable[[Scalars, Scalars], Values]  # of one joint


class Joint(NamedTuple):
    kind: str
    q: slice
    qd: slice

    @property
    def speeds(self) -> range:
        return range(self.qd.start, self.qd.stop)


class Coordinates(NamedTuple):
    joints: tuple[Joint, ...]
    nq: int
    nv: int

    @property
    def balls(self) -> list[Joint]:
        return [joint for joint in self.joints if joint.kind == "ball"]

    @property
    def first_positions(self) -> list[int]:
        """For each speed (nv,) the number in q of its joint's first position: the only one of a hinge."""
        return [joint.q.start for joint in self.joints for _ in joint.speeds]

    def by_joint(
        self, of_ball: Rule, of_other: Rule, first: Scalars, second: Scalars, *places: str
    ) -> Values:
        """The numbers that a rule gives for each joint; places: "q" or "qd", where its numbers stand in each array."""
        result: Values = []
        for joint in self.joints:
            rule = of_ball if joint.kind == "ball" else of_other
            result += rule(*(x[getattr(joint, place)] for x, place in zip((first, second), places)))
        return result

    def move(self, q: Scalars, u: Scalars) -> Values:
        """The position after a tangent u from q, quaternions of length 1."""
        return self.by_joint(lambda p, u: normalized(product(p, exponential(u))), plus, q, u, "q", "qd")

    def difference(self, q1: Scalars, q0: Scalars) -> Values:
        """The tangent from q0 to q1, (nv,): of a ball the shortest."""
        return self.by_joint(lambda p, p0: logarithm(product(conjugate(p0), p)), minus, q1, q0, "q", "q")

    def tangent(self, q: Scalars, dq: Scalars) -> Values:
        """The tangent that changes q by small dq, linear in dq."""

        def of_ball(p: Scalars, dp: Scalars) -> Values:
            return [2.0 * x for x in product(conjugate(p), dp)[1:]]

        return self.by_joint(of_ball, second, q, dq, "q", "q")

    def component_rates(self, q: Scalars, qd: Scalars) -> Values:
        """dq/dt at speeds qd, (nq,): of a ball p o (0, omega) / 2."""

        def of_ball(p: Scalars, omega: Scalars) -> Values:
            return [0.5 * x for x in product(p, [0.0, *omega])]

        return self.by_joint(of_ball, second, q, qd, "q", "qd")

    def rates(self, u: Scalars, qd: Scalars) -> Values:
        """du/dt at speeds qd, of a motion that has moved by u."""

        def of_ball(tangent: Scalars, speeds: Scalars) -> Values:
            u, omega = Vector(*tangent), Vector(*speeds)
            half = sqrt(u.dot(u) + TINY) * 0.5
            share = (1.0 - half * cos(half) / sin(half)) / (half * half) * 0.25
            once = u.cross(omega)
            return list(omega + once * 0.5 + u.cross(once) * share)

        return self.by_joint(of_ball, second, u, qd, "qd", "qd")


def second(_: Scalars, values: Scalars) -> Values:
    return list(values)


@lru_cache(maxsize=256)
def coordinates_of(kinds: tuple[str, ...]) -> Coordinates:
    joints, nq, nv = [], 0, 0
    for kind in kinds:
        positions, speeds = KINDS[kind]
        joints.append(Joint(kind, slice(nq, nq + positions), slice(nv, nv + speeds)))
        nq, nv = nq + positions, nv + speeds
    return Coordinates(tuple(joints), nq, nv)


def product(p: Scalars, r: Scalars) -> Values:
    (a, x, y, z), (b, u, v, w) = p, r
    return [
        a * b - x * u - y * v - z * w,
        a * u + x * b + y * w - z * v,
        a * v + y * b + z * u - x * w,
        a * w + z * b + x * v - y * u,
    ]


def conjugate(p: Scalars) -> Values:
    return [p[0], *(x * -1.0 for x in p[1:])]


def normalized(p: Scalars) -> Values:
    length = sqrt(sum((x * x for x in p[1:]), p[0] * p[0]))
    return [x / length for x in p]


def logarithm(p: Scalars) -> Values:
    """The tangent u, |u| at most pi rad, with exponential(u) = p / |p| or -p / |p|; of w = 0 that with p.

    No root of what vanishes, so that it has derivatives everywhere: the turn is halved, sin(a / 2) = sin(a) /
    (2 cos(a / 2)), until the series of the arc sine takes it, arcsin x = x (1 + x^2 / 6 (1 + ...)).
    """
    w, *v = normalized(p)
    side = sign(w)
    cosine, scale = w * side, side
    for _ in range(HALVINGS):
        cosine = sqrt((cosine + 1.0) * 0.5)
        scale = scale * 0.5 / cosine
    v = Vector(*v) * scale
    square, share = v.dot(v), 1.0
    zero = square - square  # so that quotients have the digits of its type
    for k in range(TERMS, 0, -1):
        ratio = (zero + (2.0 * k - 1.0) ** 2) / (2.0 * k * (2.0 * k + 1.0))
        share = share * (square * ratio) + 1.0
    return list(v * (share * 2.0 ** (HALVINGS + 1)))


def exponential(u: Scalars) -> Values:
    x, y, z = u
    half = sqrt(x * x + y * y + z * z + TINY) * 0.5
    share = sin(half) / half * 0.5
    return [cos(half), x * share, y * share, z * share]
