"""Reduction of a file's motion: what goes for nothing, which joints can be locked, and the file to take away."""

import pickle
from dataclasses import replace
from shutil import rmtree
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from helpers.edited import setup_of_file

from compare.core.check import Result
from compare.core.text import say, screen
from compare.engines.mujoco.reading import read
from compare.engines.mujoco.smaller import FREE, Smaller, locked
from compare.engines.mujoco.source import Source
from compare.experiments import reduction
from compare.experiments.options import ReductionOptions
from compare.experiments.reduction import search
from compare.experiments.reduction.scene import scene_of
from compare.experiments.reduction.search import lockable, take_out
from compare.robots.scene_file import SceneError, read_controls, read_scenes

ARM = """<body name="{0}" pos="{1} 0 1"><joint name="{0} upper" axis="0 1 0" damping="0.1" range="-170 170"/>
<geom size="0.05" mass="1" pos="0 0 -0.2"/><body name="{0} hand" pos="0 0 -0.4">
<joint name="{0} lower" axis="0 1 0" damping="0.1"/>
<geom type="box" size="0.02 0.02 0.1" mass="0.3" pos="0 0 -0.1"/><site name="{0} tip" pos="0 0 -0.2"/></body></body>"""
SERVOS = "".join(f'<position name="{side} {part}" joint="{side} {part}" kp="50" dampratio="1"/>'
                 for side in ("left", "right") for part in ("upper", "lower"))  # fmt: skip
FLOOR = '<geom name="floor" type="plane" size="3 3 0.1"/><light pos="0 0 3"/><camera name="eye"/>'
TWO_ARMS = f"""<mujoco><option integrator="implicitfast"><flag energy="enable"/></option><asset><texture name="sky" type="skybox"
builtin="flat" width="8" height="48"/></asset><worldbody>{FLOOR}{ARM.format("left", 0)}{ARM.format("right", 1)}
<geom name="shelf" type="box" size="0.1 0.1 0.1" pos="-2 0 1"/></worldbody><equality><joint name="never" joint1="left upper"
active="false"/></equality><tendon><fixed name="slack"><joint joint="left upper" coef="1"/></fixed></tendon>
<actuator>{SERVOS}<motor name="unused" joint="left lower"/></actuator><sensor><jointpos joint="left upper"/></sensor>
<keyframe><key name="home" qpos="0 0 0 0"/></keyframe></mujoco>"""
# a hand with a moving and a still finger, whose two joints a tendon ties
LINK = '<body pos="{1} 0 0"><joint name="{0}" axis="0 1 0" damping="0.05"{2}/><geom size="0.01" mass="0.02" pos="{1} 0 0"/>'
HAND = f"""<mujoco><option integrator="implicitfast"/><worldbody><body><joint name="wrist" axis="0 1 0" damping="1"/>
<geom size="0.05" mass="0.5"/>{LINK.format("index", 0.1, "")}</body>{LINK.format("thumb", -0.1, "")}
{LINK.format("thumb tip", -0.1, ' stiffness="5"')}</body></body></body></worldbody>
<tendon><fixed name="thumb"><joint joint="thumb" coef="1"/><joint joint="thumb tip" coef="1"/></fixed></tendon>
<actuator><position name="wrist" joint="wrist" kp="20"/><position name="index" joint="index" kp="2"/>
<position name="thumb" tendon="thumb" kp="5"/></actuator></mujoco>"""
TUMBLES = """<mujoco><worldbody><geom type="plane" size="3 3 0.1"/><body pos="0 0 0.3" euler="20 30 0"><freejoint/>
<geom type="box" size="0.1 0.1 0.1"/></body></worldbody></mujoco>"""


STANDS = """<mujoco><worldbody><body pos="0 0 1"><joint name="{0}" type="slide" axis="0 0 1" stiffness="{1}" damping="100"/>
<geom type="box" size="0.1 0.1 0.1" mass="1"/></body></worldbody></mujoco>"""


def setup_for(xml, **asked):
    options = ReductionOptions(**asked)
    return replace(setup_of_file(xml), alone=True, options=options, command="run --error 0.001")


def scene(xml, **asked):
    setup = setup_for(xml, **asked)
    return scene_of(setup, setup.reading)[0]


