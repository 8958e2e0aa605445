"""The equations of any tree of hinges, slides and balls: what holds at any state, and Lagrange's equations."""

import dataclasses

import mpmath
import numpy as np
import pytest
from helpers.many_digits import exact
from helpers.trees import random_state, small_tree, tree_of_kinds
from hypothesis import given, settings
from hypothesis import strategies as st

import tmt
from tmt.derivation import articulated, composite, method

EPS = np.finfo(float).eps


@st.composite
def drawn_trees(draw):
    """A tree of up to four bodies, a state of it, and a generator of whatever else a test needs."""
    kinds = draw(st.sets(st.sampled_from(["hinge", "slide", "ball"]), min_size=1))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))  # hypothesis alone would draw mostly zeros
    tree = tree_of_kinds(rng, draw(st.integers(1, 4)), sorted(kinds))
    return tree, *random_state(rng, tree), rng


def of_trees(test):
    """The test, at 20 drawn trees."""
    return settings(max_examples=20)(given(drawn_trees())(test))


def assert_close(found, expected, scale=1.0, digits=1e-7):
    assert np.abs(found - expected).max() <= digits * (scale + np.abs(expected).max())


@of_trees
def test_composite_and_articulated_bodies_give_the_numbers_of_the_literal_sums(drawn):
    tree, *state, _ = drawn
    q, qd, tau = (part.tolist() for part in state)
    M, h = map(np.array, method.mass_matrix_and_bias(tree, q, qd))
    for form in (composite, articulated):
        for found, expected in zip(form.mass_matrix_and_bias(tree, q, qd), (M, h)):
            assert_close(np.array(found), expected, digits=1e-12)
    force = method.reduced_force(tree, [0.0] * len(qd), q, qd, tau)
    qdd = np.array(articulated.acceleration(tree, q, qd, force))
    assert_close(M @ qdd, force - h, np.abs(M).max() * np.abs(qdd).max(), 1e-12)


@settings(max_examples=20)
@given(drawn_trees(), st.data())
def test_a_locked_tree_is_the_sub_block_of_the_whole(drawn, data):
    tree, q, qd, *_ = drawn
    joints = tree.coordinates.joints
    locked = data.draw(st.sets(st.integers(0, len(joints) - 1), max_size=len(joints) - 1))
    held = {}
    for i in locked:
        position = q[joints[i].q]
        held[tree.joint_names[i]] = position if tree.kind[i] == "ball" else float(position[0])
    free = [joint for i, joint in enumerate(joints) if i not in locked]
    at = [k for joint in free for k in range(joint.q.start, joint.q.stop)]
    by = [k for joint in free for k in joint.speeds]
    qd[[k for k in range(len(qd)) if k not in by]] = 0.0
    smaller, state = tree.lock(held), (q[at], qd[by])
    assert smaller.joint_names == tuple(name for i, name in enumerate(tree.joint_names) if i not in locked)
    assert smaller.damping == tuple(tree.damping[k] for k in by)
    for found, whole in (
        (tmt.mass_matrix(smaller, q[at]), tmt.mass_matrix(tree, q)[np.ix_(by, by)]),
        (tmt.bias(smaller, *state), tmt.bias(tree, q, qd)[by]),
        (tmt.spring_torque(smaller, q[at]), tmt.spring_torque(tree, q)[by]),
        (tmt.com_positions(smaller, q[at]), tmt.com_positions(tree, q)),
    ):
        assert_close(found, whole, digits=1e-12)


DIGITS = 150
TINY = mpmath.mpf(10) ** -35  # errors: of order TINY^2, and 10^-DIGITS / TINY^2
NUMBERS = "offset", "axis", "mass", "com", "inertia", "gravity", "armature", "stiffness", "rest", "reference"
mp = np.vectorize(mpmath.mpf, otypes=[object])
IDENTITY = mp(np.eye(3))


def unit(vector):
    return vector / mpmath.norm(vector)


