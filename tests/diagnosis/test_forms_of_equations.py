"""Equations that are right but for a form: whole rows and quantities times a number, angles to the world; and too few states."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import diagnosis, states, tolerance, values

import tmt
from compare.diagnosis import diagnose, packed

ARM = tmt.ARM
# three parallel hinges
ROW = replace(
    ARM,
    axis=((0.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)),
    offset=((0.0, 0.0, 0.0), (0.2, 0.0, -0.1), (0.0, 0.0, -0.3)),
)


@pytest.mark.parametrize("part, place", [
    (slice(6), "all of M"), (slice(6, None), "all of h"), (slice(None), "all of M and h"), (slice(7, 8), "h[beta]"),
])  # fmt: skip
def test_a_factor_of_a_whole_quantity_is_named(part, place):
    given = values(ARM, *states())
    given[:, part] *= 1.25
    (cause,) = (cause for cause in diagnosis(given).causes if cause.place == place)
    assert cause.explains == pytest.approx(1.25) and cause.rank == 2


def test_a_row_at_rest_in_another_is_named():
    q, qd = states()
    given = values(ARM, q, qd)
    given[:, 6] -= tmt.gravity_balance(q)[:, 1]
    (cause,) = (cause for cause in diagnosis(given).causes if cause.place == "h[beta] at rest in h[alpha]")
    assert cause.explains == pytest.approx(-1.0) and "-1 times it is added" in cause.text


def test_a_bias_that_is_zero_is_an_option():
    given = values(ARM, *states())
    given[:, 6:] = 0.0
    assert ("bias", "left out") in {(cause.place, cause.explains) for cause in diagnosis(given).causes}


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_angles_to_the_world_are_an_option_of_parallel_hinges(sense):
    """The turn of the last hinge, whose axis is opposite, enters with the other sign."""
    q, qd = states(ROW)
    turns = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.0, sense, 1.0]])  # joint angles from angles
    M, h = tmt.mass_matrix(q @ turns.T, ROW), tmt.bias(q @ turns.T, qd @ turns.T, ROW)
    given = packed(turns.T @ M @ turns, h @ turns, 3, len(q))
    found = diagnose(ROW, ROW.hinge_names, q, qd, given, 10.0 * tolerance(ROW, q, qd))
    assert ("angles" in {cause.place for cause in found.causes}) is (sense > 0.0)


@pytest.mark.parametrize("count, is_told", [(3, False), (4, True)])
def test_of_fewer_than_four_positions_no_cause_is_told(count, is_told):
    q, qd = states(count=count)
    given = values(replace(ARM, mass=(1.9, 1.52)), q, qd)
    found = diagnose(ARM, ARM.hinge_names, q, qd, given, tolerance(ARM, q, qd))
    assert found.differs and bool(found.causes) is is_told and ("No cause can be told" in found.sentence) is not is_told


@pytest.mark.parametrize("count, is_said", [(7, True), (8, False)])
def test_a_difference_at_few_states_is_said(count, is_said):
    given = values(ARM, *states())
    given[:count, 7] += np.random.default_rng(1).normal(size=count)
    found = diagnosis(given)
    assert found.causes == () and (f"They differ at {count} of 24 states only" in found.sentence) is is_said