def waves(*names):
    """Controls that wave, of these actuators."""
    times = np.linspace(0.0, 0.4, 21)
    return {"time": times} | {name: 0.3 * np.sin(2.0 * np.pi * times) for name in names}


def answered(xml, **asked) -> Result:
    return reduction.rows(setup_for(xml, **asked))


def told(result) -> dict:
    return result.top[0].values


def failed(result) -> list[str]:
    return [str(check) for check in result.checks if not check.passed]


def run(path, joint, steps, controls=None, key=0, names=None):
    """The positions of a joint by plain MuJoCo, from a keyframe; controls: a column of each step by actuators."""
    model = (
        mujoco.MjModel.from_xml_path(str(path))
        if hasattr(path, "exists")
        else mujoco.MjModel.from_xml_string(path)
    )
    data, places = mujoco.MjData(model), []
    mujoco.mj_resetDataKeyframe(model, data, key)
    for step in range(steps):
        for name, values in (controls or {}).items():
            if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name) >= 0:
                data.actuator(name).ctrl[:] = values[step]
        mujoco.mj_step(model, data)
        places.append(data.joint(joint).qpos.copy())
    return np.array(places)


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
    assert "3 actuators, right lower, right upper and unused." in lines[-1] and str(path) in lines[-1]


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


def test_a_file_beyond_the_error_fails_and_a_model_that_moves_otherwise():
    arms = scene(TWO_ARMS, recorded=waves("left upper", "left lower"))
    heavier = Smaller(arms.whole.spec.copy())
    heavier.spec.body("left hand").geoms[0].mass *= 1.5
    heavier = Smaller(heavier.spec)
    for small, error, passed in ((arms.whole, 0.99e-3, (True, True)), (arms.whole, 1.01e-3, (True, False)),
                                 (heavier, 0.0, (False, True))):  # fmt: skip
        result, locks = Result("reduction"), search.Locks([], [], [([], small, 0.0)])
        arms.left = small
        reduction.add_checks(result, arms, locks, error, 1e-3)
        assert tuple(check.passed for check in result.checks) == passed


def test_the_joints_that_a_tendon_ties_are_locked_together():
    """A hand whose thumb is still; the tendon and its servo go with it. The index moves far, at no cost to others."""
    hand = scene(HAND, recorded=waves("index"))
    locks = lockable(hand, 1e-2)
    assert {"thumb", "thumb tip"} <= set(locks.names) and "index" not in locks.names
    assert [len(names) for names, *_ in locks.models] == sorted({len(names) for names, *_ in locks.models})
    thumb = {row.joint: row.error_if_locked for row in locks.rows}
    assert thumb["thumb"] == thumb["thumb tip"] < 1e-2
    small = locked(hand.whole, {name: hand.use.middle[name] for name in ("thumb", "thumb tip")})
    assert (small.model.nv, small.model.ntendon, small.model.nu) == (2, 0, 2)
    assert hand.error(small) == thumb["thumb"]


def test_joints_are_locked_from_the_least_error_on_and_one_that_costs_too_much_is_passed_over(monkeypatch):
    costs = {"wrist": 1e-4, "index": 2e-4, "thumb": 3e-4, "thumb tip": 4e-4}

    def error_of(scene, names):
        alone = max(costs[name] for name in names)
        return SimpleNamespace(names=names), 1.0 if len(names) > 1 and "index" in names else alone

    monkeypatch.setattr(search, "error_of", error_of)
    monkeypatch.setattr(search, "tied_joints", lambda model: [[name] for name in reversed(costs)])
    monkeypatch.setattr(search, "DOES_TURN", 10.0)
    hand = scene(HAND, recorded=waves("index"))
    assert lockable(hand, 4e-4).names == ["wrist", "thumb", "thumb tip"]
    locks = lockable(hand, 3.99e-4)
    assert locks.names == ["wrist", "thumb"]
    assert [row.joint for row in locks.rows if row.why_needed] == ["index", "thumb tip"]


# alpha starts with a speed, beta falls at once, gamma only when beta has moved it
REASONS = """<mujoco><worldbody><body><joint name="alpha" axis="0 0 1"/><geom size="0.1" mass="1"/></body>
<body pos="1 0 0"><joint name="beta" axis="0 1 0"/><geom size="0.1" mass="1" pos="0.5 0 0"/>
<body pos="0.5 0 0"><joint name="gamma" axis="0 1 0"/><geom size="0.1" mass="1" pos="0 0 -0.5"/></body></body>
<body pos="3 0 0"><joint name="still" axis="0 0 1"/><geom size="0.1" mass="1" pos="0 0.5 0"/></body></worldbody>
<keyframe><key qvel="0.5 0 0 0"/></keyframe></mujoco>"""


