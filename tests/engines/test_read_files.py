"""Files for engines that read them: URDF by any name, free by --floating; what acts in Drake's runs."""

import numpy as np
import pytest
from helpers.files import assert_exact

import tmt
from compare.engines import Setting
from compare.engines.outside import Outside
from compare.engines.outside.file import OtherNames, Unread
from compare.run.reference import compared_with

INSTALLED = [name for name in ("drake", "pinocchio", "newton") if not Outside(name).unavailable()]
LINK = """<link name="{0}"><inertial><origin xyz="0.1 0.02 -0.3" rpy="0.3 0.1 0"/><mass value="2"/>
<inertia ixx="0.03" iyy="0.04" izz="0.02" ixy="0.001" ixz="0.002" iyz="-0.003"/></inertial></link>"""
JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><origin xyz="0.1 0 -0.4" rpy="0.1 0.2 0.3"/>
<axis xyz="0 0.8 0.6"/><limit lower="-3" upper="3" effort="9" velocity="9"/><dynamics damping="0.3"/></joint>"""
URDF = f"""<robot name="crane">{"".join(map(LINK.format, ("base", "mast", "boom", "tip")))}
{JOINT.format("turn", "revolute", "base", "mast")}{JOINT.format("lift", "continuous", "mast", "boom")}
{JOINT.format("reach", "prismatic", "boom", "tip")}</robot>"""
PART = """<body name="arm"><joint name="hip" axis="0 1 0" damping="0.1" stiffness="3" springref="20"/>
<inertial pos="0 0.1 -0.5" mass="2" diaginertia="0.3 0.2 0.15"/><body name="leg" pos="0 0 -1"><joint name="knee" axis="1 0 0"/>
<inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.01"/></body></body>"""


def robot_of(path, text, floating=False):
    path.write_text(text)
    return compared_with("model", str(path), floating=floating).robot


@pytest.mark.parametrize("engine", INSTALLED)
@pytest.mark.parametrize("name", ("crane.urdf", "CRANE.URDF", "crane.xml"))
@pytest.mark.parametrize("floating", (False, True), ids=("fixed", "floating"))
def test_a_urdf_is_one_by_its_text_whatever_its_name(engine, name, floating, tmp_path):
    """Its base is fixed, or free by --floating: M, h and accelerations are the exact ones."""
    robot = robot_of(tmp_path / name, URDF, floating)
    assert robot.coordinates.nv == (9 if floating else 3)
    of = Outside(engine).of(robot.case())
    assert not of.reading.differing
    assert_exact(engine, of, robot, 3)


@pytest.mark.skipif("drake" not in INSTALLED, reason="Drake is not installed")
def test_a_joint_without_a_name_is_not_found_and_a_refusal_is_the_engines(tmp_path):
    unnamed = PART.replace('name="knee"', "")
    for model, part, error in ((' model="m"', unnamed, OtherNames), ("", PART, Unread)):
        robot = robot_of(tmp_path / "robot.xml", f"<mujoco{model}><worldbody>{part}</worldbody></mujoco>")
        with pytest.raises(error, match="name" if error is Unread else "joint"):
            Outside("drake").of(robot.case()).reading  # noqa: B018


@pytest.mark.skipif("drake" not in INSTALLED, reason="Drake is not installed")
def test_damping_and_springs_act_in_drakes_runs(tmp_path):
    robot = robot_of(tmp_path / "robot.xml", f'<mujoco model="m"><worldbody>{PART}</worldbody></mujoco>')
    of, n = Outside("drake").of(robot.case()), robot.coordinates.nv
    q, v = robot.coordinates.random(np.random.default_rng(5), 1)[0], np.linspace(-0.5, 0.5, n)
    tau = np.linspace(0.3, -0.2, n)
    run, read = of.prepare(q, v, tau, Setting(0.5, 256), "RK5")
    motion, exact = read(run()), tmt.simulate(robot.tree, q, v, tau, 0.5 / 1024, 1024, "dopri8")
    assert motion.q[-1] == pytest.approx(exact.q[-1], abs=1e-10)
    assert motion.v[-1] == pytest.approx(exact.qd[-1], abs=1e-10)
