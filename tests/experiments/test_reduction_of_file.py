"""Reduction of a file's motion: what goes for nothing, which joints can be locked, and the file to take away."""

import pickle
from dataclasses import replace
from shutil import rmtree

import mujoco
import numpy as np
import pytest
from helpers.reduced_models import (
    TWO_ARMS,
    answered,
    failed,
    run,
    scene,
    setup_for,
    told,
    waves,
)

from compare.core.check import Result
from compare.core.text import say, screen
from compare.engines.mujoco.reading import read
from compare.engines.mujoco.smaller import FREE
from compare.engines.mujoco.source import Source
from compare.experiments import reduction
from compare.experiments.reduction import search
from compare.experiments.reduction.scene import scene_of
from compare.experiments.reduction.search import take_out
from compare.robots.scene_file import read_scenes


@pytest.fixture(scope="module")
def two_arms(tmp_path_factory):
    path = tmp_path_factory.mktemp("smaller") / "smaller.xml"
    controls = waves("left upper", "left lower")
    return answered(TWO_ARMS, recorded=controls, points="left tip,right hand", write=str(path)), path


def test_what_a_motion_does_not_use_goes_bit_for_bit():
    arms = scene(TWO_ARMS, recorded=waves("left upper"))
    rows, small = take_out(arms), arms.left
    assert {row.kind: row.taken_out for row in rows if row.same_bits} == {
        "drawing": 3, "sensors": 1, "geoms that never touch": 6, "equalities without force": 1, "actuators without force": 3,
        "tendons without force": 1, "limits that never act": 2, "stages without work": 3,
    }  # fmt: skip
    counts = "ngeom", "nsensor", "neq", "ntendon", "nlight", "njnt"
    assert [getattr(small.model, name) for name in counts] == [0, 0, 0, 0, 0, 4]
    assert search.same_bits(arms.run(small), arms.paths)


def test_a_kind_without_which_the_motion_differs_stays(monkeypatch):
    def heavier(small, use):
        small.spec.body("left hand").geoms[0].mass *= 1.0 + 1e-9
        return 1

    monkeypatch.setattr(search, "FREE", {"mass": heavier} | FREE)
    arms = scene(TWO_ARMS, recorded=waves("left upper"))
    assert [row.kind for row in take_out(arms) if not row.same_bits] == ["mass"]
    assert arms.left.model.body("left hand").mass == pytest.approx(0.3, rel=1e-12)


