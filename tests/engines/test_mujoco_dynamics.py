"""MuJoCo behind the project's symbols: the state that is asked for, runs that end, what of the file's options does not matter."""

import numpy as np
import pytest
from edited import XML

import tmt
from compare.engines.mujoco import parse
from compare.engines.mujoco.engine import METHODS
from compare.robots.arm import ARM

REST = np.zeros(3)


def test_quantities_are_those_of_the_state_that_is_asked_for(mujoco, rng):
    dynamics, (q, v, tau) = mujoco.of(ARM.case()), rng.uniform(-2, 2, (3, 3))
    before = dynamics.bias(q, v)
    dynamics.run(q, v, tau, 0.01, 10, "RK4")
    dynamics.acceleration(q + 1, v, tau)
    assert np.array_equal(dynamics.bias(q, v), before)


def test_a_diverged_run_is_not_reset_where_the_file_allows_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert XML.count(' autoreset="disable"') == 1
    lenient, strict = (
        parse(text, tmt.ARM).of(ARM.case()).run(REST, np.full(3, 1e3), REST, 10.0, 200, "RK4")
        for text in (XML.replace(' autoreset="disable"', ""), XML)
    )
    assert not np.isfinite(lenient.q[-1]).any() and np.array_equal(lenient.q, strict.q, equal_nan=True)
    assert lenient.ended == strict.ended and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("place, value, last", [((2, 0), 0.2, 2), ((1, 5), np.inf, 1)])
def test_a_run_is_no_number_from_where_its_clock_stands_or_a_number_is_not_finite(mujoco, place, value, last):
    dynamics, states, start = mujoco.of(ARM.case()), np.ones((1, 4, 7)), np.zeros((1, 7))
    states[0, :, 0] = [0.1, 0.2, 0.3, 0.4]
    states[0][place] = value
    q, v, ended = dynamics.path(start, states, 0.1)
    for values in (q, v):
        assert np.isfinite(values[0]).all(axis=1).tolist() == [k <= last for k in range(5)]
    assert ended[0].startswith(f"at t = {0.1 * last:g} s: ")


def test_the_files_own_integrator_does_not_matter_where_states_are_evaluated(rng):
    """One that damps implicitly would change accelerations, and what mj_inverse finds."""
    assert XML.count('integrator="RK4"') == 1
    q, v, tau = rng.uniform(-2, 2, (3, 3))
    sticky = ARM.case("sticky", damping=0.5)
    for name in METHODS.keys() & {"implicit", "discrete"}:
        text = XML.replace('integrator="RK4"', f'integrator="{name}"').replace("<flag ", '<flag invdiscrete="enable" ')
        other, same = (parse(of, tmt.ARM).of(sticky) for of in (text, XML))
        assert np.array_equal(other.acceleration(q, v, tau), same.acceleration(q, v, tau))
        assert np.array_equal(other.inverse(q, v, tau), same.inverse(q, v, tau))
