"""Another robot behind the project's symbols: its hinges and bodies stand in another order in the file than in the Tree."""

import numpy as np
import pytest
from crane import crane

import tmt
from compare.engines.mujoco import load
from compare.engines.mujoco.calls import MinimalCalls
from compare.engines.mujoco.linear import differenced, implicit_derivative, left_to_itself, transition
from compare.engines.mujoco.parameters import parameters
from compare.experiments.parameters import stated
from tmt.equations.method import bias_rates


@pytest.fixture(scope="module")
def damped(tmp_path_factory):
    """The case with damping, and its dynamics."""
    robot = crane(tmp_path_factory.mktemp("model"))
    case = robot.case("damped", damping=0.2)
    return case, load(robot.mjcf, robot.tree).of(case)


def test_every_quantity_is_that_of_the_tree(damped, rng):
    dynamics, tree = damped[1], damped[0].tree
    q, v, tau = rng.uniform(-3.0, 3.0, (3, 4, 4))
    found = {
        "com_positions": (q,), "angular_velocities": (q, v), "jacobians": (q,), "convective_terms": (q, v),
        "mass_matrix": (q,), "bias": (q, v), "gravity_balance": (q,), "acceleration": (q, v, tau),
        "potential_energy": (q,), "energy": (q, v),
    }  # fmt: skip
    for name, state in found.items():
        for ours, theirs in zip(getattr(tmt, name)(*state, tree), getattr(dynamics, name)(*state)):
            assert np.allclose(ours, theirs, rtol=1e-10, atol=1e-10), name
    assert np.allclose(dynamics.inverse(q, v, dynamics.acceleration(q, v, tau)), tau, atol=1e-10)
    if not MinimalCalls.unavailable():
        assert np.allclose(MinimalCalls(dynamics).acceleration(q, v, tau), dynamics.acceleration(q, v, tau), rtol=1e-10)
    compiled = parameters(dynamics)
    for name, numbers in stated(tree).items():
        assert np.allclose(compiled[name], numbers, atol=1e-14), name


def test_a_run_is_in_the_order_of_the_tree(damped, rng):
    """Beside the run of tmt, and what MuJoCo says of its own steps."""
    case, dynamics = damped
    q, v, tau, dt = *rng.uniform(-1.0, 1.0, (3, 4)), 0.01
    ours, motion = tmt.simulate(q, v, tau, dt, 5, "rk4", case.tree), dynamics.run(q, v, tau, dt, 5, "RK4")
    assert np.allclose(motion.q, ours.q, atol=1e-11) and np.allclose(motion.v, ours.qd, atol=1e-10)
    alone, motion = left_to_itself(dynamics, q, v, tau, dt, 5, "Euler"), dynamics.run(q, v, tau, dt, 5, "Euler")
    assert np.allclose(alone["q"], motion.q, atol=1e-13) and np.allclose(alone["qd"], motion.v, atol=1e-12)
    for integrator in ("Euler", "implicit"):
        theirs = transition(dynamics, q, tau, dt, integrator)
        assert np.allclose(theirs, differenced(dynamics, q, tau, dt, integrator), atol=1e-7)
    ours = np.array(bias_rates(case.tree, list(q), list(v))) + np.diag(case.tree.damping)
    assert np.allclose(-implicit_derivative(dynamics, q, v), ours, atol=1e-12)
