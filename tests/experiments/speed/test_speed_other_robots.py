"""Speed of robots of files: their references, who takes part, orders on a free body, units."""

from types import SimpleNamespace

import numpy as np
import pytest
from models import PATHS

import tmt
from compare.engines import Method, Setting
from compare.engines.heyoka import Heyoka
from compare.engines.mujoco import engine, read
from compare.engines.scipy import Scipy
from compare.experiments.speed import accuracy, advice, evaluations, floors, settings, tumbling
from compare.experiments.speed.runs import row_of_run
from compare.judge.check import Result
from compare.judge.rounding import growth
from compare.judge.units import renamed, said, value
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import Setup, engines
from compare.truth import reference
from compare.truth.free_body import free_turning


@pytest.fixture(scope="module")
def gripper():
    """The robot, its engines, and the scene that is followed."""
    reading = read(PATHS["gripper"])
    robot = robot_of(reading, "gripper.xml")
    return robot, engines(engine(reading)), settings.regular_of(robot)


@pytest.fixture(scope="module")
def stone():
    """A body that tumbles, and its exact quaternions at nine times."""
    case = tumbling.stone().case("tumbling", posture=tumbling.QUATERNION, speed=tumbling.SPEEDS)
    times = np.linspace(0.0, tumbling.TUMBLED, tumbling.READ + 1)
    return case, free_turning(times, tumbling.MOMENTS, case.v, case.q)[1].astype(float)


def test_a_reference_in_doubles_says_its_digits(gripper):
    _, _, case = gripper
    known = reference.in_doubles(case)
    assert known.apart < 1e-13 and known.low.max() == 0.0 and known.steps > case.steps
    finer = tmt.simulate(*case.start, case.tau, case.duration / 2**14, 2**14, "rk4", case.tree)
    assert known.error(finer.q[::256], range(4)).max() < 10 * max(known.apart, 1e-15)
    off = known.high[:, 2:3] + 1e-3
    assert known.error(off, [2]) == pytest.approx(1e-3)


def test_any_scene_of_a_file_has_a_reference_in_pairs(gripper):
    for case in gripper[0].cases[-2:]:
        known, doubles = reference.reference(case), reference.in_doubles(case)
        assert known.why is None and known.apart < 1e-29 and np.abs(known.low).max() > 0.0
        assert known.error(doubles.high[:, : case.coordinates.nq], range(4)).max() < 10 * max(doubles.apart, 1e-15)


def test_a_reference_in_doubles_measures_turns_and_no_quaternions():
    robot = robot_of(read(PATHS["free_body"]), "free_body.xml")
    case = settings.regular_of(robot)
    known = reference.in_doubles(case)
    assert known.error(-known.high[:, 3:7], [3]).max() < 1e-15  # -q is the same turn
    turned = case.coordinates.move(known.high[:, :7], [0.0, 0.0, 0.0, 0.0, 1e-3, 0.0])
    assert known.error(turned[:, 3:], [3]) == pytest.approx(1e-3)
    assert known.error(turned, range(4)) == pytest.approx(1e-3)


def test_a_run_that_does_not_end_has_no_reference(gripper):
    _, _, case = gripper
    fast = case.changed(speed=(1e12, 1e12, 0.0, 0.0))
    with pytest.raises(ValueError, match="do not reach its end"), np.errstate(all="ignore"):
        reference.in_doubles(fast)


def test_held_scenes_of_a_file_are_not_followed(gripper):
    robot, _, case = gripper
    names = [case.name, "open, step of the servos"]
    assert [other.name for other in settings.scenes_of(robot)] == names and not case.is_held
    for size, found in (("full", names), ("quick", names[:1]), ("small", names[:1])):
        assert [other.name for other in settings.followed(robot, size)] == found


