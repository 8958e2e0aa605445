"""Whatever a user can get wrong gets a ValueError that says what was given and what is accepted."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

import tmt

REST = np.zeros(3)
CALLS = {
    "com_positions": lambda q: tmt.com_positions(q),
    "angular_velocities": lambda q: tmt.angular_velocities(REST, q),
    "jacobians": lambda q: tmt.jacobians(q),
    "convective_terms": lambda q: tmt.convective_terms(REST, q),
    "mass_matrix": lambda q: tmt.mass_matrix(q),
    "bias": lambda q: tmt.bias(REST, q),
    "gravity_balance": lambda q: tmt.gravity_balance(q),
    "acceleration": lambda q: tmt.acceleration(REST, REST, q),
    "potential_energy": lambda q: tmt.potential_energy(q),
    "energy": lambda q: tmt.energy(REST, q),
    "simulate": lambda q: tmt.simulate(q, REST, REST, 0.1, 1),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
@given(array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=5))
def test_wrong_shapes(call, shape):
    if shape and shape[-1] == 3:
        return
    with pytest.raises(ValueError, match=r"has shape .*; \(\.\.\., 3\) is expected.*alpha, beta, gamma"):
        call(np.zeros(shape))


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
@given(arrays(float, 3, elements=st.floats(-10, 10)), st.integers(0, 2), st.sampled_from([np.nan, np.inf, -np.inf]))
def test_values_that_are_not_finite(call, q, place, value):
    q[place] = value
    with pytest.raises(ValueError, match="not finite; finite numbers are expected"):
        call(q)


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
@pytest.mark.parametrize(
    "q", ["abc", None, [1, 2, "x"], [[1, 2, 3], [1, 2]], [1j, 0, 0], {"q": 1}, [True, False, True]]
)
def test_what_is_not_numbers(call, q):
    with pytest.raises(ValueError, match="real numbers of shape"):
        call(q)


def test_batches_that_do_not_fit():
    with pytest.raises(ValueError, match=r"do not fit together: q \(2, 3\), qd \(4, 3\)"):
        tmt.bias(np.zeros((2, 3)), np.zeros((4, 3)))


def test_an_empty_batch_is_a_batch():
    assert tmt.mass_matrix(np.zeros((0, 3))).shape == (0, 3, 3)


@given(
    st.one_of(
        st.floats(max_value=0),
        st.just(np.nan),
        st.just(np.inf),
        st.text(),
        st.none(),
        st.complex_numbers(),
        st.booleans(),
        st.just(10**400),
    )
)
def test_steps_in_time(dt):
    with pytest.raises(ValueError, match="a step in s above 0 is expected"):
        tmt.simulate(REST, REST, REST, dt, 1)


@given(st.one_of(st.integers(max_value=0), st.floats(), st.text(), st.none(), st.booleans()))
def test_numbers_of_steps(steps):
    with pytest.raises(ValueError, match="a whole number of at least 1 is expected"):
        tmt.simulate(REST, REST, REST, 0.1, steps)


def test_unknown_method_and_model():
    with pytest.raises(
        ValueError, match="unknown method 'rk5'; known are rk4, dopri8, dopri8_adaptive, explicit_euler"
    ):
        tmt.simulate(REST, REST, REST, 0.1, 1, "rk5")
    with pytest.raises(ValueError, match="unknown method"):
        tmt.simulate(REST, REST, REST, 0.1, 1, ["rk4"])
    with pytest.raises(ValueError, match="method 'rk4' has a fixed step and takes no tolerance"):
        tmt.simulate(REST, REST, REST, 0.1, 1, tolerance=1e-6)
    for wrong in (0.0, -1.0, np.nan, np.inf, "1e-6", True):
        with pytest.raises(ValueError, match=r"tolerance is .*; a number above 0 is expected"):
            tmt.simulate(REST, REST, REST, 0.1, 1, "dopri8_adaptive", tolerance=wrong)
    with pytest.raises(ValueError, match=r"a tmt\.Tree is expected"):
        tmt.mass_matrix(REST, model="arm")


def test_messages_are_one_line():
    with pytest.raises(ValueError) as error:
        tmt.mass_matrix(np.full((3, 1000), 1j))
    assert "\n" not in str(error.value) and len(str(error.value)) < 300


@given(st.sampled_from([int, np.int32, np.int64]), st.sampled_from([float, np.float64, np.float32, Fraction]))
def test_any_kind_of_number_will_do(whole, real):
    t, q, _ = tmt.simulate([0, 0, 1], REST, REST, real(0.5), whole(2))
    assert t.dtype == q.dtype == float and t[-1] == 1.0
