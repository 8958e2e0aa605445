"""The robots that other tests use: they have the features that they are made for, and they move."""

from collections import Counter

import mujoco
import numpy as np
import pytest
from models import KINDS, PATHS, chain, gymnasium_files, random_tree

FREE, BALL, SLIDE, HINGE = range(4)  # mjtJoint
NAMES = ("free", "ball", "slide", "hinge")
SEEDS = range(8)
JOINTS = {
    "arm6": {"hinge": 6},
    "arm7": {"hinge": 7},
    "free_body": {"free": 1},
    "gripper": {"hinge": 2, "slide": 2},
    "humanoid29": {"hinge": 29},
    "humanoid29_free": {"hinge": 29, "free": 1},
    "loop": {"hinge": 3},
    "mixed": {"hinge": 4, "slide": 2, "ball": 1, "free": 1},
    "pendulum_ball": {"ball": 2},
    "quadruped": {"hinge": 12, "free": 1},
}
WITH_SERVOS = ("arm6", "arm7", "humanoid29", "humanoid29_free", "quadruped")


@pytest.fixture(autouse=True)
def no_warning():
    """A warning of MuJoCo or of its compiler fails the test."""
    warned = []
    mujoco.set_mju_user_warning(warned.append)
    yield
    mujoco.set_mju_user_warning(None)
    assert not warned


def model(name: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(PATHS[name]))


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


def turned(quaternions) -> np.ndarray:
    """Which quaternions are not the identity."""
    return np.abs(quaternions[:, 0]) < 1 - 1e-6


def of_one_number(m) -> np.ndarray:
    """Which joints are hinges or slides."""
    return np.isin(m.jnt_type, (HINGE, SLIDE))


def springs_away(m) -> np.ndarray:
    """Which hinges and slides have a spring that rests away from qpos0."""
    at = m.jnt_qposadr
    return of_one_number(m) & (np.ravel(m.jnt_stiffness)[: m.njnt] > 0) & (m.qpos_spring[at] != m.qpos0[at])


def test_every_file_has_its_joints():
    assert {name: kinds(model(name)) for name in PATHS} == JOINTS


@pytest.mark.parametrize("name", PATHS)
def test_every_file_moves_from_each_keyframe_and_from_qpos0_and_servos_hold_it(name):
    m = model(name)
    for key in range(-1, m.nkey):
        d = mujoco.MjData(m)
        if key >= 0:
            mujoco.mj_resetDataKeyframe(m, d, key)
        assert np.linalg.eigvalsh(mass_matrix(m, d))[0] > 1e-3
        after_100_steps(m, d)
        if key >= 0 and name in WITH_SERVOS:
            assert np.abs(d.qpos - m.key_qpos[key]).max() < 0.1


def test_gripper_and_loop_are_closed_by_their_equalities():
    m = model("gripper")
    assert m.eq_type.tolist() == [mujoco.mjtEq.mjEQ_JOINT] and m.ntendon == 1 and springs_away(m).sum() == 2
    assert m.actuator("fingers").trntype[0] == mujoco.mjtTrn.mjTRN_TENDON
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, m.key("closed").id)
    d.ctrl[2] = 0.03
    left, right = after_100_steps(m, d).qpos[2:]
    assert left > 0.015 and abs(left - right) < 1e-3

    m = model("loop")
    assert m.eq_type.tolist() == [mujoco.mjtEq.mjEQ_CONNECT]
    d = mujoco.MjData(m)
    d.ctrl[:] = 3
    assert after_100_steps(m, d).qpos[0] > 0.05 and np.abs(d.efc_pos).max() < 1e-3