def test_a_step_response_is_followed_from_coarse_steps_on_by_the_schemes_that_it_has(gripper):
    robot, known, free = gripper
    step = settings.scenes_of(robot)[-1]
    stiff = robot_of(read(PATHS["arm7"]), "arm7.xml").cases[-1]
    assert settings.coarsest_steps(step) == settings.coarsest_steps(stiff) == 64 < stiff.steps
    assert settings.coarsest_steps(free) == free.steps
    of_step, of_free = (
        {(m.engine, m.name): m.scheme for m in settings.methods(known, "full", "all", robot, case)}
        for case in (step, free)
    )
    assert (
        of_step["mujoco", "implicitfast"] == "implicitfast"
        and of_free["mujoco", "implicitfast"] == "semi_implicit_euler"
    )
    assert ("tmt", "implicitfast") in of_step and ("tmt", "implicitfast") not in of_free
    setup = Setup(robot, known)
    assert settings.schemes_in(setup, [step, free])[step.name]["discrete"] == "discrete"
    names = [(method.engine, method.name) for method in settings.methods_following(setup, [free, step], "all")]
    assert len(names) == len(set(names)) and set(names) == {*of_step, *of_free}


def test_a_step_response_has_the_same_error_in_both(gripper):
    robot, known, _ = gripper
    step = settings.scenes_of(robot)[-1]
    reference_of = reference.references([step])
    method = {name: known[name].methods_in(step)["implicitfast"] for name in ("mujoco", "tmt")}
    rows = [
        row_of_run(step, step, known, method[name], Setting(step.duration, 128), reference_of[step.name])
        for name in ("mujoco", "tmt")
    ]
    assert rows[0]["worst_error_rad"] == pytest.approx(rows[1]["worst_error_rad"], abs=1e-12)
    assert 1e-7 < rows[0]["worst_error_rad"] < 1e-2 and not rows[0]["diverged"]


def test_a_sentence_says_what_to_use_for_a_step_response():
    line = {"target_rad": 1e-3, "mujoco": "mujoco implicitfast, 128 steps", "mujoco_dt_s": 1 / 512, "mujoco_ms": 0.4,
            "tmt": "tmt dopri8_adaptive, tolerance 1e-03", "tmt_dt_s": None, "tmt_ms": 0.05}  # fmt: skip
    other = line | {"target_rad": 1e-6, "mujoco": "mujoco RK4, 9 steps"}
    nothing = dict.fromkeys(line) | {"target_rad": 1e-3}
    table = [
        line | {"scene": "let go"},
        other | {"scene": "let go"},
        line | {"scene": "step"},
        nothing | {"scene": "far"},
    ]
    (said_of,) = advice.step_response_in_words(table, ["step"])
    assert said_of == (
        "Which integrator and step for 0.001 rad? Where the robot's own servos act: step: mujoco implicitfast, 128 steps (dt = "
        "0.00195 s), 0.4 ms or tmt dopri8_adaptive, tolerance 1e-03, 0.05 ms. Where they do not: let go: mujoco implicitfast, "
        "128 steps (dt = 0.00195 s), 0.4 ms or tmt dopri8_adaptive, tolerance 1e-03, 0.05 ms; far: none comes so near."
    )
    assert advice.step_response_in_words(table, []) == advice.step_response_in_words(table[:2], ["step"]) == []


def test_what_takes_too_long_is_left_out_with_a_reason(gripper):
    robot, known, _ = gripper
    out = settings.left_out(known, "full", robot)
    assert all(engine == "heyoka" for engine, _ in out)
    arm7 = robot_of(read(PATHS["arm7"]), "arm7.xml")
    assert "2479 operations" in Heyoka().too_long(arm7.tree) and Heyoka().too_long(ARM.tree) is None
    humanoid = robot_of(read(PATHS["humanoid29_free"]), "humanoid29_free.xml")
    assert "35 speeds" in Heyoka().too_long(humanoid.tree)
    slow = settings.left_out(known, "full", humanoid)
    assert {engine for engine, _ in slow} == {"heyoka"}
    assert ("tmt", "implicit_midpoint") in settings.left_out(known, "quick", arm7)
    assert ("tmt", "implicit_midpoint") not in settings.left_out(known, "full", arm7)
    here = settings.methods(known, "full", "all", humanoid)
    assert not {(m.engine, m.name) for m in here} & set(slow)


def test_steps_of_a_large_robot_end_sooner(gripper):
    _, _, small = gripper
    large = settings.regular_of(robot_of(read(PATHS["humanoid29_free"]), "humanoid29_free.xml"))
    method = Method("tmt", "rk4", 4, "rk4")
    finest = [settings.halvings(method, case)[-1].steps for case in (small, large)]
    assert 2**15 <= finest[0] > 8 * finest[1]
    assert settings.halvings(method, settings.regular_of(ARM))[-1].steps == settings.FINEST["tmt"]


