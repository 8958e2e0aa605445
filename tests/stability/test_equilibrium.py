"""The linearised equations and what a step does to them: slides, balls, springs, damping, bodies that float."""

from types import SimpleNamespace

import numpy as np
import pytest
from helpers.servo_models import robot
from models import PATHS, random_tree

import tmt
from compare.stability.equilibrium import Equilibrium, equilibrium
from tmt import METHODS
from tmt.methods import amplification

FIXED = [name for name, method in METHODS.items() if not method.adaptive]
PENDULUM = """<mujoco><worldbody><body name="bob"><joint name="turn" type="ball"/>
  <geom type="sphere" size="0.1" pos="0 0 -0.5" mass="2"/></body></worldbody></mujoco>"""
CART = """<mujoco><option gravity="0 0 0"/><worldbody><body name="cart"><joint name="rail" type="slide" damping="6"/>
  <geom type="sphere" size="0.1" mass="2"/></body></worldbody></mujoco>"""


@pytest.fixture(scope="module")
def robots():
    sources = {name: PATHS[name] for name in ("gripper", "pendulum_ball", "free_body")}
    sources |= {"random": random_tree(3, joints=4), "pendulum": PENDULUM, "cart": CART}
    return {name: robot(source) for name, source in sources.items()}


@pytest.fixture(scope="module")
def on_servos(robots):
    """The gripper where its servos, a tendon's among them, hold it at rest."""
    case = robots["gripper"].case("on servos", posture="open", torque="servos", gravity=False)
    end = tmt.simulate(case.tree, *case.start, case.tau, 5e-3, 4000, "implicitfast").q[-1]
    rest = np.zeros_like(case.tau)
    for _ in range(3):  # Newton's method
        left = case.tau - tmt.inverse_dynamics(case.tree, end, rest, rest)
        end = end + np.linalg.solve(tmt.inverse_dynamics_derivatives(case.tree, end, rest, rest)[0], left)
    assert np.abs(left).max() < 1e-9
    fields = {name: getattr(case, name) for name in ("tree", "tau", "coordinates", "scene")}
    return Equilibrium(SimpleNamespace(q=end, **fields))


@pytest.fixture
def at(robots, on_servos, name):
    """The posture of a test that has the name of a robot."""
    return on_servos if name == "on servos" else equilibrium(robots[name], next(iter(robots[name].postures)))


@pytest.mark.parametrize("name", ["gripper", "pendulum_ball", "random", "on servos"])
def test_the_matrix_is_the_derivative_of_the_acceleration_by_movements(at):
    n, nudge, ends = at.nv, 1e-6 * np.eye(at.nv), []
    for sign in (1.0, -1.0):
        by_q = tmt.acceleration(at.tree, at.moved(sign * nudge), np.zeros((n, n)), np.tile(at.tau, (n, 1)))
        by_v = tmt.acceleration(at.tree, np.tile(at.q, (n, 1)), sign * nudge, np.tile(at.tau, (n, 1)))
        ends.append(np.concatenate([by_q, by_v]))
    differenced = (ends[0] - ends[1]).T / 2e-6
    assert np.abs(at.matrix[n:] - differenced).max() < 1e-7 * np.abs(at.matrix).max()


@pytest.mark.parametrize("name", ["gripper", "pendulum_ball", "on servos"])
@pytest.mark.parametrize("method", FIXED)
def test_growth_is_that_of_the_amplification_of_the_methods_own_step(robots, at, name, method):
    if METHODS[method].solves_stages and at.tree.coordinates.balls:
        at = equilibrium(robots["pendulum"], "qpos0")
    dt = {"gripper": 0.05}.get(name, 0.02)
    exact = amplification(METHODS[method], at.tree, at.q, np.zeros(at.nv), at.tau, dt)
    growth = np.abs(np.linalg.eigvals(exact)).max()
    assert at.growth(method, dt) == pytest.approx(growth, abs=1e-6)


def test_a_spherical_pendulum_swings_alike_to_both_sides_and_spins_freely(robots):
    at = equilibrium(robots["pendulum"], "qpos0")
    inertia = 2 * 0.5**2 + 0.4 * 2 * 0.1**2
    swings = at.modes[0].imag[at.modes[0].imag > 1e-6]
    assert swings == pytest.approx(2 * [np.sqrt(2 * 9.81 * 0.5 / inertia)])
    assert at.kind == "marginal" and at.stays and at.without_stiffness.sum() == 2


def test_the_limit_of_a_mode_that_only_decays_is_that_of_its_rate(robots):
    """Where damping is implicit there is none."""
    at = equilibrium(robots["cart"], "qpos0")
    for method, limit in (("rk4", 2.785293563), ("explicit_euler", 2.0)):
        assert at.limit(method) == ("finite", pytest.approx(limit / 3.0, rel=1e-6))
    assert at.limit("semi_implicit_euler") == ("never_fails", None)
