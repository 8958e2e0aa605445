"""Mbar and h of hinges, slides, ball joints and free bodies from Lagrange's equations: energies alone, 50 digits.

Energies are functions of coordinates q and rates qd, where a ball joint has the four components of its quaternion; the
speeds u are in qd = N(q) u, for a ball pd = p o (0, omega) / 2. Lagrange's equations along the motions that keep the
quaternion's length, the columns of N:

    Mbar_ij = n_i' (d2T / dqd dqd) n_j,   h_i = n_i' (d/dt dT/dqd - d(T - V)/dq) with u constant.

No Jacobian, no rule for velocities and no convective term: rates of positions and of rotation matrices, like all
derivatives, are central differences of STEP in numbers of DIGITS digits, right to more than 50; T is a quadratic form in
the rates, so that differences in them are exact.

All numbers are in SI units and are meant as what they are exactly: floats, or numbers of mpmath. Directions of slides and
hinges are not scaled: a hinge's must have length 1 to as many digits as the result shall have. Quaternions, w first, child
to parent, are scaled to length 1. Speeds of a ball are in the child's axes.
"""

from collections.abc import Sequence
from typing import NamedTuple

import mpmath
import numpy as np

DIGITS = 150
STEP = mpmath.mpf(10) ** -35  # errors: of order STEP^2, and 10^-DIGITS / STEP^2
PARTS = {"hinge": (1, 1), "slide": (1, 1), "ball": (4, 3)}  # coordinates and speeds


class Joint(NamedTuple):
    """As of a tmt.Tree: at q = 0 the frame is parallel to its parent's, its origin at offset in it."""

    kind: str
    parent: int = -1  # index of a joint before this one, -1: the world
    offset: Sequence = (0, 0, 0)
    axis: Sequence | None = None  # of a hinge or slide
    armature: float = 0  # of a ball: the same about its three axes
    stiffness: float = 0
    rest: float | Sequence = 0  # of the spring; of a ball: a quaternion


class Body(NamedTuple):
    """Carried by a joint; com and inertia, (3, 3) about the CoM, in the joint's frame."""

    joint: int
    mass: float
    com: Sequence
    inertia: Sequence


class Equations(NamedTuple):
    """Mbar ud + h = tau + spring_force: object arrays of numbers of mpmath."""

    mass_matrix: np.ndarray  # (nv, nv)
    bias: np.ndarray  # (nv,)
    spring_force: np.ndarray  # (nv,)


def cart(q, qd, rail, anchor, axis, mass, com, inertia, gravity, armature=(0, 0), stiffness=(0, 0), rest=(0, 0)):
    """A body on a slide and a body on a hinge on it; q, qd: (2,) m and rad, and per s.

    rail: the slide's direction; anchor: of the hinge on the cart; mass: (2,); com, inertia: of the pendulum.
    """
    springs = list(zip(armature, stiffness, rest))
    joints = [Joint("slide", -1, (0, 0, 0), rail, *springs[0]), Joint("hinge", 0, anchor, axis, *springs[1])]
    bodies = [Body(0, mass[0], (0, 0, 0), np.zeros((3, 3))), Body(1, mass[1], com, inertia)]
    return equations(joints, bodies, gravity, q, qd)


def spherical_pendulum(quaternion, omega, mass, com, inertia, gravity, armature=0):
    """A body on a ball joint; omega: (3,) rad/s in its own axes; com from the joint."""
    return equations([Joint("ball", armature=armature)], [Body(0, mass, com, inertia)], gravity, quaternion, omega)


def free_body(position, quaternion, velocity, omega, mass, com, inertia, gravity, armature=0):
    """A free body; u: velocity of its origin in world axes, m/s, and omega in its own, rad/s; com from the origin."""
    slides = [Joint("slide", i - 1, axis=axis, armature=armature) for i, axis in enumerate(np.eye(3))]
    joints = [*slides, Joint("ball", 2, armature=armature)]
    return equations(joints, [Body(3, mass, com, inertia)], gravity, [*position, *quaternion], [*velocity, *omega])


