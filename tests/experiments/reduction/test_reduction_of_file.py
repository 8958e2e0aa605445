"""Reduction of a file's motion: what goes for nothing, which joints can be locked, and the file to take away."""

import pickle
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from edited import setup_of_file

import tmt
from compare.core.text import say
from compare.engines.mujoco.motion import SAMPLES, Simulation, apart
from compare.engines.mujoco.reading import read
from compare.engines.mujoco.source import Source
from compare.experiments import reduction
from compare.experiments.reduction import of_file, search
from compare.experiments.reduction.records import FrontierRow, ReductionResult
from compare.experiments.reduction.scene import scene_of
from compare.experiments.reduction.search import Candidate, best_within, take_out
from compare.experiments.setup import Request
from compare.robots.scene_file import SceneError, read_controls

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


def scene(xml, **request):
    setup = replace(setup_of_file(xml), alone=True, request=Request(**request))
    return scene_of(setup, setup.reading)


def waves(*names):
    """Controls that wave, of these actuators."""
    times = np.linspace(0.0, 0.4, 21)
    return {"time": times} | {name: 0.3 * np.sin(2.0 * np.pi * times) for name in names}


def answered(xml, **request) -> ReductionResult:
    setup = replace(setup_of_file(xml), alone=True, request=Request(**request))
    result = ReductionResult("reduction")
    of_file.add(result, setup, setup.reading)
    return result


@pytest.fixture(scope="module", autouse=True)
def counted():
    """Work for times: steps, and joints and geoms in each."""

    def work(runs, rounds):
        return {name: run.steps * (2.0 + run.model.nv + run.model.ngeom) for name, run in runs.items()}

    with pytest.MonkeyPatch.context() as patch:
        for module in (search, of_file):
            patch.setattr(module, "fastest", work)
        yield


@pytest.fixture(scope="module")
def two_arms(counted, tmp_path_factory):
    path = tmp_path_factory.mktemp("smaller") / "smaller.xml"
    controls = waves("left upper", "left lower")
    return answered(TWO_ARMS, controls=controls, points="left tip,right hand", write=str(path)), path


def test_what_a_motion_does_not_use_goes_bit_for_bit():
    arms = scene(TWO_ARMS, controls=waves("left upper"))
    kinds = take_out(arms)
    assert {kind.row.kind: kind.row.taken_out for kind in kinds if kind.row.same_bits} == {
        "drawing": 3, "sensors": 1, "geoms that never touch": 6, "equalities without force": 1, "actuators without force": 3,
        "tendons without force": 1, "limits that never act": 2, "stages without work": 3,
    }  # fmt: skip
    model = kinds[-1].file.model
    assert (model.ngeom, model.nsensor, model.neq, model.ntendon, model.nlight, model.njnt) == (
        0,
        0,
        0,
        0,
        0,
        4,
    )
    assert search.same_bits(arms.run(kinds[-1].file), arms.run(arms.whole))
    assert set(arms.use.ranges) == {"left upper", "left lower", "right upper", "right lower"}


def test_a_kind_without_which_the_motion_differs_stays(monkeypatch):
    def heavier(small, use):
        small.spec.body("left hand").geoms[0].mass *= 1.0 + 1e-9
        return 1

    monkeypatch.setattr(search, "FREE", {"mass": heavier} | search.FREE)
    arms = scene(TWO_ARMS, controls=waves("left upper"))
    kinds = take_out(arms)
    assert [kind.row.kind for kind in kinds if not kind.row.same_bits] == ["mass"]
    assert kinds[0].file is arms.whole and kinds[-1].row.same_bits


def test_the_idle_arm_is_locked_and_the_written_file_does_the_same_motion(two_arms):
    """The file is read by itself, and compared with a run of the whole one that this test makes."""
    result, path = two_arms
    assert [str(check) for check in result.checks if not check.passed] == []
    assert [row.joint for row in result.tables["reduction_joints"] if row.locked] == [
        "right upper",
        "right lower",
    ]
    best = next(row for row in result.tables["reduction_frontier"] if "0.001" in row.best_for.split(", "))
    assert (
        best.locked == 2
        and best.error <= 1e-3
        and best.error <= best.error_of_model + best.error_of_step + 1e-12
    )
    arms = scene(TWO_ARMS, controls=waves("left upper", "left lower"))
    model = mujoco.MjModel.from_xml_path(str(path))
    assert [model.joint(i).name for i in range(model.njnt)] == ["left upper", "left lower"]
    assert model.nkey == 1 and model.key("home").qpos.shape == (2,) and model.site("left tip").id >= 0
    integrator = best.integrator
    assert (model.opt.timestep, model.opt.integrator) == (
        best.dt,
        getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}", 0),
    )
    error = apart(Simulation(model, arms.motion, best.dt, integrator)(), arms.finely(arms.whole), arms.motion)
    check = next(check for check in result.checks if check.quantity == "error of the smaller file")
    assert error == pytest.approx(check.value) and check.value == pytest.approx(best.error, abs=1e-9)
    text = path.read_text(encoding="utf-8")
    assert "home" in text and "error 0.001" in text and "right upper" in text  # the comment


def test_the_result_goes_to_the_process_that_draws(two_arms):
    result = pickle.loads(pickle.dumps(two_arms[0]))
    assert [name for name, *_ in (figure() for figure in reduction.figures(result, None))] == [
        "reduction_frontier"
    ]


