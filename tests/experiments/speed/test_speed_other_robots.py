"""Speed of robots of files: their references, who takes part, orders on a free body, states, units."""

from types import SimpleNamespace

import numpy as np
import pytest
from models import PATHS

import tmt
from compare.engines import Method, Setting
from compare.engines.heyoka import Heyoka
from compare.engines.mujoco import engine, read
from compare.engines.scipy import Scipy
from compare.experiments.speed import evaluations, floors, settings, tumbling
from compare.experiments.speed.runs import row_of_run
from compare.judge.check import Result
from compare.judge.rounding import growth
from compare.judge.units import renamed, said, value
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import Setup, engines
from compare.truth import reference
from compare.truth.free_body import free_turning

TIMES = np.linspace(0.0, tumbling.TUMBLED, tumbling.READ + 1)


def robot_in(name):
    return robot_of(read(PATHS[name]), f"{name}.xml")


@pytest.fixture(scope="module")
def gripper():
    """The robot, its engines, and the scene that is followed."""
    robot = robot_in("gripper")
    return robot, engines(engine(read(PATHS["gripper"]))), settings.regular_of(robot)


@pytest.fixture(scope="module")
def stone():
    """A body that tumbles, and its exact quaternions at nine times."""
    case = tumbling.stone().case("tumbling", posture=tumbling.QUATERNION, speed=tumbling.SPEEDS)
    return case, free_turning(TIMES, tumbling.MOMENTS, case.v, case.q)[1].astype(float)


def test_a_reference_in_doubles_says_its_digits(gripper):
    _, _, case = gripper
    known = reference.in_doubles(case)
    assert known.apart < 1e-13 and known.low.max() == 0.0 and known.steps > case.steps
    finer = tmt.simulate(*case.start, case.tau, case.duration / 2**14, 2**14, "rk4", case.tree)
    assert known.error(finer.q[::256], range(4)).max() < 10 * max(known.apart, 1e-15)
    assert known.error(known.high[:, 2:3] + 1e-3, [2]) == pytest.approx(1e-3)


def test_a_reference_in_doubles_measures_turns_and_no_quaternions():
    case = settings.regular_of(robot_in("free_body"))
    known = reference.in_doubles(case)
    assert known.error(-known.high[:, 3:7], [3]).max() < 1e-15  # -q is the same turn
    turned = case.coordinates.move(known.high[:, :7], [0.0, 0.0, 0.0, 0.0, 1e-3, 0.0])
    assert known.error(turned[:, 3:], [3]) == pytest.approx(1e-3)
    assert known.error(turned, range(4)) == pytest.approx(1e-3)


def test_errors_below_what_is_known_have_its_size(gripper):
    _, known, case = gripper
    truth, method = reference.in_doubles(case)._replace(why="too stiff"), known["tmt"].methods["dopri8"]
    row = row_of_run(case, case, known, method, settings.halvings(method, case)[1], truth, 1e-11)
    assert row["worst_error_rad"] == row["error_rad"] == 1e-11 and not row["diverged"]


def test_the_sampled_growth_is_the_growth(gripper):
    _, known, case = gripper
    dt = case.duration / 1024
    motion = known["tmt"].of(case).run(*case.start, case.tau, dt, 1024, "rk4")
    given = tmt.METHODS["rk4"], case.tree, motion.q, motion.v, case.tau, dt, 16
    assert np.abs(growth(*given) - floors.sampled_growth(*given)).max() < 0.1


# who takes part


def test_held_scenes_of_a_file_are_not_followed(gripper):
    robot, _, case = gripper
    names = [case.name, "open, step of the servos"]
    assert [other.name for other in settings.scenes_of(robot)] == names and not case.is_held
    for size, found in (("full", names), ("quick", names[:1]), ("small", names[:1])):
        assert [other.name for other in settings.followed(robot, size)] == found


def test_a_step_response_is_followed_from_coarse_steps_on_by_the_schemes_that_it_has(gripper):
    robot, known, free = gripper
    step, stiff = settings.scenes_of(robot)[-1], robot_in("arm7").cases[-1]
    assert settings.coarsest_steps(step) == settings.coarsest_steps(stiff) == 64 < stiff.steps
    assert settings.coarsest_steps(free) == free.steps
    of_step, of_free = (
        {(m.engine, m.name): m.scheme for m in settings.methods(known, "full", "all", robot, case)}
        for case in (step, free)
    )
    assert of_step["mujoco", "implicitfast"] == "implicitfast"
    assert of_free["mujoco", "implicitfast"] == "semi_implicit_euler"
    assert ("tmt", "implicitfast") in of_step and ("tmt", "implicitfast") not in of_free
    setup = Setup(robot, known)
    assert settings.schemes_in(setup, [step, free])[step.name]["discrete"] == "discrete"
    names = [(method.engine, method.name) for method in settings.methods_following(setup, [free, step], "all")]
    assert len(names) == len(set(names)) and set(names) == {*of_step, *of_free}


def test_a_step_response_has_the_same_error_in_both(gripper):
    robot, known, _ = gripper
    step = settings.scenes_of(robot)[-1]
    truth, setting = reference.references([step])[step.name], Setting(step.duration, 128)
    ours, theirs = (
        row_of_run(step, step, known, known[name].methods_in(step)["implicitfast"], setting, truth)
        for name in ("tmt", "mujoco")
    )
    assert ours["worst_error_rad"] == pytest.approx(theirs["worst_error_rad"], abs=1e-12)
    assert 1e-7 < ours["worst_error_rad"] < 1e-2 and not ours["diverged"]


