"""Reduction of a file's motion: what goes for nothing, which joints can be locked, and the file to take away."""

import pickle
from dataclasses import replace
from shutil import rmtree
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from edited import setup_of_file

import tmt
from compare.core.check import Result
from compare.core.text import say
from compare.engines.mujoco.motion import Simulation
from compare.engines.mujoco.reading import read
from compare.engines.mujoco.smaller import Smaller, finished
from compare.engines.mujoco.source import Source
from compare.experiments import reduction
from compare.experiments.reduction import of_file, search
from compare.experiments.reduction.records import FrontierRow
from compare.experiments.reduction.scene import scene_of
from compare.experiments.reduction.search import answer_within, compared_limits, stable_answers, take_out
from compare.experiments.setup import Request
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


def setup_for(xml, **request):
    return replace(setup_of_file(xml), alone=True, request=Request(**request), command="run --error 0.001")


def scene(xml, **request):
    setup = setup_for(xml, **request)
    return scene_of(setup, setup.reading)


def waves(*names):
    """Controls that wave, of these actuators."""
    times = np.linspace(0.0, 0.4, 21)
    return {"time": times} | {name: 0.3 * np.sin(2.0 * np.pi * times) for name in names}


def answered(xml, **request) -> Result:
    setup, result = setup_for(xml, **request), Result("reduction")
    of_file.add(result, setup, setup.reading)
    return result


@pytest.fixture(scope="module", autouse=True)
def counted():
    """Work for times: steps, and joints and geoms in each."""

    def work(runs, rounds, clock):
        return {name: run.steps * (2.0 + run.model.nv + run.model.ngeom) for name, run in runs.items()}

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "fastest", work)
        yield


@pytest.fixture(scope="module")
def two_arms(counted, tmp_path_factory):
    path = tmp_path_factory.mktemp("smaller") / "smaller.xml"
    controls = waves("left upper", "left lower")
    return answered(TWO_ARMS, controls=controls, points="left tip,right hand", write=str(path)), path


def test_what_a_motion_does_not_use_goes_bit_for_bit():
    arms = scene(TWO_ARMS, controls=waves("left upper"))
    kinds = take_out(arms)
    assert {row.kind: row.taken_out for row, _ in kinds if row.same_bits} == {
        "drawing": 3, "sensors": 1, "geoms that never touch": 6, "equalities without force": 1, "actuators without force": 3,
        "tendons without force": 1, "limits that never act": 2, "stages without work": 3,
    }  # fmt: skip
    small = kinds[-1][1]
    counts = "ngeom", "nsensor", "neq", "ntendon", "nlight", "njnt"
    assert [getattr(small.model, name) for name in counts] == [0, 0, 0, 0, 0, 4]
    assert search.same_bits(arms.run(small), arms.run(arms.whole))


def test_a_kind_without_which_the_motion_differs_stays(monkeypatch):
    def heavier(small, use):
        small.spec.body("left hand").geoms[0].mass *= 1.0 + 1e-9
        return 1

    monkeypatch.setattr(search, "FREE", {"mass": heavier} | search.FREE)
    arms = scene(TWO_ARMS, controls=waves("left upper"))
    kinds = take_out(arms)
    assert [row.kind for row, _ in kinds if not row.same_bits] == ["mass"]
    assert kinds[0][1] is arms.whole and kinds[-1][0].same_bits


