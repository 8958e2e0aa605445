"""Diagnoses of the arm, for the tests of this folder: states, tolerances and values of its Mbar and h."""

import numpy as np

import tmt
from compare.diagnosis import diagnose, packed
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR

STATES = 16


def states(tree=tmt.ARM, seed=0, count=STATES):
    """Positions and rates."""
    return np.random.default_rng(seed).uniform(-3.0, 3.0, (2, count, len(tree.axis)))


def tolerance(tree, q, qd):
    """Of each entry of Mbar and h."""
    scale, nv = Entries(tree, q, qd), len(tree.axis)
    M = np.broadcast_to(scale.mass_matrix, (len(q), nv, nv))
    return FACTOR * EPS * packed(M, np.broadcast_to(scale.bias, (len(q), nv)), nv, len(q))


def values(tree=tmt.ARM, q=None, qd=None):
    """Mbar and h of a tree, (states, entries), at the arm's states where none are given."""
    q, qd = states() if q is None else (q, qd)
    return packed(tmt.mass_matrix(q, tree), tmt.bias(q, qd, tree), len(tree.axis), len(q))


def diagnosis(given, tree=tmt.ARM, seed=0, **more):
    """Of values, (states, entries), or of those of another Tree."""
    q, qd = states(tree, seed)
    given = values(given, q, qd) if isinstance(given, tmt.Tree) else given
    return diagnose(tree, tree.hinge_names, q, qd, given, tolerance(tree, q, qd), **more)
