"""A scene followed by both engines: each level by its own bound, what is kept, whose number and motion a figure shows."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from edited import MOON, XML, setup_of_file
from models import chain, random_tree
from PIL import Image
from trajectory_curves import CASES, DAMPED, FREE, HELD, run_of

import tmt
from compare.engines.mujoco import parse
from compare.engines.mujoco.engine import METHODS
from compare.engines.tmt import Tmt
from compare.experiments.trajectory import figures_motion_gif as gif
from compare.experiments.trajectory import figures_runs, motion, runs
from compare.experiments.trajectory.runs import TrajectoryResult
from compare.judge.run import diverged_at
from compare.robots.arm import ARM
from compare.robots.stick import as_seen, stick_figure

LEVELS = {f"{level}, TMT to MuJoCo" for level in ("one step", "open loop")}
CATCH = CASES["ball catch, free"]  # in which a method of order 1 diverges
BLUE, ORANGE = (0, 114, 178), (230, 159, 0)


def side(case) -> runs.Twin:
    """TMT's side of a case by RK4 with its own steps."""
    return runs.run_of_twin(case, Tmt().of(case), case.steps, "rk4")


def judged_with(mujoco, mine) -> dict:
    """The checks of a run whose TMT side may be edited, by quantity."""
    result = TrajectoryResult("trajectory")
    runs.compare_run(result, mine, mujoco.of(mine.run.case), METHODS["RK4"])
    return {check.quantity: check for check in result.checks}


@pytest.mark.parametrize("level, field", [("one step", "step_tolerance"), ("open loop", "width")])
def test_each_level_uses_its_own_bound_and_no_other(level, field, mujoco):
    """In a scene that is judged to its end."""
    name, damped = f"{level}, TMT to MuJoCo", side(DAMPED)
    checks = judged_with(mujoco, damped)
    used = checks[name].over_tolerance
    assert all(check.passed for check in checks.values()) and 1e-5 < used < 1.0
    assert checks[name].tolerance in getattr(damped, field) and np.array_equal(damped.at, damped.run.t)
    for more, passes in ((1.01, True), (0.99, False)):
        tight = judged_with(mujoco, damped._replace(**{field: more * used * getattr(damped, field)}))
        assert [quantity for quantity, check in tight.items() if not check.passed] == [name] * (not passes)


def test_an_open_loop_is_judged_up_to_its_last_state(mujoco):
    damped = side(DAMPED)
    path, name = damped.run.paths["tmt"], "open loop, TMT to MuJoCo"
    for share, passes in ((0.9, True), (1.1, False)):
        q = path.q.copy()
        q[-1] += share * damped.width[-1, :3]
        edited = damped._replace(run=replace(damped.run, paths={"tmt": path._replace(q=q)}))
        assert judged_with(mujoco, edited)[name].passed is passes


def test_a_step_whose_bound_is_wider_than_what_moves_is_not_judged(mujoco):
    damped = side(DAMPED)
    for more, is_judged in ((1.01, True), (1.0, False)):
        widest = np.append(damped.widest[:-1], more * damped.step_tolerance[:, -1].min())
        assert ("one step" not in judged_with(mujoco, damped._replace(widest=widest))) is is_judged


@pytest.mark.parametrize("rate", [100.0, 202.0])
def test_a_step_of_more_than_half_a_turn_is_not_compared_alone(mujoco, rate):
    """Half a turn in 1/64 s is 201 rad/s."""
    case = DAMPED.changed(speed=(np.degrees(rate), 0.0, 0.0), duration=1.0, dt=1 / 64, judged=0.0)
    mine = side(case)
    path = mine.run.paths["tmt"]
    alive, v = mine.run.t < (np.inf if path.ended is None else path.ended), np.abs(path.v)
    following = np.append(v[1:].max(axis=1), 0.0)  # within each step: at its end
    slow = np.maximum(v.max(axis=1), following)[alive] / 64 <= np.pi
    assert np.array_equal(mine.at, mine.run.t[alive][slow]) and slow[0] == (rate < 201.1)
    assert ("one step, TMT to MuJoCo" in judged_with(mujoco, mine)) == slow.any()


