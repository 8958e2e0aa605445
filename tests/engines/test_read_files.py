"""Files for engines that read them: URDF, includes and names; the URDF text of a compiled model; what acts in Drake's runs."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from files import STL
from models import PATHS, random_tree

import tmt
from compare.engines import RECORDS, Setting
from compare.engines.mujoco import read
from compare.engines.mujoco.handed_on import urdf
from compare.engines.outside import Outside
from compare.engines.outside.mjcf_text import whole_text
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR
from compare.robots.states import Sample
from compare.run.reference import compared_with

INSTALLED = [name for name in ("drake", "pinocchio", "newton") if not Outside(name).unavailable()]
LINK = """<link name="{0}"><inertial><origin xyz="0.1 0.02 -0.3" rpy="0.3 0.1 0"/><mass value="2"/>
<inertia ixx="0.03" iyy="0.04" izz="0.02" ixy="0.001" ixz="0.002" iyz="-0.003"/></inertial></link>"""
JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><origin xyz="0.1 0 -0.4" rpy="0.1 0.2 0.3"/>
<axis xyz="0 0.8 0.6"/><limit lower="-3" upper="3" effort="9" velocity="9"/><dynamics damping="0.3"/></joint>"""
URDF = f"""<robot name="crane">{"".join(map(LINK.format, ("base", "mast", "boom", "tip")))}
{JOINT.format("turn", "revolute", "base", "mast")}{JOINT.format("lift", "continuous", "mast", "boom")}
{JOINT.format("reach", "prismatic", "boom", "tip")}</robot>"""
PART = """<mujocoinclude><body name="arm"><joint name="hip" axis="0 1 0" damping="0.1" stiffness="3" springref="20"/>
<inertial pos="0 0.1 -0.5" mass="2" diaginertia="0.3 0.2 0.15"/><body pos="0 0 -1"><joint axis="1 0 0"/>
<inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.01"/></body></body></mujocoinclude>"""
WHOLE = """<mujoco><worldbody><include file="part.xml"/></worldbody><keyframe><key qpos="1 2"/></keyframe></mujoco>"""
FREE = """<mujoco><worldbody><body name="top"><freejoint name="base"/>
<inertial pos="0.1 0 0.2" mass="2" diaginertia="0.3 0.2 0.15"/></body></worldbody></mujoco>"""
MESHES = """<mujoco><compiler meshdir="parts"/>
<default><default class="drawn"><geom type="mesh" mesh="m"/></default></default>
<asset><mesh name="m" file="m.stl"/></asset><worldbody>
<geom type="mesh" mesh="m"/><body><joint name="j" axis="0 1 0"/><geom class="drawn"/><geom size="0.1" mass="0"/><body pos="0 0 1">
<joint axis="1 0 0"/><inertial pos="0 0 0.5" mass="2" diaginertia="0.3 0.2 0.15"/><geom type="mesh" mesh="m"/>
</body></body></worldbody></mujoco>"""
ARM = Path(__file__).parents[2] / "mjcf" / "arm.xml"
SEVERAL = """<mujoco><worldbody><body pos="1 2 3" euler="10 20 30">
<inertial pos="0.1 0 0" mass="1" diaginertia="0.1 0.2 0.25" quat="0.9 0.1 0.3 -0.2"/>
<joint name="fixed2" type="slide" axis="1 2 0" ref="0.3" damping="0.7"/><joint axis="0 1 1" pos="0.1 0.2 -0.1" ref="20"/>
<joint name="c" axis="1 0 0.2" pos="-0.1 0.1 0" ref="-70" damping="0.2"/>
<body pos="0 0.2 0" euler="0 90 0"><inertial pos="0 0 0.1" mass="2" diaginertia="0.2 0.1 0.15"/>
<body pos="0.1 0 0" euler="40 0 -90"><inertial pos="0 0.2 0" mass="0.5" diaginertia="0.02 0.01 0.015"/>
<joint name="d" axis="0 0 1" pos="0 0 0.5"/></body></body></body></worldbody></mujoco>"""
# intermediate links have no mass, which MuJoCo takes only with a bound, here far below rounding; it would fuse fixed bodies
COMPILER = '<mujoco><compiler fusestatic="false" boundmass="2e-15" boundinertia="2e-15"/></mujoco>'


