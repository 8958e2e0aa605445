"""A sample of the made faults of `python -m tests.faults`."""

import faults
import pytest

FAULTS = faults.all_faults()


@pytest.mark.slow
def test_no_fault_is_explained_by_something_else():
    outcomes = [faults.outcome(fault)[0] for fault in FAULTS[::23]]
    assert "wrong" not in outcomes and sum(of in ("named", "tied") for of in outcomes) >= 0.75 * len(outcomes)