def test_the_sampled_growth_is_the_growth(gripper):
    _, known, case = gripper
    steps, dt = 1024, case.duration / 1024
    motion = known["tmt"].of(case).run(*case.start, case.tau, dt, steps, "rk4")
    of_all = [
        f(tmt.METHODS["rk4"], case.tree, motion.q, motion.v, case.tau, dt, 16) for f in (growth, floors.sampled_growth)
    ]
    assert np.abs(of_all[0] - of_all[1]).max() < 0.1


# the order on a free body


def test_the_two_bodies_are_the_same(stone):
    case, _ = stone
    ours, theirs = tmt.mass_matrix(case.q, case.tree), engine(read(tumbling.mjcf())).of(case).mass_matrix(case.q)
    assert np.abs(ours - theirs).max() < 1e-17


@pytest.mark.parametrize(
    "name, least, most", [("rk4", 3.9, 4.1), ("dopri8", 7.5, 8.5), ("semi_implicit_euler", 0.95, 1.05)]
)
def test_a_method_of_tmt_keeps_its_order_on_a_free_body(gripper, stone, name, least, most):
    _, known, _ = gripper
    found = tumbling.order_of(stone[0], known["tmt"], known["tmt"].methods[name], stone[1])
    assert least < found[0] < most and found[1] == pytest.approx(2 * found[2])


def test_mujoco_has_the_order_that_its_version_says(stone):
    mujoco = engine(read(tumbling.mjcf()))
    for name in ("RK4", "Euler"):
        order, *_ = tumbling.order_of(stone[0], mujoco, mujoco.methods[name], stone[1])
        assert abs(order - mujoco.methods[name].order) < 0.05


def test_a_body_with_other_moments_shows_no_order(gripper, stone):
    """The exact motion of another body is another: nothing converges to it."""
    case, _ = stone
    _, known, _ = gripper
    wrong = free_turning(np.linspace(0.0, tumbling.TUMBLED, 9), (0.03, 0.05, 0.0601), case.v, case.q)[1].astype(float)
    found = tumbling.order_of(case, known["tmt"], known["tmt"].methods["rk4"], wrong)
    assert found is None or found[0] < 0.5


def test_an_order_that_is_lower_than_with_hinges_is_said():
    row = {"engine": "mujoco", "method": "RK4", "measured_order": 2.0}
    assert "RK4 has order 2.00 there, where it has 4 with hinges" in tumbling.orders_in_words([row])
    assert "where it has" not in tumbling.orders_in_words([row | {"measured_order": 4.0}])


# what an evaluation costs


def test_states_of_any_joints_are_evaluated(gripper):
    robot, _, _ = gripper
    q, qd, tau = evaluations.states_of(robot.coordinates, np.random.default_rng(1), 5)
    assert q.shape == qd.shape == tau.shape == (5, 4) and np.abs(q[:, 2:]).max() <= 0.5
    free = robot_of(read(PATHS["free_body"]), "free_body.xml")
    q, qd, _ = evaluations.states_of(free.coordinates, np.random.default_rng(1), 5)
    assert q.shape == (5, 7) and qd.shape == (5, 6) and np.allclose(np.linalg.norm(q[:, 3:], axis=1), 1.0)
    first = evaluations.states_of(ARM.coordinates, np.random.default_rng(1), 5)
    assert np.array_equal(first, np.random.default_rng(1).uniform(-3.0, 3.0, (3, 5, 3)))


def test_of_many_joints_fewer_states_and_a_reason():
    humanoid = robot_of(read(PATHS["humanoid29_free"]), "humanoid29_free.xml").tree
    assert evaluations.most_states(humanoid) == 10_000 and evaluations.most_states(ARM.tree) == 1_000_000
    assert evaluations.lengths(humanoid) is None


# units, and the floor of a reference in doubles


