"""The robots that other tests use: they have the features that they are made for, and they move."""

from collections import Counter

import mujoco
import numpy as np
import pytest
from models import KINDS, PATHS, random_tree

FREE, BALL, SLIDE, HINGE = range(4)  # mjtJoint
NAMES = ("free", "ball", "slide", "hinge")
JOINTS = {
    "arm6": {"hinge": 6}, "arm7": {"hinge": 7}, "free_body": {"free": 1}, "gripper": {"hinge": 2, "slide": 2},
    "humanoid29": {"hinge": 29}, "humanoid29_free": {"hinge": 29, "free": 1}, "loop": {"hinge": 3},
    "mixed": {"hinge": 4, "slide": 2, "ball": 1, "free": 1}, "pendulum_ball": {"ball": 2},
    "quadruped": {"hinge": 12, "free": 1},
}  # fmt: skip
WITH_SERVOS = ("arm6", "arm7", "humanoid29", "humanoid29_free", "quadruped")


@pytest.fixture(autouse=True)
def no_warning():
    """A warning of MuJoCo or of its compiler fails the test."""
    warned = []
    mujoco.set_mju_user_warning(warned.append)
    yield
    mujoco.set_mju_user_warning(None)
    assert not warned


def kinds(m) -> dict[str, int]:
    return dict(Counter(NAMES[kind] for kind in m.jnt_type))


def mass_matrix(m, d) -> np.ndarray:
    mujoco.mj_forward(m, d)
    found = np.zeros((m.nv, m.nv))
    mujoco.mj_fullM(m, d, found)
    return found


def after_100_steps(m, d) -> mujoco.MjData:
    mujoco.mj_step(m, d, nstep=100)
    assert not any(warning.number for warning in d.warning) and d.time > 99 * m.opt.timestep
    assert np.isfinite(d.qpos).all() and np.isfinite(d.qvel).all()
    return d


@pytest.mark.parametrize("name", PATHS)
def test_every_file_has_its_joints_moves_from_each_posture_and_servos_hold_it(name):
    m = mujoco.MjModel.from_xml_path(str(PATHS[name]))
    assert kinds(m) == JOINTS[name]
    for key in range(-1, m.nkey):
        d = mujoco.MjData(m)
        if key >= 0:
            mujoco.mj_resetDataKeyframe(m, d, key)
        assert np.linalg.eigvalsh(mass_matrix(m, d))[0] > 1e-3
        after_100_steps(m, d)
        if key >= 0 and name in WITH_SERVOS:
            assert np.abs(d.qpos - m.key_qpos[key]).max() < 0.1


def test_random_trees_have_every_kind_of_joint_each_feature_and_move(rng):
    models = []
    for seed in range(12):
        assert random_tree(seed) == random_tree(seed) != random_tree(seed + 1)
        m = mujoco.MjModel.from_xml_string(random_tree(seed))
        models.append(m)
        assert set(kinds(m)) == set(KINDS) and m.njnt == 8 and kinds(m)["free"] == 1
        after_100_steps(m, d := mujoco.MjData(m))
        mujoco.mj_resetData(m, d)
        mujoco.mj_integratePos(m, d.qpos, rng.normal(size=m.nv), 2.0)
        assert np.linalg.cond(mass_matrix(m, d)) < 1e6
        assert (np.abs(m.body_quat[1:, 0]) < 1 - 1e-6).all() and (m.body_mass[1:] > 0).all()
    spring = [np.ravel(m.jnt_stiffness)[: m.njnt] > 0 for m in models]
    away = [m.qpos_spring[m.jnt_qposadr] != m.qpos0[m.jnt_qposadr] for m in models]
    straight = [m.jnt_type >= SLIDE for m in models]  # hinges and slides
    assert sum((a & b & c).any() for a, b, c in zip(spring, away, straight)) >= 3
    assert sum((a & (m.jnt_type == BALL)).any() for a, m in zip(spring, models)) >= 3
    features = {
        "branched": lambda m: max(Counter(m.body_parentid[1:].tolist()).values()) > 1,
        "several joints in a body": lambda m: (m.body_jntnum > 1).any(),
        "anchor off the origin": lambda m: m.jnt_pos.any(),
        "armature": lambda m: m.dof_armature.any(),
        "damping": lambda m: np.any(m.dof_damping),
        "qpos0 away from zero": lambda m: m.qpos0[m.jnt_qposadr[m.jnt_type >= SLIDE]].any(),
        "fixed to a body": lambda m: ((m.body_jntnum == 0) & (m.body_weldid > 0)).any(),
        "fixed to the world": lambda m: ((m.body_jntnum == 0) & (m.body_weldid == 0))[1:].any(),
        "free base with joints on it": lambda m: (m.body_rootid == m.jnt_bodyid[m.jnt_type == FREE][0]).sum() > 2,
    }
    assert [name for name, has in features.items() if sum(bool(has(m)) for m in models) < 3] == []
