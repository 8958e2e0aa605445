"""The robots that other tests use: they load, they have what they are made for, and they move."""

from collections import Counter
from pathlib import Path

import mujoco
import numpy as np
import pytest
from models import KINDS, PATHS, chain, gymnasium_files, random_tree

FREE, BALL, SLIDE, HINGE = range(4)  # mjtJoint
NAMES = ("free", "ball", "slide", "hinge")
SEEDS = range(12)

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


def speeds_after_100_steps(m, d) -> np.ndarray:
    mujoco.mj_step(m, d, nstep=100)
    assert not any(warning.number for warning in d.warning) and d.time > 99 * m.opt.timestep
    assert np.isfinite(d.qpos).all() and np.isfinite(d.qvel).all()
    return d.qvel


def turned(quaternions) -> np.ndarray:
    """Which quaternions are not the identity."""
    return np.abs(quaternions[:, 0]) < 1 - 1e-6


def springs_away(m) -> np.ndarray:
    """Which hinges and slides have a spring that rests away from qpos0."""
    at = m.jnt_qposadr
    one = np.isin(m.jnt_type, (HINGE, SLIDE))
    return one & (np.ravel(m.jnt_stiffness)[: m.njnt] > 0) & (m.qpos_spring[at] != m.qpos0[at])


def test_every_file_has_its_joints():
    assert [mujoco.mjtJoint(kind).name for kind in range(4)] == [f"mjJNT_{name.upper()}" for name in NAMES]
    assert {name: kinds(model(name)) for name in PATHS} == JOINTS


@pytest.mark.parametrize("name", PATHS)
def test_every_file_says_what_it_is_for(name):
    text = PATHS[name].read_text(encoding="utf-8")
    assert text.startswith(f"<!--\n  {name}: ")
    assert model(name).opt.timestep in (0.001, 0.002)


@pytest.mark.parametrize("name", PATHS)
def test_every_file_moves_from_each_keyframe_and_from_qpos0(name):
    m = model(name)
    for key in range(-1, m.nkey):
        d = mujoco.MjData(m)
        if key >= 0:
            mujoco.mj_resetDataKeyframe(m, d, key)
        assert np.linalg.eigvalsh(mass_matrix(m, d))[0] > 1e-3
        speeds_after_100_steps(m, d)


@pytest.mark.parametrize("name", ["arm6", "arm7", "humanoid29", "humanoid29_free", "quadruped"])
def test_servos_hold_their_keyframe(name):
    m = model(name)
    ranges = m.jnt_range[m.jnt_limited.astype(bool)]
    limited = m.jnt_qposadr[m.jnt_limited.astype(bool)]
    for key in range(m.nkey):
        d = mujoco.MjData(m)
        mujoco.mj_resetDataKeyframe(m, d, key)
        assert (ranges[:, 0] < d.qpos[limited]).all() and (d.qpos[limited] < ranges[:, 1]).all()
        speeds_after_100_steps(m, d)
        # while it sags to its rest, no joint moves far
        assert np.abs(d.qpos - m.key_qpos[key]).max() < 0.1


@pytest.mark.parametrize("name", ["arm6", "arm7", "humanoid29", "humanoid29_free", "quadruped"])
def test_robots_with_servos_have_what_such_files_have(name):
    m = model(name)
    assert m.nu == JOINTS[name]["hinge"]
    assert (m.actuator_biasprm[:, 1] < 0).all() and (m.actuator_biasprm[:, 2] < 0).all()
    assert m.actuator_forcelimited.all()
    hinges = m.jnt_dofadr[m.jnt_type == HINGE]
    assert (m.dof_armature[hinges] > 0).all() and (np.ravel(m.dof_damping)[hinges] > 0).all()
    assert m.jnt_limited[m.jnt_type == HINGE].all()
    assert m.nkey >= 1 and m.geom_contype.any()


def test_arm6_takes_some_inertias_from_geoms_and_states_others():
    spec = mujoco.MjSpec.from_file(str(PATHS["arm6"]))
    stated = [bool(body.explicitinertial) for body in spec.bodies[1:]]
    assert any(stated) and not all(stated)
    assert model("arm6").key(0).name == "home"


