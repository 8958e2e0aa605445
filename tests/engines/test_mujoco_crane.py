"""Another robot behind the project's symbols: its hinges and bodies stand in another order in the file than in the Tree."""

import numpy as np
import pytest
from crane import TREE, XML, crane

import tmt
from compare.engines.mujoco import ModelError, load, parse
from compare.engines.mujoco.calls import MinimalCalls
from compare.engines.mujoco.linear import differenced, implicit_derivative, left_to_itself, transition
from compare.engines.mujoco.parameters import parameters
from compare.experiments.parameters import stated
from tmt.equations.method import bias_rates


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return crane(tmp_path_factory.mktemp("model"))


@pytest.fixture(scope="module")
def damped(robot):
    """The case with damping, and its dynamics."""
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
        minimal = MinimalCalls(dynamics)
        for name in ("mass_matrix", "bias", "acceleration"):
            assert np.allclose(getattr(minimal, name)(*found[name]), getattr(dynamics, name)(*found[name]), rtol=1e-10)
    compiled = parameters(dynamics)
    for name, numbers in stated(tree).items():
        assert np.allclose(compiled[name], numbers, atol=1e-14), name


def test_a_run_is_in_the_order_of_the_tree(damped, rng):
    """One step of RK4 by hand from the accelerations, and what MuJoCo says of its own steps."""
    case, dynamics = damped
    q, v, tau, dt = *rng.uniform(-1.0, 1.0, (3, 4)), 0.01
    slopes = [(v, dynamics.acceleration(q, v, tau))]
    for part in (0.5, 0.5, 1.0):
        (dq, dv), at = slopes[-1], part * dt
        slopes.append((v + at * dv, dynamics.acceleration(q + at * dq, v + at * dv, tau)))
    weights = dt * np.array([1.0, 2.0, 2.0, 1.0]) / 6.0
    end = [start + weights @ [slope[k] for slope in slopes] for k, start in enumerate((q, v))]
    motion = dynamics.run(q, v, tau, dt, 1, "RK4")
    assert np.allclose(motion.q[1], end[0], atol=1e-13) and np.allclose(motion.v[1], end[1], atol=1e-12)
    alone = left_to_itself(dynamics, q, v, tau, dt, 5, "Euler")
    motion = dynamics.run(q, v, tau, dt, 5, "Euler")
    assert np.allclose(alone["q"], motion.q, atol=1e-13) and np.allclose(alone["qd"], motion.v, atol=1e-12)
    for integrator in ("Euler", "implicit"):
        theirs = transition(dynamics, q, tau, dt, integrator)
        assert np.allclose(theirs, differenced(dynamics, q, tau, dt, integrator), atol=1e-7)
    ours = np.array(bias_rates(case.tree, list(q), list(v))) + np.diag(case.tree.damping)
    assert np.allclose(-implicit_derivative(dynamics, q, v), ours, atol=1e-12)


@pytest.mark.parametrize("name", ["foot", "hook"])
def test_a_body_that_no_hinge_tells_is_found_by_its_name(name):
    with pytest.raises(
        ModelError, match=f"the text has no body '{name}'; it is expected, for no hinge tells which it is"
    ):
        parse(XML.replace(f'name="{name}"', 'name="other"'), TREE)
    assert parse(XML.replace('name="boom"', 'name="other"'), TREE).bodies == [1, 2, 4, 5, 3]