def test_the_idle_arm_is_locked_and_the_written_file_does_the_same_motion(two_arms):
    """Plain MuJoCo runs both files from their keyframes with the recorded controls."""
    result, path = two_arms
    assert failed(result) == []
    joints, models = result.tables["reduction_joints"], result.tables["reduction_models"]
    assert [row.joint for row in joints if row.locked] == ["right upper", "right lower"]
    assert [row.joints_locked for row in models] == [0, 0, 1, 2]
    assert all(row.step > 0.0 for row in models)
    held = waves("left upper", "left lower")
    at = np.minimum((np.arange(200) * 0.002 + 1e-9) // 0.02, 20).astype(int)
    controls = {name: values[at] for name, values in held.items() if name != "time"}
    errors = []
    for joint in ("left upper", "left lower"):
        apart = run(path, joint, 200, controls) - run(TWO_ARMS, joint, 200, controls)
        errors.append(np.abs(apart).max())
    check = next(check for check in result.checks if check.quantity == "motion of the smaller model")
    assert max(errors) <= check.value <= 1e-12  # points count, too
    assert models[-1].error == check.value == told(result)["error"]
    model = mujoco.MjModel.from_xml_path(str(path))
    assert [model.joint(i).name for i in range(model.njnt)] == ["left upper", "left lower"]
    assert model.nkey == 1 and model.key("home").qpos.shape == (2,) and model.site("left tip").id >= 0
    assert model.opt.timestep == 0.002 and model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    text, lines = path.read_text(encoding="utf-8"), screen(result.top[0])
    assert "home" in text and "run, error 0.001" in text and "right upper" in text  # the comment
    assert len(lines) <= 12 and "2 of 4 joints, and 20 elements" in lines[0]
    assert any("the same bits for 0.4 s" in line for line in lines)
    assert "3 actuators (right upper, right lower and unused)." in lines[-1] and str(path) in lines[-1]


SCENES = """[[scene]]
name = "{} alone"
torque = "servos"
targets = [{}]
duration = 0.2
"""


def test_a_reduction_holds_in_all_of_the_scenes(tmp_path):
    """In each of them another arm moves: neither is locked, and the file has a keyframe of each."""
    path, written = tmp_path / "scenes.toml", tmp_path / "smaller.xml"
    both = SCENES.format("left", "20, 0, 0, 0") + SCENES.format("right", "0, 0, 20, 0")
    for scenes in (both, both.partition('"right')[0].rpartition("[[")[0]):
        path.write_text(scenes)
        setup = setup_for(TWO_ARMS, write=str(written))
        setup = replace(setup, robot=setup.robot.with_scenes(read_scenes(path, setup.robot)))
        result = reduction.rows(setup)
        assert failed(result) == []
        model = mujoco.MjModel.from_xml_path(str(written))
        names = [model.key(key).name for key in range(model.nkey)]
        assert names == (["left alone", "right alone"] if scenes is both else ["left alone"])
        assert model.njnt == (4 if scenes is both else 2)
        for key, moves in enumerate(name.split()[0] for name in names):
            apart = run(written, f"{moves} upper", 100, key=key)
            arms, _ = scene_of(setup, setup.reading)
            assert np.abs(apart[:, 0] - arms.paths[key].q[1:, 0 if moves == "left" else 2]).max() <= 1e-3
    posed = replace(setup.robot.scenes[-1], gravity=False)
    other = replace(setup, robot=replace(setup.robot, scenes=(posed,)))
    (check,) = reduction.rows(other).checks
    assert not check.judged and "changes the model" in check.note


PYRAMID = "\n".join(f"v {place}" for place in ("0.1 0 0", "-0.1 0.1 0", "-0.1 -0.1 0", "0 0 0.2"))
FALLS = """<mujoco><compiler meshdir="parts"/><asset><mesh file="tip.obj"/><mesh name="other" file="deep/tip.obj"/></asset>
<worldbody><geom type="plane" size="3 3 0.1"/><body pos="0 0 0.01"><freejoint/><geom type="mesh" mesh="tip" mass="1"/>
</body><body pos="1 0 0.01"><freejoint/><geom type="mesh" mesh="other" mass="1"/></body></worldbody></mujoco>"""


def test_the_written_file_is_moved_with_its_meshes(tmp_path):
    for folder in ("parts", "parts/deep", "written"):
        (tmp_path / folder).mkdir()
    for part in ("tip.obj", "deep/tip.obj"):
        (tmp_path / "parts" / part).write_text(f"{PYRAMID}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    (tmp_path / "whole.xml").write_text(FALLS)
    result = answered(tmp_path / "whole.xml", write=str(tmp_path / "written" / "smaller.xml"))
    assert failed(result) == []
    rmtree(tmp_path / "parts")
    (tmp_path / "written").rename(tmp_path / "elsewhere")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "elsewhere" / "smaller.xml"))
    assert model.nmesh == 2
    assert "smaller_assets" in say(result.top[0])


PULLED = """<mujoco><worldbody><body name="hand" mocap="true" pos="0.3 0 1"/><body name="arm" pos="0 0 1">
<joint name="arm" axis="0 1 0" damping="1"/><geom size="0.05" pos="0.3 0 0"/></body>
<body pos="2 0 0"><joint name="still" axis="0 0 1" damping="1"/><geom size="0.05" pos="0.3 0 0"/></body></worldbody><equality>
<connect body1="hand" body2="arm" anchor="0 0 0"/></equality><keyframe><key name="up" mpos="0.2 0 1.3"/></keyframe></mujoco>"""


