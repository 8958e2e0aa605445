"""A scene followed by both engines: each level by its own bound, which rules are applied, what is kept; joints of all kinds."""

import numpy as np
import pytest
from models import chain, random_tree
from trajectory_curves import DAMPED, FREE, HELD

import tmt
from compare.engines.mujoco import parse, reading
from compare.engines.mujoco.engine import METHODS as OF_MUJOCO
from compare.engines.tmt import Tmt
from compare.experiments.trajectory import derivative, horizon, leaving, runs, sentences
from compare.judge.check import Result
from compare.judge.run import diverged_at
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import engines as engines_of
from tmt.methods import METHODS, one_step

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
    runs.compare_runs(result, case, mujoco.of(case), case.steps, [OF_MUJOCO["RK4"]], mine)
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


@pytest.mark.parametrize("more", [0.0, 1e-15])
def test_an_integrator_of_other_bits_is_seen(more, mujoco):
    dynamics, result = mujoco.of(FREE), Result("trajectory")
    run = dynamics.run

    def other(*arguments):
        motion = run(*arguments)
        return motion._replace(q=motion.q + more * (arguments[-1] == "implicitfast"))

    dynamics.run = other
    runs.compare_runs(result, FREE, dynamics, 64, [OF_MUJOCO["Euler"], OF_MUJOCO["implicitfast"]], side(FREE))
    assert [check.passed for check in result.checks if check.quantity == "the same bits as Euler"] == [more == 0.0]


def test_a_run_of_which_nothing_is_judged_is_said(engines):
    case = FREE.changed(duration=1 / 64, dt=1 / 512)
    notes = [runs.follow(case, engines, (1,), entries=entries).notes for entries in (0, 100_000)]
    assert [any("RK4, 8 steps" in note for note in of_run) for of_run in notes] == [True, False]


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


def test_a_start_is_moved_by_eps_of_a_radian_and_by_more_where_a_number_has_no_such_place():
    eps = 2.0**-52
    moved = runs.nudged(np.array([0.0, -0.5, 6.0, -6.0]))
    np.testing.assert_array_equal(moved, [eps, -0.5 + eps, 6.0 + 4 * eps, -6.0 + 4 * eps])


# joints of all kinds: a free body, balls, slides, hinges, springs; so short that nothing is compiled for it

READ = reading.read(random_tree(2, joints=5))
ROBOT = robot_of(READ, "kinds.xml")


def test_every_level_of_a_run_is_compared_as_movements():
    """From a state and its negative quaternions: the same turns, so nothing is off."""
    coordinates, rng = ROBOT.coordinates, np.random.default_rng(0)
    q, v = coordinates.random(rng, 5), rng.normal(size=(5, coordinates.nv))
    other, moved = q.copy(), 1e-3 * rng.normal(size=v.shape)
    for joint in coordinates.places.balls:
        other[:, joint.q] *= -1.0
    assert np.abs(runs.off_by(coordinates, (q, v), (other, v))).max() < 1e-14
    off = runs.off_by(coordinates, (coordinates.move(q, moved), v + moved), (other, v))
    assert off == pytest.approx(np.hstack([moved, moved]), abs=1e-13)


def test_the_derivative_of_the_bias_is_that_of_mujoco():
    result = Result("trajectory")
    derivative.compare_derivatives(result, ROBOT, engines_of(reading.engine(READ)))
    assert result.checks[0].passed and result.checks[0].unit == "N m s/rad or N s/m"


def test_the_linear_map_is_that_of_rk4():
    """Small deviations from where it is held, in movements and speeds: after a step they are where the map has them."""
    case = ROBOT.case("held", torque="hold")
    J, _ = leaving.linear_map(case)
    n, off = case.coordinates.nv, 1e-6 * np.random.default_rng(1).normal(size=len(J))
    q, v = one_step(METHODS["rk4"], case.tree, case.coordinates.move(case.q, off[:n]), off[n:], case.tau, case.scene.dt)
    found = np.concatenate([case.coordinates.difference(np.array(q), case.q), v])
    assert found == pytest.approx(J @ off, abs=1e-3 * np.abs(J @ off).max())