def test_the_idle_arm_is_locked_and_the_written_file_does_the_same_motion(two_arms):
    """The file is read by itself, and compared with a run of the whole one that this test makes."""
    result, path = two_arms
    assert [str(check) for check in result.checks if not check.passed] == []
    locked = [row.joint for row in result.tables["reduction_joints"] if row.locked]
    assert locked == ["right upper", "right lower"]
    best = next(row for row in result.tables["reduction_frontier"] if "0.001" in row.best_for.split(", "))
    assert best.locked == 2 and best.error <= 1e-3
    assert best.error <= best.error_of_model + best.error_of_step + 1e-12
    whole = result.tables["reduction_frontier"][0]
    assert whole.time_of_second == pytest.approx(200 * (2 + 4 + 6) / 0.4)  # see counted
    arms = scene(TWO_ARMS, controls=waves("left upper", "left lower"))
    model = mujoco.MjModel.from_xml_path(str(path))
    assert [model.joint(i).name for i in range(model.njnt)] == ["left upper", "left lower"]
    assert model.nkey == 1 and model.key("home").qpos.shape == (2,) and model.site("left tip").id >= 0
    assert model.opt.timestep == best.dt
    paths = Simulation(model, arms.motions, best.dt, best.integrator)()
    error = arms.apart(paths, arms.finely(arms.whole))
    check = next(check for check in result.checks if check.quantity == "error of the smaller file")
    assert error == pytest.approx(check.value) and check.value == pytest.approx(best.error, rel=1e-3)
    digits = result.top[0].values["facts"]["digits"]
    assert abs(check.value - best.error) <= digits < 1e-5  # of six digits
    text = path.read_text(encoding="utf-8")
    assert "3 of 5 actuators go: right upper, right lower, unused." in text
    assert "home" in text and "run, error 0.001" in text and "right upper" in text  # the comment


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
        setup, result = setup_for(TWO_ARMS, write=str(written)), Result("reduction")
        setup = replace(setup, robot=setup.robot.with_scenes(read_scenes(path, setup.robot)))
        of_file.add(result, setup, setup.reading)
        assert [str(check) for check in result.checks if not check.passed] == []
        judged = [check.scene for check in result.checks if check.quantity.startswith("error")]
        model = mujoco.MjModel.from_xml_path(str(written))
        assert judged == [model.key(key).name for key in range(model.nkey)]
        assert model.njnt == (4 if scenes is both else 2)
    assert judged == ["left alone"]


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
    assert [str(check) for check in result.checks if not check.passed] == []
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
    path, turned = tmp_path / "smaller.xml", []
    assert all(check.passed for check in answered(PULLED, write=str(path)).checks)
    for model in (mujoco.MjModel.from_xml_string(PULLED), mujoco.MjModel.from_xml_path(str(path))):
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        while data.time < 0.5:
            mujoco.mj_step(model, data)
        turned.append(data.joint("arm").qpos[0])
    assert turned[0] == pytest.approx(turned[1], abs=1e-3) and turned[0] < -0.5
    assert model.njnt == 1


def test_each_kind_is_taken_out_of_what_the_kinds_before_it_have_left(two_arms):
    rows = two_arms[0].tables["reduction_free"]
    assert [row.before for row in rows[1:]] == [row.after for row in rows[:-1]]
    assert rows[0].before > rows[-1].after


def test_the_smaller_file_starts_where_the_motion_does():
    arms = scene(
        TWO_ARMS.replace('qpos="0 0 0 0"', 'qpos="0.1 0 0 0" ctrl="0.3 0 0 0 0"'), controls=waves("unused")
    )
    key = finished(arms.whole, arms.motions, 0.002, "Euler").model.key(0)
    assert (key.name, key.qpos[0], key.ctrl[0]) == ("home", 0.1, 0.3)


def test_the_result_goes_to_the_process_that_draws(two_arms):
    result = pickle.loads(pickle.dumps(two_arms[0]))
    names = [name for name, *_ in (figure() for figure in reduction.figures(result, None))]
    assert names == ["reduction_frontier"]


def test_the_equations_of_the_smaller_model_are_those_of_tmts_lock(two_arms):
    result, path = two_arms
    where = "home, joints locked: 2"
    quantities = {check.quantity for check in result.checks if check.scene == where}
    assert quantities == {f"{name}, lock of tmt to the smaller model" for name in ("Mbar", "bias")}
    whole, written, elsewhere = read(Source(TWO_ARMS)).tree, read(path).tree, Result("reduction")
    of_file.compare_locked(elsewhere, where, whole.lock({"right upper": 1.0, "left lower": 0.0}), written)
    assert not any(check.passed for check in elsewhere.checks)


def test_a_file_beyond_the_error_fails(two_arms):
    arms = scene(TWO_ARMS, controls=waves("left upper", "left lower"))
    row = two_arms[0].top[0].values["facts"]["whole"]
    heavier = Smaller(arms.whole.spec.copy())
    heavier.spec.body("left hand").geoms[0].mass *= 1.5
    heavier = Smaller(heavier.spec)
    for share, free, written, passed in (
        (1.01, arms.whole, arms.whole, True), (0.99, heavier, arms.whole, False), (1.01, heavier, heavier, False),
    ):  # fmt: skip
        result = Result("reduction")
        answer = SimpleNamespace(row=row, allowed=share * row.error, at_own_step=False)
        of_file.add_checks(result, arms, free, {}, answer, arms.whole, written)
        verdicts = {check.quantity: check.passed for check in result.checks}
        assert verdicts["error of the smaller file"] is passed
        assert verdicts["motion without what is not used"] is passed


