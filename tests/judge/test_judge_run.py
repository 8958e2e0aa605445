"""When a run has left or diverged, robots too stiff for their step, the order of a method: just inside and just outside."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.judged import BOTH, INSIDE, OUTSIDE, verdicts
from helpers.servo_models import spring
from helpers.trees import one_body
from models import chain

import tmt
from compare.core.check import Result
from compare.engines.mujoco import read
from compare.judge import run
from compare.judge.order import ORDER_MARGIN, check_order, is_higher
from compare.judge.run import check_movement, departure, deviation, leaves_no_digits, required_time
from compare.robots import Robot
from compare.robots.actuators import Controller
from compare.robots.arm import ARM
from compare.robots.coordinates import rates_at
from compare.robots.file import robot_of
from compare.truth.reference import has_no_reference

CASES = {case.name: case for case in ARM.cases}
T = np.array([0.0, 0.5])
# shares of the energy that can be gained, and when a run over T diverges
ENDS = ((INSIDE, None), (OUTSIDE, 0.5))
MOVED = ("bent, free", 0.0), ("ball catch, held", [0.1, -0.2, 0.3]), ("thrown, no gravity", 0.0)


@pytest.mark.parametrize("name, moved", MOVED)
def test_a_run_has_diverged_beyond_the_energy_that_the_arm_can_have(name, moved):
    """A second state that has gained this share of all energy that the case's arm can have."""
    case, (start, rate) = CASES[name], CASES[name].start
    q, at_first = start + moved, rate @ tmt.mass_matrix(case.tree, start) @ rate / 2
    allowed = 2.0 * 9.81 * (1.9 * 0.15 + 1.5 * 0.45) + at_first
    before, after = (tmt.potential_energy(case.tree, at) for at in (start, q))
    gained = after - before - (q - start) @ case.tau
    for share, ends in ENDS:
        kinetic = share * allowed + at_first - gained
        new = np.array([np.sqrt(2.0 * kinetic / tmt.mass_matrix(case.tree, q)[0, 0]), 0.0, 0.0])
        assert run.diverged_at(case, T, np.array([start, q]), np.array([rate, new])) == ends


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("of_rates", [False, True])
def test_a_run_has_diverged_where_a_number_is_not_finite(bad, of_rates):
    case = CASES["bent, held"]
    q, qd = np.tile(case.q, (4, 1)), np.zeros((4, 3))
    times = np.arange(4.0)
    assert run.diverged_at(case, times, q, qd) is None
    (qd if of_rates else q)[2, 1] = bad
    assert run.diverged_at(case, times, q, qd) == 2.0


@pytest.mark.parametrize("scheme, dt, judged, least", [
    ("rk4", 0.05, None, 1.0), ("rk4", 0.05, 0.6, 0.6), ("euler", 0.0099, 0.6, 0.6), ("euler", 0.0101, 0.6, 0.3),
    ("euler", 0.0101, 0.2, 0.2), ("euler", 0.0101, None, 0.3),
])  # fmt: skip
def test_a_run_must_be_judged_for_the_time_of_its_scene_at_a_coarse_step_for_0_3_s(scheme, dt, judged, least):
    case = ARM.case("x", duration=1.0, dt=1 / 64, judged=judged)
    assert required_time(case, scheme, dt) == least


def test_an_arm_has_left_at_a_tenth_of_a_radian():
    path = np.ones((3, 2))
    for off, left in ((0.0999, None), (0.1001, 1.0), (-0.1001, 1.0)):
        path[1, 1] = 1.0 + off
        assert departure(np.arange(3.0), path) == left
    assert deviation(np.array([1.1, 0.7]), 1.0) == pytest.approx(0.3)


@pytest.mark.parametrize("moved, passes", [(0.1001, True), (0.0999, False), (np.nan, False)])
def test_a_free_run_moves_by_a_tenth_of_a_radian(moved, passes):
    result = Result("trajectory")
    check_movement(result, "x", moved)
    assert verdicts(result) == {"movement": passes}


def alone(kind, **more) -> tmt.Tree:
    """A ball of 2 kg with inertia 0.5 kg m2 on a slide along z or on a ball joint, its centre in the origin."""
    axis = np.eye(3) if kind == "ball" else [(0.0, 0.0, 1.0)]
    fields = {"gravity": (0.0, 0.0, 0.0), "mass": [2.0], "inertia": np.eye(3) * 0.5}
    return one_body(axis, (kind,), **fields | more)