def test_columns_say_rad_only_of_what_is_in_rad():
    rows = [{"scene": "s", "worst_error_rad": 0.5}]
    assert renamed(rows, "rad") == rows and value(rows[0], "worst_error") == 0.5
    (other,) = renamed(rows, "rad or m")
    assert other == {"scene": "s", "worst_error": 0.5, "unit": "rad or m"} and value(other, "worst_error") == 0.5
    assert said("0.1 rad, target_rad", "rad or m") == "0.1 rad or m, target" and said("1 rad", "rad") == "1 rad"


def test_the_digits_of_a_reference_in_doubles_are_said():
    known = {"s": reference.Reference(None, None, None, 3e-13, 1024, None, "a series takes long")}
    (words,) = accuracy.references_in_words(known, {"s": 1e-12})
    assert "s: 3e-13 (1024 steps; a series takes long)" in words


@pytest.mark.parametrize("of_file, shown", [(True, 0), (False, 1)])
def test_no_order_of_a_file_is_measured_near_what_is_known(of_file, shown):
    result = Result("speed", curves={"floors": {"s": 1e-9}, "of_file": of_file})
    result.rows = [
        {"scene": "s", "engine": "tmt", "method": "rk4", "dt_s": dt, "early": early}
        for dt, early in ((4e-3, 2.56e-8), (2e-3, 1.6e-9), (1e-3, 1e-10))
    ]
    assert len(advice.orders(result, ["s"], [Method("tmt", "rk4", 4, "rk4")], complete=False)) == shown


@pytest.mark.parametrize("change, asked", [(0.149, True), (0.151, False), (None, False)])
def test_an_order_of_a_file_is_asked_where_it_has_settled(change, asked):
    orders = [4.0 + 2.0 * (change or 0.0), 4.0 + (change or 0.0)][change is None :]
    errors = 1e-4 / 2.0 ** np.cumsum([0.0, *orders])
    result = Result("speed", curves={"floors": {"s": 1e-16}, "of_file": True})
    result.rows = [
        {"scene": "s", "engine": "tmt", "method": "rk4", "dt_s": 0.01 / 2**k, "early": error}
        for k, error in enumerate(errors)
    ]
    advice.orders(result, ["s"], [Method("tmt", "rk4", 4, "rk4")], complete=False)
    assert bool(result.checks) is asked and bool(result.notes) is not asked
    assert asked or "s, tmt rk4." in result.notes[0]


def test_errors_below_what_is_known_have_its_size(gripper):

    robot, known, case = gripper
    truth = reference.in_doubles(case)._replace(why="too stiff")
    setting = settings.halvings(known["tmt"].methods["dopri8"], case)[1]
    row = row_of_run(case, case, known, known["tmt"].methods["dopri8"], setting, truth, 1e-11)
    assert row["worst_error_rad"] == row["error_rad"] == 1e-11 and not row["diverged"]
    assert Setup.small(robot, known).robot is robot


def test_a_coarse_run_of_scipy_has_quaternions_of_length_1(stone):
    case, exact = stone
    motion = Scipy().of(case).run(*case.start, case.tau, tumbling.TUMBLED / 8, 8, "RK45", tolerance=1e-2)
    assert np.abs(np.linalg.norm(motion.q, axis=1) - 1.0).max() < 1e-15
    assert np.abs(case.coordinates.difference(motion.q, exact)).max() > 1e-6


def test_an_order_that_a_method_has_not_fails(gripper):
    ours = gripper[1]["tmt"]
    claims = {"rk4": ours.methods["rk4"]._replace(order=5)}
    result = Result("speed")
    tumbling.orders_on_a_body(result, {"tmt": SimpleNamespace(of=ours.of, methods=claims)})
    failed = [check.scene for check in result.checks if not check.passed]
    assert len(failed) == 1 and failed[0].endswith("tmt rk4")


def test_an_adaptive_method_sees_the_errors_of_a_ball(stone):
    case, stepping = stone[0], tmt.METHODS["dopri8_adaptive"]

    def slope(q, qd):
        return stepping.slope(case.tree, q, qd, case.tau.tolist(), 0.1)

    *_, fifth, fifth_of_speeds, third, third_of_speeds = stepping.attempt(
        slope, case.q.tolist(), case.v.tolist(), 0.1, case.tree.coordinates
    )
    assert min(np.abs([fifth, fifth_of_speeds]).max(axis=1)) > 1e-9
    assert min(np.abs([third, third_of_speeds]).max(axis=1)) > 1e-7