def test_a_body_that_is_moved_from_outside_is_where_the_keyframe_has_it(tmp_path):
    """It pulls the arm up, also in the written file."""
    path = tmp_path / "smaller.xml"
    assert failed(answered(PULLED, write=str(path))) == []
    turned = [run(file, "arm", 250)[-1, 0] for file in (PULLED, path)]
    assert turned[0] == pytest.approx(turned[1], abs=1e-3) and turned[0] < -0.5
    assert mujoco.MjModel.from_xml_path(str(path)).njnt == 1


def test_the_smaller_file_starts_where_the_motion_does(tmp_path):
    """A control of 0 that is stated is not replaced by what holds the posture."""
    key = 'qpos="0.1 0 0 0" ctrl="0 0 0 0 0.3"'
    path = tmp_path / "small.xml"
    result = answered(TWO_ARMS.replace('qpos="0 0 0 0"', key), write=str(path))
    model = mujoco.MjModel.from_xml_path(str(path))
    (kept,) = [model.key(k) for k in range(model.nkey)]
    assert (kept.name, kept.qpos[0]) == ("home", 0.1) and failed(result) == []
    assert kept.ctrl[model.actuator("left upper").id] == 0.0 and kept.ctrl[model.actuator("unused").id] == 0.3
    apart = run(path, "left upper", 500) - run(TWO_ARMS.replace('qpos="0 0 0 0"', key), "left upper", 500)
    assert np.abs(apart).max() <= told(result)["error"] <= 1e-3


RANGES = """<mujoco><compiler angle="{0}"/><option gravity="0 0 0"/><default><joint damping="1"/>
<default class="c"><joint range="{1}"/></default></default>
<worldbody><body><joint name="a" axis="0 1 0" class="c"/><joint name="s" type="slide" axis="1 0 0" range="-1 1"/>
<geom size="0.1"/></body></worldbody><actuator><position joint="a" inheritrange="1" kp="3"/></actuator>
<keyframe><key name="set" ctrl="0.3" qvel="0.1 0.1"/></keyframe></mujoco>"""


@pytest.mark.parametrize("angle, limits", [("degree", "-71.23456789 50"), ("radian", "-1.23456789 0.9")])
def test_the_range_of_a_limit_that_is_taken_out_stays_the_same_in_the_written_file(tmp_path, angle, limits):
    """It states radians; a servo has the range of its joint."""
    text, path = RANGES.format(angle, limits), tmp_path / "smaller.xml"
    assert failed(answered(text, write=str(path), error=1e-9)) == []
    whole, small = mujoco.MjModel.from_xml_string(text), mujoco.MjModel.from_xml_path(str(path))
    assert whole.jnt_limited.all() and not small.jnt_limited.any()
    assert small.jnt_range == pytest.approx(whole.jnt_range, rel=1e-15)
    assert small.actuator_ctrlrange == pytest.approx(whole.actuator_ctrlrange, rel=1e-15)


def test_the_result_goes_to_the_process_that_draws(two_arms):
    result = pickle.loads(pickle.dumps(two_arms[0]))
    names = [name for name, *_ in (figure() for figure in reduction.figures(result, None))]
    assert names == ["reduction_models"]


def test_the_equations_of_the_smaller_model_are_those_of_tmts_lock(two_arms):
    result, path = two_arms
    where = "home, locked: right upper, right lower"
    quantities = {check.quantity for check in result.checks if check.scene == where}
    assert quantities == {f"{name}, lock of tmt to the smaller model" for name in ("Mbar", "bias")}
    whole, written, elsewhere = read(Source(TWO_ARMS)).tree, read(path).tree, Result("reduction")
    reduction.compare_locked(elsewhere, where, whole.lock({"right upper": 1.0, "left lower": 0.0}), written)
    assert not any(check.passed for check in elsewhere.checks)
