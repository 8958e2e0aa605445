"""What runs show: limits, growth, pushes; dry friction; controllers at their own rate; motions; and changes that help."""

from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest
from small import HOLDING, INERTIA, KINDS, STANDING, hinge, limit_of, place_of, rest_of, sphere, two

from compare.engines.mujoco.step import Step
from compare.engines.mujoco.variants import (
    with_armature,
    with_impratio,
    with_kv,
    with_other_cone,
    with_slower_contacts,
)
from compare.stability import cures
from compare.stability.control import controlled
from compare.stability.growth import growth, push_of
from compare.stability.limits import Tried, tried
from compare.stability.motion import motion
from compare.stability.runs import USUAL_PUSH, WAYS, Runs, Shown, lasting, upwards

WITH_KV = hinge(20.0, 5.0)
FOOT = STANDING.format(cone="elliptic", condim=3)
MOTORS = '<motor joint="turn" gear="2"/>'
SPIN = """<mujoco><option timestep="0.01" gravity="0 0 0"/><worldbody><body><freejoint/>
  <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.02 0.03"/></body></worldbody>
  <keyframe><key qvel="0 0 0 0 {} 0"/></keyframe></mujoco>"""


SWING = """<mujoco><option timestep="0.01"/><worldbody><body><joint name="a" axis="0 1 0" {}/>
  <geom size="0.05" pos="0 0 -0.5" mass="1"/></body></worldbody><keyframe><key qvel="3"/></keyframe></mujoco>"""


def runs_of(text, integrator="Euler"):
    """Runs of a model from its rest; fine steps are those of 0.25 ms."""
    place = place_of(text)
    held = rest_of(text, 2e-3, integrator).is_held
    return Runs(place.model, place.rest, integrator, 2.5e-4, held, creep=0.0)


@pytest.mark.parametrize("text, integrator", [
    (FOOT, "Euler"), (FOOT, "RK4"), (KINDS["pyramidal, condim 6"], "Euler"), (KINDS["a muscle"], "RK4"),
    (KINDS["a DC motor"], "Euler"), (KINDS["friction loss"], "Euler"), (KINDS["fluid"], "Euler"),
    (KINDS["a limit"], "RK4"), (KINDS["a filter"], "RK4"), (KINDS["damping of an actuator"], "RK4"),
])  # fmt: skip
def test_runs_show_the_limit_within_three_hundredths(text, integrator):
    found = limit_of(text, integrator)
    assert found.kind == "finite"
    below, above = runs_of(text, integrator).limit(2e-3, found.dt)
    assert (below, above) == (pytest.approx(0.97 * found.dt), pytest.approx(1.03 * found.dt))


@pytest.mark.parametrize("more, stable", [
    ({}, True), ({"moved": 0.31}, False), ({"rest": SimpleNamespace(is_found=False)}, False),
    ({"growth": SimpleNamespace(rate=0.11)}, False), ({"growth": SimpleNamespace(rate=0.11), "drift": 0.056}, True),
])  # fmt: skip
def test_a_step_is_stable_at_a_rest_nearby_where_nothing_grows_faster_than_what_grows_by_itself(more, stable):
    usual = {"rest": SimpleNamespace(is_found=True), "growth": SimpleNamespace(rate=0.09)}
    usual |= {"dt": 0.1, "drift": 0.0, "moved": 0.29}
    assert Tried(**usual | more).is_stable is stable


def test_a_servo_too_weak_for_a_push_bears_it_at_no_step():
    """An inverted pendulum whose servo has the force for small angles alone; after a fall it calms down, hanging."""
    servo = '<position joint="a" kp="1.6" kv="0.02" forcerange="-0.008 0.008"/>'
    body = (
        '<body><joint name="a" axis="0 1 0" damping="0.06"/><geom size="0.02" pos="0 0 0.1" mass="1"/></body>'
    )
    text = f"<mujoco><worldbody>{body}</worldbody><actuator>{servo}</actuator></mujoco>"
    largest, finer_too = runs_of(text).largest_push(2e-3)
    assert 1e-3 < largest < USUAL_PUSH and finer_too
    free = hinge(actuator=MOTORS)  # nothing brakes it: it moves on as at a finer step
    assert runs_of(free).largest_push(2e-3) == (USUAL_PUSH, None)


