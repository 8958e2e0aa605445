"""The search for the largest number that holds."""

import pytest

from compare.stability.search import largest


def searched(holds, first, least=1e-3, most=10.0, within=1.01):
    tried = []
    found = largest(lambda x: tried.append(x) or holds(x), first, least, most, within)
    return found, tried


@pytest.mark.parametrize("first", [0.002, 0.05, 0.7, 0.72, 3.0, 10.0])
def test_the_largest_number_from_below_and_from_above(first):
    (low, high), tried = searched(lambda x: x <= 0.71, first)
    assert low <= 0.71 < high <= low * 1.01 and len(set(tried)) == len(tried) and min(tried) >= 1e-3


def test_what_always_or_never_holds():
    assert searched(lambda x: True, 0.5)[0] == (10.0, None)
    assert searched(lambda x: False, 0.5)[0] == (None, 1e-3)
    assert searched(lambda x: x <= 1e-3, 0.5)[0] == (1e-3, pytest.approx(1e-3, rel=0.01))
    assert searched(lambda x: False, 5e-4)[0] == (None, 5e-4)  # it begins below the least


def test_numbers_that_hold_again_further_up_are_not_reached():
    (low, high), _ = searched(lambda x: x < 0.3 or x > 2.0, 0.1)
    assert low < 0.3 <= high < 2.0
