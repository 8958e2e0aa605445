"""M and h with a made fault: by tmt's composite form, by the second derivation, in joints of one's own."""

from typing import Protocol

import numpy as np

import tmt
from tmt.equations.composite import mass_matrix_and_bias

from .derivation import by_lagrange, derived


class Made(Protocol):
    """What is made of which Tree, see faults."""

    tree: tmt.Tree
    make: tuple


def values_of_fault(fault: Made, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """M (states, nv, nv) and h (states, nv) as they are with a fault."""
    how, *about = fault.make
    if how == "tree":  # a changed Tree, by tmt's composite form
        return by_composite(about[0], q, qd)
    if how == "derived":
        return derived(fault.tree, q, qd, *about)
    if how == "lagrange":
        return by_lagrange(fault.tree, q, qd, *about)
    if how == "joints":
        return in_own_joints(fault.tree, q, qd, *about)
    M, h = by_composite(fault.tree, q, qd)
    if how == "negative":
        return M, -h
    if how == "damped":
        return M, h + about[0] * np.array(fault.tree.damping) * qd
    entry, factor = about
    if entry[0] == "M":
        M[:, entry[1], entry[2]] *= factor
        M[:, entry[2], entry[1]] = M[:, entry[1], entry[2]]
    else:
        h[:, entry[1]] += (factor - 1.0) * part_of_bias(fault.tree, q, qd, *entry[1:])
    return M, h


def by_composite(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    M, h = mass_matrix_and_bias(tree, list(q.T), list(qd.T))
    states = len(q)
    M = np.stack([np.stack([np.broadcast_to(x, states) for x in row], axis=-1) for row in M], axis=1)
    return np.array(M), np.stack([np.broadcast_to(x, states) for x in h], axis=-1).copy()


def in_own_joints(tree, q, qd, order, sense, zero, of_q, of_qd) -> tuple[np.ndarray, np.ndarray]:
    """In joints of one's own: own = (sense x model's + zero) x unit, in this order; q and qd are taken as these."""
    sense, back = np.array(sense), np.argsort(order)
    model_q, model_qd = ((q / of_q - zero) * sense)[:, back], (qd / of_qd * sense)[:, back]
    M, h = by_composite(tree, model_q, model_qd)
    return M[:, order][:, :, order] * sense[:, None] * sense, h[:, order] * sense


def part_of_bias(tree, q, qd, i: int, *rates: int) -> np.ndarray:
    """Of h_i the part at rest, or that of the product of two rates, (states,)."""

    def h(*at):
        return by_composite(tree, q, np.broadcast_to(sum((np.eye(qd.shape[1])[j] for j in at), 0.0 * qd[0]), qd.shape))[
            1
        ][:, i]

    if not rates:
        return h()
    j, k = rates
    coefficient = h(j) - h() if j == k else h(j, k) - h(j) - h(k) + h()
    return coefficient * qd[:, j] * qd[:, k]
