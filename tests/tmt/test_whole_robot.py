"""The quantities of the whole robot, and the matrices that follow from Mbar and h: beside MuJoCo and their own laws."""

import mujoco
import numpy as np
import pytest
from helpers.crane import crane
from helpers.trees import random_states, small_tree, tree_of_kinds
from models import PATHS

import compare
import tmt
from compare.engines.mujoco import parse

TREES = {"arm": tmt.ARM, "balls": tree_of_kinds(np.random.default_rng(3)), "gains": small_tree()}


@pytest.mark.parametrize("name", ["gripper", "free_body"])
def test_they_are_those_of_mujoco(name, rng):
    model = mujoco.MjModel.from_xml_path(str(PATHS[name]))
    tree, data = compare.tree(model), mujoco.MjData(model)
    q = data.qpos.copy()
    mujoco.mj_integratePos(model, q, rng.normal(size=model.nv), 1.0)
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    jacobian, angular = np.zeros((2, 3, model.nv))
    mujoco.mj_jacSubtreeCom(model, data, jacobian, 0)
    mujoco.mj_angmomMat(model, data, angular, 0)
    mass = sum(tree.mass)
    assert np.abs(tmt.com(tree, q) - data.subtree_com[0]).max() < 1e-13
    assert np.abs(tmt.com_jacobian(tree, q) - jacobian).max() < 1e-13
    momentum = tmt.centroidal_momentum_matrix(tree, q)
    assert np.abs(momentum - np.concatenate([mass * jacobian, angular])).max() < 1e-13 * max(1.0, mass)


def test_bodies_that_never_move_count_where_the_tree_has_them(tmp_path, rng):
    robot = crane(tmp_path)  # with a foot of 4 kg on the world
    mujoco_of_it, q = parse(robot.mjcf, robot.tree).of(robot.case()), rng.uniform(-1.0, 1.0, (3, 4))
    for name in ("com", "com_jacobian", "centroidal_momentum_matrix"):
        assert np.abs(getattr(tmt, name)(robot.tree, q) - getattr(mujoco_of_it, name)(q)).max() < 1e-14
    assert np.abs(tmt.com(robot.tree, q)[:, 1]).min() > 0.01


@pytest.mark.parametrize("tree", TREES.values(), ids=TREES)
def test_coriolis_matrix_has_the_velocity_part_of_h_and_is_half_of_the_rate_of_mbar_but_for_a_skew_part(
    tree, rng
):
    q, qd, _ = random_states(rng, tree, 4)
    C = tmt.coriolis_matrix(tree, q, qd)
    moving = tmt.bias(tree, q, qd) - tmt.gravity_balance(tree, q)
    assert np.abs((C @ qd[..., None])[..., 0] - moving).max() < 1e-12
    ends = [
        tmt.mass_matrix(tree, np.array([tree.coordinates.move(x, step * v) for x, v in zip(q, qd)]))
        for step in (1e-5, -1e-5)
    ]
    left = (ends[0] - ends[1]) / 2e-5 - 2.0 * C
    assert np.abs(left + left.swapaxes(1, 2)).max() < 1e-6 < np.abs(left).max()


def test_coriolis_matrix_of_hinges_is_of_christoffel_symbols(rng):
    q, qd, _ = random_states(rng, tmt.ARM, 1)
    steps = 1e-5 * np.eye(3)
    by_q = np.array(
        [(tmt.mass_matrix(tmt.ARM, q[0] + e) - tmt.mass_matrix(tmt.ARM, q[0] - e)) / 2e-5 for e in steps]
    )
    expected = sum(0.5 * qd[0, k] * (by_q[k] + by_q[:, :, k].T - by_q[:, :, k]) for k in range(3))
    assert np.abs(tmt.coriolis_matrix(tmt.ARM, q[0], qd[0]) - expected).max() < 1e-8


@pytest.mark.parametrize("tree", TREES.values(), ids=TREES)
def test_regressor_times_the_numbers_of_the_bodies_is_the_torque(tree, rng):
    q, qd, qdd = random_states(rng, tree, 4)
    Y = tmt.regressor(tree, q, qd, qdd)
    torque = (tmt.mass_matrix(tree, q) @ qdd[..., None])[..., 0] + tmt.bias(tree, q, qd)
    torque -= np.array(tree.armature) * qdd
    assert Y.shape == (4, tree.nv, 10 * len(tree.mass))
    assert np.abs(Y @ tree.inertial_parameters - torque).max() < 1e-12 * max(1.0, np.abs(torque).max())


JOINTS = [
    tmt.Joint("base", "free", offset=(0.2, 0.1, 0.5), mass=2.0, inertia=(0.1, 0.2, 0.15)),
    tmt.Joint("hip", offset=(0.1, 0.0, -0.2), axis=(0.0, 1.0, 0.0), damping=0.3),
    tmt.Joint("leg", axis=(1.0, 0.0, 0.0), mass=0.7, com=(0.0, 0.0, -0.2), inertia=(0.02, 0.03, 0.02, 0.002, 0.001, 0.003)),
    tmt.Joint("eye", "ball", parent="base", offset=(0.3, 0.0, 0.0), mass=0.1, com=(0.0, 0.01, 0.0), inertia=np.eye(3) * 1e-3),
    tmt.Joint("rail", "slide", parent=None, axis=(0.0, 0.0, 1.0), mass=1.0, stiffness=4.0, armature=0.2),
]  # fmt: skip
WRITTEN = """
<mujoco><compiler angle="radian"/><worldbody>
<body name="base"><freejoint/><inertial pos="0 0 0" mass="2" diaginertia=".1 .2 .15"/>
<body name="leg" pos=".1 0 -.2"><joint axis="0 1 0" damping=".3"/><joint axis="1 0 0"/>
<inertial pos="0 0 -.2" mass=".7" fullinertia=".02 .03 .02 .002 .001 .003"/></body>
<body name="eye" pos=".3 0 0"><joint type="ball"/><inertial pos="0 .01 0" mass=".1" diaginertia=".001 .001 .001"/></body></body>
<body name="rail"><joint type="slide" axis="0 0 1" stiffness="4" armature=".2"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>
</worldbody></mujoco>"""


def test_a_tree_written_joint_by_joint_is_that_of_the_same_file(rng):
    written, read = tmt.Tree.from_joints(JOINTS), compare.tree(WRITTEN)
    assert (written.nq, written.nv) == (read.nq, read.nv) == (14, 12)
    assert written.joint_names[:5] == ("base x", "base y", "base z", "base turn", "hip")
    q, qd, tau = random_states(rng, read, 3)
    shift = np.zeros(read.nq)
    shift[:3] = 0.2, 0.1, 0.5  # MuJoCo has the place itself as coordinates
    assert np.allclose(tmt.com(written, q - shift), tmt.com(read, q), atol=1e-14)
    found, expected = (tmt.acceleration(tree, q, qd, tau) for tree in (written, read))
    assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()


WRONG = {
    "parent": [tmt.Joint("a", parent="b", mass=1.0)], "inertia": [tmt.Joint("a", mass=1.0, inertia=(1.0, 1.0))],
    "tmt.Joint": ["a"], "offset": [], "rotor": [tmt.Joint("rotor", "rotor", mass=1.0)],
}  # fmt: skip


@pytest.mark.parametrize("word", WRONG)
def test_what_is_no_joint_is_said_in_a_line(word):
    with pytest.raises(ValueError, match=word) as error:
        tmt.Tree.from_joints(WRONG[word])
    assert "\n" not in str(error.value)