def test_why_a_joint_is_needed():
    locks = lockable(scene(REASONS), 1e-3)
    rows = {row.joint: row for row in locks.rows}
    assert rows["alpha"].why_needed == "alpha has a speed at the start"
    assert "at the start" in rows["beta"].why_needed and rows["still"].locked and not rows["still"].why_needed
    # a joint at rest and its load of 1 kg at 0.5 m below it, and of 1 kg at 0.5 m beside it: both hang on beta
    model, data = mujoco.MjModel.from_xml_string(REASONS), None
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    assert rows["beta"].acceleration >= abs(data.qacc[1]) > 5.0
    assert rows["gamma"].why_needed.startswith("gamma accelerates by") and rows["gamma"].acceleration > 1.0


def test_where_everything_moves_and_touches_nothing_is_left_out():
    result = answered(TUMBLES, error=1e-9)
    assert told(result)["names"] == [] and told(result)["free"] == []
    assert "Everything is needed" in say(result.top[0]) and failed(result) == []


FIXED = """<mujoco><compiler {0}/><worldbody><body name="foot" pos="0 0 1"><geom size="0.1" mass="3"/><body name="arm">
<joint name="hinge" axis="0 1 0" damping="0.5"/><geom size="0.05" mass="0.4" pos="0.1 0 -0.3"/><body name="tool" pos="0 0 -0.5">
<geom size="0.05" mass="0.2" pos="0.05 0 0"/></body></body></body></worldbody></mujoco>"""


def test_bodies_that_are_fixed_to_others_may_be_fused_by_the_file(tmp_path):
    turned = []
    for fused in ("", 'fusestatic="true"'):
        path = tmp_path / f"{len(turned)}.xml"
        assert failed(answered(FIXED.format(fused), write=str(path))) == []
        turned.append(run(path, "hinge", 250)[-1, 0])
    assert turned[0] == pytest.approx(run(FIXED.format(""), "hinge", 250)[-1, 0], abs=1e-6)
    assert turned[1] == pytest.approx(turned[0], abs=1e-6) and abs(turned[0]) > 0.05


DAMPED = """<mujoco><option integrator="RK4" timestep="{}"/><worldbody><body><joint name="hinge" axis="0 1 0" damping="1"/>
<geom size="0.05" mass="0.1" pos="0 0 -0.1"/></body></worldbody><keyframe><key name="down" qvel="{}"/></keyframe></mujoco>"""


@pytest.mark.parametrize("dt, speed, is_stable", [(0.02, 1.0, False), (0.02, 0.0, False), (0.002, 0.0, True)])
def test_a_file_that_is_not_stable_at_its_own_step_gets_no_recommendation(tmp_path, dt, speed, is_stable):
    """Of 0.0011 kg m2 and 1 N m s/rad RK4 is stable up to 2.785 * 0.0011 s; at rest its own run shows nothing."""
    result = answered(DAMPED.format(dt, speed), write=str(tmp_path / "small.xml"))
    assert say(result.top[0]).startswith("Not stable: 20 ms with RK4") is not is_stable
    assert (tmp_path / "small.xml").exists() is is_stable and all(
        check.judged for check in result.checks
    ) is is_stable
    if not is_stable:
        assert (
            len(result.checks) == len(result.top) == 1
            and 0.94 * 3.0635e-3 < told(result)["limit"] < 3.0635e-3
        )


def many_legs(rng):
    """A free trunk with 24 legs."""
    legs = "".join(
        f"""<body pos="{numbers(rng, 0.1)}"><joint name="leg {leg}" axis="{numbers(rng, 1.0)}"/>
        <inertial pos="{numbers(rng, 0.05)}" mass="0.5" diaginertia="1e-3 1.2e-3 1.9e-3" quat="{numbers(rng, 1.0, 4)}"/></body>"""
        for leg in range(24)
    )
    trunk = '<freejoint name="base"/><inertial pos="0.01 0 0" mass="5" diaginertia="0.1 0.12 0.2" quat="1 2 3 4"/>'
    return f"<mujoco><worldbody><body>{trunk}{legs}</body></worldbody></mujoco>"