def test_the_first_step_at_which_the_files_run_fails_is_found_wherever_the_derivative_has_its_limit():
    """From a start beside the rest: a servo with kv, and one without, which swings for ever, at 0.04 rad/s."""
    start = Step(place_of(WITH_KV).model, 1e-3, "Euler").moved(place_of(WITH_KV).rest, np.array([2e-3, 0.0]))
    shown = replace(runs_of(WITH_KV), state=start)
    exact = (-5.0 + np.sqrt(25.0 + 4.0 * INERTIA * 20.0)) / 20.0
    for first, predicted in ((2e-3, 0.1), (2e-3, 0.005), (0.1, np.inf), (0.05, 0.03), (2e-3, exact)):
        low, high = shown.limit(first, predicted)
        assert low < 1.03 * exact and 0.97 * exact < high < 1.066 * low
    swinging = replace(runs_of(hinge(20.0, 0.0)), state=start)
    calm = [replace(swinging, creep=by).is_calm(1e-3, 2e-3) for by in (0.005, 0.02)]
    assert calm == [False, True]
    assert runs_of(hinge(20.0, 5.0, integrator="implicitfast"), "implicitfast").limit(2e-3, np.inf) == (
        0.2,
        None,
    )


@pytest.mark.parametrize(
    "third, last, decays", [(0.79, 0.63, True), (0.81, 0.6, False), (0.79, 0.64, False), (1.9, 1.5, False)]
)
def test_a_speed_that_calms_down_loses_a_fifth_in_each_quarter(third, last, decays):
    shown = Shown(0.1 * np.array([9.0, 0.1, 1.0, 0.5, 0.5, third, 0.2, last]))
    assert shown.decays is decays and shown.speed == 0.1 * last
    assert not Shown(20.0 * shown.eighths).decays  # it is fast


def test_a_slow_decay_is_a_rest_and_what_never_ends_is_none():
    """A servo that is damped little swings down in half a minute."""
    for kv, calm in ((0.0, False), (0.04, True)):
        weak = runs_of(hinge(20.0, kv, integrator="implicitfast"), "implicitfast")
        start = Step(weak.model, 1e-3, "Euler").moved(weak.state, np.array([2e-3, 0.0]))
        swinging = replace(weak, state=start)
        assert swinging.shown(1e-3, 2e-3, 4.0, 0).speed > 4e-3 and swinging.is_calm(1e-3, 2e-3) is calm


def test_what_chatters_at_fine_steps_may_do_so_faster_at_coarse_ones():
    """A brake of limited force: to and fro with force dt / (2 inertia), unless a fine step brakes it to rest."""
    brake = '<general joint="turn" biastype="affine" biasprm="0 0 -1000" forcerange="-0.05 0.05"/>'
    shown = runs_of(hinge(joint='stiffness="20"', actuator=brake))
    for dt in (2e-3, 8e-3, 3e-2):
        assert dt / 2.0 < shown.shown(1e-3, dt, lasting(dt), 0).speed < 1.1 * dt
        assert shown.survives(1e-3, dt) and not replace(shown, fine=5e-5).survives(1e-3, dt)


def test_a_creep_grows_as_contacts_are_softened_to_twice_the_step():
    """The speed of a sticking contact is proportional to its time constant."""
    text = sphere(0.02, impratio=1.0, pull=3.0, condim=3, x="").replace('refsafe="disable"', "")
    shown = runs_of(text)
    fine, coarse = (shown.shown(1e-3, dt, 4.0, 0).speed for dt in (2e-3, 0.05))
    assert coarse == pytest.approx(5.0 * fine, rel=0.01) and fine > 2e-3
    assert shown.expected(1e-3, 0.05) == pytest.approx(coarse, rel=0.01) and shown.survives(1e-3, 0.05)
    assert runs_of(sphere()).timeconst == np.inf


def test_a_stop_that_a_coarse_step_softens_is_another_rest_and_no_fall():
    stop = """<mujoco><option timestep="0.002"/><worldbody><body><geom size="0.01" pos="0.04 0 0" mass="1"/>
      <joint name="j" axis="0 1 0" range="-90 0" damping="0.003"/></body></worldbody></mujoco>"""
    shown, coarse = runs_of(stop, "implicitfast"), rest_of(stop, 0.12, "implicitfast")
    assert coarse.state[1] - shown.state[1] > 0.55 and shown.all_hold(0.12)
    fallen = Step(shown.model, 0.12, "Euler").moved(shown.state, np.array([-1.0, 0.0]))
    assert not shown.is_at_rest(0.12, fallen, 0.5) and shown.is_at_rest(0.12, fallen, 1.01)


