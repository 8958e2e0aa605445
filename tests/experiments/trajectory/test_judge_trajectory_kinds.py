"""Runs of robots with slides, balls and many joints: what is compared, what is bounded, and what is drawn."""

from types import SimpleNamespace

import numpy as np
import pytest
from models import chain, random_tree

from compare.engines.mujoco import reading
from compare.experiments import trajectory
from compare.experiments.trajectory import derivative, figures_lines, figures_runs, horizon, leaving, runs, sentences
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
    (check,) = result.checks
    assert check.passed and check.unit == "N m s/rad or N s/m"


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
    finer, judged = sentences.of_left_out([case], (1, 2), 6400 * 511)
    assert finer == "Runs of more than 511 steps, finer than a scene's own, are left out: c."
    assert judged.endswith("these scenes are judged for no more steps than can be afforded: c: 511 steps.")
    assert sentences.of_left_out([case], (1,), 6400 * 512) == []
    assert [runs.recorded(case.changed(duration=n / 64, dt=1 / 64)) for n in (5, 64, 65, 130, 512)] == [
        5,
        64,
        65,
        65,
        64,
    ]
    duration, steps = horizon.growth_run(LONG, [case], small=False)
    assert (duration, steps) == (416 / 512, 416) and horizon.growth_run(LONG, [case], small=True) == (0.25, 128)
    assert horizon.early(np.linspace(0.0, 0.25, 9)) == 4 and horizon.early(np.linspace(0.0, 60.0, 61)) == 5


def curve(case, off):
    """A run whose engines are off by so much in each movement, of which the second half is not judged."""
    t = np.linspace(0.0, 1.0, 5)
    q = case.coordinates.move(case.q, t[:, None] * 0.1 * np.ones(case.coordinates.nv))
    v = np.ones((5, case.coordinates.nv))
    theirs = case.coordinates.move(q, np.outer(t <= 0.5, off) + np.outer(t > 0.5, off[::-1]))
    return {
        "integrator": "RK4", "t": t, "every": 1, "tmt": [q, v], "mujoco": [theirs, v], "band": np.full(5, 1e-9), "nudged": q,
        "judged_until_s": 0.5, "ended": {"tmt": None, "mujoco": None}, "left": {"tmt": None, "mujoco": None},
    }  # fmt: skip


def test_of_many_joints_the_six_that_differ_most_are_drawn():
    case = LONG.case("c", duration=1.0, dt=1 / 4)
    off = np.zeros(40)
    off[[30, 2, 39, 7, 11, 5]] = np.arange(1, 7) * 1e-9
    off[9] = 0.5e-9
    result = Result("trajectory", curves={"runs": {("c", "rk4", 4): curve(case, off)}, "errors": {}})
    _, fig, caption = figures_runs.draw_run(result, case)
    names = [text.get_text() for text in fig.legends[0].get_texts()]
    drawn = ["joint3, TMT", "joint6, TMT", "joint8, TMT", "joint12, TMT", "joint31, TMT", "joint40, TMT"]
    assert names[:6] == drawn and names[10:] == ["not judged"]
    assert "Of 40 positions and speeds the 6 are shown in which" in caption and "Of a ball" not in caption


def test_a_ball_is_drawn_by_its_turn_from_the_start():
    case = ROBOT.case("c", duration=1.0, dt=1 / 4)
    of_case, count = curve(case, np.zeros(case.coordinates.nv)), case.coordinates.nv
    values = figures_lines.drawn(case, of_case["tmt"][0])
    for kind, at, by in case.coordinates.places.joints:
        if kind == "ball":
            assert values[-1, by] == pytest.approx(0.1)
        else:
            assert values[:, by] == pytest.approx(of_case["tmt"][0][:, at])
    result = Result("trajectory", curves={"runs": {("c", "rk4", 4): of_case}, "errors": {}})
    _, fig, caption = figures_runs.draw_run(result, case)
    for k, turn in ((2, 1.75), (3, 1.85)):  # times the root of 3: on this side of half a turn and beyond it
        of_case["tmt"][0][k] = case.coordinates.move(case.q, np.full(case.coordinates.nv, turn))
    beyond = figures_lines.drawn(case, of_case["tmt"][0])
    balls = [by for kind, _, by in case.coordinates.places.joints if kind == "ball"]
    assert all(np.isnan(beyond[3, by]).all() and np.isfinite(beyond[:3, by]).all() for by in balls) and balls
    assert fig.axes[0].get_ylabel() == "position, rad or m" and "Of a ball the turn from its start is drawn" in caption
    assert values.shape == (5, count)


def test_a_robot_from_a_file_is_said_which_scheme_each_integrator_is():
    said = sentences.of_integrators(ROBOT, ENGINES["mujoco"])
    assert said[0].startswith("Their schemes in tmt, for this ") and "RK4: rk4" in said[0]
    methods = {name: method for name, method in ENGINES["mujoco"].methods.items() if name != "implicit"}
    lacking = sentences.of_integrators(ROBOT, SimpleNamespace(methods=methods))
    assert lacking[-1].startswith("No scheme in tmt is that of MuJoCo's implicit for this")
    assert "quaternions are multiplied" in trajectory.tolerance(ROBOT) and "1 rad" not in trajectory.claim(ROBOT)
    assert "quaternions" not in trajectory.tolerance(LONG)
