"""A sample of the made faults of `python -m tests.faults`."""

import faults
import numpy as np
import pytest

import tmt

FAULTS = faults.all_faults()


@pytest.mark.slow
def test_no_fault_is_explained_by_something_else():
    outcomes = [faults.outcome(fault)[0] for fault in FAULTS[::23]]
    assert "wrong" not in outcomes and sum(of in ("named", "tied") for of in outcomes) >= 0.75 * len(outcomes)


def test_the_second_derivation_is_right_where_nothing_is_wrong():
    trees = tmt.ARM, faults.reading.read(faults.ARM6).tree, *(fault.tree for fault in FAULTS[-3:])
    for tree in trees:
        q, qd = np.random.default_rng(7).uniform(-3.0, 3.0, (2, 2, len(tree.axis)))
        M, h = faults.derived(tree, q, qd)
        assert np.abs(M - tmt.literal.mass_matrix(q, tree)).max() < 1e-12
        assert np.abs(h - tmt.literal.bias(q, qd, tree)).max() < 1e-10
