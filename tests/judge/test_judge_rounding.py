"""The width of the band of rounding, and the growth of a small difference."""

import dataclasses

import mpmath
import numpy as np
import pytest
from helpers.trees import one_body

import tmt
from compare.engines.mujoco import engine, reading
from compare.engines.mujoco.names import INTEGRATORS
from compare.judge.entries import Entries
from compare.judge.rounding import (
    LEFT_OUT,
    OF_A_BALL,
    accelerated,
    band,
    growth,
    slope_rounding,
    step_rounding,
)
from compare.judge.scale import FACTOR, gain_scale
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from tmt.derivation.coordinates import coordinates_of
from tmt.methods import METHODS, amplification

EPS = 2.0**-52
EULER = METHODS["semi_implicit_euler"]
# one hinge without gravity: a linear system, and nothing but a sum of roundings
UP, DISC = (0.0, 0.0, 1.0), np.diag([1.0, 1.0, 2.0])
TURN = one_body([UP], inertia=DISC, gravity=(0.0, 0.0, 0.0))
TORQUE = np.array([3.0])


def turning(steps, dt, rate=5.0):
    """States of the disc under a constant torque, and the rounding of each step as the report states it."""
    t, torque = dt * np.arange(steps + 1), TORQUE[0]
    a = torque / 2.0
    q, qd = 1.0 + rate * t + a * t**2 / 2, rate + a * t
    rounding = (64 * EPS * 2.0 * a + 64 * EPS * torque) / 2.0
    rates = dt * rounding + 8 * EPS * (qd + dt * a)
    return q[:, None], qd[:, None], 8 * EPS * (q + dt * qd) + dt * rates, rates


def rounded(stepping, tree, q, qd, tau, dt):
    """Accelerations and the bound of their rounding."""
    a, A = accelerated(stepping, tree, q, qd, tau, dt)
    return a, slope_rounding(stepping, tree, q, qd, tau, a, A)


@pytest.mark.parametrize("name, share, left_out", [
    ("discrete", 0.99, True), ("discrete", 3.99, True), ("discrete", 4.01, False), ("implicitfast", 0.99, False),
])  # fmt: skip
def test_the_bound_of_discrete_with_servos_has_the_force_that_mujoco_leaves_out(name, share, left_out):
    servo = '<position joint="turn" kp="50" kv="4"/>'
    joint = '<joint name="turn" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 2"/>'
    text = f"<mujoco><worldbody><body>{joint}</body></worldbody><actuator>{servo}</actuator></mujoco>"
    found = reading.read(text)
    case = next(case for case in robot_of(found, "disc.xml").cases if case.controller)
    q = np.array([(case.tau - share * LEFT_OUT) / 50.0])  # the force is that share
    a, bound = rounded(METHODS[name], case.tree, q, 0.0 * q, case.tau, 1e-3)
    assert bool(bound[0, 0] > LEFT_OUT / 2.1) is left_out
    if name in INTEGRATORS:
        qdd = engine(found).of(case).run(q[0], [0.0], case.tau, 1e-3, 1, name).v[1] / 1e-3
        assert np.abs(qdd - a[0]).max() <= bound[0, 0]


def test_what_a_controller_feeds_back_is_rounded_too():
    """64 eps of |P| |q| + |S| |qd|, of the disc whose torque these gains all but take away."""
    driven = dataclasses.replace(TURN, position_gain=((50.0,),), speed_gain=((4.0,),))
    q, qd, M = np.array([[1.0], [-3.0]]), np.array([[5.0], [-2.0]]), 2.0
    fed = 50.0 * np.abs(q) + 4.0 * np.abs(qd)
    assert gain_scale(driven, q, qd) == pytest.approx(fed) and not gain_scale(TURN, q, qd).any()
    a, bound = rounded(METHODS["rk4"], driven, q, qd, TORQUE, 0.1)
    size = np.abs(a)
    assert size == pytest.approx(np.abs(3.0 - 50.0 * q - 4.0 * qd) / M)
    assert bound == pytest.approx(64 * EPS * (M * size + 3.0 + fed) / M, rel=1e-9, abs=0.0)


