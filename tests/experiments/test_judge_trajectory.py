"""The rules of runs, just inside and just outside; errors, departures, the headline."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.edited import setup_of_file
from helpers.trajectory_curves import FREE, HELD, NEVER, pair_of, run_of

import tmt
from compare.experiments.trajectory import find_errors, headline, runs
from compare.experiments.trajectory.pairs import TrajectoryResult
from compare.judge.run import widest_judged
from compare.robots.arm import ARM
from compare.robots.case import Coordinates
from compare.truth.reference import reference

LIFT_AND_HEAD = Coordinates(("lift", "head"), ("slide", "ball"))  # four movements, and four speeds
NARROW, AT_ONCE = np.full(11, 0.999e-3), np.array([0.0, 1e-9, *[np.inf] * 9])


def test_a_run_is_judged_while_its_band_is_narrow_and_nothing_has_diverged():
    case = FREE.changed(duration=4.0, dt=1.0)
    narrow = np.full((5, 6), 0.9e-3)
    wide = narrow + 0.2e-3 * np.array([[False], [True], [False], [True], [True]])

    def judged(width, ended=NEVER):
        return replace(pair_of(case, ended=ended, steps=4), width=width).judged

    assert judged(narrow) == 5
    assert judged(wide) == judged(np.hstack([wide[:, :1], narrow[:, 1:]])) == 1
    assert judged(np.where(np.arange(5)[:, None] < 2, narrow, 1.0)) == 2
    assert judged(narrow, (2.5, 4.0)) == 3
    assert judged(narrow + 1.0) == 1


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
    pair = SimpleNamespace(case=FREE, where="", required=required, judged_until=until)
    result = TrajectoryResult("trajectory")
    runs.check_time_judged(result, pair, alive)
    assert [check.passed for check in result.checks] == [judged] * (required > 0.0 or not judged)
    assert all(check.judged == judged for check in result.checks)


def level(difference, bar):
    """The check and the row of differences (states, 2 nv)."""
    result, times = TrajectoryResult("trajectory"), np.arange(len(difference)) / 2
    case = lift_and_head()
    still = run_of(case, np.tile(case.q, (65, 1)), np.zeros((65, 4)))
    pair = replace(pair_of(FREE), runs={"tmt": still, "mujoco": still})
    tolerance = np.full(np.shape(difference), bar)
    runs.check_level(result, pair, "open loop", times, np.array(difference), tolerance)
    return result.checks[0], result.rows[0]


@cache
def lift_and_head():
    """A case of a slide that carries a ball."""
    inertial = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    ball = f'<body><joint name="head" type="ball"/>{inertial}</body>'
    lift = f'<body><joint name="lift" type="slide" axis="0 0 1"/>{inertial}{ball}</body>'
    return setup_of_file(f"<mujoco><worldbody>{lift}</worldbody></mujoco>").robot.case("c")


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
    (*NEVER, NARROW, []), (0.5, 0.5, NARROW, [True]), (0.5, 0.51, NARROW, [False]),
    (np.inf, 0.5, NARROW, [False]), (0.5, np.inf, NARROW + 2e-6, []), (0.1, 0.11, AT_ONCE, [False]),
    (0.12, 0.13, AT_ONCE, []),  # the band opens before the next recorded state
])  # fmt: skip
def test_both_diverge_at_the_same_step_while_the_band_is_narrow(ours, theirs, width, found):
    """In a second with 100 steps, of which each tenth is recorded."""
    case = FREE.changed(duration=1.0, dt=0.1)
    result = TrajectoryResult("trajectory")
    width = np.outer(width, [1.0, 1.0, 1.0, 1e9, 1e9, 1e9])  # that of speeds does not count
    runs.check_divergence(result, replace(pair_of(case, ended=(ours, theirs), steps=100), width=width))
    assert [check.passed for check in result.checks] == found


def test_the_error_of_a_held_scene_is_its_distance_from_the_start_and_of_a_free_one_that_from_many_digits():
    q = tmt.simulate(FREE.tree, *FREE.start, FREE.tau, 5 / 64, 64, "rk4").q
    others = [pair_of(HELD, 9.0, 9.0, scheme="implicit"), pair_of(HELD, 9.0, 9.0, steps=128)]
    free, held = pair_of(FREE), pair_of(HELD, 0.25, np.nan)
    free = replace(free, runs={"tmt": run_of(FREE, q, q), "mujoco": run_of(FREE, q + 100.0, q)})
    result = TrajectoryResult("trajectory", pairs=[*others, free, held])
    find_errors(result, ARM, {FREE.name: reference(FREE)})
    assert list(result.errors) == [HELD.name, FREE.name] and result.errors[HELD.name] == (0.25, None)
    assert result.answer.values["steps"] == 64
    differences = {scene["scene"]: scene["difference"] for scene in result.notes[-1].values["scenes"]}
    assert differences[FREE.name] == pytest.approx(100.0) and np.isnan(differences[HELD.name])
    ours, theirs = result.errors[FREE.name]
    assert ours == pytest.approx(0.27, rel=0.03) and theirs > 90.0


@pytest.mark.parametrize("ours, theirs, at_once, found", [
    (2.5, 2.5, False, [True]), (2.5, 2.6, False, [False]), (*NEVER, False, []),
    (5 / 64, 5 / 64, False, [True]), (5 / 64, 5 / 64, True, [None]),  # the band is wide: nothing is known
])  # fmt: skip
def test_of_two_runs_that_diverge_the_step_is_compared_or_nothing_is_judged(ours, theirs, at_once, found):
    """In a user's scene, which states no time and no movement."""
    case = FREE.changed(judged=0.0, tags=("own",))
    pair = pair_of(case, ended=(ours, theirs))
    if at_once:
        pair = replace(pair, width=np.full((65, 6), np.inf))
    result = TrajectoryResult("trajectory")
    runs.check_end(result, pair)
    ended = [check for check in result.checks if check.quantity != "time judged"]
    assert [check.passed if check.judged else None for check in ended] == found


def test_a_headline_has_the_share_of_the_band_only_where_nothing_fails():
    for off, said in ((0.9, True), (1.1, False), (np.nan, False)):
        result, apart, bars = TrajectoryResult("trajectory"), np.zeros((2, 6)), np.ones((2, 6))
        apart[1, 2] = off
        runs.check_level(result, pair_of(FREE), "open loop", np.arange(2.0), apart, bars)
        runs.check_level(result, pair_of(HELD), "open loop", np.arange(2.0), 0.0 * bars, bars)
        found = headline(result)
        assert (found is not None) is said
        assert not said or found.values == {"scenes": 2, "share": pytest.approx(0.9)}
