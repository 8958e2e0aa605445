"""The longest stable step after a push: against closed forms, MuJoCo's derivative and plain runs with other signs."""

from dataclasses import replace
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from helpers import pushed_models as models
from helpers.pushed_models import (
    BOX,
    FLOOR,
    INERTIA,
    KP,
    LEDGE,
    LIMIT,
    UPRIGHT,
    end_speed,
    hinge,
    leg,
    sphere,
    walker,
)

import compare
from compare.stability.answer import StepLimitRow
from compare.stability.push import Pushed, Verdict
from compare.stability.runs import Runs

SERVO_WITHOUT_KV = '<position joint="turn" kp="400"/>'


def limits(text, *integrators, **more):
    return compare.step_limits(text, integrators=integrators or None, **more)


def euler(text, **more):
    return limits(text, "Euler", **more)["Euler"]


def test_a_servo_of_one_hinge_has_the_limit_of_its_two_by_two_step():
    row = euler(hinge())
    assert row.stable_up_to_s < LIMIT < row.fails_at_s * 1.02 and row.stable_up_to_s > 0.9 * LIMIT
    assert row.fails_at_s / row.stable_up_to_s < 1.061
    assert row.moves_first == "turn" and row.judged_by == "rest"
    assert limits(hinge(), "implicitfast")["implicitfast"].fails_at_s is None


@pytest.mark.parametrize("dampratio, integrator, limit", [
    (1.0, "Euler", 0.828427), (1.0, "implicitfast", 0.828427), (0.5, "Euler", 0.618034),
])  # fmt: skip
def test_a_sphere_on_a_plane_has_the_limit_of_its_impedance(dampratio, integrator, limit):
    """4 - 4 x - x^2 / z^2 = 0 with x = dt / timeconst."""
    row = limits(sphere(dampratio), integrator)[integrator]
    assert 0.85 * limit * 0.02 < row.stable_up_to_s < 1.02 * limit * 0.02 and row.moves_first == "z"


def test_a_floor_raises_the_limit_of_euler_and_lowers_that_of_implicitfast():
    """MuJoCo solves the contact force with M, and integrates it with M + dt D."""
    for integrator, is_raised in (("Euler", True), ("implicitfast", False)):
        on_floor = limits(leg(integrator), integrator)[integrator]
        above = limits(leg(integrator, -5.0, 'stiffness="1e5" damping="1e3"'), integrator)[integrator]
        assert (on_floor.stable_up_to_s > above.longest_s) is is_raised
        assert on_floor.stable_up_to_s < 1.03 * models.linear_limit(leg(integrator), integrator)


@pytest.mark.parametrize("text", [
    hinge(), hinge('<position joint="turn" kp="300" kv="2"/>', joint='damping="0.3"'), leg(), sphere(),
])  # fmt: skip
def test_plain_runs_with_other_signs_hold_below_and_fail_above(text):
    for row in limits(text, "Euler", "RK4")[: 1 if 'size="0.1" mass="2"' in text else 2]:
        rest = row.creep_rad_per_s + max(0.01, row.push_rad_per_s / 2.0)
        steps = [(0.94 * (row.stable_up_to_s or 0.0), True), (1.08 * (row.fails_at_s or 0.0), False)]
        for dt, holds in [(dt, holds) for dt, holds in steps if dt]:
            ends = [end_speed(text, dt, row.integrator, row.push_rad_per_s, seed) for seed in range(3)]
            assert all(speed <= rest for speed in ends) is holds


def test_dry_friction_does_not_hide_what_a_push_shows():
    """It holds small deviations at any step: kv of 5 at twice the limit."""
    stuck = hinge(joint='frictionloss="0.05"', dt=2.0 * LIMIT)
    assert end_speed(stuck, 2.0 * LIMIT, "Euler", 1e-6) < 1e-3
    row = euler(stuck)
    assert not row.stable_at_file_dt and row.stable_up_to_s < 1.1 * LIMIT


def test_the_solvers_iterations_are_part_of_the_file():
    few, more = (limits(walker(count), "implicitfast")["implicitfast"] for count in (1, 10))
    assert few.longest_s < 0.005 <= more.longest_s and not few.stable_at_file_dt and more.stable_at_file_dt


def test_what_moves_on_by_itself_is_judged_by_divergence_alone():
    falling = euler(UPRIGHT.format("", ""))
    assert falling.judged_by == "divergence" and falling.survived_rad_per_s == 0.0
    assert falling.by_itself == "rests"
    tilted = UPRIGHT.format('damping="0.01"', '<keyframe><key name="tilted" qpos="0.3"/></keyframe>')
    row = euler(tilted)
    assert row.by_itself == "moves on" and row.stable_at_file_dt and row.unpushed_rad_per_s > 0.05
    free = euler(BOX.format(floor=""))
    assert free.by_itself == "moves on" and free.stable_at_file_dt
    assert euler(BOX.format(floor=FLOOR)).by_itself == "rests"