def equations(joints: Sequence[Joint], bodies: Sequence[Body], gravity, q, u) -> Equations:
    """Of any tree at one state; q: (nq,), u: (nv,), joint by joint."""
    with mpmath.workdps(DIGITS):
        joints = [joint._replace(**exactly(joint._asdict())) for joint in joints]
        bodies = [body._replace(**exactly(body._asdict())) for body in bodies]
        gravity, q, u = mp(gravity), unit(joints, mp(q)), mp(u)

        def kinetic(q, qd):
            return kinetic_energy(joints, bodies, q, qd)

        def lagrangian(q, qd):
            return kinetic(q, qd) - potential_energy(joints, bodies, gravity, q)

        def along(function, direction, step=STEP):
            return (function(step * direction) - function(-step * direction)) / (2 * step)

        n = tangents(joints, q).T
        qd = u @ n
        energies = [kinetic(q, one) for one in n]
        M = np.array([[kinetic(q, a + b) - x - y for b, y in zip(n, energies)] for a, x in zip(n, energies)])

        def momentum(moved, one):
            now = u @ tangents(joints, q + moved).T
            return along(lambda change: kinetic(q + moved, now + change), one, step=1)

        h = [
            along(lambda moved, one=one: momentum(moved, one), qd) - along(lambda moved: lagrangian(q + moved, qd), one)
            for one in n
        ]
        springs = [-along(lambda moved: spring_energy(joints, q + moved), one) for one in n]
    return Equations(M, np.array(h), np.array(springs))


# energies


def kinetic_energy(joints, bodies, q, qd):
    """Of the bodies, m xd^2 / 2 + tr(Rd J Rd') / 2 with J = tr(I) / 2 - I, and of the armatures."""
    before, after = (places(joints, bodies, q + step * qd) for step in (-STEP, STEP))
    T = 0
    for body, (x0, R0), (x1, R1) in zip(bodies, before, after):
        xd, Rd = (x1 - x0) / (2 * STEP), (R1 - R0) / (2 * STEP)
        J = np.trace(body.inertia) / 2 * IDENTITY - body.inertia
        T += body.mass * (xd @ xd) / 2 + np.sum((Rd @ J) * Rd) / 2
    for joint, rates in zip(joints, split(joints, qd)):
        T += joint.armature * (rates @ rates) * (2 if joint.kind == "ball" else mpmath.mpf(1) / 2)  # omega = 2 |pd|
    return T


def potential_energy(joints, bodies, gravity, q):
    return -sum(body.mass * (gravity @ x) for body, (x, _) in zip(bodies, places(joints, bodies, q)))


def spring_energy(joints, q):
    return sum(j.stiffness * turned(j, value) ** 2 / 2 for j, value in zip(joints, split(joints, q)) if j.stiffness)


def turned(joint, value):
    """How far a joint is from the rest position of its spring: m or rad, of a ball the angle of one turn."""
    if joint.kind != "ball":
        return value[0] - joint.rest
    return 2 * mpmath.acos(abs(value @ joint.rest) / mpmath.norm(value))


# positions


def places(joints, bodies, q) -> list:
    """Of each body: its CoM in the world, and its rotation matrix."""
    frames = {-1: (0 * IDENTITY[0], IDENTITY)}
    for i, (joint, value) in enumerate(zip(joints, split(joints, q))):
        x, R = frames[joint.parent]
        x = x + R @ joint.offset
        if joint.kind == "slide":
            x = x + R @ joint.axis * value[0]
        else:
            R = R @ (ball_turn(value) if joint.kind == "ball" else hinge_turn(joint.axis, value[0]))
        frames[i] = x, R
    return [(frames[b.joint][0] + frames[b.joint][1] @ b.com, frames[b.joint][1]) for b in bodies]


def hinge_turn(axis, angle):
    """The rotation matrix of a turn about an axis of length 1: Rodrigues."""
    x, y, z = axis
    cross, along = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.outer(axis, axis)
    return along + (IDENTITY - along) * mpmath.cos(angle) + cross * mpmath.sin(angle)


def ball_turn(p):
    """The rotation matrix of a quaternion of length 1."""
    w, x, y, z = p
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )


def tangents(joints, q) -> np.ndarray:
    """N, (nq, nv): qd = N u."""
    N = np.full((len(q), sum(PARTS[joint.kind][1] for joint in joints)), mpmath.mpf(0))
    row = column = 0
    for joint, value in zip(joints, split(joints, q)):
        rows, columns = PARTS[joint.kind]
        part = np.array([[1]])
        if joint.kind == "ball":
            w, x, y, z = value / 2
            part = np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
        N[row : row + rows, column : column + columns] = part
        row, column = row + rows, column + columns
    return N


# numbers


def split(joints, q) -> list:
    """The coordinates of each joint."""
    return np.split(q, np.cumsum([PARTS[joint.kind][0] for joint in joints])[:-1])


def unit(joints, q) -> np.ndarray:
    """q with quaternions of length 1."""
    parts = zip(joints, split(joints, q))
    return np.concatenate([part / mpmath.norm(part) if joint.kind == "ball" else part for joint, part in parts])


def exactly(fields) -> dict:
    """The fields that are real numbers as numbers of mpmath."""
    names = [name for name, value in fields.items() if name not in ("kind", "parent", "joint") and value is not None]
    return {name: mp(fields[name])[()] for name in names}


mp = np.vectorize(mpmath.mpmathify, otypes=[object])
IDENTITY = mp(np.eye(3))