class Directed(Runs):
    """Runs that hold up to a step, s, of each way of a push."""

    def run(self, push, dt, lasts, way):
        return Shown(np.full(8, 0.0 if dt <= self.state[way] else np.inf))


@pytest.mark.parametrize(
    "limits", [(0.1, 0.08, 0.08, 0.05), (0.1, 0.04, 0.02, 0.03), (0.1, 1e-3, 0.02, 0.02)]
)
def test_a_limit_holds_whichever_way_the_robot_is_pushed(limits):
    low, high = Directed(None, np.array(limits), "Euler", 1e-4, None, 0.0).limit(2e-3, np.inf)
    assert low <= min(limits) < high < 1.066 * low
    rods = Step(place_of(two()).model, 2e-3, "Euler")
    pushes = [push_of(rods, place_of(two()).rest, 1.0, way)[2:4] for way in WAYS]
    assert np.linalg.matrix_rank(pushes) == 2 and (np.abs(pushes) == 1.0).all()


def test_a_body_that_leaves_at_fine_steps_too_has_no_limit_of_the_step():
    """A weight that hovers: a push turns it, and it sinks sideways."""
    hover = """<mujoco><option timestep="0.01"/><worldbody><body pos="0 0 9"><freejoint/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.02"/><site name="up"/></body></worldbody>
      <actuator><motor site="up" gear="0 0 1 0 0 0"/></actuator><keyframe><key qpos="0 0 9 1 0 0 0" ctrl="9.81"/></keyframe>
      </mujoco>"""
    shown = runs_of(hover)
    assert shown.shown(1e-3, 0.01, 4.0, 0).speed > 0.05
    assert shown.limit(0.01, np.inf) == (0.2, None)


def test_steps_upwards_have_both_sides_of_a_limit_and_no_gap():
    steps = [0.002, *upwards(0.002, 0.1)]
    assert [steps.count(pytest.approx(mark)) for mark in (0.097, 0.103, 0.2)] == [1, 1, 1]
    assert max(np.divide(steps[1:], steps[:-1])) < 1.500001 and steps == sorted(steps)


# controllers


def exact_growth(steps, delay, kp, kv, dt=2e-3):
    """Of one hinge under Euler: force kp q + kv v of a reading every `steps`, which acts `delay` < `steps` later."""
    step, push = np.array([[1.0, dt], [0.0, 1.0]]), np.array([dt * dt, dt]) / INERTIA
    state = np.eye(2, 3)  # and the force of the reading before
    forces = np.eye(1, 3, 2)[0], -np.array([kp, kv]) @ state
    for k in range(steps):
        state = step @ state + np.outer(push, forces[k >= delay])
    return np.abs(np.linalg.eigvals(np.vstack([state, forces[1]]))).max()


@lru_cache
def program(text, kp=None, kv=None, dt=2e-3, integrator="Euler"):
    place = place_of(text)
    return controlled(place.model, place.rest, dt, integrator, kp, kv)


def test_a_program_grows_as_the_exact_map_of_one_hinge():
    servo, motor = program(hinge(20.0, 1.0)), program(hinge(actuator=MOTORS), 10.0, 0.5)
    for steps, delay in ((1, 0), (10, 4), (45, 0), (60, 0), (60, 7)):
        exact = exact_growth(steps, delay, 20.0, 1.0)
        for found in (servo, motor):  # the gear is 2
            exact_here = exact if found is servo else exact_growth(steps, delay, 40.0, 2.0)
            assert found.factor(steps, delay) == pytest.approx(max(1.0, exact_here), rel=1e-6)
    assert program(hinge(actuator=MOTORS)) is None and len(servo.servos) == len(motor.servos) == 1


@pytest.mark.parametrize("delay", [0, 4, 11])
def test_runs_show_the_longest_period_and_the_longest_delay_of_two_servos(delay):
    weak = two(HOLDING.replace('kv="3"', 'kv="0.7"').replace('kv="2"', 'kv="0.4"'))
    found = program(weak, dt=5e-4, integrator="implicitfast")
    longest = found.longest_period(delay)
    assert not found.grows_in_run(longest, delay) and found.grows_in_run(longest + 2, delay)
    latest = found.longest_delay(longest - 3, delay)
    grown = [found.grows_in_run(longest - 3, late) for late in (latest, latest + 2)]
    assert latest >= delay and grown == [False, True]


