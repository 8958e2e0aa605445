"""Which of many differences is judged: the one that comes closest to its tolerance."""

import numpy as np
import pytest

from compare.judge.check import closest


@pytest.mark.parametrize(
    "difference, tolerance, place",
    [
        ([1.0, 3.0, -2.0], [1.0, 6.0, 1.0], 2),  # the largest share, of whatever sign, not the largest difference
        ([1.0, 3.0, -2.0], 1.0, 1),
        ([1.0, np.nan, 9.0], 1.0, 1),  # no number comes before all
        ([1.0, np.inf, 9.0], 1.0, 1),
        ([5.0, 0.0, 1e-300], [1.0, 0.0, 0.0], 2),  # so does a difference where none is allowed
        ([0.5, 0.0], [1.0, 0.0], 0),  # where there is none it is none
        ([1.0, 2.0], [2.0, np.inf], 0),
    ],
)
def test_the_difference_closest_to_its_tolerance(difference, tolerance, place):
    assert closest(np.array(difference), np.array(tolerance)) == (place,)


def test_a_tolerance_of_a_state_stands_for_all_components():
    assert closest(np.array([[1.0, 2.0], [0.5, 0.4]]), np.array([[4.0], [0.5]])) == (1, 0)