def numbers(rng, size, count=3):
    return " ".join(map(str, size * rng.normal(size=count)))


def test_each_fusing_of_bodies_rounds_all_that_are_in_it():
    """An error of 1e-11 is still seen."""
    rng = np.random.default_rng(1)
    whole = Smaller.whole(Source(many_legs(rng)))
    legs = {f"leg {leg}": rng.uniform(-2.0, 2.0, 1) for leg in range(24)}
    small = locked(whole, legs)
    assert small.model.nbody == 2
    tree = read(whole.model).tree.lock({name: float(q[0]) for name, q in legs.items()})
    smaller = read(small.model).tree
    heavier = replace(smaller, mass=tuple((1.0 + 1e-11) * mass for mass in smaller.mass))
    for other, passed in ((smaller, True), (heavier, False)):
        result = Result("reduction")
        reduction.compare_locked(result, "legs locked", tree, other)
        assert all(check.passed for check in result.checks) is passed


def test_a_run_that_fails_is_infinitely_far():
    """From the time on where it fails."""
    arms = scene(TWO_ARMS, recorded=waves("left upper"))
    assert arms.error(arms.whole) == 0.0
    arms.paths[0].q[-1, 3] = np.nan
    assert arms.error(arms.whole) == np.inf


def test_recorded_controls_are_held_between_their_times():
    slow = TWO_ARMS.replace('integrator="implicitfast"', 'timestep="0.05"')
    arms = scene(slow, recorded={"time": np.array([0.0, 0.1, 0.3]), "left upper": np.array([1.0, 2.0, 3.0])})
    (motion,) = arms.rolls
    assert (
        motion.controls[:, 0].tolist() == [1.0, 1.0, 2.0, 2.0, 2.0, 2.0] and not motion.controls[:, 1:].any()
    )
    assert arms.duration == pytest.approx(0.3)


TWO_ROWS = "time,left upper\n0,1\n0.1,2\n"


@pytest.mark.parametrize("text, message", [
    (TWO_ROWS, ""), (f"\ufeff{TWO_ROWS}", ""), (TWO_ROWS.replace("upper", "upper "), ""),
    (TWO_ROWS.replace("\n", "\r\n"), ""), ("time,left upper\n0,1\n\n,\n 0.1 , 2\n", ""), ("time,left upper\n0,1\n200,2\n", ""),
    ("time,left upper\n0,1\n200.1,2\n", "200.1 s, which are 1e\\+05 steps of 2 ms"),
    ("time,left upper\n0,1\n1e9,2\n", "5e\\+11 steps"),
    ("time,elbow\n0,1\n0.1,2\n", "no actuator elbow"),
    ("time,left upper,left upper\n0,1,1\n1,1,1\n", '"left upper" is there twice'),

    ("time,time,left upper\n0,0,1\n1,1,1\n", '"time" is there twice'),
    ("time,left upper\n0,x\n1,1\n", 'row 1: left upper is "x"'),
    ("time,left upper\n0.1,1\n0.2,1\n", "begins at 0.1"), ("time,left upper\n0,1\n0,2\n", "row 2: time does not rise"),
    ("time,left upper\n0,1\n2,1\n1,2\n", "row 3: time does not rise .1 after 2 s"), ("time,left upper\n0,1\n", "two rows"),
    ("time\n0\n1\n", "at least one"), ("left upper\n0\n1\n", "a column time"), ("", "a column time"),
    ("time,left upper\n", "rows of"),
    ("time,left upper\n0,nan\n1,1\n", "row 1: left upper"), ("time,left upper\n0,1\n1\n", "row 2: 1 cells"),
])  # fmt: skip
def test_a_file_of_controls_is_read_or_refused_in_one_line(tmp_path, text, message):
    path = tmp_path / "controls.csv"
    path.write_text(text, newline="", encoding="utf-8")
    if not message:
        assert read_controls(path, ["left upper"], 0.002)["left upper"].tolist() == [1.0, 2.0]
    else:
        with pytest.raises(SceneError, match=message) as refused:
            read_controls(path, ["left upper"], 0.002)
        assert "\n" not in str(refused.value)
        with pytest.raises(SceneError, match="the file has none"):
            read_controls(path, [], 0.002)
