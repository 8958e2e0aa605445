"""Runs of robots with slides, balls and many joints: what is compared, what is bounded, and what is drawn."""

import numpy as np
import pytest
from models import chain, random_tree

from compare.engines.mujoco import reading
from compare.experiments.trajectory import derivative, figures_lines, horizon, leaving, runs, sentences
from compare.judge.check import Result
from compare.robots.file import robot_of
from compare.setup import engines as engines_of
from tmt.methods import METHODS, one_step

# a free body, balls, slides, hinges, springs: so short that nothing is compiled for it
READ = reading.read(random_tree(2, joints=5))
ROBOT = robot_of(READ, "kinds.xml")
ENGINES = engines_of(reading.engine(READ))
LONG = robot_of(reading.read(chain(40)), "chain.xml")


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
    derivative.compare_derivatives(result, ROBOT, ENGINES)
    assert result.checks[0].passed and result.checks[0].unit == "N m s/rad or N s/m"


def test_the_linear_map_is_that_of_rk4_for_a_robot_of_any_kind():
    """Small deviations from where it is held, in movements and speeds: after a step they are where the map has them."""
    case = ROBOT.case("held", torque="hold")
    J, _ = leaving.linear_map(case)
    n, off = case.coordinates.nv, 1e-6 * np.random.default_rng(1).normal(size=len(J))
    q, v = one_step(METHODS["rk4"], case.tree, case.coordinates.move(case.q, off[:n]), off[n:], case.tau, case.scene.dt)
    found = np.concatenate([case.coordinates.difference(np.array(q), case.q), v])
    assert found == pytest.approx(J @ off, abs=1e-3 * np.abs(J @ off).max())


def test_what_jacobians_cost_bounds_the_steps_of_a_run():
    """40 hinges: 6400 entries a step."""
    case = LONG.case("c", duration=1.0, dt=1 / 512)
    assert runs.steps_afforded(case, 6400 * 100) == 100 and runs.steps_afforded(case, 6399) == 0
    assert runs.counts(case, (1, 2, 16), 6400 * 1023) == [512] and runs.counts(case, (1, 2), 6400 * 1024) == [512, 1024]
    assert [len(sentences.of_left_out([case], *given)) for given in (((1, 2), 6400 * 511), ((1,), 6400 * 512))] == [
        2,
        0,
    ]
    of_steps = {n: runs.recorded(case.changed(duration=n / 64, dt=1 / 64)) for n in (5, 64, 65, 130, 512)}
    assert of_steps == {5: 5, 64: 64, 65: 65, 130: 65, 512: 64}
    assert horizon.growth_run(LONG, [case], small=False) == (416 / 512, 416)
    assert horizon.growth_run(LONG, [case], small=True) == (0.25, 128)
    assert horizon.early(np.linspace(0.0, 0.25, 9)) == 4 and horizon.early(np.linspace(0.0, 60.0, 61)) == 5


def test_a_start_is_moved_by_eps_of_a_radian_and_by_more_where_a_number_has_no_such_place():
    eps = 2.0**-52
    moved = runs.nudged(np.array([0.0, 1.0, -0.5, 6.0, -6.0]))
    np.testing.assert_array_equal(moved, [eps, 1.0 + eps, -0.5 + eps, 6.0 + 4 * eps, -6.0 + 4 * eps])


def test_a_ball_is_drawn_by_its_turn_from_the_start():
    """Times the root of 3: on this side of half a turn, and beyond it, where nothing is drawn."""
    case = ROBOT.case("c")
    nv, joints = case.coordinates.nv, case.coordinates.places.joints
    turns = np.array([0.0, 0.1, 1.75, 1.85])
    q = case.coordinates.move(case.q, turns[:, None] * np.ones(nv))
    values, balls = figures_lines.drawn(case, q), [by for kind, _, by in joints if kind == "ball"]
    assert values.shape == (4, nv) and balls
    for kind, at, by in joints:
        if kind == "ball":
            assert values[:3, by] == pytest.approx(turns[:3, None] * np.ones(3)) and np.isnan(values[3, by]).all()
        else:
            assert values[:, by] == pytest.approx(q[:, at])
