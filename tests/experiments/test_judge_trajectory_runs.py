"""A scene followed by both engines: each level by its own bound, what is kept, whose number and motion a figure shows."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.edited import MOON, XML, setup_of_file
from helpers.trajectory_curves import CASES, DAMPED, FREE, HELD, pair_of, run_of
from models import chain
from PIL import Image

import tmt
from compare.engines.mujoco import parse
from compare.engines.mujoco.engine import METHODS
from compare.engines.tmt import Tmt
from compare.experiments.runs import follow
from compare.experiments.trajectory import figures_motion_gif as gif
from compare.experiments.trajectory import figures_runs, runs
from compare.experiments.trajectory.pairs import TrajectoryResult
from compare.judge.rounding import step_rounding
from compare.judge.run import widest_judged
from compare.robots.arm import ARM
from compare.robots.stick import as_seen, stick_figure

LEVELS = {f"{level}, TMT to MuJoCo" for level in ("one step", "open loop")}
CATCH = CASES["ball catch, free"]  # in which a method of order 1 diverges
BLUE, ORANGE = (0, 114, 178), (230, 159, 0)


def compared(mujoco, case, **edited):
    """The checks, by quantity, and the run of a case by RK4 with its own steps; edited: functions of `runs`."""
    result, dynamics = TrajectoryResult("trajectory"), {"tmt": Tmt().of(case), "mujoco": mujoco.of(case)}
    with pytest.MonkeyPatch.context() as patch, np.errstate(over="ignore", invalid="ignore"):
        for name, function in edited.items():
            patch.setattr(runs, name, function)
        (run,) = runs.compare_scheme(result, case, dynamics, case.steps, "rk4", [METHODS["RK4"]])
    return {check.quantity: check for check in result.checks}, run


def scaled(function, share):
    return lambda *arguments: share * function(*arguments)


def times_of_steps(mujoco, case) -> np.ndarray:
    """The times from which single steps of a case are compared."""
    levels = []

    def level(result, run, name, at, apart, tolerance):
        levels.append((name, at))

    compared(mujoco, case, check_level=level)
    return dict(levels).get("one step", np.zeros(0))


@pytest.mark.parametrize("level, bound", [("one step", "step_rounding"), ("open loop", "band")])
def test_each_level_uses_its_own_bound_and_no_other(level, bound, mujoco):
    """In a scene that is judged to its end."""
    name, function = f"{level}, TMT to MuJoCo", getattr(runs, bound)
    checks, run = compared(mujoco, DAMPED)
    assert np.array_equal(times_of_steps(mujoco, DAMPED), run.t)
    used = checks[name].over_tolerance
    assert all(check.passed for check in checks.values()) and 1e-5 < used < 1.0
    for more, passes in ((1.01, True), (0.99, False)):
        tight, _ = compared(mujoco, DAMPED, **{bound: scaled(function, more * used)})
        assert [quantity for quantity, check in tight.items() if not check.passed] == [name] * (not passes)


def test_an_open_loop_is_judged_up_to_its_last_state(mujoco):
    name, (_, damped) = "open loop, TMT to MuJoCo", compared(mujoco, DAMPED)
    for share, passes in ((0.9, True), (1.1, False)):

        def moved(case, dynamics, setting, method, share=share):
            run = follow(case, dynamics, setting, method)
            run.q[-1] += share * damped.width[-1, :3] * (method == "RK4")
            return run

        checks, _ = compared(mujoco, DAMPED, follow=moved)
        assert checks[name].passed is passes


def test_a_step_whose_bound_is_wider_than_what_moves_is_not_judged(mujoco):
    steps = []
    compared(mujoco, DAMPED, step_rounding=lambda *of: steps.append(step_rounding(*of)) or steps[0])
    for more, is_judged in ((1.01, True), (1.0, False)):

        def widest(*run, more=more):
            return np.append(widest_judged(*run)[:-1], more * steps[0][:, -1].min())

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(runs.rules, "widest_judged", widest)
            checks, _ = compared(mujoco, DAMPED)
        assert ("one step" not in checks) is is_judged


@pytest.mark.parametrize("rate", [100.0, 202.0])
def test_a_step_of_more_than_half_a_turn_is_not_compared_alone(mujoco, rate):
    """Half a turn in 1/64 s is 201 rad/s."""
    case = DAMPED.changed(speed=(np.degrees(rate), 0.0, 0.0), duration=1.0, dt=1 / 64, judged=0.0)
    checks, run = compared(mujoco, case)
    path, at = run.runs["tmt"], times_of_steps(mujoco, case)
    alive, v = run.t < path.ended, np.abs(path.v)
    following = np.append(v[1:].max(axis=1), 0.0)  # within each step: at its end
    slow = np.maximum(v.max(axis=1), following)[alive] / 64 <= np.pi
    assert np.array_equal(at, run.t[alive][slow]) and slow[0] == (rate < 201.1)
    assert ("one step, TMT to MuJoCo" in checks) == slow.any()


def test_a_step_that_ends_faster_than_half_a_turn_is_not_compared_alone(mujoco):
    """From rest the arm falls; in a step of 10 s RK4 turns it far."""
    far = FREE.changed(duration=20.0, dt=10.0, judged=0.0, tags=("own",))
    assert 0.0 not in times_of_steps(mujoco, far) and 0.0 in times_of_steps(mujoco, FREE)
    checks, _ = compared(mujoco, far)
    assert [name for name, check in checks.items() if not check.judged] == ["open loop"]


@pytest.mark.parametrize("judged, passes", [(3.04, True), (3.05, False)])
def test_the_time_that_is_judged_is_at_least_what_the_scene_asks_for(judged, passes, mujoco):
    checks, _ = compared(mujoco, HELD.changed(judged=judged))
    of_time = checks["time judged"]
    assert (of_time.value, of_time.passed, of_time.judged) == (3.046875 if passes else None, passes, passes)


def test_of_a_users_own_scene_nothing_is_expected_but_agreement(mujoco):
    case = DAMPED.changed(judged=0.0, damping=0.0, tags=("own",))
    assert compared(mujoco, case)[0].keys() == LEVELS
    assert compared(mujoco, FREE)[0].keys() == LEVELS | {"time judged", "movement"}
    still = parse(XML.replace("0 0 -9.81", "0 0 0"), tmt.ARM)
    assert compared(still, FREE)[0]["movement"].value == 0.0  # one side stays: it tests nothing


def test_what_is_kept_of_a_run_is_whose_it_says():
    """Beside MuJoCo without gravity: a torque that holds pushes the arm away."""
    moon = parse(MOON, tmt.ARM)
    _, pair = compared(moon, HELD)
    motion = moon.of(HELD).run(*HELD.start, HELD.tau, 5 / 64, 64, "RK4")
    ours, theirs = pair.runs.values()
    assert [*pair.runs] == ["tmt", "mujoco"] and (ours.ended, ours.left) == (np.inf, None)
    for values, expected in ((theirs.q, motion.q), (theirs.v, motion.v)):
        assert np.array_equal(values, expected, equal_nan=True)
    assert theirs.left == 5 / 64 and (theirs.ended < np.inf) == (not np.isfinite(motion.q).all())


LIGHT = """<mujoco><worldbody><body><joint name="arm" axis="0 1 0" damping="0.1"/><geom size="0.1" pos="0.3 0 0"/>
<body pos="0.3 0 0"><joint name="light" axis="0 1 0" damping="1"/>
<inertial pos="0 0 0" mass="0.001" diaginertia="1e-5 1e-5 1e-5"/></body></body></worldbody></mujoco>"""


def test_a_scheme_that_does_not_bear_the_step_of_a_file_is_compared_in_the_beginning(tmp_path):
    """RK4, of a joint that decays at 1e5 per s; the others have its damping implicit. A user's own scene stays as it is."""
    setup = setup_of_file(LIGHT)
    case = setup.robot.case("c", duration=1.0, dt=1 / 64, tags=("own",))
    result, stated = (
        runs.compare_case(each, setup.engines, (1,)) for each in (case, case.changed(tags=("user",)))
    )
    assert {check.passed for check in result.checks} == {True} and False in {
        check.judged for check in stated.checks
    }
    for row in result.rows:
        dt = pytest.approx(1e-5 if row.engine_integrator == "RK4" else 1 / 64, rel=0.01)
        assert (row.dt, row.judged_until / 64) == (dt, dt)
    assert {pair.scheme for pair in result.pairs} == {"semi_implicit_euler", "implicit"}
    assert {row.engine_integrator for row in result.of_beginnings} == {"RK4"} and stated.of_beginnings == []


