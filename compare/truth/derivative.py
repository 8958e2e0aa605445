"""Exact derivatives of what holds a posture, along movements of its joints."""

import numpy as np

import tmt
from tmt import literal
from tmt.equations import method
from tmt.equations.dual import seeded


def stiffness(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """d(torque that holds)/dq at q, of gravity, springs and a controller, N m/rad, (nv, nv), by movements: exact.

    Of hinges without springs V is a + b cos q_i + c sin q_i in each angle; else by dual numbers.
    """
    if set(tree.kind) == {"hinge"} and not (tree.has_springs or tree.has_gains):
        quarter = np.pi / 2 * np.eye(len(q))
        return (literal.gravity_balance(q + quarter, tree) - literal.gravity_balance(q - quarter, tree)) / 2
    moved = moving(tree, q, np.eye(tree.coordinates.nv))
    return np.array(slopes(moved, holding(tree, moved)))


def moving(tree: tmt.Tree, q, directions) -> list:
    """The position q, (nq,) of any scalars, as dual numbers that move along directions, (nv,) of slopes: (nq,)."""
    start = [float(x) for x in q] if isinstance(q, np.ndarray) else q
    return seeded(start, tree.coordinates.component_rates(start, list(directions)))


def holding(tree: tmt.Tree, q) -> list:
    """The torque that holds a posture against gravity, springs and a controller, N m, (nv,), over any scalar."""
    torque = method.bias(method.bodies(tree, q), tree.gravity)
    if tree.has_springs:
        torque = [a + b for a, b in zip(torque, method.spring_torque(tree, q))]
    return [a + b for a, b in zip(torque, method.fed_back(tree, q, [0.0] * len(torque)))] if tree.has_gains else torque


def slopes(seeds, values) -> list:
    """The derivatives of values by what these seeds move along."""
    shape = np.shape(seeds[0].slope)
    found = [seeds[0].parts(value)[1] for value in values]
    return [np.broadcast_to(slope, shape) if np.ndim(slope) < len(shape) else slope for slope in found]