def test_arm7_has_a_tilted_wrist_and_two_keyframes():
    m = model("arm7")
    assert 17 < m.body_mass.sum() < 19
    assert (np.count_nonzero(np.abs(m.jnt_axis) > 1e-3, axis=1) > 1).any()
    assert turned(m.body_quat).sum() >= 4
    assert (m.dof_frictionloss > 0).all()
    assert [m.key(k).name for k in range(m.nkey)] == ["ready", ""]
    assert m.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST


def test_both_humanoids_are_one_robot():
    fixed, free = model("humanoid29"), model("humanoid29_free")
    assert (fixed.nq, fixed.nv, free.nq, free.nv) == (29, 29, 36, 35)
    for field in ("body_mass", "body_inertia", "body_ipos", "actuator_gainprm"):
        assert np.array_equal(getattr(fixed, field), getattr(free, field))
    assert np.array_equal(fixed.jnt_axis, free.jnt_axis[1:])
    assert np.array_equal(fixed.key_qpos[0], free.key_qpos[0, 7:])
    # branched: some body carries several
    assert max(Counter(fixed.body_parentid[2:].tolist()).values()) > 1


@pytest.mark.parametrize("name", ["humanoid29_free", "quadruped"])
def test_walkers_stand_on_the_floor(name):
    m = model(name)
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, m.key("stand").id)
    start = d.qpos[2]
    speeds_after_100_steps(m, d)
    assert d.ncon >= 4 and start - 0.02 < d.qpos[2] < start + 0.005


def test_quadruped_states_implicitfast():
    assert model("quadruped").opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST


def test_gripper_has_a_mimic_a_tendon_and_springs_away_from_qpos0():
    m = model("gripper")
    assert m.eq_type.tolist() == [mujoco.mjtEq.mjEQ_JOINT]
    assert m.ntendon == 1
    assert m.actuator("fingers").trntype[0] == mujoco.mjtTrn.mjTRN_TENDON
    assert springs_away(m).sum() == 2
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, m.key("closed").id)
    d.ctrl[2] = 0.03
    speeds_after_100_steps(m, d)
    left, right = d.qpos[2:]
    assert left > 0.015 and abs(left - right) < 1e-3


def test_loop_is_closed_by_its_equality():
    m = model("loop")
    assert m.eq_type.tolist() == [mujoco.mjtEq.mjEQ_CONNECT]
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    assert np.abs(d.efc_pos).max() < 1e-12
    d.ctrl[:] = 3
    speeds_after_100_steps(m, d)
    assert d.qpos[0] > 0.05 and np.abs(d.efc_pos).max() < 1e-3


def test_balls_and_free_body_are_in_turned_bodies():
    m = model("pendulum_ball")
    assert turned(m.body_quat[1:]).all() and m.jnt_pos.any(axis=1).all()
    m = model("free_body")
    assert turned(m.qpos0[None, 3:]).all() and m.qpos0[:3].all()
    assert len(set(m.body_inertia[1])) == 3


def test_mixed_has_everything():
    m = model("mixed")
    assert sorted(m.body_jntnum[1:].tolist())[-2:] == [2, 2]
    pairs = [tuple(m.jnt_type[a : a + 2]) for a, n in zip(m.body_jntadr, m.body_jntnum) if n == 2]
    assert {(SLIDE, HINGE), (HINGE, HINGE)} == set(pairs)
    assert (m.jnt_pos.any(axis=1)).sum() >= 4
    assert springs_away(m).sum() == 4
    assert m.qpos0[m.jnt_qposadr[np.isin(m.jnt_type, (HINGE, SLIDE))]].any()
    ball = m.joint("tail")
    assert np.ravel(ball.stiffness)[0] > 0 and np.ravel(ball.damping)[0] > 0 and ball.armature[0] > 0
    assert m.body_weldid[m.body("wall").id] == 0 and m.body("wall").mass[0] > 0
    assert m.body_jntnum[m.body("tip").id] == 0 and m.body_weldid[m.body("tip").id] != 0
    assert "" in [m.body(b).name for b in range(m.nbody)]
    assert [m.joint(j).name for j in range(m.njnt)].count("") == 2


@pytest.mark.parametrize("n", [1, 7, 30])
def test_chain_has_n_tilted_hinges(n):
    for seed in (0, 1):
        text = chain(n, seed)
        m = mujoco.MjModel.from_xml_string(text)
        assert kinds(m) == {"hinge": n} and m.nv == n
        assert m.body_parentid.tolist() == [0, *range(n)]
        assert (np.abs(m.jnt_axis) < 0.95).all()
        assert np.linalg.cond(mass_matrix(m, mujoco.MjData(m))) < 10 * n**3
        assert text == chain(n, seed) != chain(n, seed + 1)