@pytest.mark.parametrize("share, is_whole", [(0.99, True), (1.01, False)])
def test_only_the_beginning_is_compared_where_the_fastest_rate_times_the_step_exceeds_2(share, is_whole):
    """A pendulum alone decays at damping / inertia: of RK4, to which damping is explicit."""
    damping = share * 2.0 * 64.0 * 2.0  # of 2 kg m2, at dt = 1/64 s
    text = f"""<mujoco><worldbody><body><joint name="arm" axis="0 1 0" damping="{damping!r}"/>
    <inertial pos="0 0 0" mass="1" diaginertia="2 2 2"/></body></worldbody></mujoco>"""
    case = setup_of_file(text).robot.case("c", duration=1.0, dt=1 / 64, tags=("own",))
    part = runs.stable_part(case, "rk4", 1 / 64)
    assert (part is case) is is_whole and runs.stable_part(case, "semi_implicit_euler", 1 / 64) is case
    assert part.duration == pytest.approx(1.0 if is_whole else 64 / (share * 128.0))


def test_figures_of_a_run_have_the_numbers_of_each_engine_in_their_place():
    schemes = "rk4", "implicit", "discrete"
    found = [pair_of(HELD, 0.1, 0.2, (None, 4.0), scheme=scheme, until=2.5) for scheme in schemes]
    result = TrajectoryResult("trajectory", pairs=found, errors={HELD.name: (0.1, 0.2)})
    caption = figures_runs.draw_held(result, found[0], 2)[2].values
    engines = [{"label": "TMT", "left": None, "error": 0.1}, {"label": "MuJoCo", "left": 4.0, "error": 0.2}]
    assert caption["engines"] == engines
    assert (caption["judged"], caption["apart"]) == (2.5, pytest.approx(0.05))  # half of the run

    about = {"scene": HELD.name, "level": "open loop"}
    result.rows = [SimpleNamespace(**about, difference_over_band=used) for used in (0.25, None, 0.125)]
    _, fig, caption = figures_runs.draw_run(result, HELD)
    assert caption.values["share"] == 0.25 and {at for _, at in caption.values["judged"]} == {2.5}
    paths = found[0].runs
    for ax, name in ((fig.axes[0], "q"), (fig.axes[3], "v")):  # movements and speeds of the first scheme
        ours, theirs = (getattr(paths[engine], name)[:, 0] for engine in ("tmt", "mujoco"))
        start = HELD.q[0] if name == "q" else 0.0
        assert ax.lines[0].get_ydata() == pytest.approx(ours - start, abs=1e-15)
        assert ax.lines[1].get_ydata() == pytest.approx(theirs[::3] - start, abs=1e-15)


