"""Momenta that no inner force changes, against the bodies' own, and against their motion."""

import dataclasses

import numpy as np
import pytest
from models import PATHS

import tmt
from compare.engines.mujoco import read
from compare.experiments.acceleration import rate
from compare.truth.conserved import conserved
from tmt.equations import method


def tree_of(name):
    return read(PATHS[name]).tree


def some_state(rng, tree):
    """q (1, nq) and qd (1, nv), its quaternions of length 1."""
    u, qd = rng.normal(size=(2, tree.coordinates.nv))
    return np.array([tree.coordinates.move(list(tree.zero), list(u))], dtype=float), qd[None]


def test_a_free_robot_has_the_momenta_of_its_bodies(rng):
    """Linear and angular about the origin: sums over the bodies alone, without rotors."""
    tree = tree_of("quadruped")
    q, qd = some_state(rng, tree)
    found = [m.momentum(list(q[0]), list(qd[0])) for m in conserved(tree)]
    x, (T, B) = tmt.com_positions(q, tree)[0], tmt.jacobians(q, tree)
    linear, angular, frames = np.zeros(3), np.zeros(3), method.joint_frames(tree, q[0].tolist())
    for b, mass in enumerate(tree.mass):
        p = mass * T[0, b] @ qd[0]
        turn = np.array([list(row) for row in frames[tree.body_hinge[b]].turn])
        linear, angular = linear + p, angular + np.cross(x[b], p) + turn @ np.array(tree.inertia[b]) @ B[0, b] @ qd[0]
    assert np.allclose(found, [linear, angular], atol=1e-12)


@pytest.mark.parametrize("name", ["quadruped", "pendulum_ball", "gripper", "mixed"])
def test_it_changes_by_the_force_at_the_joints_that_carry_all(name, rng):
    tree = dataclasses.replace(tree_of(name), gravity=(0.0, 0.0, 0.0))
    q, qd = some_state(rng, tree)
    tau = rng.normal(size=qd.shape)
    qdd = tmt.acceleration(q, qd, tau, tree)
    force = tau - np.array(tree.damping) * qd - tmt.spring_torque(q, tree)
    for momentum in conserved(tree):
        change, effect = np.stack(rate(momentum.momentum, tree, q, qd, qdd), axis=-1), momentum.effect(q, force)
        assert np.allclose(change, effect, atol=1e-10 * np.abs(force).max() * tree.coordinates.nv)
        assert (np.abs(effect) <= momentum.size(q, np.abs(force)) * (1 + 1e-12)).all()


def names(tree):
    return [momentum.name.removesuffix(" momentum") for momentum in conserved(tree)]


def test_which_momenta_there_are():
    """Those at the joint that carries all; rotors that turn with it, alike about all of its axes, leave them."""
    arm, ball, free = map(tree_of, ("arm6", "pendulum_ball", "free_body"))
    assert names(arm) == [f"p_{arm.hinge_names[0]}"] and conserved(arm)[0].unit == "N m"
    assert conserved(dataclasses.replace(arm, kind=("slide", *arm.kind[1:])))[0].unit == "N"
    for tree, armature, left in (
        (ball, ball.armature, ["angular"]),
        (ball, (0.1, 0.1, 0.2, 0, 0, 0), []),
        (ball, (0.1, 0.1, 0.1, 0, 0.3, 0), ["angular"]),
        (free, (0, 0, 0, 0.1, 0, 0), ["linear"]),
        (free, (0.2,) * 3 + (0.1,) * 3, ["linear", "angular"]),
    ):
        assert names(dataclasses.replace(tree, armature=armature)) == left


@pytest.mark.parametrize("name", ["position_gain", "speed_gain"])
def test_a_controller_at_the_joint_that_carries_all_takes_its_momentum_away(name):
    for place, left in (((0, 0), 0), ((0, 2), 0), ((2, 0), 1)):
        gain = np.zeros((3, 3))
        gain[place] = 2.0
        assert len(conserved(dataclasses.replace(tmt.ARM, **{name: gain}))) == left