def random_models():
    return [mujoco.MjModel.from_xml_string(random_tree(seed)) for seed in SEEDS]


@pytest.mark.parametrize("seed", SEEDS)
def test_random_tree_has_every_kind_of_joint_and_moves(seed, rng):
    text = random_tree(seed)
    assert text == random_tree(seed) != random_tree(seed + 1)
    m = mujoco.MjModel.from_xml_string(text)
    count = kinds(m)
    assert set(count) == set(KINDS) and m.njnt == 8 and count["free"] == 1
    assert m.nv == count["hinge"] + count["slide"] + 3 * count["ball"] + 6
    assert m.body_parentid[m.jnt_bodyid[m.jnt_type == FREE]].tolist() == [0]
    d = mujoco.MjData(m)
    speeds_after_100_steps(m, d)
    for _ in range(5):
        mujoco.mj_resetData(m, d)
        mujoco.mj_integratePos(m, d.qpos, rng.normal(size=m.nv), 2.0)
        assert np.linalg.cond(mass_matrix(m, d)) < 1e6


def test_random_trees_have_every_feature():
    models = random_models()
    assert all(turned(m.body_quat[1:]).all() and (m.body_mass[1:] > 0).all() for m in models)
    features = {
        "branched": [max(Counter(m.body_parentid[1:].tolist()).values()) > 1 for m in models],
        "several joints in a body": [(m.body_jntnum > 1).any() for m in models],
        "anchor off the origin": [m.jnt_pos.any() for m in models],
        "armature": [m.dof_armature.any() for m in models],
        "damping": [np.any(m.dof_damping) for m in models],
        "spring away from qpos0": [springs_away(m).any() for m in models],
        "spring on a ball": [np.ravel(m.jnt_stiffness)[: m.njnt][m.jnt_type == BALL].any() for m in models],
        "qpos0 away from zero": [m.qpos0[m.jnt_qposadr[np.isin(m.jnt_type, (HINGE, SLIDE))]].any() for m in models],
        "fixed to a body": [((m.body_jntnum == 0) & (m.body_weldid > 0)).any() for m in models],
        "fixed to the world": [((m.body_jntnum == 0) & (m.body_weldid == 0))[1:].any() for m in models],
        "free base with joints on it": [
            (m.body_rootid == m.jnt_bodyid[m.jnt_type == FREE][0]).sum() > 2 for m in models
        ],
    }
    assert {name: sum(map(bool, found)) >= 3 for name, found in features.items()} == dict.fromkeys(features, True)
    # each in some seeds only, where a tree can be without it
    assert not all(features["several joints in a body"]) or not all(features["fixed to the world"])


def test_random_tree_of_some_kinds():
    for chosen in (("hinge",), ("hinge", "slide"), ("ball",), ("free",), ("free", "hinge")):
        m = mujoco.MjModel.from_xml_string(random_tree(5, chosen, joints=4))
        assert set(kinds(m)) == set(chosen) and m.njnt == 4


@pytest.mark.parametrize("chosen, joints", [((), 3), (("hinge", "screw"), 3), (("hinge", "slide"), 1)])
def test_random_tree_refuses_what_it_cannot_make(chosen, joints):
    with pytest.raises(ValueError, match="joints: give some of"):
        random_tree(0, chosen, joints)


def test_gymnasium_files_are_found_without_importing_it(monkeypatch, tmp_path):
    assets = tmp_path / "gymnasium" / "envs" / "mujoco" / "assets"
    assets.mkdir(parents=True)
    (tmp_path / "gymnasium" / "__init__.py").write_text("raise ImportError('imported')", encoding="utf-8")
    for name in ("b.xml", "a.xml", "c.txt"):
        (assets / name).touch()
    monkeypatch.syspath_prepend(tmp_path)
    assert gymnasium_files() == [assets / "a.xml", assets / "b.xml"]
    monkeypatch.setattr("sys.path", [])
    monkeypatch.setattr("sys.path_importer_cache", {})
    assert gymnasium_files() == []


def test_gymnasium_ships_14_files():
    files = gymnasium_files()
    if not files:
        pytest.skip("gymnasium is not installed (extra `test`)")
    assert len(files) == 14 and all(isinstance(path, Path) and path.is_file() for path in files)