def test_what_diverges_while_it_falls_is_told():
    text = UPRIGHT.format("", "").replace("<geom", '<joint name="tail" axis="1 0 0"/><geom')
    servo = '<actuator><position joint="tail" kp="2000" kv="200"/></actuator></mujoco>'
    row = euler(text.replace("</mujoco>", servo))
    assert row.judged_by == "divergence" and not row.stable_at_file_dt and row.outcome == "diverges"


def test_undamped_motion_is_judged_by_its_speed_and_numerical_damping_is_told():
    text = hinge(SERVO_WITHOUT_KV, dt=0.005)
    found = limits(text)
    own = found["Euler"]
    assert own.judged_by == "speed" and own.stable_at_file_dt and own.kept == pytest.approx(1.0, abs=0.05)
    exact = 2.0 / np.sqrt(400.0 / INERTIA)  # semi-implicit Euler's
    assert own.stable_up_to_s == pytest.approx(exact, rel=0.08)
    if "discrete" in [row.integrator for row in found]:
        assert found["discrete"].is_damped and not own.is_damped


def test_weak_growth_is_seen_in_a_longer_run():
    """RK4 of an undamped hinge just above its limit of 2 sqrt(2)."""
    omega = np.sqrt(KP / INERTIA)
    limit = 2.0 * np.sqrt(2.0) / omega
    row = limits(hinge(f'<position joint="turn" kp="{KP}"/>'), "RK4")["RK4"]
    assert row.stable_up_to_s < 1.03 * limit


def test_a_push_that_is_stated_is_not_lowered():
    spring = UPRIGHT.format('stiffness="3" damping="0.3"', "")  # rests upright, falls beyond a small push
    assert euler(spring).survived_rad_per_s > 0.0
    row = euler(UPRIGHT.format("", ""), push=0.5)
    assert row.judged_by == "falls" and row.push_rad_per_s == 0.5 and row.stable_up_to_s is None
    assert "not judged" in str(limits(UPRIGHT.format("", ""), "Euler", push=0.5))


def test_no_finite_fine_run_is_not_judged():
    stiff = hinge('<position joint="turn" kp="1e14"/>', keys='<key name="off" qpos="0.2" ctrl="0.1"/>')
    row = euler(stiff)
    assert row.judged_by == "" and row.stable_at_file_dt is None and row.stable_up_to_s is None


def test_a_keyframe_with_speeds_is_judged_joint_by_joint():
    spin = hinge('<motor joint="turn"/>', keys='<key name="spin" qvel="3"/>')
    row = euler(spin)
    assert row.by_itself == "in motion" and row.stable_at_file_dt and row.kept == pytest.approx(1.0, rel=1e-6)


def test_an_equality_that_does_not_hold_at_the_start_is_told():
    other = '<body name="b"><joint name="other" axis="0 0 1"/><geom size="0.1"/></body></worldbody>'
    text = hinge().replace("</worldbody>", other)
    tie = '<equality><joint joint1="turn" joint2="other" polycoef="0.8 1 0 0 0"/></equality>'
    text = text.replace("</mujoco>", f"{tie}</mujoco>")
    row = euler(text)
    assert "jump" in row.starts and euler(hinge()).starts == ""


def test_what_creeps_is_told_by_the_law_of_a_soft_contact():
    """Speed g_t (1 - d) / (d b impratio), b = 2 / (d timeconst), of one sticking contact under a pull."""
    row = euler(sphere(impratio=3.0, pull=2.0, condim=3, x=""))
    d = 0.9
    speed = 2.0 * (1.0 - d) / (d * 2.0 / (d * 0.02) * 3.0)
    assert row.creep_rad_per_s == pytest.approx(speed, rel=0.02) and row.creeping_joint == "x"


def test_distance_from_fine_steps_falls_with_the_step_and_with_the_order():
    def apart(dt, integrator):
        return limits(hinge(dt=dt), integrator)[integrator].apart

    assert apart(0.008, "Euler") > 1.5 * apart(0.004, "Euler") > 2.0 * apart(0.002, "Euler") > 0.0
    assert apart(0.004, "RK4") < 0.3 * apart(0.004, "Euler")


def test_the_longest_step_within_an_error_is_shorter():
    row = euler(hinge(), error=1e-3)
    assert 0.0 < row.within_error_s < row.stable_up_to_s
    assert euler(hinge(), error=1e-12).within_error_s is None


