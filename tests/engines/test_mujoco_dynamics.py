"""MuJoCo behind the project's symbols: states, torques, divergence."""

import numpy as np
import pytest
from edited import XML

import tmt
from compare.engines.mujoco import parse
from compare.engines.mujoco.engine import METHODS
from compare.robots.arm import ARM

REST = np.zeros(3)


@pytest.fixture
def dynamics(mujoco):
    """The arm as it is."""
    return mujoco.of(ARM.case())


def test_quantities_are_those_of_the_state_that_is_asked_for(dynamics, rng):
    q, v, tau = rng.uniform(-2, 2, (3, 3))
    before = dynamics.bias(q, v)
    dynamics.run(q, v, tau, 0.01, 10, "RK4")
    dynamics.acceleration(q + 1, v, tau)
    assert np.array_equal(dynamics.bias(q, v), before)


def test_a_diverged_run_is_not_reset_where_the_file_allows_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert XML.count(' autoreset="disable"') == 1
    lenient = parse(XML.replace(' autoreset="disable"', ""), tmt.ARM).of(ARM.case())
    motion = lenient.run(REST, np.full(3, 1e3), REST, 10.0, 200, "RK4")
    strict = parse(XML, tmt.ARM).of(ARM.case()).run(REST, np.full(3, 1e3), REST, 10.0, 200, "RK4")
    assert not np.isfinite(motion.q[-1]).any() and np.array_equal(motion.q, strict.q, equal_nan=True)
    assert motion.ended == strict.ended
    assert list(tmp_path.iterdir()) == []


def test_the_files_own_integrator_does_not_matter_where_states_are_evaluated(dynamics, rng):
    """One that damps implicitly would change accelerations, and what mj_inverse finds."""
    assert XML.count('integrator="RK4"') == 1
    names = [name for name in ("implicit", "discrete") if name in METHODS]
    q, v, tau = rng.uniform(-2, 2, (3, 3))
    sticky = ARM.case("sticky", damping=0.5)
    for name in names:
        text = XML.replace('integrator="RK4"', f'integrator="{name}"').replace("<flag ", '<flag invdiscrete="enable" ')
        other, same = (parse(of, tmt.ARM).of(sticky) for of in (text, XML))
        assert np.array_equal(other.acceleration(q, v, tau), same.acceleration(q, v, tau))
        assert np.array_equal(other.inverse(q, v, tau), same.inverse(q, v, tau))