def test_the_force_of_a_step_counts_every_term_by_its_absolute_value():
    """Elbow alone, damped: gravity of the link that it moves, the centripetal term, torque and damping."""
    tree = ARM.case("elbow", posture=(0.0, 0.0, 30.0), locked=("alpha", "beta"), damping=0.5).tree
    q, qd, tau, dt, M = 0.3, -4.0, 2.0, 0.01, 0.05275
    (h,) = tmt.bias(tree, np.array([q]), np.array([qd]))
    a = (tau - 0.5 * qd - h) / M
    from_centre = 1.9 / (1.9 + 1.5) * np.hypot(0.15 * np.cos(q), 0.15 + 0.15 * np.sin(q))
    weight = 9.81 * 1.5 * (0.15 + from_centre / 4 + 0.45 / 64)
    S = weight + 1.5 * 0.15**2 * abs(np.sin(2 * q)) * qd**2 + tau + 0.5 * 4.0
    rates = dt * (64 * EPS * M * abs(a) + 64 * EPS * S) / M + 8 * EPS * (4.0 + dt * abs(a))
    expected = [8 * EPS * (q + dt * 4.0) + dt * rates, rates]
    at = tree, np.array([[q]]), np.array([[qd]]), np.array([tau]), dt
    assert step_rounding(METHODS["explicit_euler"], *at)[0] == pytest.approx(expected, rel=1e-9, abs=0.0)
    assert 0.85 < step_rounding(EULER, *at)[0, 1] / rates < 1.0  # the same with Mbar + dt D in Mbar's place


