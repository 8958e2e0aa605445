"""assert_agrees of a Coriolis matrix of one's own: C qd, and dM/dt - 2 C skew, and which of both fails."""

import numpy as np
import pytest
from models import PATHS

import compare
import tmt
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR

MJCF = str(PATHS["arm6"])
TREE = compare.tree(MJCF)


def right(q, qd):
    return tmt.coriolis_matrix(TREE, q, qd)


def skewed(q, qd):
    """Another C with the same product: of no Christoffel symbols."""
    S = np.zeros((6, 6))
    S[0, :2] = qd[1], -qd[0]
    return right(q, qd) + S


def with_a_sign(q, qd):
    C = right(q, qd)
    C[2] *= -1.0
    return C


def symmetric(q, qd):
    """A symmetric matrix with the right product: so has its transpose."""
    h, size = right(q, qd) @ qd, float(qd @ qd) or 1.0
    return (np.outer(h, qd) + np.outer(qd, h)) / size - (h @ qd) * np.outer(qd, qd) / size**2


SAID = {
    "transposed": (lambda q, qd: right(q, qd).T, {"C qd"}),
    "is 2 times": (lambda q, qd: 2.0 * right(q, qd), {"C qd", "C + C'"}),
    "not skew": (skewed, {"C + C'"}),
    "not skew: C is not": (symmetric, {"C + C'"}),
    "is not the velocity part": (with_a_sign, {"C qd", "C + C'"}),
}


@pytest.mark.parametrize("said", SAID)
def test_it_says_which_law_fails(said):
    function, quantities = SAID[said]
    found = compare.differences(MJCF, coriolis_matrix=function, states=20)
    assert {row.quantity for row in found if row.ratio > 1.0} == quantities
    with pytest.raises(AssertionError, match=said):
        compare.assert_agrees(MJCF, coriolis_matrix=function, states=20)


def test_a_right_one_agrees_as_a_function_a_table_and_in_other_joints(rng):
    compare.assert_agrees(MJCF, coriolis_matrix=right, bias=lambda q, qd: tmt.bias(TREE, q, qd))
    q, qd = rng.uniform(-1.0, 1.0, (2, 12, 6))
    compare.assert_agrees(MJCF, coriolis_matrix=tmt.coriolis_matrix(TREE, q, qd), q=q, qd=qd)
    names = [f"-{TREE.joint_names[0]}", *TREE.joint_names[1:]]
    S = np.diag([-1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    compare.assert_agrees(MJCF, coriolis_matrix=lambda q, qd: S @ right(S @ q, S @ qd) @ S, joints=names)


@pytest.mark.parametrize("share, differs", [(0.9, False), (1.2, True)])
def test_just_inside_and_just_outside(share, differs):
    worst = compare.differences(MJCF, coriolis_matrix=right, states=1)
    (row,) = [row for row in worst if row.entry.startswith("(C qd)") and TREE.joint_names[1] in row.entry]

    def off(q, qd):
        C = right(q, qd)
        C[1, 1] += share * row.tolerance / qd[1]
        return C

    found = compare.differences(MJCF, coriolis_matrix=off, states=1)
    assert any(x.ratio > 1.0 for x in found if x.quantity == "C qd") == differs


def test_the_tolerance_of_dM_dt_is_that_of_twice_the_terms_of_C(rng):
    q, qd = rng.uniform(-1.0, 1.0, (2, 3, 6))
    found = compare.differences(MJCF, coriolis_matrix=tmt.coriolis_matrix(TREE, q, qd), q=q, qd=qd)
    tolerances = {(row.state.number, row.entry): row.tolerance for row in found}
    names = TREE.joint_names
    for (s, i, j), terms in np.ndenumerate(Entries(TREE, q, qd).coriolis_matrix):
        allowed = tolerances[s, f"(C + C')[{names[i]}][{names[j]}]"]
        assert allowed == pytest.approx(FACTOR * EPS * 2.0 * terms, rel=1e-9, abs=0.0)