def test_the_written_equations_are_those_of_tmts_lock(two_arms):
    result, _ = two_arms
    where = "home, 2 joints locked"
    quantities = {check.quantity for check in result.checks if check.scene == where}
    assert quantities == {"Mbar, lock of tmt to the smaller file", "bias, lock of tmt to the smaller file"}
    elsewhere = ReductionResult("reduction")
    whole, written = read(Source(TWO_ARMS)).tree, read(two_arms[1])
    of_file.compare_locked(elsewhere, where, whole.lock({"right upper": 0.0, "right lower": 0.0}), written)
    assert all(check.passed for check in elsewhere.checks)
    of_file.compare_locked(elsewhere, where, whole.lock({"right upper": 1.0, "left lower": 0.0}), written)
    assert not all(check.passed for check in elsewhere.checks)


def test_a_file_beyond_the_error_fails(two_arms):
    arms = scene(TWO_ARMS, controls=waves("left upper", "left lower"))
    kinds = take_out(arms)
    locks = search.Locks(arms, kinds[-1].file, search.groups_of(arms, kinds[-1].file))
    (best, *_) = search.frontier(arms, locks, (1e-3,), lambda: None)
    text = search.locked(arms.whole, {"right lower": np.array([0.3])}).text()
    for allowed, passed in ((best.row.error * 1.01, True), (best.row.error * 0.99, False)):
        result = ReductionResult("reduction")
        row = replace(best.row, error=0.0)  # as if it were found to be exact
        of_file.add_checks(result, arms, locks, best._replace(row=row), allowed, arms.whole.text())
        assert {check.quantity: check.passed for check in result.checks}[
            "error of the smaller file"
        ] is passed
    assert "right lower" not in text


def test_the_joints_that_a_tendon_ties_are_locked_together():
    """A hand whose thumb is still; the tendon and its servo go with it."""
    hand = scene(HAND, controls=waves("index"))
    groups = search.groups_of(hand, hand.whole)
    assert frozenset({"thumb", "thumb tip"}) in [group.names for group in groups]
    assert [group.predicted for group in groups] == sorted(group.predicted for group in groups)
    small = search.locked(hand.whole, {name: hand.use.middle[name] for name in ("thumb", "thumb tip")})
    assert (small.model.nv, small.model.ntendon, small.model.nu) == (2, 0, 2)
    assert apart(hand.run(small), hand.run(hand.whole), hand.motion) < 0.01
    result = answered(HAND, controls=waves("index"), error=1e-2)
    assert {"thumb", "thumb tip"} <= {row.joint for row in result.tables["reduction_joints"] if row.locked}
    assert "index" not in {row.joint for row in result.tables["reduction_joints"] if row.locked}


def test_the_prediction_is_the_movement_times_the_coupling_through_the_mass_matrix():
    """The others, were they free, would move by M22^-1 M21 times it."""
    arms = scene(HAND, controls=waves("index"))
    tree = arms.reading.tree
    (group,) = [group for group in search.groups_of(arms, arms.whole) if group.names == {"wrist"}]
    path, expected = arms.run(arms.whole), 0.0
    for q in path.q[:: len(path.q) // SAMPLES]:
        M = np.array(tmt.mass_matrix(q, model=tree))
        moved = np.abs(q[0] - arms.use.middle["wrist"][0])
        expected = max(expected, np.abs(np.linalg.solve(M[1:, 1:], M[1:, 0])).max() * moved)
    assert group.predicted == pytest.approx(expected, rel=1e-9)


def test_where_everything_moves_and_touches_nothing_is_left_out():
    result = answered(TUMBLES, error=1e-9)
    answer = result.top[0].values["found"]
    assert not answer["names"] and not any(row.same_bits for row in answer["free"])
    assert "nothing can be left out" in say(result.top[0])
    assert {check.quantity for check in result.checks if check.passed} >= {of_file.OWN_STEP}


def row(gain, error, locked=0) -> Candidate:
    numbers = {"error": error, "error_of_model": 0.0, "error_of_step": error, "gain": gain}
    return Candidate(
        FrontierRow(model="", locked=locked, integrator="Euler", dt=0.1, **numbers),
        None,
        None,
        0.0 if gain == 1.0 else None,
    )


@pytest.mark.parametrize("candidates, best", [
    ([row(1.0, 0.5), row(3.0, 1.0), row(9.0, 1.01)], 1), ([row(1.0, 5.0), row(3.0, 1.01)], 0),  # within the error; none is
    ([row(1.0, 0.0), row(3.1, 1.0), row(3.0, 0.5, locked=2)], 2), ([row(1.0, 0.0), row(3.2, 1.0), row(3.0, 0.5, locked=2)], 1),
])  # fmt: skip
def test_the_fastest_within_the_error_is_the_answer(candidates, best):
    assert best_within(candidates, 1.0) is candidates[best]


def test_recorded_controls_are_held_between_their_times():
    arms = scene(
        TWO_ARMS, controls={"time": np.array([0.0, 0.1, 0.3]), "left upper": np.array([1.0, 2.0, 3.0])}
    )
    controls = arms.motion.controls(arms.whole.model, 0.05, 6)
    assert controls[:, 0].tolist() == [1.0, 1.0, 2.0, 2.0, 2.0, 2.0] and not controls[:, 1:].any()
    assert arms.motion.duration == 0.3


@pytest.mark.parametrize("text, message", [
    ("time,left upper\n0,1\n0.1,2\n", ""), ("time,elbow\n0,1\n0.1,2\n", "no actuator elbow"),
    ("time,left upper\n0,x\n", "cannot read"),
    ("time,left upper\n0.1,1\n0.2,1\n", "rises from 0"), ("time\n0\n1\n", "at least one"), ("", "cannot read"),
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
