"""What the tests of the judge share."""

import pytest

INSIDE, OUTSIDE = 0.999, 1.001  # of a tolerance
BOTH = pytest.mark.parametrize("share, passes", [(INSIDE, True), (OUTSIDE, False)])


def only(result) -> bool:
    """Whether the one check of a result passes."""
    (check,) = result.checks
    return check.passed


def verdicts(result) -> dict:
    """Whether each check passed, by the name of its quantity."""
    assert len({check.quantity for check in result.checks}) == len(result.checks)
    return {check.quantity: check.passed for check in result.checks}
