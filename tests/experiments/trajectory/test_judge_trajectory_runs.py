"""A scene followed by both engines: each level by its own bound, which rules are applied, what is kept."""

import numpy as np
import pytest
from models import chain, random_tree
from trajectory_curves import DAMPED, FREE, HELD

import tmt
from compare.engines.mujoco import parse, reading
from compare.engines.mujoco.engine import METHODS
from compare.engines.tmt import Tmt
from compare.experiments.trajectory import derivative, horizon, runs, sentences
from compare.judge.check import Result
from compare.judge.run import diverged_at
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import engines as engines_of

LEVELS = {f"{level}, TMT to MuJoCo" for level in ("derivative", "one step", "open loop")}


def side(case) -> runs.TmtSide:
    """TMT's side of a case by RK4 with its own steps."""
    return runs.tmt_side(case, Tmt().of(case), case.steps, "rk4")


@pytest.fixture(scope="module")
def damped():
    """TMT's side of a scene that is judged to its end."""
    return side(DAMPED)


def judged_with(mujoco, mine, case=DAMPED, result=None) -> dict:
    """The checks of a run whose TMT side may be edited, by quantity."""
    result = result or Result("trajectory")
    runs.compare_runs(result, case, mujoco.of(case), case.steps, [METHODS["RK4"]], mine)
    return {check.quantity: check for check in result.checks}


@pytest.mark.parametrize(
    "level, field", [("derivative", "derivative_tolerance"), ("one step", "step_tolerance"), ("open loop", "width")]
)
def test_each_level_uses_its_own_bound_and_no_other(level, field, mujoco, damped):
    name = f"{level}, TMT to MuJoCo"
    checks = judged_with(mujoco, damped)
    used = checks[name].over_tolerance
    assert all(check.passed for check in checks.values()) and 1e-5 < used < 1.0
    assert checks[name].tolerance in getattr(damped, field)
    for more, passes in ((1.01, True), (0.99, False)):
        tight = judged_with(mujoco, damped._replace(**{field: more * used * getattr(damped, field)}))
        assert {quantity for quantity, check in tight.items() if not check.passed} == (set() if passes else {name})


@pytest.mark.parametrize("rate", [100.0, 202.0])
def test_a_step_of_more_than_half_a_turn_is_not_compared_alone(mujoco, rate):
    """Half a turn in 1/64 s is 201 rad/s."""
    case = DAMPED.changed(speed=(np.degrees(rate), 0.0, 0.0), duration=1.0, dt=1 / 64, judged=0.0)
    result, mine = Result("trajectory"), side(case)
    checks = judged_with(mujoco, mine, case, result)
    count, fast = len(mine.states[0]), int((np.abs(mine.states[1]).max(axis=1) / 64 > np.pi).sum())
    assert ("one step, TMT to MuJoCo" in checks) == (fast < count) and bool(fast) == (rate > 201.1)
    assert [f"{fast} of {count}" in note for note in result.notes] == [True] * bool(fast)


@pytest.mark.parametrize("judged, passes", [(3.12, True), (3.13, False)])
def test_the_time_that_is_judged_is_at_least_what_the_scene_asks_for(judged, passes, mujoco):
    case = HELD.changed(judged=judged)
    checks = judged_with(mujoco, side(case), case)
    assert (checks["time judged"].value, checks["time judged"].passed) == (3.125, passes)


def test_of_a_users_own_scene_nothing_is_expected_but_agreement(mujoco):
    case = DAMPED.changed(judged=0.0, damping=0.0, tags=("own",))
    assert judged_with(mujoco, side(case), case).keys() == LEVELS
    assert judged_with(mujoco, side(FREE), FREE).keys() == LEVELS | {"time judged", "movement"}


def test_what_is_kept_of_a_run_is_whose_it_says():
    moon = parse(ARM.mjcf.read_text().replace("0 0 -9.81", "0 0 -1.62"), tmt.ARM)
    mine, result = side(HELD), Result("trajectory")
    judged_with(moon, mine, HELD, result)
    (kept,) = result.curves.values()
    t, *theirs = moon.of(HELD).run(*HELD.start, HELD.tau, 5 / 64, 64, "RK4")[:3]
    assert all(np.array_equal(a, b) for a, b in zip(kept["tmt"], (mine.q, mine.v)))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(kept["mujoco"], theirs))
    assert kept["left"] == {"tmt": None, "mujoco": 5 / 64} and kept["ended"]["tmt"] is None
    assert kept["ended"]["mujoco"] == diverged_at(HELD, t, *theirs)
    assert {row["diverged_at_s"] for row in result.rows} == {kept["ended"]["mujoco"]}


def test_no_run_has_more_steps_than_8192_and_than_its_jacobians_allow_unless_the_scene_itself_has():
    """Of 40 hinges a step has 6400 entries."""
    assert runs.counts(FREE, (1, 16, 128)) == [64, 1024, 8192] and runs.counts(FREE.changed(dt=5 / 8193), (1,)) == [
        8193
    ]
    long = robot_of(reading.read(chain(40)), "chain.xml")
    case = long.case("c", duration=1.0, dt=1 / 512)
    assert runs.counts(case, (1, 2, 16), 6400 * 1023) == [512] and runs.counts(case, (1, 2), 6400 * 1024) == [512, 1024]
    left_out = [len(sentences.of_left_out([case], *given)) for given in (((1, 2), 6400 * 511), ((1,), 6400 * 512))]
    assert left_out == [2, 0]
    of_steps = {n: runs.recorded(case.changed(duration=n / 64, dt=1 / 64)) for n in (5, 64, 65, 130, 512)}
    assert of_steps == {5: 5, 64: 64, 65: 65, 130: 65, 512: 64}
    assert [horizon.growth_run(long, [case], small) for small in (False, True)] == [(416 / 512, 416), (0.25, 128)]


def test_the_derivative_of_the_bias_is_that_of_mujoco_for_joints_of_all_kinds():
    read, result = reading.read(random_tree(2, joints=5)), Result("trajectory")
    derivative.compare_derivatives(result, robot_of(read, "kinds.xml"), engines_of(reading.engine(read)))
    assert result.checks[0].passed and result.checks[0].unit == "N m s/rad or N s/m"
