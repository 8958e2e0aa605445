"""The method beside Lagrange's equations: energies alone, 50 digits.

Energies are functions of coordinates q and rates qd, where a ball has the four components of its quaternion; the speeds u are
in qd = N(q) u, for a ball pd = p o (0, omega) / 2. Lagrange's equations along the motions that keep the quaternion's length,
the columns of N:

    Mbar_ij = n_i' (d2T / dqd dqd) n_j,   h_i = n_i' (d/dt dT/dqd - d(T - V)/dq) with u constant.

No Jacobian, no rule for velocities and no convective term: rates of positions and of rotation matrices, like all
derivatives, are central differences of STEP in numbers of DIGITS digits, right to more than 50; T is a quadratic form in
the rates, so that differences in them are exact.
"""

import dataclasses

import mpmath
import numpy as np
import pytest
from trees import random_state, small_tree, tree_of_kinds

from tmt.exact.values import exact

DIGITS = 150
STEP = mpmath.mpf(10) ** -35  # errors: of order STEP^2, and 10^-DIGITS / STEP^2
NUMBERS = ("offset", "axis", "mass", "com", "inertia", "gravity", "armature", "stiffness", "rest", "reference")
mp = np.vectorize(mpmath.mpf, otypes=[object])
IDENTITY = mp(np.eye(3))


def unit(vector):
    return vector / mpmath.norm(vector)


class Lagrange:
    """Mbar and h of a Tree, and the force of its springs, whose balls have the same armature about their three axes."""

    def __init__(self, tree):
        self.tree, self.joints = tree, tree.coordinates.joints
        vars(self).update({name: mp(getattr(tree, name)) for name in NUMBERS})

    def equations(self, q, u):
        q, u = mp(q), mp(u)

        def along(function, direction, step=STEP):
            return (function(step * direction) - function(-step * direction)) / (2 * step)

        n = self.tangents(q)
        energies = [self.kinetic(q, one) for one in n]
        M = np.array([[self.kinetic(q, a + b) - x - y for b, y in zip(n, energies)] for a, x in zip(n, energies)])

        def momentum(moved, one):
            now = u @ self.tangents(q + moved)
            return along(lambda change: self.kinetic(q + moved, now + change), one, step=1)

        def lagrangian(moved):
            return self.kinetic(q + moved, u @ n) - self.potential(q + moved)

        h = [along(lambda moved, one=one: momentum(moved, one), u @ n) - along(lagrangian, one) for one in n]
        return M, np.array(h), np.array([along(lambda moved: self.of_springs(q + moved), one) for one in n])

    def kinetic(self, q, qd):
        """Of the bodies, m xd^2 / 2 + tr(Rd J Rd') / 2 with J = tr(I) / 2 - I, and of the armatures."""
        before, after = (self.places(q + step * qd) for step in (-STEP, STEP))
        T = 0
        for mass, inertia, (x0, R0), (x1, R1) in zip(self.mass, self.inertia, before, after):
            xd, Rd = (x1 - x0) / (2 * STEP), (R1 - R0) / (2 * STEP)
            J = np.trace(inertia) / 2 * IDENTITY - inertia
            T += mass * (xd @ xd) / 2 + np.sum((Rd @ J) * Rd) / 2
        for kind, at, by in self.joints:  # of a ball omega = 2 |pd|
            T += self.armature[by.start] * (qd[at] @ qd[at]) * (2 if kind == "ball" else mpmath.mpf(1) / 2)
        return T

    def potential(self, q):
        return -sum(mass * (self.gravity @ x) for mass, (x, _) in zip(self.mass, self.places(q)))

    def of_springs(self, q):
        """Energy by how far each joint is from the rest of its spring: of a ball the angle of one turn."""
        energy = 0
        for k, (kind, at, _) in zip(self.stiffness, self.joints):
            off = q[at.start] - self.rest[at.start]
            if kind == "ball":
                off = 2 * mpmath.acos(abs(unit(q[at]) @ unit(self.rest[at])))
            energy += k * off**2 / 2
        return energy

    def places(self, q) -> list:
        """Of each body: its CoM in the world, and its rotation matrix."""
        frames = {-1: (0 * IDENTITY[0], IDENTITY)}
        for i, (kind, at, by) in enumerate(self.joints):
            x, R = frames[self.tree.parent[i]]
            x, axis = x + R @ self.offset[i], unit(self.axis[by.start])
            if kind == "ball":
                third = unit(np.cross(axis, self.axis[by][1]))
                frame = np.array([axis, np.cross(third, axis), third])  # its rows are the axes
                R = R @ frame.T @ turn(*q[at]) @ frame
            elif kind == "slide":
                x = x + R @ axis * (q[at.start] - self.reference[i])
            else:
                half = (q[at.start] - self.reference[i]) / 2
                R = R @ turn(mpmath.cos(half), *(axis * mpmath.sin(half)))
            frames[i] = x, R
        carriers = [frames[joint] for joint in self.tree.body_hinge]
        return [(x + R @ com, R) for (x, R), com in zip(carriers, self.com)]

    def tangents(self, q) -> np.ndarray:
        """N', (nv, nq): qd = N u."""
        N = mp(np.zeros((len(q), len(self.axis))))
        for kind, at, by in self.joints:
            w, x, y, z = q[at] / 2 if kind == "ball" else 4 * [mpmath.mpf(1)]
            N[at, by] = [[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]] if kind == "ball" else w
        return N.T


def turn(w, x, y, z):
    """The rotation matrix of a quaternion of length 1."""
    v, cross = np.array([x, y, z]), np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (w * w - v @ v) * IDENTITY + 2 * np.outer(v, v) + 2 * w * cross


@pytest.mark.parametrize("make", [small_tree, lambda: tree_of_kinds(np.random.default_rng(7), bodies=1)])
def test_the_method_is_lagranges_equations_for_every_kind_of_joint(make, rng):
    tree = make()
    armature, (q, qd, tau) = np.array(tree.armature), random_state(rng, tree)
    for joint in tree.coordinates.balls:
        armature[joint.qd] = 0.25
        q[joint.q] = rng.choice([-0.5, 0.5], 4)  # of length 1 exactly
    tree = dataclasses.replace(tree, armature=armature)
    truth = exact(tree, q, qd, tau)
    with mpmath.workdps(DIGITS):
        M, h, springs = Lagrange(tree).equations(q, qd)
        for found, expected in ((truth.mass_matrix, M), (truth.bias, h), (truth.spring_torque, springs)):
            assert abs(found - expected).max() < 1e-35 and abs(expected).max() > 0.1
    assert set(tree.kind) >= {"slide", "ball"}
