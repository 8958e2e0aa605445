"""Reduction of the joints of a file: which are locked, why others are needed, and the controls of a motion."""

from dataclasses import replace
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from helpers.reduced_models import HAND, TUMBLES, TWO_ARMS, answered, failed, run, scene, told, waves

from compare.core.check import Result
from compare.core.text import say
from compare.engines.mujoco.reading import read
from compare.engines.mujoco.smaller import Smaller, locked
from compare.engines.mujoco.source import Source
from compare.experiments import reduction
from compare.experiments.reduction import search
from compare.experiments.reduction.search import lockable
from compare.robots.scene_file import SceneError, read_controls


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