@pytest.mark.parametrize("tree, scene", [
    (alone("ball"), {"torque": (0.0, 0.0, 3.0)}),  # it turns and turns: all of its energy is the work of the torque
    (alone("slide", gravity=(0.0, 0.0, -9.81)), {}),  # no reach, and the weight goes down with it
    (alone("slide", stiffness=(8.0,), rest=(0.0,)), {"posture": (0.7,), "duration": np.pi / 4, "dt": np.pi / 256}),
])  # fmt: skip
def test_a_run_of_any_joint_has_diverged_with_more_energy_than_its_motion_can_have_exchanged(tree, scene):
    """Each starts at rest: at the end its kinetic energy is what it has got, and may be twice that, but no more."""
    case = Robot("ball", None, tree, {}, ()).case("alone", **{"duration": 4.0, "dt": 1 / 16} | scene)
    t, q, v = tmt.simulate(tree, *case.start, case.tau, case.scene.dt, case.steps, "dopri8")
    for share, ends in ((INSIDE, None), (OUTSIDE, t[-1])):
        wrong = v.copy()
        wrong[-1] *= np.sqrt(1.0 + share)
        assert run.diverged_at(case, t, q, wrong) == ends


@pytest.mark.parametrize("lifted, ends", [(1e300, None), (1e308, 0.5)])
def test_a_run_whose_energy_is_not_a_number_has_diverged(lifted, ends):
    """Lifted by the force that balances its weight: the energy less the work is 0, and inf - inf."""
    case = Robot("slide", None, alone("slide", gravity=(0.0, 0.0, -10.0)), {}, ()).case(
        "held", torque=(20.0,)
    )
    q = np.array([[0.0], [lifted]])
    assert run.diverged_at(case, T, q, np.zeros((2, 1))) == ends


@pytest.mark.parametrize("start", [0.0, 0.3, -0.7])
def test_a_servo_gives_no_more_than_it_has_stored(start):
    """At most 50 (0.2)^2 / 2 = 1 J beyond the 1 J that it has given when it is at its target."""

    class Servo:
        def controller(self, posture, q, targets):
            u = float((q + targets)[0])
            return Controller((u,), (), np.array([50.0 * u]), np.array([[50.0]]), np.array([[0.0]]))

    robot = Robot("ball", None, alone("slide"), {}, (), drive=Servo())
    case = robot.case("step", posture=(start,), torque="servos", targets=0.2)
    for share, ends in ENDS:
        speeds = np.array([[0.0], [np.sqrt(1.0 + share)]])  # of 2 kg
        assert run.diverged_at(case, T, np.array([case.q, case.q + 0.2]), speeds) == ends


@BOTH
def test_a_rate_that_leaves_no_digits_after_two_steps(share, passes):
    dt = 1.0 / 8192
    robot = spring((share * (1e-3 / 64 / 2.0**-52) ** 0.25 / dt) ** 2)
    assert np.isclose(robot.cases[0].scene.dt, dt)
    assert (leaves_no_digits(robot) is None) is passes


def test_a_reference_in_doubles_is_not_asked_of_a_rate_with_which_it_diverges():
    assert has_no_reference(spring(1e6)) is None and has_no_reference(spring(9e12)) is not None
    assert leaves_no_digits(ARM) is None and has_no_reference(ARM) is None


@pytest.mark.parametrize("rate, has_one", [(4e4, True), (1e5, False)])
def test_damping_that_rk4_does_not_bear_with_16384_steps_leaves_no_reference(rate, has_one):
    """Of 14 hinges, whose runs have 1024 steps; 2.785 x 16384 is 4.6e4."""
    tree = read(chain(14)).tree
    ease = rates_at(replace(tree, damping=(1.0,) * 14), np.zeros(14))[0]
    damped = chain(14).replace("<joint ", f'<joint damping="{rate / ease!r}" ')
    assert (has_no_reference(robot_of(read(damped), "chain.xml")) is None) is has_one


def checked(*order):
    """The check of a measured order."""
    result = Result("test")
    check_order(result, "pendulum", *order)
    return result.checks[0]


@BOTH
def test_a_measured_order_is_at_least_that_of_the_method_and_of_order_8_at_least_7(share, passes):
    check = checked(4, 4.0 - share * ORDER_MARGIN, "error of the swing", "3.85")
    assert check.passed == passes and check.quantity == "deviation from order 4: error of the swing"
    assert checked(8, 8.0 - share).passed == passes and checked(8, 9.5).passed
    assert checked(4, 5.0).passed  # the leading term of an error may vanish


@BOTH
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("twin", [1.0, 2.0])
def test_a_higher_order_is_that_of_the_same_scheme_in_tmt(share, passes, side, twin):
    measured = twin + side * share * ORDER_MARGIN
    check = checked(1, measured, "error", "", twin)
    assert check.passed == passes and f"tmt's same scheme {twin:.2f}" in check.note


@pytest.mark.parametrize("measured", [np.nan, np.inf, -np.inf])
def test_an_order_that_is_no_number_fails(measured):
    assert not checked(4, measured).passed and checked(4, measured).value is None
    assert not checked(1, measured, "error", "", 1.0).passed


@pytest.mark.parametrize("measured, higher", [(2.14, False), (2.16, True), (1.0, False)])
def test_an_order_is_higher_by_more_than_its_margin(measured, higher):
    assert is_higher(measured, 2) is higher
