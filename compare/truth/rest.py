"""What holds a posture at rest: gravity and springs, and their exact derivatives."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import tmt
from tmt.derivation import method
from tmt.derivation.dual import seeded
from tmt.methods import by_speed


def moving(tree: tmt.Tree, q, directions) -> list:
    """The position q, (nq,) of any scalars, as dual numbers with these slopes of movements, directions (nv,): (nq,)."""
    start = [float(x) for x in q] if isinstance(q, np.ndarray) else q
    return seeded(start, tree.coordinates.component_rates(start, list(directions)))


def holding(tree: tmt.Tree, q) -> list:
    """The holding torque against gravity, springs and a controller, N m, (nv,), over any scalar."""
    torque = method.bias(method.bodies(tree, q), tree.gravity)
    if tree.has_springs:
        torque = [a + b for a, b in zip(torque, method.spring_torque(tree, q))]
    return (
        [a + b for a, b in zip(torque, method.fed_back(tree, q, [0.0] * len(torque)))]
        if tree.has_gains
        else torque
    )


def slopes(seeds, values) -> list:
    """The derivatives of values along the directions of these dual numbers."""
    shape = np.shape(seeds[0].slope)
    derivatives = [seeds[0].parts(value)[1] for value in values]
    return [np.broadcast_to(slope, shape) if np.ndim(slope) < len(shape) else slope for slope in derivatives]


def carries(tree: tmt.Tree) -> np.ndarray:
    """[i, j]: whether joint i carries joint j, or is it."""
    carrying = np.eye(len(tree.parent), dtype=bool)
    for j, before in enumerate(tree.parent):
        if before >= 0:
            carrying[:, j] |= carrying[:, before]
    return carrying


class Weight(NamedTuple):
    """The torque that holds a posture against gravity, (nv,) N m or N, and its derivative along movements, (nv, nv)."""

    torque: np.ndarray
    slope: np.ndarray
    size: float  # the largest torque with gravity in any direction


def weight(tree: tmt.Tree, q: np.ndarray, mass: Sequence[float], gravity: Sequence[float]) -> Weight:
    """Of bodies of these masses, (bodies,) kg, under gravity, (3,) m/s2.

    With the mass m that a joint carries, and its first moment s about the joint, force F = m a along a slide's axis a, a x s
    about that of a hinge: the torque is -g . F. What a joint carries turns about its axis w with all vectors on it, by w x F.
    """
    frames, carrying = method.joint_frames(tree, q.tolist()), carries(tree)
    masses, moments = np.zeros(len(frames)), np.zeros((len(frames), 3))
    for m, com, j in zip(mass, tree.com, tree.body_joint):
        if j >= 0:
            masses[j] += m
            moments[j] += m * (
                np.array([*frames[j].origin]) + np.array([[*row] for row in frames[j].turn]) @ com
            )
    masses, moments = carrying @ masses, carrying @ moments
    joint = by_speed(tree, range(len(frames)))
    axes = np.array([[*axis] for frame in frames for axis in frame.axes])
    slides = np.array([frames[j].slides for j in joint])[:, None]
    about = moments[joint] - masses[joint, None] * np.array([[*frames[j].origin] for j in joint])
    forces = np.where(slides, masses[joint, None] * axes, np.cross(axes, about))
    turned = -np.where(slides, 0.0, axes) @ np.cross(forces, gravity).T  # [outer, inner]
    outer = carrying[np.ix_(joint, joint)]
    slope = np.where(outer.T, turned.T, np.where(outer, turned, 0.0))
    size = np.linalg.norm(forces, axis=1).max() * np.linalg.norm(gravity)
    return Weight(-forces @ np.asarray(gravity, float), slope, float(size))


def spring_slope(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """The derivative of the torque of the joints' springs along movements, (nv, nv); of balls by dual numbers."""
    if any(k and kind == "ball" for k, kind in zip(tree.stiffness, tree.kind)):
        moved = moving(tree, q, np.eye(len(tree.axis)))
        return np.array(slopes(moved, method.spring_torque(tree, moved)))
    return np.diag(by_speed(tree, tree.stiffness)).astype(float)