@pytest.mark.parametrize("every", [1, 64])
def test_the_band_is_the_sum_of_what_each_step_adds_carried_to_the_present(every):
    """J of the disc is ((1, dt), (0, 1)): an error of rate becomes m dt times as much of angle after m steps."""
    steps, dt = 128, 0.05
    q, qd, angles, rates = turning(steps, dt)
    found = band(EULER, TURN, q, qd, TORQUE, dt, every)
    assert found.shape == (steps // every + 1, 2) and not found[0].any()
    for row, n in zip(found[1:], range(every, steps + 1, every)):
        k = np.arange(n)
        # an error of rate reaches the angle in its own step through the sum, in each later one through dt
        expected = [(angles[:n] + (n - 1 - k) * dt * rates[:n]).sum(), rates[:n].sum()]
        assert row == pytest.approx(expected, rel=1e-9 if every == 1 else 0.04, abs=0.0)


def test_the_band_is_carried_by_the_jacobian_of_each_step_where_they_differ():
    """Along a swinging arm, whose Jacobians change: from step to step, w+ = |J| carried roundings, one by one."""
    steps, dt, tau = 12, 0.05, np.zeros(3)
    _, q, qd = tmt.simulate(tmt.ARM, [2.0, 0.5, 1.0], [1.0, -2.0, 3.0], tau, dt, steps, "semi_implicit_euler")
    delta = step_rounding(EULER, tmt.ARM, q[:-1], qd[:-1], tau, dt)
    carried, expected = np.zeros((6, 0)), [np.zeros(6)]
    for step, added in enumerate(delta):
        J = tmt.step_derivatives(tmt.ARM, q[step], qd[step], tau, dt, "semi_implicit_euler")[0]
        carried = np.hstack([J @ carried, np.diag(added)])
        expected.append(np.abs(carried).sum(axis=1))
    for every in (1, 4):
        assert band(EULER, tmt.ARM, q, qd, tau, dt, every) == pytest.approx(
            np.array(expected[::every]), rel=1e-9, abs=0.0
        )


@pytest.mark.parametrize("name", ["semi_implicit_euler", "rk4"])
def test_at_fine_steps_the_jacobian_in_the_middle_of_four_steps_stands_for_each(name):
    """Along a swinging arm, whose Jacobians change: within 10 % of the band by the Jacobian of each step."""
    steps, dt, tau = 192, 0.003, np.zeros(3)
    _, q, qd = tmt.simulate(tmt.ARM, [2.0, 0.5, 1.0], [1.0, -2.0, 3.0], tau, dt, steps, name)
    of_each, of_four = (band(METHODS[name], tmt.ARM, q, qd, tau, dt, every) for every in (4, 16))
    assert of_four == pytest.approx(of_each[::4], rel=0.1, abs=0.0)
    assert (of_four[1:] != of_each[4::4]).any()


def test_roundings_of_two_joints_do_not_cancel_in_an_acceleration():
    """Two discs on one axis, Mbar = ((4, 2), (2, 2)): its inverse ((1, -1), (-1, 2)) / 2 is taken without signs."""
    discs, tau = (
        one_body([UP] * 2, inertia=DISC, gravity=(0.0, 0.0, 0.0), armature=(2.0, 0.0)),
        np.array([3.0, 1.0]),
    )
    a, bound = rounded(METHODS["rk4"], discs, np.zeros((1, 2)), np.zeros((1, 2)), tau, 0.1)
    assert a == pytest.approx(np.array([[1.0, -0.5]]))
    R = np.array([[4.0, 8.0**0.5], [8.0**0.5, 2.0]])
    errors = 64 * EPS * (R @ np.abs(a[0]) + tau)
    assert bound[0] == pytest.approx(
        [(errors[0] + errors[1]) / 2.0, errors[0] / 2.0 + errors[1]], rel=1e-9, abs=0.0
    )


def test_growth_at_rest_on_a_saddle_is_that_of_the_powers_of_its_step():
    """Upright, held: every step has the same Jacobian, so a small difference grows as the norm of its powers."""
    q, steps, dt = np.radians([180.0, 0.0, 90.0]), 64, 0.01
    path, tau = np.tile(q, (steps + 1, 1)), tmt.gravity_balance(tmt.ARM, q)
    (J,) = amplification(METHODS["rk4"], tmt.ARM, q[None], np.zeros((1, 3)), tau, dt)
    grown = growth(METHODS["rk4"], tmt.ARM, path, 0.0 * path, tau, dt, every=16)
    expected = [np.log10(np.linalg.norm(np.linalg.matrix_power(J, k), 2)) for k in range(0, steps + 1, 16)]
    assert grown == pytest.approx(expected, abs=1e-6) and grown[-1] > 2.0


def test_the_rounding_of_a_turn_is_that_of_a_product_of_quaternions():
    """Of 100 movements and differences of a ball, beside 50 digits: no more than what the bound counts for them."""
    ball, rng = coordinates_of(("ball",)), np.random.default_rng(3)
    turned, measured = [], []
    for _ in range(100):
        p, u = rng.normal(size=4), rng.uniform(-2.0, 2.0, 3)
        p, near = p / np.linalg.norm(p), np.array(ball.move(list(p / np.linalg.norm(p)), list(1e-9 * u)))
        found = ball.move(list(p), list(u))
        with mpmath.workdps(50):
            digits = [[mpmath.mpf(float(x)) for x in values] for values in (p, u, found, near)]
            off = ball.difference(digits[2], ball.move(*digits[:2]))
            exact = ball.difference(digits[3], digits[0])
            turned.append(max(map(abs, off)))
            measured.append(max(abs(a - b) for a, b in zip(exact, ball.difference(list(near), list(p)))))
    assert 0.5 * EPS < max(turned) < 12 * EPS and 0.5 * EPS < max(measured) < 8 * EPS
    assert OF_A_BALL == (2 * 12 + 8) * EPS


def test_the_band_is_infinite_from_where_a_run_diverges_or_after_the_steps_that_are_asked_for():
    q, qd, *_ = turning(16, 0.1)
    run = METHODS["rk4"], TURN, q, qd, TORQUE, 0.1
    whole, part = (band(*run, 4, most) for most in (None, 11))
    assert np.array_equal(part[:3], whole[:3]) and np.isinf(part[3:]).all() and np.isfinite(whole).all()
    q[5:] = np.nan
    width, grown = band(*run), growth(*run, every=2)
    assert np.isfinite(width[:5]).all() and np.isinf(width[5:]).all()
    assert np.isfinite(grown[:3]).all() and np.isnan(grown[3:]).all()


FAR = """<mujoco><worldbody><body name="post">{0}<body name="far" pos="{1} 0 0.2">
<inertial pos="0 0 0.002" mass="0.003" diaginertia="1e-8 1e-8 1e-8"/><joint name="turn" type="{2}"/></body>
</body></worldbody></mujoco>"""
HEAVY = '<inertial pos="0 0 0" mass="40" diaginertia="1 1 1"/><joint name="rail" type="slide" axis="0 1 0"/>'
ON_THE_SAME = f'<body name="weight" pos="0 0.3 0">{HEAVY}</body>'


@pytest.mark.parametrize("weight, kind, length", [
    (HEAVY, "ball", 0.6), (HEAVY, "hinge", 4.0), (ON_THE_SAME, "ball", 4.0), (ON_THE_SAME, "hinge", 0.6),
])  # fmt: skip
def test_the_tolerance_of_a_light_body_is_that_of_the_moments_about_the_centre_of_mass(weight, kind, length):
    reading_of = reading.read(FAR.format(weight, length, kind))
    robot, tree = robot_of(reading_of, "far"), reading_of.tree
    q = robot.coordinates.random(np.random.default_rng(3), 100)
    M = engine(reading_of).of(robot.case()).mass_matrix(q)
    turning = Entries(tree, q).mass_matrix[:, 1:, 1:]
    share = np.abs(M - tmt.mass_matrix(tree, q))[:, 1:, 1:].max() / (FACTOR * EPS * turning.max())
    assert 0.02 < share < 1.0
