"""Compiled quantities of a tree: the same bits side by side as one at a time. Their numbers see test_answers."""

import numpy as np
import pytest
from trees import random_states, small_tree

import tmt
from tmt import literal
from tmt.compiled import evaluator
from tmt.compiled.evaluator import TERMS
from tmt.compiled.sine import LIMIT
from tmt.equations import composite, method

SMALL = small_tree()
COUNT = 19  # two blocks and a rest, in any register


def rows_of(compiled, states):
    out = np.full((len(states[0]), compiled.size), np.nan)
    compiled.each(*states, out)
    return out


def in_columns(compiled, states):
    out = np.full((compiled.size, len(states[0])), np.nan)
    compiled.lanes(*(np.ascontiguousarray(x.T) for x in states), out)
    return out.T


def test_states_side_by_side_have_the_bits_of_each_alone(rng):
    states, compiled = random_states(rng, SMALL, COUNT), evaluator(SMALL, TERMS)
    M, h = (literal.mass_matrix(states[0], SMALL), literal.bias(*states[:2], SMALL))
    wanted, found = np.hstack([M[:, *np.triu_indices(len(SMALL.axis))], h]), rows_of(compiled, states)
    assert np.abs(found - wanted).max() <= 64 * np.finfo(float).eps * np.abs(wanted).max() and compiled.operations > 0
    for count in (*range(10), 17, COUNT):
        assert np.array_equal(in_columns(compiled, [rows[:count] for rows in states]), found[:count])
        if count:
            assert np.array_equal(compiled.of_rows(*(rows[:count] for rows in states)), found[:count])
    assert compiled.chain(*(rows[0] for rows in states), 3) == pytest.approx(found[0].sum(), rel=1e-9)


def test_of_a_wrong_state_there_is_no_number(rng):
    """Nor has it a part in those beside it; beyond 2^49 rad there is no sine."""
    states, compiled = random_states(rng, SMALL, COUNT), evaluator(SMALL, "acceleration")
    right = rows_of(compiled, states)
    hinge = next(joint for joint in SMALL.coordinates.joints if joint.kind == "hinge")
    for part, place, value in ((0, hinge.q.start, 4.0 * LIMIT), (1, 0, np.inf), (1, 2, np.nan), (2, 1, -np.inf)):
        wrong = [rows.copy() for rows in states]
        wrong[part][5, place] = value
        found = rows_of(compiled, wrong)
        assert not np.isfinite(found[5]).all() and compiled.of_rows(*wrong) is None
        assert np.array_equal(in_columns(compiled, wrong), found, equal_nan=True)
        assert np.array_equal(np.delete(found, 5, 0), np.delete(right, 5, 0))


def test_another_form_of_mbar_and_h_is_traced_and_not_kept(folder, rng):
    def own(tree, q, qd):
        M, h = composite.mass_matrix_and_bias(tree, q, qd)
        return [[2.0 * x for x in row] for row in M], [2.0 * x for x in h]

    states = list(rng.uniform(-2, 2, (3, 5, 3)))
    doubled = evaluator(tmt.ARM, "acceleration", own)
    wanted = literal.acceleration(states[0], states[1], states[2] / 2.0)
    assert rows_of(doubled, states) == pytest.approx(wanted, rel=1e-10, abs=1e-10) and not list(folder.glob("*"))
    literally = evaluator(tmt.ARM, TERMS, method.mass_matrix_and_bias)
    assert literally.operations > 2 * evaluator(tmt.ARM, TERMS).operations
