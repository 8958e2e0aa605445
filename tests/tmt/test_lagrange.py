"""Lagrange's equations of every kind of joint compared with MuJoCo, with plain formulas and with tmt."""

from dataclasses import replace

import mpmath
import mujoco
import numpy as np
import pytest
from lagrange import PARTS, Body, Joint, cart, equations, free_body, spherical_pendulum
from trees import random_tree

from tmt.exact.values import exact

GRAVITY = (1.0, -2.0, -9.0)


def random_inertia(rng):
    spread = rng.uniform(-0.3, 0.3, (6, 3))
    return sum(np.dot(r, r) * np.eye(3) - np.outer(r, r) for r in spread)


def direction(rng):
    axis = rng.normal(size=3)
    return axis / np.linalg.norm(axis)


def random_joints(rng, kinds, parents):
    """Joints of these kinds and a body on each."""
    joints, bodies = [], []
    for i, (kind, parent) in enumerate(zip(kinds, parents)):
        armature, stiffness = rng.uniform(0.1, 1.0, 2)
        axis, rest = (None, (1, 0, 0, 0)) if kind == "ball" else (direction(rng), rng.normal())
        joints.append(Joint(kind, parent, rng.uniform(-0.4, 0.4, 3), axis, armature, stiffness, rest))
        bodies.append(Body(i, rng.uniform(0.5, 2.0), rng.uniform(-0.3, 0.3, 3), random_inertia(rng)))
    return joints, bodies


def numbers(values):
    return " ".join(repr(float(v)) for v in np.ravel(values))


def inertial(mass, com, inertia):
    """Principal moments and axes: MuJoCo turns a fullinertia only to about 1e-8."""
    moments, axes = np.linalg.eigh(np.array(inertia, dtype=float))
    axes[:, 0] *= np.linalg.det(axes)
    turn = f'xyaxes="{numbers(axes[:, :2].T)}" diaginertia="{numbers(moments)}"'
    return f'<inertial pos="{numbers(com)}" mass="{numbers(mass)}" {turn}/>'


