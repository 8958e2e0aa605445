"""The order of a method from errors of several steps, and its check."""

import math

import numpy as np
import pytest
from judged import BOTH

from compare.core.check import Result
from compare.judge.order import ORDER_MARGIN, check_order, measured_order

STEPS = (0.4, 0.2, 0.1, 0.05)


def errors(*orders: float) -> list[float]:
    """Errors that fall by these orders from step to step."""
    return [*0.5 ** np.cumsum([0.0, *orders])]


def test_the_two_finest_of_enough_steps_give_the_order():
    order, coarse, fine = measured_order(STEPS, errors(1.0, 2.0, 4.0))
    assert order == pytest.approx(4.0) and (coarse, fine) == STEPS[-2:]
    assert measured_order(STEPS[:1], [1.0]) is None and measured_order(STEPS[:3], errors(4.0, 4.0), 4) is None


@BOTH
def test_an_order_has_settled_if_the_last_two_differ_by_the_margin(share, passes):
    falling = errors(4.0, 4.0 + share * ORDER_MARGIN)
    assert (measured_order(STEPS[:3], falling, 3) is not None) == passes
    assert measured_order(STEPS[:3], falling, 2)


def checked(*order):
    """The check of a measured order."""
    result = Result("test")
    check_order(result, "pendulum", *order)
    return result.checks[0]


@pytest.mark.parametrize("error", [math.nan, 0.0])
def test_an_error_that_is_no_number_or_zero_fails(error):
    order, *_ = measured_order(STEPS[:2], [1.0, error])
    assert checked(4, order).failed


@BOTH
def test_a_measured_order_is_at_least_that_of_the_method_and_of_order_8_at_least_7(share, passes):
    check = checked(4, 4.0 - share * ORDER_MARGIN, "error of the swing", "3.85")
    assert check.passed == passes and check.quantity == "deviation from order 4: error of the swing"
    assert checked(8, 8.0 - share).passed == passes and checked(8, 9.5).passed
    assert checked(4, 5.0).passed  # the leading term of an error may vanish


@BOTH
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("twin", [1.0, 2.0])
def test_a_higher_order_is_that_of_the_same_scheme_in_tmt(share, passes, side, twin):
    measured = twin + side * share * ORDER_MARGIN
    check = checked(1, measured, "error", "", twin)
    assert check.passed == passes and f"tmt's same scheme {twin:.2f}" in check.note
