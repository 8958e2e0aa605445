"""The rules of runs and of the drift of energy, just inside and just outside; errors and departures."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from trajectory_curves import CASES, DAMPED, FREE, HELD, run_of

import tmt
from compare.core.check import Result
from compare.engines.mujoco import parse
from compare.experiments.followed import Deviation
from compare.experiments.trajectory import errors, runs
from compare.experiments.trajectory.runs import Path, TrajectoryResult
from compare.judge.run import widest_judged
from compare.robots.arm import ARM
from compare.robots.case import Coordinates
from compare.truth.reference import reference

LIFT_AND_HEAD = Coordinates(("lift", "head"), ("slide", "ball"))  # four movements, and four speeds
NARROW, AT_ONCE = np.full(11, 0.999e-3), np.array([0.0, 1e-9, *[np.inf] * 9])


def test_a_run_is_judged_while_its_band_is_narrow_and_nothing_has_diverged():
    times, never = np.arange(5.0), (None, None)
    narrow = np.ones((5, 2), bool)
    wide = narrow & np.array([[True], [True], [False], [True], [True]])
    assert runs.judged(times, narrow, never) == 5
    assert runs.judged(times, wide, never) == runs.judged(times, narrow & wide[:, :1], never) == 2
    assert runs.judged(times, narrow, (2.5, 4.0)) == 3
    assert runs.judged(times, ~narrow, never) == 1


def test_a_band_judges_nothing_that_moves_less():
    """Of a slide and a ball: at most 1e-3 rad or m, and at most what moves; a joint that hardly moves is not what counts."""
    nv, free = 4, SimpleNamespace(coordinates=LIFT_AND_HEAD, is_held=False)
    q, v = np.array([[0.0, 1.0, 0.0, 0.0, 0.0]] * 2), np.zeros((2, nv))

    def widest(lift=0.0, turn=0.0, speeds=(0.0,) * 4, torque="free", targets=0.0):
        free.scene = SimpleNamespace(torque=torque, speed=(), targets=targets)
        q[1] = [lift, np.cos(turn / 2), np.sin(turn / 2), 0.0, 0.0]
        v[1] = speeds
        return widest_judged(free, q, v)

    assert np.allclose(widest(lift=2e-4, speeds=(3.0, 0, 0, 0)), [2e-4, 1e-3, 1e-3, 1e-3, 3.0, *[np.inf] * 3])
    assert np.allclose(widest(0.5, 1.0, (3.0, 2.0, 1e-9, 0)), [*[1e-3] * 4, 3.0, 2.0, 2.0, 2.0])
    slow, rounded = widest(1.0, 4e-4, (1.0, 2e-2, 1e-3, 0)), widest(2.0, 1e-12, (1.0, 1e-12, 0, 0))
    assert np.allclose(slow, [1e-3, *[4e-4] * 3, 1.0, 2e-2, 1e-3, 2e-2])
    assert np.allclose(rounded, [*[1e-3] * 4, 1.0, *[np.inf] * 3])
    assert not widest().any() and not widest(torque="servos", targets=6.0)[:nv].any()  # nothing moves
    for rests in ("hold", "servos"):
        assert np.array_equal(widest(torque=rests), [*[1e-3] * 4, *[np.inf] * 4])


@pytest.mark.parametrize("required, until, alive, judged", [
    (2.0, 2.0, 5.0, True), (2.0, 1.99, 5.0, False), (0.0, 0.5, 5.0, True), (0.0, 0.49, 5.0, False), (0.0, 0.2, 0.2, True),
    (0.0, 0.0, 0.0, True),
])  # fmt: skip
def test_a_run_that_is_judged_too_short_is_not_judged(required, until, alive, judged):
    result, run = TrajectoryResult("trajectory"), run_of(FREE.changed(judged=required), until=until)
    runs.check_time_judged(result, run, alive)
    assert [check.passed for check in result.checks] == [judged] * (required > 0.0 or not judged)
    assert all(check.judged == judged for check in result.checks)


def level(difference, bar):
    """The check and the row of differences (states, 2 nv)."""
    result, times = TrajectoryResult("trajectory"), np.arange(len(difference)) / 2
    deviation = Deviation(LIFT_AND_HEAD, times, np.array(difference), np.full(np.shape(difference), bar))
    runs.check_level(result, run_of(FREE), "open loop", deviation)
    return result.checks[0], result.rows[0]


@pytest.mark.parametrize("off, bar", [(0.999, 1.0), (1.001, 1.0), (np.nan, 1.0), (0.0, 0.0), (1e-300, 0.0)])
@pytest.mark.parametrize("at, name, unit", [(0, "lift", "m"), (3, "head z", "rad"), (5, "head x", "rad/s")])
def test_a_row_is_the_component_and_the_time_that_come_closest_to_the_tolerance(at, name, unit, off, bar):
    differences = np.zeros((3, 8))
    differences[1, at] = off
    check, row = level(differences, bar)
    assert check.passed is (off in (0.999, 0.0)) and row.worst_difference == check.value
    if bar:
        assert (check.unit, row.worst_unit, row.worst_place) == (unit, unit, check.note)
        assert check.note.startswith(name) and "0.500" in check.note


def test_a_row_has_the_largest_movement_beside_the_worst_component():
    _, row = level([[0.2, 0, 0, 0.7, 3.0, 0, 0, 0], [0.1, 0, 0, 0.4, 0, 0, 0, 0.9]], 1.0)
    assert (row.largest_difference, row.worst_difference) == (0.7, 3.0)


@pytest.mark.parametrize("ours, theirs, width, found", [
    (None, None, NARROW, []), (0.5, 0.5, NARROW, [True]), (0.5, 0.51, NARROW, [False]),
    (None, 0.5, NARROW, [False]), (0.5, None, NARROW + 2e-6, []), (0.1, 0.11, AT_ONCE, [False]),
    (0.12, 0.13, AT_ONCE, []),  # the band opens before the next recorded state
])  # fmt: skip
def test_both_diverge_at_the_same_step_while_the_band_is_narrow(ours, theirs, width, found):
    """In a second with 100 steps, of which each tenth is recorded."""
    case = FREE.changed(duration=1.0, dt=0.1)
    result = TrajectoryResult("trajectory")
    runs.check_divergence(result, replace(run_of(case, ended=(ours, theirs), steps=100), band=width))
    assert [check.passed for check in result.checks] == found


def test_the_error_of_a_held_scene_is_its_distance_from_the_start_and_of_a_free_one_that_from_many_digits():
    q = tmt.simulate(*FREE.start, FREE.tau, 5 / 64, 64, "rk4", FREE.tree).q
    others = [run_of(HELD, 9.0, 9.0, scheme="implicit"), run_of(HELD, 9.0, 9.0, steps=128)]
    free, held = run_of(FREE), run_of(HELD, 0.25, np.nan)
    free = replace(free, paths={"tmt": Path(q, q), "mujoco": Path(q + 100.0, q)})
    result = TrajectoryResult("trajectory", runs=[*others, free, held])
    errors.find_errors(result, ARM, {FREE.name: reference(FREE)})
    assert list(result.errors) == [HELD.name, FREE.name] and result.errors[HELD.name] == (0.25, None)
    assert result.answer.values["steps"] == 64
    differences = {scene["scene"]: scene["difference"] for scene in result.notes[0].values["scenes"]}
    assert differences[FREE.name] == pytest.approx(100.0) and np.isnan(differences[HELD.name])
    ours, theirs = result.errors[FREE.name]
    assert ours == pytest.approx(0.27, rel=0.03) and theirs > 90.0


@pytest.mark.parametrize("engine, label", [("tmt", "TMT"), ("mujoco", "MuJoCo")])
@pytest.mark.parametrize("order, passes", [(0.851, True), (0.849, False), (1.3, True)])
def test_the_drift_of_energy_falls_at_least_at_the_order(engine, label, order, passes):
    drifts = {"tmt": [4.0, 2.0], "mujoco": [4.0, 2.0]} | {engine: [2.0**order, 1.0]}
    result = Result("trajectory")
    errors.check_order(result, FREE, "x", 1, drifts)
    passed = {check.scene: check.passed for check in result.checks}
    assert passed == {"x, TMT, 1 s": True, "x, MuJoCo, 1 s": True} | {f"x, {label}, 1 s": passes}


def with_gravity(gravity) -> dict:
    return {"mujoco": parse(ARM.mjcf.read_text().replace("0 0 -9.81", gravity), tmt.ARM)}


def test_drift_is_measured_where_nothing_takes_energy_and_an_engine_that_does_not_drift_is_seen(engines):
    """Without gravity MuJoCo's arm stays where it is let go, and TMT's falls."""
    scenes = tuple(CASES[name].scene for name in ("bent, free", "bent, damped", "bent, held"))
    robot = replace(ARM, scenes=scenes)
    result = errors.measure_energy(robot, engines | with_gravity("0 0 0"), {1: (32, 64), 4: (32, 64)})
    drifts = {(row.integrator, row.engine): row.drift for row in result.tables["energy"]}
    assert {row.scene for row in result.tables["energy"]} == {"bent, free"} and len(drifts) == 6
    assert drifts["RK4", "mujoco"] == 0.0 < drifts["RK4", "tmt"]
    assert not any(check.passed for check in result.checks if ", MuJoCo" in check.scene)


@pytest.mark.parametrize("ended", [None, 1.0])
def test_the_drift_of_the_energy_is_told_of_the_coarsest_step_where_a_file_is_free_and_undamped(
    ended, engines
):
    free, damped = (replace(case, scene=replace(case.scene, tags=("own",))) for case in (FREE, DAMPED))
    run = run_of(free, theirs=0.1, ended=(None, ended))
    # the last is the arm's
    others = run_of(free, steps=128), run_of(damped), run_of(CASES["zero, free"])
    result = TrajectoryResult("trajectory", runs=[run, *others])
    result.tables["energy"] = []
    errors.find_energy(result, engines["mujoco"])
    (row,) = result.tables["energy"]
    energy = tmt.energy(run.paths["mujoco"].q, run.paths["mujoco"].v)
    drift = None if ended else pytest.approx(np.abs(energy - energy[0]).max())
    assert (row.scene, row.dt, row.drift) == (free.name, 5.0 / 64, drift) and len(result.top) == 1