def test_what_takes_too_long_is_left_out_with_a_reason(gripper):
    robot, known, case = gripper
    arm7, humanoid = robot_in("arm7"), robot_in("humanoid29_free")
    assert "2479" in Heyoka().too_long(arm7.tree) and "35" in Heyoka().too_long(humanoid.tree)
    assert Heyoka().too_long(ARM.tree) is None
    assert all(engine == "heyoka" for engine, _ in settings.left_out(known, "full", robot))
    slow = settings.left_out(known, "full", humanoid)
    assert {engine for engine, _ in slow} == {"heyoka"}
    assert not {(m.engine, m.name) for m in settings.methods(known, "full", "all", humanoid)} & set(slow)
    assert ("tmt", "implicit_midpoint") in settings.left_out(known, "quick", arm7)
    assert ("tmt", "implicit_midpoint") not in settings.left_out(known, "full", arm7)
    rk4, cases = Method("tmt", "rk4", 4, "rk4"), (case, settings.regular_of(humanoid), settings.regular_of(ARM))
    few, fewer, arms = (settings.halvings(rk4, case)[-1].steps for case in cases)
    assert 2**15 <= few > 8 * fewer and arms == settings.FINEST["tmt"]


# the order on a free body


def test_each_method_keeps_its_order_on_a_free_body(gripper, stone):
    ours, theirs, case = gripper[1]["tmt"], engine(read(tumbling.mjcf())), stone[0]
    assert np.abs(tmt.mass_matrix(case.q, case.tree) - theirs.of(case).mass_matrix(case.q)).max() < 1e-17
    for name, within in (("rk4", 0.1), ("dopri8", 0.5), ("semi_implicit_euler", 0.05)):
        order, coarse, fine = tumbling.order_of(case, ours, ours.methods[name], stone[1])
        assert order == pytest.approx(ours.methods[name].order, abs=within) and coarse == pytest.approx(2 * fine)
    for name in ("RK4", "Euler"):
        order, *_ = tumbling.order_of(case, theirs, theirs.methods[name], stone[1])
        assert order == pytest.approx(theirs.methods[name].order, abs=0.05)


def test_a_body_with_other_moments_shows_no_order(gripper, stone):
    """The exact motion of another body is another: nothing converges to it."""
    case, ours = stone[0], gripper[1]["tmt"]
    wrong = free_turning(TIMES, (0.03, 0.05, 0.0601), case.v, case.q)[1].astype(float)
    found = tumbling.order_of(case, ours, ours.methods["rk4"], wrong)
    assert found is None or found[0] < 0.5


def test_an_order_that_a_method_has_not_fails(gripper):
    ours, result = gripper[1]["tmt"], Result("speed")
    claims = {"rk4": ours.methods["rk4"]._replace(order=5)}
    table = tumbling.orders_on_a_body(result, {"tmt": SimpleNamespace(of=ours.of, methods=claims)})
    (failed,) = (check.scene for check in result.checks if not check.passed)
    assert failed.endswith("tmt rk4")
    rk4 = next(row for row in table if row["method"] == "RK4")
    low, right = (tumbling.orders_in_words([rk4 | {"measured_order": order}]) for order in (2.0, 4.0))
    assert "order 2.00" in low and "order 4.00" not in right


def test_a_coarse_run_of_scipy_has_quaternions_of_length_1(stone):
    case, exact = stone
    motion = Scipy().of(case).run(*case.start, case.tau, tumbling.TUMBLED / 8, 8, "RK45", tolerance=1e-2)
    assert np.abs(np.linalg.norm(motion.q, axis=1) - 1.0).max() < 1e-15
    assert np.abs(case.coordinates.difference(motion.q, exact)).max() > 1e-6


def test_an_adaptive_method_sees_the_errors_of_a_ball(stone):
    case, stepping = stone[0], tmt.METHODS["dopri8_adaptive"]

    def slope(q, qd):
        return stepping.slope(case.tree, q, qd, case.tau.tolist(), 0.1)

    *_, fifth, fifth_of_speeds, third, third_of_speeds = stepping.attempt(
        slope, case.q.tolist(), case.v.tolist(), 0.1, case.tree.coordinates
    )
    assert min(np.abs([fifth, fifth_of_speeds]).max(axis=1)) > 1e-9
    assert min(np.abs([third, third_of_speeds]).max(axis=1)) > 1e-7


# what an evaluation costs, and units


def test_states_of_any_joints_are_evaluated(gripper):
    q, qd, tau = evaluations.states_of(gripper[0].coordinates, np.random.default_rng(1), 5)
    assert q.shape == qd.shape == tau.shape == (5, 4) and np.abs(q[:, 2:]).max() <= 0.5
    q, qd, _ = evaluations.states_of(robot_in("free_body").coordinates, np.random.default_rng(1), 5)
    assert q.shape == (5, 7) and qd.shape == (5, 6) and np.allclose(np.linalg.norm(q[:, 3:], axis=1), 1.0)
    humanoid = robot_in("humanoid29_free").tree  # of many joints fewer
    assert evaluations.most_states(humanoid) == 10_000 and evaluations.most_states(ARM.tree) == 1_000_000
    assert evaluations.lengths(humanoid) is None


def test_columns_say_rad_only_of_what_is_in_rad():
    rows = [{"scene": "s", "worst_error_rad": 0.5}]
    assert renamed(rows, "rad") == rows and value(rows[0], "worst_error") == 0.5
    (other,) = renamed(rows, "rad or m")
    assert other == {"scene": "s", "worst_error": 0.5, "unit": "rad or m"} and value(other, "worst_error") == 0.5
    assert said("0.1 rad, target_rad", "rad or m") == "0.1 rad or m, target" and said("1 rad", "rad") == "1 rad"