def test_a_rod_that_tumbles_as_it_falls_through_air_is_as_stable_as_at_fine_steps():
    """Whether it turns depends on the signs of the push: no step makes it faster than finer ones do for the same push."""
    text = """<mujoco><option density="1.2" viscosity="1e-3"/><worldbody><body><freejoint name="rod"/>
    <geom type="capsule" size=".03 .12" density="700"/></body></worldbody>
    <keyframe><key qpos="0 0 1 1 0 0.2 0" qvel="0.2 -0.1 -0.4 -0.2 -0.3 0.5"/></keyframe></mujoco>"""
    row = euler(text)
    assert row.judged_by == "speed" and row.stable_at_file_dt and row.fails_at_s is None


def test_a_run_that_diverges_is_not_said_to_be_damped():
    row = StepLimitRow(
        posture="home",
        integrator="Euler",
        push_rad_per_s=0.1,
        kept=0.1,
        outcome="moves",
        file_dt_s=1e-3,
        file_integrator="Euler",
    )
    assert row.is_damped and not replace(row, outcome="diverges").is_damped


def test_a_push_that_topples_at_fine_steps_is_no_fault_of_the_step():
    """A ball near a ledge falls off after one pattern of signs, which is not among the first four, and at any step."""
    assert end_speed(LEDGE, 2.5e-4, "Euler", 0.1, signs=(-1.0, -1.0, -1.0)) > 20.0
    assert all(end_speed(LEDGE, 0.01, "Euler", 0.1, signs=(sign, 1.0, -sign)) < 0.01 for sign in (1.0, -1.0))
    row = euler(LEDGE)
    assert row.judged_by == "rest" and row.stable_at_file_dt and row.stable_up_to_s > 0.01


class ByChance(Pushed):
    """Steps near 48 ms and above 52 ms fail after a further push, above 60 ms after the first ones, nowhere after most."""

    def __init__(self):
        self.dt, self.fine_dt, self.longest, self.tried, self.surely = 0.005, 5e-4, 0.2, {}, set()

    def told(self, trial, fails):
        return self.tried.setdefault(trial, Verdict("diverges" if fails else "", 0, 0, 0.0, 0.0, None))

    def verdict(self, trial):
        return self.told(trial, trial.dt > 0.06)

    def sure(self, trial):
        if self.verdict(trial).holds and (0.0475 < trial.dt < 0.0484 or trial.dt > 0.052):
            del self.tried[trial]
            self.told(trial, fails=True)
        return self.tried[trial].holds

    def mostly_fails(self, trial):
        return False


def test_no_step_up_to_the_limit_was_seen_to_fail_and_the_one_that_fails_was():
    pushed = ByChance()
    limit = pushed.limit(0.1, "Euler")
    failed = [trial.dt for trial, verdict in pushed.tried.items() if not verdict.holds]
    assert any(dt < 0.05 for dt in failed) and 0.04 < limit.stable_up_to < limit.fails_at == min(failed)


def test_fine_steps_that_shake_within_a_range_of_forces_are_not_the_truth():
    """The limit of Euler is 2 I / kv = 0.4 ms, fine steps are of 0.5 ms; within 100 N m nothing diverges."""
    strong = hinge(
        f'<position joint="turn" kp="400" kv="{2.0 * INERTIA / 4e-4}" forcerange="-100 100"/>', dt=0.004
    )
    assert end_speed(strong, 5e-4, "Euler", 0.1) > 0.3 and end_speed(strong, 1e-4, "Euler", 0.1) < 0.01
    row = euler(strong)
    assert row.fine_integrator == "implicitfast" and row.judged_by == "rest" and not row.stable_at_file_dt


@pytest.mark.parametrize("place, turn, apart", [
    ((3.0, -2.0, 1.0), (0.0, 0.0, 2.0), 0.0), ((0.0, 0.0, 0.6), (0.0, 0.0, 0.0), 0.4),
    ((0.0, 0.0, 1.0), (0.5, 0.0, 0.0), 0.5), ((0.0, 0.0, 1.0), (0.0, 3.0, 0.0), 3.0),
])  # fmt: skip
def test_what_is_free_ends_elsewhere_if_it_is_lower_or_tilted(place, turn, apart):
    text = '<mujoco><worldbody><body pos="0 0 1"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>'
    model, start = mujoco.MjModel.from_xml_string(text), np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    end = np.r_[place, start[3:]]
    mujoco.mj_integratePos(model, end, np.r_[np.zeros(3), turn], 1.0)
    run, other = (SimpleNamespace(q=q[None]) for q in (end, start))
    assert Runs.elsewhere(SimpleNamespace(model=model), run, other) == pytest.approx(apart, abs=1e-9)
