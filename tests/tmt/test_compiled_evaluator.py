"""Compiled quantities of a tree: the numbers of the literal form and of many digits, side by side as one at a time."""

import numpy as np
import pytest
from trees import large_tree, random_states, small_tree

import tmt
from tmt import literal
from tmt.compiled import evaluator
from tmt.compiled.evaluator import TERMS
from tmt.compiled.sine import LIMIT
from tmt.equations import composite, method
from tmt.equations.quantities import QUANTITIES

EPS = np.finfo(float).eps
SMALL, LARGE = small_tree(), large_tree()
COUNT = 19  # two blocks and a rest, in any register


def columns(arrays):
    return [np.ascontiguousarray(x.T) for x in arrays]


def rows_of(compiled, states):
    out = np.full((len(states[0]), compiled.size), np.nan)
    compiled.each(*states, out)
    return out


def in_columns(compiled, states):
    out = np.full((compiled.size, len(states[0])), np.nan)
    compiled.lanes(*columns(states), out)
    return out.T


def expected(tree, quantity, q, qd, tau):
    """The literal form's values, flat."""
    if quantity == TERMS:
        M, h = (expected(tree, name, q, qd, tau) for name in ("mass_matrix", "bias"))
        n = len(tree.axis)
        return np.hstack([M.reshape(-1, n, n)[:, *np.triu_indices(n)], h])
    given = [x for name, x in (("q", q), ("qd", qd), ("tau", tau)) if name in QUANTITIES[quantity].takes]
    found = getattr(literal, quantity)(*given, tree)
    parts = found if isinstance(found, tuple) else (found,)
    return np.hstack([part.reshape(len(q), -1) for part in parts])


def slack(tree, quantity, q) -> float:
    """What rounding may leave, in units of the largest number."""
    condition = np.linalg.cond(literal.mass_matrix(q, tree)).max() if quantity == "acceleration" else 1.0
    return 64 * EPS * condition


@pytest.mark.parametrize("quantity", ["acceleration", "jacobians", TERMS])  # of the others see test_answers
def test_a_quantity_of_every_kind_of_joint(quantity, rng):
    states, compiled = random_states(rng, SMALL, COUNT), evaluator(SMALL, quantity)
    wanted, found = expected(SMALL, quantity, *states), rows_of(compiled, states)
    allowed = slack(SMALL, quantity, states[0]) * np.abs(wanted).max()
    assert compiled.size == wanted.shape[1] and compiled.operations > 0
    assert np.abs(found - wanted).max() <= allowed
    for count in (*range(10), 17, COUNT):
        assert np.array_equal(in_columns(compiled, [rows[:count] for rows in states]), found[:count])
        if count:
            assert np.array_equal(compiled.of_rows(*(rows[:count] for rows in states)), found[:count])
    assert compiled.chain(*(rows[0] for rows in states), 3) == pytest.approx(found[0].sum(), rel=1e-9)


@pytest.mark.slow
def test_a_large_tree(rng):
    """Its code is cut into parts, and is in the articulated form."""
    states, compiled = random_states(rng, LARGE, 9), evaluator(LARGE, "acceleration")
    wanted, found = literal.acceleration(*states, LARGE), rows_of(compiled, states)
    assert np.abs(found - wanted).max() <= slack(LARGE, "acceleration", states[0]) * np.abs(wanted).max()
    assert np.array_equal(in_columns(compiled, states), found)
    states[0][:, :3] += 1e4  # far from the world no digit is lost
    assert np.array_equal(rows_of(compiled, states), found)


def test_of_a_wrong_state_there_is_no_number(rng):
    """Nor has it a part in those beside it; beyond 2^49 rad there is no sine."""
    states, compiled = random_states(rng, SMALL, COUNT), evaluator(SMALL, "acceleration")
    right = rows_of(compiled, states)
    hinge = next(joint for joint in SMALL.coordinates.joints if joint.kind == "hinge")
    for (part, place), value in {
        (0, hinge.q.start): 4.0 * LIMIT, (1, 0): np.inf, (1, 2): np.nan, (2, 1): -np.inf,
    }.items():  # fmt: skip
        wrong = [rows.copy() for rows in states]
        wrong[part][5, place] = value
        found = rows_of(compiled, wrong)
        assert not np.isfinite(found[5]).all() and compiled.of_rows(*wrong) is None
        assert np.array_equal(in_columns(compiled, wrong), found, equal_nan=True)
        assert np.array_equal(np.delete(found, 5, 0), np.delete(right, 5, 0))


@pytest.mark.parametrize("terms", [method.mass_matrix_and_bias, "own"])
def test_another_form_of_mbar_and_h_is_traced(terms, rng):
    def own(tree, q, qd):
        M, h = composite.mass_matrix_and_bias(tree, q, qd)
        return [[2.0 * x for x in row] for row in M], [2.0 * x for x in h]

    states = list(rng.uniform(-2, 2, (3, 5, 3)))
    fastest, other = (evaluator(tmt.ARM, TERMS, *which) for which in ((), (own if terms == "own" else terms,)))
    found, factor = rows_of(other, states), 2.0 if terms == "own" else 1.0
    assert found == pytest.approx(factor * rows_of(fastest, states), rel=1e-11, abs=1e-12)
    assert terms is not method.mass_matrix_and_bias or other.operations > 2 * fastest.operations
    qdd = evaluator(tmt.ARM, "acceleration", own if terms == "own" else terms)
    states[2] *= factor
    wanted = literal.acceleration(states[0], states[1], states[2] / factor)
    assert rows_of(qdd, states) == pytest.approx(wanted, rel=1e-10, abs=1e-10)