@pytest.mark.parametrize("stiffness, name, moves", [(1000.0, "qpos0, at rest", False), (20.0, "qpos0", True)])
def test_a_robot_that_stands_starts_at_its_rest(stiffness, name, moves):
    """It sinks by 10 mm, or by half a meter: that is what it does."""
    stands = scene(STANDS.format("plate", stiffness))
    assert stands.name == name
    assert (stands.use.ranges["plate"] > of_file.STILL) is moves


def test_the_joints_that_a_tendon_ties_are_locked_together():
    """A hand whose thumb is still; the tendon and its servo go with it."""
    hand = scene(HAND, controls=waves("index"))
    groups = search.groups_of(hand, hand.whole)
    assert {"thumb", "thumb tip"} in [set(group.names) for group in groups]
    assert not any("index" in group.names for group in groups)  # the motion is about it
    assert [group.predicted for group in groups] == sorted(group.predicted for group in groups)
    small = search.locked(hand.whole, {name: hand.use.middle[name] for name in ("thumb", "thumb tip")})
    assert (small.model.nv, small.model.ntendon, small.model.nu) == (2, 0, 2)
    assert hand.apart(hand.run(small), hand.run(hand.whole)) < 0.01
    result = answered(HAND, controls=waves("index"), error=1e-2)
    assert {"thumb", "thumb tip"} <= {row.joint for row in result.tables["reduction_joints"] if row.locked}
    assert "index" not in {row.joint for row in result.tables["reduction_joints"] if row.locked}
    told = say(result.top[0])
    assert "2 of 3 actuators go: wrist and thumb." in told
    facts = result.top[0].values["facts"] | {"of_actuators": 2}
    assert "go: wrist and thumb; the smaller model has none." in say(
        replace(result.top[0], values={"facts": facts})
    )
    steps = [row for row in result.tables["reduction_frontier"] if row.error_of_step != row.error]
    assert steps and all(row.locked for row in steps)  # of the others the whole error is that of the step


def test_after_a_joint_that_costs_too_much_others_are_tried():
    locks = SimpleNamespace(order=range(4), error=lambda groups: float(2 in groups))
    locks.first = lambda count: frozenset(range(count))
    assert search.Locks.within(locks, 0.5) == {0, 1, 3} and search.Locks.within(locks, 1.0) == {0, 1, 2, 3}


def test_the_prediction_is_the_movement_times_the_coupling_through_the_mass_matrix():
    """The others, were they free, would move by M22^-1 M21 times it."""
    arms = scene(HAND, controls=waves("index"))
    tree = arms.reading.tree
    (group,) = [group for group in search.groups_of(arms, arms.whole) if group.names == ["wrist"]]
    expected = 0.0
    for q in arms.positions(arms.whole):
        M = np.array(tmt.mass_matrix(q, model=tree))
        moved = np.abs(q[0] - arms.use.middle["wrist"][0])
        expected = max(expected, np.abs(np.linalg.solve(M[1:, 1:], M[1:, 0])).max() * moved)
    assert group.predicted == pytest.approx(expected, rel=1e-9)


def test_where_everything_moves_and_touches_nothing_is_left_out():
    result = answered(TUMBLES, error=1e-9)
    answer = result.top[0].values["facts"]
    assert not answer["names"] and {row.kind for row in answer["free"] if row.same_bits} <= {
        "division into islands"
    }
    assert "nothing can be left out" in say(result.top[0])
    facts = answer | {"names": ["a"]}
    assert "nothing is gained at" in say(replace(result.top[0], values={"facts": facts}))
    assert all(check.passed for check in result.checks)


# a stiff damper, which is at rest: RK4 is not stable at its own step, or beyond it
DAMPED = """<mujoco><option integrator="RK4" timestep="{}"/><worldbody><body><joint name="hinge" axis="0 1 0" damping="1"/>
<geom size="0.05" mass="0.1" pos="0 0 -0.1"/></body></worldbody><keyframe><key qvel="{}"/></keyframe></mujoco>"""