@pytest.fixture(scope="module")
def followed(engines):
    return runs.compare_case(CATCH, engines, (1, 4)).pairs


def test_sticks_go_from_joint_to_joint_and_from_the_last_to_its_centre_of_mass_and_up_is_up():
    points, links = stick_figure(setup_of_file(chain(3)).robot, np.zeros((1, 3)))
    assert links == [(0, 1), (1, 2), (2, 3)] and points.shape == (1, 4, 3)
    right, _, up = as_seen(np.eye(3))
    assert up == pytest.approx([0.0, np.cos(np.radians(20.0))]) and right[0] > 0.9


def test_the_gif_shows_each_engine_where_it_is_until_it_has_diverged(followed, tmp_path):
    """A run of three states: MuJoCo where the arm is let go, then beside tmt, then nowhere."""
    (pair,) = gif.drawn_pairs(ARM, followed)
    left, right = ARM.posture("bent"), ARM.posture("zero")
    case = pair.case.changed(duration=2.0, dt=1.0)
    runs_of = {"tmt": run_of(case, np.array([left] * 3), np.zeros((3, 3))),
               "mujoco": run_of(case, np.array([right, left, left]), np.zeros((3, 3)), ended=2.0)}  # fmt: skip
    pair = replace(pair, runs=runs_of)
    pictures = list(gif.drawn(pair, "TMT"))
    places = []
    for picture in pictures:
        pixels = np.asarray(picture.convert("RGB"), int)[64:-24]  # below the names
        near = [np.abs(pixels - colour).max(axis=2) < 12 for colour in (BLUE, ORANGE)]
        places.append(
            [of.any() and (np.argwhere(of).min(axis=0), np.argwhere(of).max(axis=0)) for of in near]
        )
    assert [bool(theirs) for _, theirs in places] == [True, True, False] and all(ours for ours, _ in places)
    apart = [np.abs(np.subtract(ours, theirs)).max() for ours, theirs in places[:2]]
    assert apart[0] > 60 and apart[1] < 12  # pixels
    gif.Animation([pair], "TMT").savefig(tmp_path / "motion.gif")
    with Image.open(tmp_path / "motion.gif") as image:
        assert (image.n_frames, image.size) == (3, (512, 336))
