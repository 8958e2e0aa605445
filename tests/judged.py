"""What the tests of the judge share."""


def verdicts(result) -> dict:
    """Whether each check passed, by the name of its quantity."""
    assert len({check.quantity for check in result.checks}) == len(result.checks)
    return {check.quantity: check.passed for check in result.checks}