def test_no_answer_is_a_step_that_is_unstable_at_rest():
    """A robot that rests exactly stays at any step: its run shows nothing."""
    rests = scene(DAMPED.format(1e-3, 0.0))
    candidates = search.frontier(rests, search.Locks(rests, rests.whole), [1e-3], int)
    candidates = [candidate for candidate in candidates if candidate.row.integrator == "RK4"]
    for candidate in candidates:
        candidate.row.gain = candidate.row.dt
    (answer,) = stable_answers(rests, candidates, [1e-3])
    assert max(candidate.row.dt for candidate in candidates) == 8e-3
    (limit,) = compared_limits(rests, rests.whole, ["RK4"])[1:]
    assert 1e-3 <= answer.row.dt < limit.step < 2.0 * answer.row.dt


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
    small = search.locked(whole, legs)
    assert small.model.nbody == 2
    locked = read(whole.model).tree.lock({name: float(q[0]) for name, q in legs.items()})
    smaller = read(small.model).tree
    heavier = replace(smaller, mass=tuple((1.0 + 1e-11) * mass for mass in smaller.mass))
    for other, passed in ((smaller, True), (heavier, False)):
        result = Result("reduction")
        of_file.compare_locked(result, "legs locked", locked, other)
        assert all(check.passed for check in result.checks) is passed


def test_a_file_whose_own_run_fails_is_not_judged():
    result = answered(DAMPED.format(0.02, 1.0))
    (check,) = result.checks
    assert not check.passed and "own run fails" in str(check)


def test_a_run_that_fails_is_infinitely_far(two_arms):
    """From the time on where it fails; of two motions, one."""
    arms = scene(TWO_ARMS, controls=waves("left upper"))
    paths, others = arms.run(arms.whole), arms.run(arms.whole)
    assert arms.apart(paths, others) == 0.0
    others[0].q[-1, 3] = np.nan
    assert arms.apart(paths, others) == arms.apart(2 * paths, paths + others) == np.inf


def row(gain, error, locked=0, own=None) -> FrontierRow:
    numbers = {"error": error, "error_of_model": 0.0, "error_of_step": error, "error_at_own_step": own}
    return FrontierRow(model="", locked=locked, integrator="Euler", dt=0.1, gain=gain, **numbers)


WHOLE = row(1.0, 0.5, own=0.0)


@pytest.mark.parametrize("rows, best, at_own_step", [
    ([WHOLE, row(3.0, 1.0), row(9.0, 1.01)], 1, False), ([WHOLE, row(3.0, 1.01)], 0, False),  # within the error; none is
    ([WHOLE, row(3.1, 1.0), row(3.0, 0.5, 2)], 2, False), ([WHOLE, row(3.2, 1.0), row(3.0, 0.5, 2)], 1, False),
    ([row(1.0, 1.01, own=0.0), row(3.0, 1.02)], 0, True),
    ([WHOLE, row(2.7, 0.9), row(4.8, 2.0, own=0.1)], 2, True), ([WHOLE, row(5.2, 0.9), row(4.8, 2.0, own=0.1)], 1, False),
    ([WHOLE, row(1.04, 0.5), row(2.0, 5.0, 3, own=1.0)], 2, True), ([WHOLE, row(2.0, 5.0, 3, own=1.01)], 0, False),
])  # fmt: skip
def test_the_fastest_within_the_error_is_the_answer(rows, best, at_own_step):
    answer = answer_within(rows, 1.0)
    assert answer.row is rows[best] and answer.at_own_step is at_own_step
    assert answer.is_gain is (best > 0)


def test_recorded_controls_are_held_between_their_times():
    arms = scene(
        TWO_ARMS, controls={"time": np.array([0.0, 0.1, 0.3]), "left upper": np.array([1.0, 2.0, 3.0])}
    )
    (motion,) = arms.motions
    controls = motion.controls(arms.whole.model, 0.05, 6)
    assert controls[:, 0].tolist() == [1.0, 1.0, 2.0, 2.0, 2.0, 2.0] and not controls[:, 1:].any()
    assert motion.duration == 0.3


@pytest.mark.parametrize("text, message", [
    ("time,left upper\n0,1\n0.1,2\n", ""), ("time,elbow\n0,1\n0.1,2\n", "no actuator elbow"),
    ("time,left upper\n0,x\n", "cannot read"),
    ("time,left upper\n0.1,1\n0.2,1\n", "rises from 0"), ("time,left upper\n0,1\n0,2\n", "rises from 0"),
    ("time\n0\n1\n", "at least one"), ("", "cannot read"),
    ("time,left upper\n0,nan\n1,1\n", "numbers"), ("time,left upper\n0,1\n1\n", "cannot read"),
])  # fmt: skip
def test_a_file_of_controls_is_read_or_refused_in_one_line(tmp_path, text, message):
    path = tmp_path / "controls.csv"
    path.write_text(text)
    if not message:
        assert read_controls(path, ["left upper"])["left upper"].tolist() == [1.0, 2.0]
    else:
        with pytest.raises(SceneError, match=message) as refused:
            read_controls(path, ["left upper"])
        assert "\n" not in str(refused.value)