class Lagrange:
    """Mbar and h of a Tree, and the force of its springs, from energies alone; balls have one armature about all their axes.

    They are functions of q and its rates qd, where a ball has the four components of its quaternion; the speeds u are in
    qd = N(q) u, for a ball pd = p o (0, omega) / 2. Along the motions that keep the quaternion's length, the columns of N:

        Mbar_ij = n_i' (d2T / dqd dqd) n_j,   h_i = n_i' (d/dt dT/dqd - d(T - V)/dq) with u constant.

    No Jacobian, no rule for velocities, no convective term: all derivatives are central differences of TINY in numbers of
    DIGITS digits, right to more than 50; T is a quadratic form in the rates, so that differences in them are exact.
    """

    def __init__(self, tree):
        self.tree, self.joints = tree, tree.coordinates.joints
        vars(self).update({name: mp(getattr(tree, name)) for name in NUMBERS})

    def equations(self, q, u):
        q, u = mp(q), mp(u)

        def along(function, direction, step=TINY):
            return (function(step * direction) - function(-step * direction)) / (2 * step)

        n = self.tangents(q)
        energies = [self.kinetic(q, one) for one in n]
        tangents = list(zip(n, energies))
        M = np.array([[self.kinetic(q, a + b) - x - y for b, y in tangents] for a, x in tangents])

        def momentum(moved, one):
            now = u @ self.tangents(q + moved)
            return along(lambda change: self.kinetic(q + moved, now + change), one, step=1)

        def lagrangian(moved):
            return self.kinetic(q + moved, u @ n) - self.potential(q + moved)

        h = [along(lambda moved, one=one: momentum(moved, one), u @ n) - along(lagrangian, one) for one in n]
        return M, np.array(h), np.array([along(lambda moved: self.of_springs(q + moved), one) for one in n])

    def kinetic(self, q, qd):
        """Of the bodies, m xd^2 / 2 + tr(Rd J Rd') / 2 with J = tr(I) / 2 - I, and of the armatures."""
        before, after = (self.places(q + step * qd) for step in (-TINY, TINY))
        T = 0
        for mass, inertia, (x0, R0), (x1, R1) in zip(self.mass, self.inertia, before, after):
            xd, Rd = (x1 - x0) / (2 * TINY), (R1 - R0) / (2 * TINY)
            J = np.trace(inertia) / 2 * IDENTITY - inertia
            T += mass * (xd @ xd) / 2 + np.sum((Rd @ J) * Rd) / 2
        for joint in self.joints:  # of a ball omega = 2 |pd|
            share = 2 if joint.kind == "ball" else mpmath.mpf(1) / 2
            T += self.armature[joint.qd.start] * (qd[joint.q] @ qd[joint.q]) * share
        return T

    def potential(self, q):
        return -sum(mass * (self.gravity @ x) for mass, (x, _) in zip(self.mass, self.places(q)))

    def of_springs(self, q):
        """Energy by how far each joint is from the rest of its spring: of a ball the angle of one turn."""
        energy = 0
        for k, joint in zip(self.stiffness, self.joints):
            off = q[joint.q.start] - self.rest[joint.q.start]
            if joint.kind == "ball":
                off = 2 * mpmath.acos(abs(unit(q[joint.q]) @ unit(self.rest[joint.q])))
            energy += k * off**2 / 2
        return energy

    def places(self, q) -> list:
        """Of each body: its CoM in the world, and its rotation matrix."""
        frames = {-1: (0 * IDENTITY[0], IDENTITY)}
        for i, joint in enumerate(self.joints):
            x, R = frames[self.tree.parent[i]]
            x, axis = x + R @ self.offset[i], unit(self.axis[joint.qd.start])
            if joint.kind == "ball":
                third = unit(np.cross(axis, self.axis[joint.qd][1]))
                frame = np.array([axis, np.cross(third, axis), third])  # its rows are the axes
                R = R @ frame.T @ turn(*q[joint.q]) @ frame
            elif joint.kind == "slide":
                x = x + R @ axis * (q[joint.q.start] - self.reference[i])
            else:
                half = (q[joint.q.start] - self.reference[i]) / 2
                R = R @ turn(mpmath.cos(half), *(axis * mpmath.sin(half)))
            frames[i] = x, R
        carriers = [frames[joint] for joint in self.tree.body_joint]
        return [(x + R @ com, R) for (x, R), com in zip(carriers, self.com)]

    def tangents(self, q) -> np.ndarray:
        """N', (nv, nq): qd = N u."""
        N = mp(np.zeros((len(q), len(self.axis))))
        for joint in self.joints:
            N[joint.q, joint.qd] = mpmath.mpf(1)
            if joint.kind == "ball":
                w, x, y, z = q[joint.q] / 2
                N[joint.q, joint.qd] = [[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]
        return N.T


def turn(w, x, y, z):
    """The rotation matrix of a quaternion of length 1."""
    v, cross = np.array([x, y, z]), np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (w * w - v @ v) * IDENTITY + 2 * np.outer(v, v) + 2 * w * cross


@pytest.mark.parametrize("tree", [tmt.ARM, small_tree(), tree_of_kinds(np.random.default_rng(7), bodies=1)])
def test_the_method_is_lagranges_equations_for_every_kind_of_joint(tree, rng):
    armature, (q, qd, tau) = np.array(tree.armature), random_state(rng, tree)
    for joint in tree.coordinates.balls:
        armature[joint.qd] = 0.25
        q[joint.q] = rng.choice([-0.5, 0.5], 4)  # of length 1 exactly
    tree = dataclasses.replace(tree, armature=armature)
    truth = exact(tree, q, qd, tau)
    with mpmath.workdps(DIGITS):
        M, h, springs = Lagrange(tree).equations(q, qd)
        for found, expected in ((truth.mass_matrix, M), (truth.bias, h), (truth.spring_torque, springs)):
            assert abs(found - expected).max() < 1e-35
        assert min(abs(M).max(), abs(h).max()) > 0.1 and tree.has_springs == (abs(springs).max() > 0.1)
