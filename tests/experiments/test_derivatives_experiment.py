"""Derivatives: the eps that is advised, errors by blocks, controls, a wrong model."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.edited import XML, edited, setup_between, setup_of, setup_of_file
from helpers.servo_models import hinge

import tmt
from compare.core.text import screen
from compare.experiments import derivatives
from compare.experiments.derivatives import ways
from compare.experiments.derivatives.figures_derivatives import draw_errors


def failed(result) -> list[str]:
    return [check.quantity for check in result.checks if not check.passed]


def answered(xml):
    return derivatives.rows(replace(setup_of_file(xml), alone=True))


@pytest.mark.parametrize("errors, eps, alike", [
    ({1e-1: 1.0, 1e-2: 1e-3, 1e-3: 1e-6, 1e-4: 1e-3}, 1e-3, (1e-3, 1e-3)),
    ({1e-1: 1.0, 1e-2: 2.99e-6, 1e-3: 1e-6, 1e-4: 2.99e-6, 1e-5: 1.0}, 1e-3, (1e-4, 1e-2)),
    ({1e-1: 1.0, 1e-2: 3.01e-6, 1e-3: 1e-6, 1e-4: 3.01e-6, 1e-5: 1.0}, 1e-3, (1e-3, 1e-3)),
    ({1e-1: 2e-6, 1e-2: 1.5e-6, 1e-3: 2.5e-6, 1e-4: 1e-6, 1e-5: 1.0}, 1e-2, (1e-4, 1e-1)),  # the better of two middles
    ({1e-1: 1e-6, 1e-2: 1.0, 1e-3: 1.1e-6}, 1e-1, (1e-1, 1e-1)),  # alike, but no neighbours
    ({1e-1: None, 1e-2: 1.0, 1e-3: None}, 1e-2, (1e-2, 1e-2)),
])  # fmt: skip
def test_the_middle_of_a_plateau_is_advised(errors, eps, alike):
    best = ways.best_of("way", errors)
    assert (best.eps, best.finest_alike, best.coarsest_alike) == (eps, *alike)
    assert best.error == errors[eps]


def test_an_error_is_that_of_the_largest_entry_of_its_block():
    """Of two joints and an input: blocks of 2 x 2 and 2 x 1."""
    exact = np.array([[1.0, 1e-3, 2e-3, 0.0, 1e-6], [0.0, 1.0, 0.0, 2e-3, 2e-6],
                      [5.0, 0.0, 1.0, 0.0, 1e-3], [0.0, 1e-9, 0.0, 0.5, 0.0]])  # fmt: skip
    for (row, column), block, size in (
        ((0, 0), "dq/dq", 1.0), ((0, 3), "dq/dv", 2e-3), ((3, 1), "dv/dq", 5.0), ((3, 3), "dv/dv", 1.0),
        ((0, 4), "dq/du", 2e-6), ((3, 4), "dv/du", 1e-3),
    ):  # fmt: skip
        difference = np.zeros_like(exact)
        difference[row, column] = 1e-8
        assert ways.worst_block(difference, exact, 2) == (pytest.approx(1e-8 / size), block)
    zero, rounding = np.where(np.abs(exact) < 1e-5, 0.0, exact), np.full_like(exact, 1e-5)
    # dq/du is but rounding
    assert ways.worst_block(np.full_like(exact, 1e-8), exact, 2, rounding)[1] == "dv/du"
    assert ways.worst_block(np.full_like(exact, 1e-8), zero, 2)[1] == "dv/du"
    assert ways.worst_block(np.nan * exact, exact, 2)[0] == np.inf


def test_the_answer_of_the_arm(small):
    """Of RK4, which mjd_transitionFD refuses: differences of steps have their best error where both terms meet."""
    result = small("derivatives")
    assert failed(result) == []
    centred, one_sided, exact = result.tables["derivative_costs"]
    assert centred.way == "differences of mj_step, centred" and 1e-7 < centred.eps < 1e-3
    assert 1e-12 < centred.error < 1e-8 and 10.0 * centred.error < one_sided.error and exact.error < 1e-12
    assert all(row.time > 0.0 for row in (centred, one_sided, exact))
    lines = screen(result.top[0])
    assert len(lines) <= 7 and "does not take this integrator" in lines[-1]
    errors = {row.eps: row.error for row in result.rows if row.way == centred.way}
    assert min(errors, key=errors.get) == centred.eps and len(errors) == len(ways.SIZES)
    assert draw_errors(result)[0] == "derivatives_errors"


GEAR = (
    hinge(kp=20.0, kv=0.5)
    .replace('kv="0.5"', 'kv="0.5" gear="3"')
    .replace("<option ", '<option integrator="{}" ')
)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_b_is_by_control_with_the_gear(integrator):
    """A hinge of 0.05 kg m2 with a servo of kp 20, kv 0.5 at a gear of 3: its step is linear, so all eps are alike."""
    setup = setup_of_file(GEAR.format(integrator))
    subject = ways.Subject(setup.engines["mujoco"], ways.case_of(setup.robot), 0.002, integrator, 2)
    assert subject.by == "ctrl" and subject.gains == pytest.approx(np.full((2, 1, 1), 60.0))
    dt, k, d, inertia = 0.002, 9.0 * 20.0, 9.0 * 0.5, 0.05
    inertia += dt * d * (integrator == "implicitfast")
    by = np.array([-k, -d, 60.0]) * dt / inertia
    speed = np.array([0.0, 1.0, 0.0]) + by
    expected = np.array([np.array([1.0, 0.0, 0.0]) + dt * speed, speed])
    assert subject.exact == pytest.approx(np.tile(expected, (2, 1, 1)), rel=1e-12)
    assert subject.by_differences(1e-4, True) == pytest.approx(subject.exact, rel=1e-8)
    result = answered(GEAR.format(integrator))
    assert failed(result) == [] and result.tables["derivative_costs"][0].error < 1e-10


MOTORS = """<mujoco><option integrator="Euler"/><worldbody><body><joint name="hip" axis="0 1 0"/>
<geom size="0.1 0.05" type="capsule" pos="0.1 0 0.2"/>
<body pos="0 0 0.5"><joint name="knee" axis="0 1 0.2"/><geom size="0.05" pos="0.2 0 0.1"/></body></body></worldbody>
<actuator><motor joint="knee" gear="5"/></actuator></mujoco>"""


def test_a_robot_with_motors_alone_is_set_going_and_moved_by_its_controls():
    setup = setup_of_file(MOTORS)
    case = ways.case_of(setup.robot)
    subject = ways.Subject(setup.engines["mujoco"], case, 0.002, "Euler", 3)
    assert np.abs(case.v).min() > 0.1 and subject.by == "ctrl" and subject.gains.shape == (3, 2, 1)
    assert subject.gains == pytest.approx(np.tile([[0.0], [5.0]], (3, 1, 1)))
    best = answered(MOTORS).tables["derivative_costs"][0]
    assert 1e-6 < best.eps < 1e-2 and best.error < 1e-7


def test_a_robot_too_stiff_for_explicit_methods_is_followed_to_its_end(monkeypatch):
    monkeypatch.setattr("tmt.compiled.runner.MOST_EVALUATIONS", 10_000)  # 1e8 take minutes
    setup = setup_of_file(MOTORS.replace('name="hip"', 'name="hip" damping="1e11"'))
    case = ways.case_of(setup.robot)
    subject = ways.Subject(setup.engines["mujoco"], case, 0.002, "Euler", 3)
    motion = tmt.simulate(case.tree, *case.start, case.tau, case.scene.dt, case.steps, "implicitfast")
    assert subject.q[-1] == pytest.approx(motion.q[-1], abs=1e-12) and abs(motion.q[-1, 1] - case.q[1]) > 0.1


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast"])
@pytest.mark.parametrize("more, inputs", [('<motor joint="knee" gear="2"/>', [1]), ("", [])])
def test_the_control_of_a_damper_changes_damping_and_is_no_input(integrator, more, inputs):
    """The force of a damper is -kv u speed: an implicit step divides by an inertia that depends on u."""
    damper = f'<damper joint="hip" kv="3" ctrlrange="0 1"/>{more}'
    text = MOTORS.replace("Euler", integrator).replace('<motor joint="knee" gear="5"/>', damper)
    keys = f'<keyframe><key qpos="0.2 0.3" qvel="0.5 -0.4" ctrl="0.7{" 0.1" * len(inputs)}"/></keyframe></mujoco>'
    text = text.replace("</mujoco>", keys)
    setup = setup_of_file(text)
    subject = ways.Subject(setup.engines["mujoco"], ways.case_of(setup.robot), 0.002, integrator, 2)
    assert subject.inputs.tolist() == inputs and subject.gains.shape == (2, 2, len(inputs))
    assert subject.by_differences(1e-4, True) == pytest.approx(subject.exact, rel=1e-6, abs=1e-8)
    assert failed(answered(text)) == []


def test_a_wrong_damper_and_a_wrong_derivative_are_seen(mujoco, monkeypatch):
    servo = hinge(kp=20.0, kv=0.5)
    assert failed(derivatives.rows(setup_between(servo))) == []
    damped = servo.replace('axis="0 0 1"', 'axis="0 0 1" damping="1e-6"')
    (wrong,) = failed(derivatives.rows(setup_between(servo, damped)))
    assert wrong == "mjd_transitionFD, centred, to exact, over its tolerance"
    right = tmt.step_derivatives

    def with_error(*arguments):
        A, B = right(*arguments)
        A[..., 0, 1] += 1e-8
        return A, B

    monkeypatch.setattr(tmt, "step_derivatives", with_error)
    assert len(failed(derivatives.rows(setup_of(mujoco)))) == 2
    heavier = setup_of(edited(('mass="1.5"', 'mass="1.50001"'), text=XML))
    monkeypatch.setattr(tmt, "step_derivatives", right)
    assert failed(derivatives.rows(heavier)) == [
        "differences of mj_step, centred, to exact, over its tolerance"
    ]
