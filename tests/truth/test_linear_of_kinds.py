"""The linearised equations and what a step does to them: slides, balls, springs, damping, bodies that float; and rest."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from models import PATHS, random_tree

import tmt
from compare.engines.mujoco import reading
from compare.robots.file import robot_of
from compare.truth.conserved import floats
from compare.truth.derivative import holding, stiffness
from compare.truth.linear import Held, held
from compare.truth.postures import posture_names
from compare.truth.rest import at_rest
from tmt import METHODS
from tmt.methods import amplification

FIXED = [name for name, method in METHODS.items() if not method.adaptive]
PENDULUM = """<mujoco><worldbody><body name="bob"><joint name="turn" type="ball"/>
  <geom type="sphere" size="0.1" pos="0 0 -0.5" mass="2"/></body></worldbody></mujoco>"""
CART = """<mujoco><option gravity="0 0 0"/><worldbody><body name="cart"><joint name="rail" type="slide" damping="6"/>
  <geom type="sphere" size="0.1" mass="2"/></body></worldbody></mujoco>"""
LIFT = CART.replace('<option gravity="0 0 0"/>', "")


def robot(source):
    return robot_of(reading.read(source), "robot.xml")


@pytest.fixture(scope="module")
def robots():
    names = {name: robot(PATHS[name]) for name in ("gripper", "pendulum_ball", "free_body", "loop")}
    return names | {"random": robot(random_tree(3, joints=4)), "pendulum": robot(PENDULUM), "cart": robot(CART)}


@pytest.mark.parametrize("name", ["gripper", "pendulum_ball", "random"])
def test_the_matrix_is_the_derivative_of_the_acceleration_by_movements(robots, name):
    at = held(robots[name], posture_names(robots[name])[0])
    n, nudge, ends = at.nv, 1e-6 * np.eye(at.nv), []
    for sign in (1.0, -1.0):
        by_q = tmt.acceleration(at.moved(sign * nudge), np.zeros((n, n)), np.tile(at.tau, (n, 1)), at.tree)
        by_v = tmt.acceleration(np.tile(at.q, (n, 1)), sign * nudge, np.tile(at.tau, (n, 1)), at.tree)
        ends.append(np.concatenate([by_q, by_v]))
    differenced = (ends[0] - ends[1]).T / 2e-6
    assert np.abs(at.matrix[n:] - differenced).max() < 1e-7 * np.abs(at.matrix).max()
    assert np.abs(at.mass_matrix @ at.matrix[n:, :n] + stiffness(at.tree, at.q)).max() < 1e-9 * np.abs(at.matrix).max()


@pytest.mark.parametrize("name", ["gripper", "pendulum_ball"])
@pytest.mark.parametrize("method", FIXED)
def test_a_step_is_the_amplification_of_the_methods_own_step(robots, name, method):
    at = held(robots[name], posture_names(robots[name])[0])
    if METHODS[method].solves_stages and at.tree.coordinates.balls:
        at = held(robots["pendulum"], "qpos0")
    for dt in (1e-3, 0.05):
        exact = amplification(METHODS[method], at.tree, at.q, np.zeros(at.nv), at.tau, dt)
        assert np.abs(at.step(method, dt) - exact).max() < 1e-12 * np.abs(exact).max()
        growth = np.abs(np.linalg.eigvals(exact)).max()
        assert at.growth(method, dt) == pytest.approx(growth, abs=1e-6)


@pytest.fixture(scope="module")
def on_servos(robots):
    """The gripper where its servos, a tendon's among them, hold it at rest."""
    case = robots["gripper"].case("on servos", posture="open", torque="servos", gravity=False)
    end = tmt.simulate(*case.start, case.tau, 5e-3, 4000, "implicitfast", case.tree).q[-1]
    for _ in range(3):  # Newton's method, with the derivative that is tested
        left = case.tau - np.array(holding(case.tree, list(end)), float)
        end = end + np.linalg.solve(stiffness(case.tree, end), left)
    assert np.abs(left).max() < 1e-9
    return Held(SimpleNamespace(tree=case.tree, q=end, tau=case.tau, coordinates=case.coordinates, scene=case.scene))


@pytest.mark.parametrize("method", FIXED)
def test_a_step_under_servos_is_the_amplification_of_the_methods_own(on_servos, method):
    at = on_servos
    for dt in (1e-3, 0.02):
        exact = amplification(METHODS[method], at.tree, at.q, np.zeros(at.nv), at.tau, dt)
        assert np.abs(at.step(method, dt) - exact).max() < 1e-11 * np.abs(exact).max()


def test_the_stiffness_under_servos_is_the_derivative_of_what_holds(on_servos):
    at, nudge = on_servos, 1e-6
    ends = [
        [np.array(holding(at.tree, list(at.q + sign * nudge * unit)), float) for unit in np.eye(at.nv)]
        for sign in (1, -1)
    ]
    found = stiffness(at.tree, at.q)
    assert np.abs((np.array(ends[0]) - ends[1]).T / (2 * nudge) - found).max() < 1e-8 * np.abs(found).max()
    hinges = dataclasses.replace(tmt.ARM, position_gain=np.diag([5.0, 6.0, 7.0]))
    assert np.allclose(
        stiffness(hinges, np.ones(3)) - stiffness(tmt.ARM, np.ones(3)), np.diag([5.0, 6.0, 7.0]), atol=1e-12
    )


def test_a_spherical_pendulum_swings_alike_to_both_sides_and_spins_freely(robots):
    at = held(robots["pendulum"], "qpos0")
    inertia = 2 * 0.5**2 + 0.4 * 2 * 0.1**2
    swings = at.modes[0].imag[at.modes[0].imag > 1e-6]
    assert swings == pytest.approx(2 * [np.sqrt(2 * 9.81 * 0.5 / inertia)])
    assert at.kind == "marginal" and at.stays and at.without_stiffness.sum() == 2 and at.soft.shape == (3, 1)


@pytest.mark.parametrize("method, limit", [("rk4", 2.785293563), ("explicit_euler", 2.0)])
def test_the_limit_of_a_mode_that_only_decays_is_that_of_its_rate(robots, method, limit):
    kind, dt = held(robots["cart"], "qpos0").limit(method)
    assert kind == "finite" and dt == pytest.approx(limit / 3.0, rel=1e-6)


def test_implicit_damping_has_no_limit(robots):
    assert held(robots["cart"], "qpos0").limit("semi_implicit_euler") == ("never_fails", None)


def test_a_free_body_is_held_without_gravity_and_no_mode_of_it_grows(robots):
    assert floats(robots["free_body"].tree) and not floats(robots["pendulum"].tree)
    at = held(robots["free_body"], "qpos0")
    assert not at.case.scene.gravity and not at.tau.any() and at.stays and at.without_stiffness.all()
    for method in ("rk4", "semi_implicit_euler", "gauss_legendre_4"):
        assert at.limit(method) == ("never_fails", None)


def test_downhill_a_robot_comes_to_a_posture_that_needs_no_torque_and_stays(robots):
    loop = robots["loop"]
    start = loop.posture("qpos0")
    q = at_rest(loop.tree, start)
    assert np.abs(tmt.gravity_balance(q, loop.tree)).max() < 1e-8 < np.abs(tmt.gravity_balance(start, loop.tree)).max()
    assert np.linalg.eigvalsh(stiffness(loop.tree, q)).min() > 0.0


def test_what_falls_for_ever_has_no_rest():
    lift = robot(LIFT)
    assert at_rest(lift.tree, lift.posture("qpos0")) is None
