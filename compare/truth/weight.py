"""What gravity does to a posture, and its derivative, in closed form: at once for any number of joints."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import tmt
from tmt.equations import method

from .derivative import moving, slopes


class Weight(NamedTuple):
    """The torque that holds a posture, (nv,) N m or N, and its derivative along movements of the joints, (nv, nv)."""

    torque: np.ndarray
    slope: np.ndarray
    size: float  # of the largest torque that could be, in whatever direction gravity is


def weight(tree: tmt.Tree, q: np.ndarray, mass: Sequence[float], gravity: Sequence[float]) -> Weight:
    """Of bodies of these masses, (bodies,) kg, under gravity, (3,) m/s2.

    With the mass m that a joint carries, and its first moment s about the joint, force F = m a along a slide's axis a, a x s
    about that of a hinge: the torque is -g . F. What a joint carries turns about its axis w with all vectors on it, by w x F.
    """
    frames, joints = method.joint_frames(tree, q.tolist()), tree.coordinates.joints
    n = len(frames)
    carries = np.eye(n, dtype=bool)  # [i, j]: joint i carries joint j, or is it
    for j, before in enumerate(tree.parent):
        if before >= 0:
            carries[:, j] |= carries[:, before]
    masses, moments = np.zeros(n), np.zeros((n, 3))
    for m, com, j in zip(mass, tree.com, tree.body_hinge):
        if j >= 0:
            masses[j] += m
            moments[j] += m * (np.array([*frames[j].origin]) + np.array([[*row] for row in frames[j].turn]) @ com)
    masses, moments = carries @ masses, carries @ moments
    joint = np.repeat(np.arange(n), [by.stop - by.start for _, _, by in joints])
    axes = np.array([[*axis] for frame in frames for axis in frame.axes])
    slides = np.array([frames[j].slides for j in joint])[:, None]
    about = moments[joint] - masses[joint, None] * np.array([[*frames[j].origin] for j in joint])
    forces = np.where(slides, masses[joint, None] * axes, np.cross(axes, about))
    turned = -np.where(slides, 0.0, axes) @ np.cross(forces, gravity).T  # [outer, inner]
    outer = carries[np.ix_(joint, joint)]
    slope = np.where(outer.T, turned.T, np.where(outer, turned, 0.0))
    size = np.linalg.norm(forces, axis=1).max() * np.linalg.norm(gravity)
    return Weight(-forces @ np.asarray(gravity, float), slope, float(size))


def spring_slope(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """The derivative of the torque of the joints' springs along movements, (nv, nv); of balls by dual numbers."""
    if any(k and kind == "ball" for k, kind in zip(tree.stiffness, tree.kind)):
        moved = moving(tree, q, np.eye(len(tree.axis)))
        return np.array(slopes(moved, method.spring_torque(tree, moved)))
    return np.diag(tmt.methods.by_speed(tree, tree.stiffness)).astype(float)
