"""Steps of models with quaternions: their derivatives, minimal calls, additions."""

import numpy as np
import pytest
from files import EVERYTHING, PLAIN, case_of, mjcf
from trees import random_states

import tmt
from compare.engines.mujoco import engine, read
from compare.engines.mujoco.additions import MINIMAL, contacts, with_additions
from compare.engines.mujoco.calls import MinimalCalls
from compare.engines.mujoco.linear import differenced, transition


@pytest.fixture(scope="module")
def reading():
    return read(EVERYTHING)


def test_a_step_is_differenced_in_movements_and_minimal_calls_are_the_same(reading, rng):
    dynamics, (q, v, tau) = engine(reading).of(case_of(reading.tree)), random_states(rng, reading.tree, 3)
    for integrator in ("Euler", "implicit"):
        A = transition(dynamics, q[0], tau[0], 1e-3, integrator)
        assert A.shape == (2 * dynamics.coordinates.nv,) * 2
        assert np.allclose(A, differenced(dynamics, q[0], tau[0], 1e-3, integrator), atol=1e-6)
    assert np.allclose(transition(dynamics, q[0], tau[0], 1e-9, "RK4"), np.eye(len(A)), atol=1e-5)
    if not MinimalCalls.unavailable():
        minimal = MinimalCalls(dynamics)
        assert np.allclose(minimal.acceleration(q, v, tau), dynamics.acceleration(q, v, tau), rtol=1e-9, atol=1e-9)


def test_additions_to_a_bare_model(reading, rng):
    engines = with_additions(engine(reading), 0.02, -5.0, -50.0)
    case, state = case_of(reading.tree), [x[0] for x in random_states(rng, reading.tree, 1)]
    bare = engine(reading).of(case).run(*state, 1e-3, 5, "RK4").states
    assert "8 sensors" in engines
    for name, addition in engines.items():
        dynamics = addition.of(case)
        if name == MINIMAL:
            assert np.allclose(dynamics.acceleration(*state), tmt.acceleration(*state, reading.tree), rtol=1e-9)
        if "capsules" not in name:
            assert np.allclose(dynamics.run(*state, 1e-3, 5, "RK4").states, bare, rtol=1e-12, atol=1e-12)
            assert contacts(dynamics, *state, 1e-3, 5, "RK4") == (0.0, False)


@pytest.mark.parametrize("flag", ["gravity", "damper", "spring"])
def test_default_flags_bring_back_no_force_that_the_file_disables(flag):
    joint = PLAIN.replace('name="j"', 'name="j" axis="0 1 0" damping="1" stiffness="3" springref="40"')
    reading, state = read(mjcf(joint, f'<option><flag {flag}="disable"/></option>')), ([0.3], [0.5], [0.0])
    for name, addition in with_additions(engine(reading), 0.02, -5.0, -9.0).items():
        found = addition.of(case_of(reading.tree)).acceleration(*state)
        assert found == pytest.approx(tmt.acceleration(*state, reading.tree), rel=1e-12), name