def test_a_force_range_and_the_rest_of_a_program_are_those_of_the_file():
    """Two rods on their servos: the program's forces hold them where MuJoCo's did."""
    text = two()
    found, rest = program(text, integrator="implicitfast"), rest_of(text, 2e-3, "implicitfast")
    assert found.rest.left < 1e-4 and np.abs(found.rest.state[1:3] - rest.state[1:3]).max() < 1e-8
    assert found.factor(1, 0) == 1.0
    cut = hinge(actuator='<position joint="turn" kp="20" kv="1" forcerange="-0.3 0.3"/>')
    (servo,) = program(cut).servos
    assert [servo.force(q, 0.0) for q in (-1.0, -0.01, 1.0)] == pytest.approx([0.3, 0.2, -0.3])


# motions


def test_a_body_that_spins_about_its_middle_axis_leaves_by_itself():
    """At omega sqrt((I2 - I1) (I3 - I2) / (I1 I3)), 1/s; the exact motion as well."""
    rates = []
    for omega in (0.0, 20.0):
        place = place_of(SPIN.format(omega))
        found = motion(place, 0.01, "RK4")
        assert found.passed and found.failed_at is None
        assert found.rate == pytest.approx(found.exact_rate, rel=0.05)
        rates.append(found.exact_rate)
    assert rates[1] - rates[0] == pytest.approx(20.0 / np.sqrt(3.0), rel=0.1)


# cures


def test_the_least_changes_of_one_hinge_are_those_of_the_formula(monkeypatch):
    """4 I > 2 dt kv + dt^2 kp, 1 % above the step."""
    kp, kv, dt, inertia = 20.0, 30.0, 0.02, INERTIA + 0.01
    place, above = place_of(hinge(kp, kv, 'armature="0.01"')), 0.02 * cures.SPARE
    shown = runs_of(hinge(kp, kv, 'armature="0.01"'))
    assert not shown.survives(1e-3, dt)
    found = {cure.change: cure.factor for cure in cures.cures(shown, dt)}
    less = 2.0 * above * kv / (4.0 * inertia - above**2 * kp)
    more = (2.0 * above * kv + above**2 * kp) / (4.0 * inertia) - 1.0
    assert found.keys() == {"less_kv", "more_armature"}
    assert 0.999 * less < found["less_kv"] < cures.WITHIN * less
    assert 0.999 * more < found["more_armature"] < cures.WITHIN * more
    weaker = with_kv(place.model, 1.0 / found["less_kv"])
    heavier = with_armature(place.model, found["more_armature"])
    assert all(replace(shown, model=changed).survives(1e-3, dt) for changed in (weaker, heavier))
    monkeypatch.setattr(Runs, "survives", lambda runs, push, dt: False)
    assert cures.cures(shown, dt) == []  # a run has the last word


def test_what_helps_a_standing_leg_holds_in_a_run_and_half_of_it_does_not():
    place, dt = place_of(FOOT), 1.3 * limit_of(FOOT, "implicitfast").dt
    made = {change.name: change for change in cures.CHANGES}
    shown = runs_of(FOOT, "implicitfast")
    found = cures.cures(shown, dt)
    assert {cure.change for cure in found} & {"less_kv", "more_armature", "slower_contacts"}
    for cure in found:
        change = made[cure.change]
        changed = change.made(place.model, cure.factor)
        assert replace(shown, model=changed).survives(1e-6, dt)
        if cure.factor > change.first * cures.WITHIN**2:
            less = change.made(place.model, cure.factor / cures.WITHIN**2)
            assert not tried(less, place.rest, cures.SPARE * dt, "implicitfast").is_stable


def test_each_change_changes_what_it_says():
    place = place_of(FOOT)
    model = place.model
    assert with_kv(model, 0.5).actuator_biasprm[:, 2].tolist() == [-25.0, -3.0, -3.0]
    assert with_impratio(model, 4.0).opt.impratio == 12.0
    assert with_other_cone(model, 1.0).opt.cone != model.opt.cone
    assert with_slower_contacts(model, 3.0).geom_solref[:, 0] == pytest.approx(0.06)
    assert with_kv(place_of(KINDS["a box"]).model, 0.5) is None
    assert not with_armature(place_of(KINDS["a box"]).model, 9.0).dof_armature.any()  # of a free joint
    # the model itself is as it was
    assert model.actuator_biasprm[0, 2] == -50.0 and model.opt.impratio == 3.0
    assert growth(rest_of(FOOT)).factor == 1.0 and Step(model, 1e-3, "Euler").model is not model
