"""Derivatives: the eps that is advised, errors by blocks, a wrong model, contacts and limits, what no control moves."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from helpers.edited import XML, edited, setup_between, setup_of, setup_of_file
from helpers.servo_models import hinge

import tmt
from compare.core.text import say, screen
from compare.engines.mujoco import read
from compare.experiments import derivatives
from compare.experiments.derivatives import standing, ways
from compare.experiments.derivatives.figures_derivatives import draw_errors
from compare.experiments.derivatives.standing import Standing, directions, errors_of, not_moved


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


def noisy(eps, noise, slope, kink):
    """A derivative of 2, of a block of one entry, with a term in eps^2, noise of a step, and a kink from an eps on."""
    rounding = np.random.default_rng(int(1e15 * eps)).uniform(-1.0, 1.0)
    size = 2.0 + slope * eps**2 + noise / eps * rounding + (np.sqrt(eps / kink) if eps > kink else 0.0)
    return np.array([[size, 1.0], [1.0, 1.0]])


@pytest.mark.parametrize("noise, kink, eps", [(1e-13, 1.0, 1e-5), (1e-13, 1e-6, 1e-6), (1e-9, 1.0, 1e-3)])
def test_what_agrees_for_neighbouring_eps_is_right(noise, kink, eps):
    values, halved = ([noisy(size / part, noise, 1e3, kink) for size in ways.SIZES] for part in (1.0, 2.0))
    errors, truth = errors_of(values, halved, 1)
    assert truth[0, 0] == pytest.approx(2.0, abs=1e-4 if noise > 1e-12 else 1e-6)
    found = ways.best_of("", dict(zip(ways.SIZES, errors)))
    assert eps / 10.1 < found.eps < 10.1 * eps
    known = [abs(value[0, 0] - 2.0) / 2.0 for value in values]
    assert all(0.3 < error / right < 3.0 for error, right in zip(errors, known) if right > 1e-4)


def test_where_nothing_agrees_no_eps_is_right():
    rng = np.random.default_rng(0)
    values = [rng.normal(size=(2, 2)) for _ in ways.SIZES]
    errors, truth = errors_of(values, values, 1)
    assert truth is None and set(errors) == {np.inf}
    about = {"posture": "stand", "contacts": 4, "limits": ["limit of knee"]}
    told = {"about": about, "best": None, "opened": None, "names": []}
    assert "no eps is right" in say(derivatives.Result("derivatives").finding("standing", **told))


FEET = "".join(
    f'<geom name="foot{k}" type="sphere" size="0.02" pos="{x} {y} 0"/>'
    for k, (x, y) in enumerate([(0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)])
)
TABLE = f"""<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>
<geom name="floor" type="plane" size="1 1 1"/><body name="table" pos="0 0 0.02"><freejoint/>
<inertial pos="0.02 0.03 0.05" mass="1" diaginertia="0.01 0.02 0.025"/>{FEET}<geom name="knob" size="0.02" pos="0 0 0.002"/>
</body></worldbody></mujoco>"""


def differences_of_six(model, state, eps):
    """[A B] of order 6 by plain MuJoCo: columns by movements and speeds."""
    data, spec = mujoco.MjData(model), mujoco.mjtState.mjSTATE_INTEGRATION
    start, columns = np.zeros(model.nq), []

    def after(k, by):
        mujoco.mj_setState(model, data, state, spec)
        start[:] = data.qpos
        movement = by * np.eye(2 * model.nv)[k]
        mujoco.mj_integratePos(model, data.qpos, movement[: model.nv], 1.0)
        data.qvel += movement[model.nv :]
        mujoco.mj_step(model, data)
        moved = np.zeros(model.nv)
        mujoco.mj_differentiatePos(model, moved, 1.0, start, data.qpos)
        return np.concatenate([moved, data.qvel])

    for k in range(2 * model.nv):
        one, two, three = (after(k, n * eps) - after(k, -n * eps) for n in (1, 2, 3))
        columns.append((45.0 * one - 9.0 * two + three) / (60.0 * eps))
    return np.array(columns).T


def test_a_table_on_its_feet():
    """The advised eps is as right as is said, beside differences of order 6; contacts that open or close are named."""
    result = answered(TABLE)
    rows = {row.eps: row for row in result.tables["contact_derivatives"]}
    values = result.top[1].values
    best, place = values["best"], Standing(read(TABLE))
    assert values["about"]["contacts"] == 4 and values["about"]["limits"] == [] and failed(result) == []
    right = differences_of_six(place.stepper.model, place.state, 1e-6)
    for eps, row in rows.items():
        error = ways.worst_block(place.values(eps)[:, :12] - right, right, 6)[0]
        assert error < 1e-8 or 0.3 < row.error / error < 3.0
    assert rows[best.eps].error == best.error < 1e-5
    assert "floor and knob" in rows[1e-2].changed and rows[1e-7].changed == ""
    assert values["opened"].eps == min(eps for eps, row in rows.items() if row.changed)
    assert f"from {values['opened'].eps:.0e} on".replace("e-0", "e-") in say(result.top[1])


def test_what_touches_nothing_has_no_row_and_a_limit_that_acts_is_said():
    in_air = answered(TABLE.replace('type="plane"', 'type="plane" contype="0" conaffinity="0"'))
    assert "contact_derivatives" not in in_air.tables and "Standing" not in say(in_air.top[1])
    rests = """<mujoco><worldbody><body><joint name="lid" axis="0 1 0" range="-10 10" damping="0.1"/>
    <geom size="0.05" pos="0.3 0 0"/></body></worldbody></mujoco>"""
    told = answered(rests).top[1]
    assert told.values["about"] == {"posture": "qpos0", "contacts": 0, "limits": ["limit of lid"]}
    assert "Standing on its limit of lid" in say(told)


CARTS = """<mujoco><option gravity="0 0 0"/><worldbody><body>
<joint name="driven" type="slide" axis="1 0 0"/><geom size="0.1" mass="1"/></body>
<body pos="0 1 0"><joint name="other" type="slide" axis="1 0 0" {}/><geom size="0.1" mass="1"/></body></worldbody>
<actuator><motor joint="driven"/>{}</actuator></mujoco>"""
BALANCER = """<mujoco><option timestep="0.002"/><worldbody><geom type="plane" size="5 5 .1"/>
<body name="frame" pos="0 0 0.07"><freejoint name="base"/>
<geom type="box" pos="0 0 0.12" size=".04 .05 .07" mass="0.9" contype="0" conaffinity="0"/>{}</body></worldbody>
<actuator><motor joint="left"/><motor joint="right"/></actuator></mujoco>"""
WHEEL = """<body pos="0 {} 0"><joint name="{}" axis="0 1 0" damping="0.002"/>
<geom type="cylinder" zaxis="0 1 0" size=".07 .015" mass=".15"/></body>"""
INVERTED = CARTS.replace('<option gravity="0 0 0"/>', "").replace(
    'type="slide" axis="1 0 0" {}/><geom size="0.1" mass="1"/>',
    'axis="0 1 0" {}/><geom size="0.1" mass="1" pos="0 0 0.5"/>'
)  # fmt: skip


@pytest.mark.parametrize("xml, names", [
    (CARTS.format("", ""), ["other"]), (CARTS.format('damping="5"', ""), ["other"]),  # its place stays
    (CARTS.format('damping="5" stiffness="9"', ""), []), (CARTS.format("", '<motor joint="other"/>'), []),
    (CARTS.format("", '<general joint="other" dyntype="filter" dynprm="0.1"/>'), []), (INVERTED.format("", ""), ["other"]),
    (BALANCER.format(WHEEL.format(0.09, "left") + WHEEL.format(-0.09, "right")), ["base x", "base y", "base turn z"]),
])  # fmt: skip
def test_directions_that_no_control_moves_are_named(xml, names):
    """A cart on its own; of a robot on two wheels three: it slips neither along nor about the vertical, nor sideways."""
    told = answered(xml).top[1]
    assert sorted(told.values["names"]) == sorted(names)
    assert ("a linear-quadratic regulator has no solution" in say(told)) == bool(names)


def test_a_singular_value_within_the_error_counts_as_zero():
    """The second of two integrators is moved by a little: that divided by the root of 2 is the singular value."""
    A, units = np.array([[1.0, 1.0], [0.0, 1.0]]), np.ones(2)
    for moved, error, count in ((0.0, 1e-9, 1), (1.35e-6, 1e-6, 1), (1.5e-6, 1e-6, 0)):
        values = np.hstack([A, [[1.0], [moved]]])
        truth = values + np.diag([0.0, error])[:, [0, 1, 0]] * [1.0, 1.0, 0.0]
        assert len(not_moved(values, truth, units)) == count
    stepper = Standing(read(CARTS.format("", ""))).stepper
    assert directions(stepper, np.array([[0.6, 1.0, 0.0, 0.0], [0.0, 0.0, 0.1, 1.0]])) == [
        "driven with other",
        "other",
    ]
    assert standing.FEWEST == 3