def test_a_step_that_ends_faster_than_half_a_turn_is_not_compared_alone(mujoco):
    """From rest the arm falls; in a step of 10 s RK4 turns it far."""
    far = FREE.changed(duration=20.0, dt=10.0, judged=0.0, tags=("own",))
    mine = side(far)
    assert 0.0 not in mine.at and 0.0 in side(FREE).at
    assert [name for name, check in judged_with(mujoco, mine).items() if not check.judged] == ["open loop"]


@pytest.mark.parametrize("judged, passes", [(3.04, True), (3.05, False)])
def test_the_time_that_is_judged_is_at_least_what_the_scene_asks_for(judged, passes, mujoco):
    case = HELD.changed(judged=judged)
    checks = judged_with(mujoco, side(case))
    of_time = checks["time judged"]
    assert (of_time.value, of_time.passed, of_time.judged) == (3.046875 if passes else None, passes, passes)


def test_of_a_users_own_scene_nothing_is_expected_but_agreement(mujoco):
    case = DAMPED.changed(judged=0.0, damping=0.0, tags=("own",))
    assert judged_with(mujoco, side(case)).keys() == LEVELS
    assert judged_with(mujoco, side(FREE)).keys() == LEVELS | {"time judged", "movement"}
    still = parse(XML.replace("0 0 -9.81", "0 0 0"), tmt.ARM)
    assert judged_with(still, side(FREE))["movement"].value == 0.0  # one side stays: it tests nothing


def test_what_is_kept_of_a_run_is_whose_it_says():
    moon = parse(MOON, tmt.ARM)
    mine, result = side(HELD), TrajectoryResult("trajectory")
    run = runs.compare_run(result, mine, moon.of(HELD), METHODS["RK4"])
    motion = moon.of(HELD).run(*HELD.start, HELD.tau, 5 / 64, 64, "RK4")
    (ours, theirs), ended = run.paths.values(), diverged_at(HELD, motion.t, motion.q, motion.v)
    assert [*run.paths] == ["tmt", "mujoco"] and ours is mine.run.paths["tmt"]
    assert (ours.ended, ours.left) == (None, None)
    for values, expected in ((theirs.q, motion.q), (theirs.v, motion.v)):
        assert np.array_equal(values, expected, equal_nan=True)
    assert (theirs.ended, theirs.left) == (ended, 5 / 64)
    assert {row.diverged_at for row in result.rows} == {ended}


LIGHT = """<mujoco><worldbody><body><joint name="arm" axis="0 1 0" damping="0.1"/><geom size="0.1" pos="0.3 0 0"/>
<body pos="0.3 0 0"><joint name="light" axis="0 1 0" damping="1"/>
<inertial pos="0 0 0" mass="0.001" diaginertia="1e-5 1e-5 1e-5"/></body></body></worldbody></mujoco>"""


def test_a_scheme_that_does_not_bear_the_step_of_a_file_is_compared_in_the_beginning(tmp_path):
    """RK4, of a joint that decays at 1e5 per s; the others have its damping implicit. A user's own scene stays as it is."""
    setup = setup_of_file(LIGHT)
    case = setup.robot.case("c", duration=1.0, dt=1 / 64, tags=("own",))
    result, stated = (runs.follow(each, setup.engines, (1,)) for each in (case, case.changed(tags=("user",))))
    assert {check.passed for check in result.checks} == {True} and False in {
        check.judged for check in stated.checks
    }
    for row in result.rows:
        dt = pytest.approx(1e-5 if row.engine_integrator == "RK4" else 1 / 64, rel=0.01)
        assert (row.dt, row.judged_until / 64) == (dt, dt)
    assert {run.scheme for run in result.runs} == {"semi_implicit_euler", "implicit"}
    assert {row.engine_integrator for row in result.of_beginnings} == {"RK4"} and stated.of_beginnings == []