SOURCES = {name: PATHS[name] for name in ("arm6", "arm7", "gripper", "humanoid29", "loop")} | {"arm": ARM}
SOURCES |= {f"random {seed}": random_tree(seed, ("hinge", "slide"), 6) for seed in range(5)}
SOURCES["several joints in one body that carries a fixed one"] = SEVERAL


def robot_of(path, text, floating=False):
    path.write_text(text)
    return compared_with("model", str(path), floating=floating).robot


@pytest.mark.parametrize("engine", INSTALLED)
@pytest.mark.parametrize("name, text", (
    ("crane.urdf", URDF), ("floating.urdf", URDF), ("robot.xml", WHOLE), ("meshes.xml", MESHES),
))  # fmt: skip
def test_a_urdf_and_files_with_an_include_and_with_meshes(engine, name, text, tmp_path):
    """A body whose mass is a mesh's, by its class, has the inertia that MuJoCo has computed."""
    (tmp_path / "part.xml").write_text(PART)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "m.stl").write_bytes(STL)
    robot = robot_of(tmp_path / name, text, floating=name == "floating.urdf")
    of, rng = Outside(engine).of(robot.case()), np.random.default_rng(4)
    q = robot.coordinates.random(rng, 3)
    v, tau = rng.uniform(-2.0, 2.0, (2, 3, robot.coordinates.nv))
    sample = Sample(robot.tree, "", q, v, tau, 3)
    assert set(of.reading["mended"]) <= {"stiffness"}
    for quantity, state in (("mass_matrix", (q,)), ("bias", (q, v)), ("acceleration", (q, v, tau))):
        exact = sample.exact(quantity).high
        share = 5e3 * RECORDS[engine].eps
        assert np.allclose(getattr(of, quantity)(*state), exact, rtol=share, atol=share * np.abs(exact).max())


def test_includes_and_names_of_a_text(tmp_path):
    (tmp_path / "part.xml").write_text(PART)
    (tmp_path / "robot.xml").write_text(WHOLE)
    text = whole_text(tmp_path / "robot.xml")
    assert "include" not in text and "keyframe" not in text
    assert 'name="joint 1"' in text and 'name="body 2"' in text and 'model="robot"' in text


@pytest.mark.skipif("drake" not in INSTALLED, reason="Drake is not installed")
@pytest.mark.parametrize("text", (PART.replace("mujocoinclude", "worldbody"), FREE), ids=("springs", "free"))
def test_what_acts_in_drakes_runs(text, tmp_path):
    """Damping and springs, and a torque that turns with a free body."""
    text = text if "<mujoco>" in text else f"<mujoco>{text}</mujoco>"
    robot = robot_of(tmp_path / "robot.xml", text)
    of, n = Outside("drake").of(robot.case()), robot.coordinates.nv
    q, v = robot.coordinates.random(np.random.default_rng(5), 1)[0], np.linspace(-0.5, 0.5, n)
    tau = np.linspace(0.3, -0.2, n)
    run, read = of.prepare(q, v, tau, Setting(0.5, 256), "RK5")
    motion, exact = read(run()), tmt.simulate(q, v, tau, 0.5 / 1024, 1024, "dopri8", robot.tree)
    assert np.abs(robot.coordinates.difference(motion.q[-1], exact.q[-1])).max() < 1e-10
    assert np.abs(motion.v[-1] - exact.qd[-1]).max() < 1e-10


@pytest.mark.parametrize("source", SOURCES.values(), ids=SOURCES)
def test_what_mujoco_reads_back_has_the_same_values(source, rng, states=5):
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


def test_what_a_urdf_cannot_say_is_refused():
    with pytest.raises(ValueError, match="r' is of type ball"):
        urdf(read(PATHS["pendulum_ball"]).model)
