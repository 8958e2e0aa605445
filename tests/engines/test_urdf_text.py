"""The URDF text of a compiled model: MuJoCo, which reads it back, has the same mass matrix, bias and damping."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from models import PATHS, random_tree

from compare.engines.mujoco import read
from compare.engines.mujoco.handed_on import urdf
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR

ARM = Path(__file__).parents[2] / "mjcf" / "arm.xml"
FILES = (ARM, *(PATHS[name] for name in ("arm6", "arm7", "gripper", "humanoid29", "loop")))
SEVERAL = """<mujoco><worldbody><body pos="1 2 3" euler="10 20 30">
<inertial pos="0.1 0 0" mass="1" diaginertia="0.1 0.2 0.25" quat="0.9 0.1 0.3 -0.2"/>
<joint name="fixed2" type="slide" axis="1 2 0" ref="0.3" damping="0.7"/><joint axis="0 1 1" pos="0.1 0.2 -0.1" ref="20"/>
<joint name="c" axis="1 0 0.2" pos="-0.1 0.1 0" ref="-70" damping="0.2"/>
<body pos="0 0.2 0" euler="0 90 0"><inertial pos="0 0 0.1" mass="2" diaginertia="0.2 0.1 0.15"/>
<body pos="0.1 0 0" euler="40 0 -90"><inertial pos="0 0.2 0" mass="0.5" diaginertia="0.02 0.01 0.015"/>
<joint name="d" axis="0 0 1" pos="0 0 0.5"/></body></body></body></worldbody></mujoco>"""
# intermediate links have no mass, which MuJoCo takes only with a bound, here far below rounding; it would fuse fixed bodies
COMPILER = '<mujoco><compiler fusestatic="false" boundmass="2e-15" boundinertia="2e-15"/></mujoco>'


@pytest.mark.parametrize("source", FILES, ids=lambda path: path.stem)
def test_a_file(source, rng):
    assert_the_same(source, rng)


def test_several_joints_in_one_body_that_carries_a_fixed_one(rng):
    assert_the_same(SEVERAL, rng)


@pytest.mark.parametrize("seed", range(5))
def test_a_random_tree(seed, rng):
    assert_the_same(random_tree(seed, ("hinge", "slide"), 6), rng)


def assert_the_same(source, rng, states=5):
    reading = read(source)
    text, tree = urdf(reading.model).replace("</robot>", f"{COMPILER}</robot>"), reading.tree
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.gravity = tree.gravity
    numbers = [model.joint(name).id for name in tree.joint_names]
    assert (model.dof_damping[numbers] == tree.damping).all()
    data, dense = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    q = reading.qpos0 + rng.uniform(-3.0, 3.0, (states, model.nv))
    v = rng.uniform(-3.0, 3.0, q.shape)
    scales = Entries(tree, q, v)
    expected, of_tree = mujoco.MjData(reading.model), np.zeros_like(dense)
    reading.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    for state in range(states):
        data.qpos[numbers], data.qvel[numbers] = q[state], v[state]
        expected.qpos[:], expected.qvel[:] = q[state], v[state]
        for m, d, M in ((model, data, dense), (reading.model, expected, of_tree)):
            mujoco.mj_forward(m, d)
            mujoco.mj_fullM(m, d, M)
        M = dense[np.ix_(numbers, numbers)] + np.diag(tree.armature)
        assert (np.abs(M - of_tree) <= FACTOR * EPS * scales.mass_matrix[state]).all()
        error = np.abs(data.qfrc_bias[numbers] - expected.qfrc_bias)
        assert (error <= FACTOR * EPS * scales.bias[state]).all()


@pytest.mark.parametrize(
    "name, why", [("quadruped", "root' is of type free"), ("pendulum_ball", "r' is of type ball")]
)
def test_what_a_urdf_cannot_say_is_refused(name, why):
    with pytest.raises(ValueError, match=why):
        urdf(read(PATHS[name]).model)