def test_figures_of_a_run_have_the_numbers_of_each_engine_in_their_place():
    schemes = "rk4", "implicit", "discrete"
    found = [run_of(HELD, 0.1, 0.2, (None, 4.0), scheme=scheme, until=2.5) for scheme in schemes]
    result = TrajectoryResult("trajectory", runs=found, errors={HELD.name: (0.1, 0.2)})
    caption = figures_runs.draw_held(result, found[0], 2)[2].values
    engines = [{"label": "TMT", "left": None, "error": 0.1}, {"label": "MuJoCo", "left": 4.0, "error": 0.2}]
    assert caption["engines"] == engines
    assert (caption["judged"], caption["apart"]) == (2.5, pytest.approx(0.05))

    about = {"scene": HELD.name, "level": "open loop"}
    result.rows = [SimpleNamespace(**about, difference_over_band=used) for used in (0.25, None, 0.125)]
    _, fig, caption = figures_runs.draw_run(result, HELD)
    assert caption.values["share"] == 0.25 and {at for _, at in caption.values["judged"]} == {2.5}
    paths = found[0].paths
    for ax, name in ((fig.axes[0], "q"), (fig.axes[3], "v")):  # angles and rates of the first scheme
        ours, theirs = (getattr(paths[engine], name)[:, 0] for engine in ("tmt", "mujoco"))
        assert np.array_equal(ax.lines[0].get_ydata(), ours)
        assert np.array_equal(ax.lines[1].get_ydata(), theirs[::3])


def test_a_ball_is_drawn_by_its_turn_from_the_start():
    """Times the root of 3: on this side of half a turn, and beyond it, where nothing is drawn."""
    case = setup_of_file(random_tree(2, joints=5)).robot.case("c")
    turns = np.array([0.0, 0.1, 1.75, 1.85])
    q = case.coordinates.move(case.q, turns[:, None] * np.ones(case.coordinates.nv))
    values = figures_runs.drawable(case, "q", q)
    for joint in case.coordinates.places.joints:
        if joint.kind == "ball":
            assert values[:3, joint.qd] == pytest.approx(turns[:3, None] * np.ones(3))
            assert np.isnan(values[3, joint.qd]).all()
        else:
            assert values[:, joint.qd] == pytest.approx(q[:, joint.q])


@pytest.fixture(scope="module")
def followed(engines):
    return runs.follow(CATCH, engines, (1, 4)).runs


@pytest.fixture(scope="module")
def drawn(followed):
    (run,) = motion.drawn_runs(ARM, followed)
    return motion.pictures_of(run)


def test_sticks_go_from_joint_to_joint_and_from_the_last_to_its_centre_of_mass_and_up_is_up():
    points, links = stick_figure(setup_of_file(chain(3)).robot, np.zeros((1, 3)))
    assert links == [(0, 1), (1, 2), (2, 3)] and points.shape == (1, 4, 3)
    right, _, up = as_seen(np.eye(3))
    assert up == pytest.approx([0.0, np.cos(np.radians(20.0))]) and right[0] > 0.9


def test_the_gif_shows_each_engine_where_it_is_until_it_has_diverged(drawn, tmp_path):
    left = np.array([[-1.0, 1.0], [-1.0, 1.5], [-1.0, 2.0]])
    right = left[:, ::-1]
    points = {"tmt": np.stack([left] * 3), "mujoco": np.stack([right, left, np.nan * right])}
    scene = drawn._replace(t=drawn.t[:3], apart=drawn.apart[:3], points=points)
    gif.Animation([scene], "TMT").savefig(tmp_path / "motion.gif")
    found = []
    with Image.open(tmp_path / "motion.gif") as image:
        for k in range(image.n_frames):
            image.seek(k)
            pixels = np.asarray(image.convert("RGB"), int)[gif.TOP : -gif.BOTTOM]  # below the names
            columns = [np.nonzero(np.abs(pixels - colour).max(axis=2) < 8)[1] for colour in (BLUE, ORANGE)]
            found.append([of.mean() // (gif.PIXELS[0] / 2) if len(of) > 100 else None for of in columns])
    assert found == [[0, 1], [0, 0], [0, None]]  # in the left half, in the right one, nowhere
