"""A scene followed by both engines: each level by its own bound, every rule applied, whose number stands where."""

import dataclasses

import numpy as np
import pytest
from trajectory_curves import CASES, DAMPED, FREE, HELD

import tmt
from compare.engines.mujoco import Mujoco, load, parse
from compare.engines.mujoco.dynamics import MujocoDynamics
from compare.engines.mujoco.engine import METHODS
from compare.engines.tmt import Tmt
from compare.experiments.trajectory import drift, runs
from compare.judge.check import Result
from compare.judge.run import diverged_at
from compare.robots.arm import ARM

XML = ARM.mjcf.read_text()
TMT = Tmt()


def side(case) -> runs.TmtSide:
    """TMT's side of a case by RK4 with its own steps."""
    return runs.tmt_side(case, TMT.of(case), case.steps, "rk4")


@pytest.fixture(scope="module")
def damped():
    """TMT's side of a scene that is judged to its end."""
    return side(DAMPED)


def judged_with(mujoco, mine, case=DAMPED) -> dict:
    """The checks of a run whose TMT side may be edited, by quantity."""
    result = Result("trajectory")
    runs.compare_runs(result, case, mujoco.of(case), 64, [METHODS["RK4"]], mine)
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
    runs.compare_runs(result, case, mujoco.of(case), 64, [METHODS["RK4"]], mine)
    one = [check for check in result.checks if check.quantity == "one step, TMT to MuJoCo"]
    count, fast = len(mine.states[0]), int((np.abs(mine.states[1]).max(axis=1) / 64 > np.pi).sum())
    assert all(check.passed for check in one) and len(one) == (fast < count) and bool(fast) == (rate > 201.1)
    assert [f"{fast} of {count}" in note for note in result.notes] == [True] * bool(fast)


@pytest.mark.parametrize("judged, passes", [(3.12, True), (3.13, False)])
def test_the_time_that_is_judged_is_at_least_what_the_scene_asks_for(judged, passes, mujoco):
    case = HELD.changed(judged=judged)
    checks = judged_with(mujoco, side(case), case)
    assert (checks["time judged"].value, checks["time judged"].passed) == (3.125, passes)


def test_of_a_users_own_scene_nothing_is_expected_but_agreement(mujoco, engines):
    case = DAMPED.changed(judged=0.0, damping=0.0, tags=("own",))
    levels = {f"{level}, TMT to MuJoCo" for level in ("derivative", "one step", "open loop")}
    assert judged_with(mujoco, side(case), case).keys() == levels
    assert judged_with(mujoco, side(FREE), FREE).keys() == levels | {"time judged", "movement"}
    result, robot = Result("trajectory"), dataclasses.replace(ARM, scenes=(case.scene,))
    drift.measure_drift(result, robot, engines, drift.FEW_DRIFT_STEPS)
    assert result.checks == []


def test_what_is_kept_of_a_run_is_whose_it_says():
    moon = parse(XML.replace("0 0 -9.81", "0 0 -1.62"), tmt.ARM).of(HELD)
    mine, result = side(HELD), Result("trajectory")
    runs.compare_runs(result, HELD, moon, 64, [METHODS["RK4"]], mine)
    (kept,) = result.curves.values()
    t, *theirs = moon.run(*HELD.start, HELD.tau, 5 / 64, 64, "RK4")[:3]
    assert all(np.array_equal(a, b) for a, b in zip(kept["tmt"], (mine.q, mine.v)))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(kept["mujoco"], theirs))
    assert kept["left"] == {"tmt": None, "mujoco": 5 / 64} and kept["ended"]["tmt"] is None
    assert kept["ended"]["mujoco"] == diverged_at(HELD, t, *theirs)
    assert {row["diverged_at_s"] for row in result.rows} == {kept["ended"]["mujoco"]}


def test_every_rule_of_a_run_is_applied(engines):
    """The names of the checks that each kind of scene gets, with every integrator."""
    found = {}
    for case in (CASES["ball catch, free"], HELD):
        for check in runs.follow(case, engines, (1,)).checks:
            assert check.passed, str(check)
            found.setdefault(check.scene, set()).add(check.quantity)
    levels = {f"{level}, TMT to MuJoCo" for level in ("derivative", "one step", "open loop")} | {"time judged"}
    diverges, bits = {"step of divergence, MuJoCo's, is TMT's"}, {"the same bits as Euler"}
    of = "ball catch, free, {}, dt = 5/64 s"
    assert found[of.format("RK4")] == levels | {"movement"}
    assert found[of.format("Euler")] == found[of.format("implicit")] == levels | {"movement"} | diverges
    assert found[of.format("implicitfast")] == levels | {"movement"} | diverges | bits
    assert found["ball catch, held, RK4, dt = 5/64 s"] == levels
    assert found["ball catch, held, implicitfast, dt = 5/64 s"] == levels | bits


def test_a_run_is_no_finer_than_8192_steps_unless_the_scene_itself_is():
    assert runs.counts(FREE, (1, 16, 128)) == [64, 1024, 8192]
    assert runs.counts(FREE.changed(dt=5 / 65), (1, 16, 128)) == [65, 1040]
    assert runs.counts(FREE.changed(dt=5 / 8193), (1, 16)) == [8193]


class OtherBits(MujocoDynamics):
    """MuJoCo, of which one integrator gives other bits."""

    def run(self, q, v, tau, dt, steps, method, tolerance=None):
        motion = super().run(q, v, tau, dt, steps, method, tolerance)
        return motion._replace(q=motion.q + 1e-15 * (method == "implicitfast"))


class Different(Mujoco):
    """The engine of such dynamics."""

    def of(self, case):
        dynamics = super().of(case)
        dynamics.__class__ = OtherBits
        return dynamics


def test_an_integrator_of_other_bits_is_seen(engines):
    different = load(ARM.mjcf, ARM.tree)
    different.__class__ = Different
    checks = runs.follow(FREE, engines | {"mujoco": different}, (1,)).checks
    failed = [check.scene for check in checks if "same bits" in check.quantity and not check.passed]
    assert failed == ["bent, free, implicitfast, dt = 5/64 s"]


def test_a_run_of_which_nothing_is_judged_is_said(engines):
    case = FREE.changed(duration=1 / 64, dt=1 / 512)
    notes = [runs.follow(case, engines, (1,), entries=entries).notes for entries in (0, 100_000)]
    assert [any("RK4, 8 steps" in note for note in of_run) for of_run in notes] == [True, False]


def test_an_arm_that_flies_apart_is_reported_as_diverged(engines):
    """A forearm of nearly no inertia: MuJoCo's run diverges, that of the same scheme does not; no number stands for it."""
    text = XML.replace("0.001 0.019 0.019", "1e-9 1e-9 1e-9")
    feather = parse(text.replace('pos="0.15 0 0" mass="1.5"', 'pos="1e-5 0 0" mass="1.5"'), tmt.ARM)
    part = runs.follow(CASES["zero, free"], engines | {"mujoco": feather}, (1,))
    failed = {check.quantity for check in part.checks if not check.passed}
    assert {"derivative, TMT to MuJoCo", "time judged"} <= failed
    for row in part.rows:
        assert row["diverged_at_s"] < (row["twin_diverged_at_s"] or 5.1)
        assert not any(isinstance(value, float) and np.isnan(value) for value in row.values())