def loaded(bodies):
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler angle="radian" inertiafromgeom="false" balanceinertia="false"/>
        <option gravity="{numbers(GRAVITY)}"><flag contact="disable" constraint="disable"/></option>
        <worldbody>{bodies}</worldbody></mujoco>"""
    )


def in_mujoco(joints, bodies):
    """The MJCF of joints that carry a body each, in the order of MuJoCo: depth first."""

    def body(i):
        j, b = joints[i], bodies[i]
        line = f'<joint type="{j.kind}" armature="{numbers(j.armature)}" stiffness="{numbers(j.stiffness)}"'
        line += "/>" if j.kind == "ball" else f' axis="{numbers(j.axis)}" springref="{numbers(j.rest)}"/>'
        inside = "".join(body(child) for child, other in enumerate(joints) if other.parent == i)
        return f'<body pos="{numbers(j.offset)}">{line}{inertial(b.mass, b.com, b.inertia)}{inside}</body>'

    return loaded("".join(body(i) for i, joint in enumerate(joints) if joint.parent == -1))


def assert_mujoco_agrees(found, model, q, u):
    data = mujoco.MjData(model)
    data.qpos, data.qvel = q, u
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    for value, expected in zip(found, (full, data.qfrc_bias, data.qfrc_spring)):
        assert np.abs(value.astype(float) - expected).max() < 1e-13 * max(1.0, np.abs(expected).max())


def quaternion(rng):
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def state(rng, kinds):
    q = np.concatenate([quaternion(rng) if kind == "ball" else rng.normal(size=1) for kind in kinds])
    return q, 3.0 * rng.normal(size=sum(PARTS[kind][1] for kind in kinds))


@pytest.mark.parametrize(
    "kinds, parents",
    [
        ("hinge slide ball", (-1, 0, 1)),
        ("slide ball slide hinge", (-1, 0, 1, 0)),
    ],
)
def test_trees_of_every_kind_of_joint_in_mujoco(rng, kinds, parents):
    kinds = kinds.split()
    joints, bodies = random_joints(rng, kinds, parents)
    q, u = state(rng, kinds)
    found = equations(joints, bodies, GRAVITY, q, u)
    assert_mujoco_agrees(found, in_mujoco(joints, bodies), q, u)
    assert np.abs(found.spring_force).min() > 1e-3


def test_a_cart_on_a_tilted_rail_with_a_pendulum_in_mujoco(rng):
    rail, axis, anchor, com, inertia = (
        direction(rng),
        direction(rng),
        rng.normal(size=3),
        rng.normal(size=3),
        random_inertia(rng),
    )
    mass, armature, stiffness, rest = (2.0, 0.7), (0.3, 0.02), (40.0, 0.0), (0.25, 0.0)
    model = loaded(
        f"""<body><joint type="slide" axis="{numbers(rail)}" armature="0.3" stiffness="40" springref="0.25"/>
        <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/><body pos="{numbers(anchor)}">
        <joint axis="{numbers(axis)}" armature="0.02"/>{inertial(0.7, com, inertia)}</body></body>"""
    )
    for _ in range(3):
        q, qd = rng.normal(size=2), 3.0 * rng.normal(size=2)
        found = cart(q, qd, rail, anchor, axis, mass, com, inertia, GRAVITY, armature, stiffness, rest)
        assert_mujoco_agrees(found, model, q, qd)
        assert found.spring_force[0] == pytest.approx(-40.0 * (q[0] - 0.25)) and found.spring_force[1] == 0


def test_a_free_body_in_mujoco(rng):
    com, inertia = rng.normal(size=3), random_inertia(rng)
    model = loaded(f'<body><joint type="free" armature="0.4"/>{inertial(1.3, com, inertia)}</body>')
    for _ in range(1):
        x, p, v, w = rng.normal(size=3), quaternion(rng), rng.normal(size=3), 3.0 * rng.normal(size=3)
        found = free_body(x, p, v, w, 1.3, com, inertia, GRAVITY, 0.4)
        assert_mujoco_agrees(found, model, [*x, *p], [*v, *w])


def test_newton_and_euler_for_a_spherical_pendulum_and_a_free_body(rng):
    """Mbar = J, h = omega x J omega - r x m R'g to 50 digits; a free body has m r crossed with both beside."""
    m, r, inertia = 1.25, np.array([0.5, -0.25, 0.75]), random_inertia(rng)
    with mpmath.workdps(50):
        exactly = np.vectorize(mpmath.mpf, otypes=[object])
        p, w, r, inertia, gravity = map(exactly, (rng.normal(size=4), rng.normal(size=3), r, inertia, GRAVITY))
        R = rotation_matrix(p / mpmath.norm(p))
        J = inertia + m * (np.dot(r, r) * exactly(np.eye(3)) - np.outer(r, r))
        turning = np.cross(w, J @ w) - m * np.cross(r, R.T @ gravity)
        found = spherical_pendulum(p, w, m, r, inertia, gravity)
        assert abs(found.mass_matrix - J).max() < 1e-49 and abs(found.bias - turning).max() < 1e-48

        r_cross = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
        M = np.block([[m * exactly(np.eye(3)), -m * R @ r_cross], [m * r_cross @ R.T, J]])
        h = [*(R @ (m * np.cross(w, np.cross(w, r))) - m * gravity), *turning]
        found = free_body((1, 2, 3), p, (3, 2, 1), w, m, r, inertia, gravity)
        assert abs(found.mass_matrix - M).max() < 1e-49 and abs(found.bias - h).max() < 1e-48


def rotation_matrix(p):
    w, v = p[0], p[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3, dtype=int) + 2 * w * cross + 2 * cross @ cross


def test_trees_of_hinges_in_tmt(rng):
    """To more than 45 digits, where the axes have length 1 to as many: along the axes of the frames."""
    tree = random_tree(rng, bodies=2)
    n = len(tree.parent)
    tree = replace(tree, axis=np.eye(3)[rng.integers(3, size=n)])
    joints = [Joint("hinge", *row) for row in zip(tree.parent, tree.offset, tree.axis)]
    bodies = list(map(Body, tree.body_hinge, tree.mass, tree.com, tree.inertia))
    q, qd = rng.uniform(-np.pi, np.pi, n), rng.uniform(-10, 10, n)
    found, expected = equations(joints, bodies, tree.gravity, q, qd), exact(tree, q, qd, np.zeros(n))
    with mpmath.workdps(50):
        assert abs(found.mass_matrix - expected.mass_matrix).max() < 1e-47
        assert abs(found.bias - expected.bias).max() < 1e-45