def test_mixed_and_the_free_ones_have_turned_bodies_anchors_springs_and_references():
    assert turned(model("pendulum_ball").body_quat[1:]).all() and model("pendulum_ball").jnt_pos.any(axis=1).all()
    m = model("free_body")
    assert turned(m.qpos0[None, 3:]).all() and m.qpos0[:3].all() and len(set(m.body_inertia[1])) == 3
    m = model("mixed")
    pairs = [tuple(m.jnt_type[a : a + 2]) for a, n in zip(m.body_jntadr, m.body_jntnum) if n == 2]
    assert {(SLIDE, HINGE), (HINGE, HINGE)} == set(pairs)
    assert (m.jnt_pos.any(axis=1)).sum() >= 4 and springs_away(m).sum() == 4
    assert m.qpos0[m.jnt_qposadr[of_one_number(m)]].any()
    ball = m.joint("tail")
    assert np.ravel(ball.stiffness)[0] > 0 and np.ravel(ball.damping)[0] > 0 and ball.armature[0] > 0
    assert m.body_weldid[m.body("wall").id] == 0 and m.body_weldid[m.body("tip").id] != 0
    assert [m.joint(j).name for j in range(m.njnt)].count("") == 2


@pytest.mark.parametrize("n", [1, 7, 30])
def test_chain_has_n_tilted_hinges(n):
    text = chain(n, 0)
    m = mujoco.MjModel.from_xml_string(text)
    assert kinds(m) == {"hinge": n} and m.body_parentid.tolist() == [0, *range(n)]
    assert (np.abs(m.jnt_axis) < 0.95).all() and np.linalg.cond(mass_matrix(m, mujoco.MjData(m))) < 10 * n**3
    assert text == chain(n, 0) != chain(n, 1)


@pytest.mark.parametrize("seed", SEEDS)
def test_random_tree_has_every_kind_of_joint_and_moves(seed, rng):
    text = random_tree(seed)
    assert text == random_tree(seed) != random_tree(seed + 1)
    m = mujoco.MjModel.from_xml_string(text)
    count = kinds(m)
    assert set(count) == set(KINDS) and m.njnt == 8 and count["free"] == 1
    d = mujoco.MjData(m)
    after_100_steps(m, d)
    for _ in range(5):
        mujoco.mj_resetData(m, d)
        mujoco.mj_integratePos(m, d.qpos, rng.normal(size=m.nv), 2.0)
        assert np.linalg.cond(mass_matrix(m, d)) < 1e6


def test_each_feature_is_in_some_random_trees():
    models = [mujoco.MjModel.from_xml_string(random_tree(seed)) for seed in range(12)]
    assert all(turned(m.body_quat[1:]).all() and (m.body_mass[1:] > 0).all() for m in models)
    features = {
        "branched": lambda m: max(Counter(m.body_parentid[1:].tolist()).values()) > 1,
        "several joints in a body": lambda m: (m.body_jntnum > 1).any(),
        "anchor off the origin": lambda m: m.jnt_pos.any(),
        "armature": lambda m: m.dof_armature.any(),
        "damping": lambda m: np.any(m.dof_damping),
        "spring away from qpos0": lambda m: springs_away(m).any(),
        "spring on a ball": lambda m: np.ravel(m.jnt_stiffness)[: m.njnt][m.jnt_type == BALL].any(),
        "qpos0 away from zero": lambda m: m.qpos0[m.jnt_qposadr[of_one_number(m)]].any(),
        "fixed to a body": lambda m: ((m.body_jntnum == 0) & (m.body_weldid > 0)).any(),
        "fixed to the world": lambda m: ((m.body_jntnum == 0) & (m.body_weldid == 0))[1:].any(),
        "free base with joints on it": lambda m: (m.body_rootid == m.jnt_bodyid[m.jnt_type == FREE][0]).sum() > 2,
    }
    assert [name for name, has in features.items() if sum(bool(has(m)) for m in models) < 3] == []


def test_random_tree_of_some_kinds():
    for chosen in (("hinge",), ("hinge", "slide"), ("ball",), ("free",), ("free", "hinge")):
        m = mujoco.MjModel.from_xml_string(random_tree(5, chosen, joints=4))
        assert set(kinds(m)) == set(chosen) and m.njnt == 4
    for chosen, joints in (((), 3), (("hinge", "screw"), 3), (("hinge", "slide"), 1)):
        with pytest.raises(ValueError):
            random_tree(0, chosen, joints)


def test_gymnasium_ships_14_files():
    files = gymnasium_files()
    if not files:
        pytest.skip("gymnasium is not installed (extra `test`)")
    assert len(files) == 14 and all(path.is_file() for path in files)
