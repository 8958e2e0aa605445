"""The stick figure of a robot: points, sticks and the view."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from tmt import literal
from tmt.derivation import method

from .case import Robot
from .coordinates import free_joints

Sticks = list[tuple[int, int]]
ELEVATION, AZIMUTH = 20.0, -70.0  # deg, of the camera
_E, _A = np.radians([ELEVATION, AZIMUTH])
RIGHTWARD = np.array([-np.sin(_A), np.cos(_A), 0.0])  # of the camera
UPWARD = np.array([-np.sin(_E) * np.cos(_A), -np.sin(_E) * np.sin(_A), np.cos(_E)])


def stick_figure(robot: Robot, q: np.ndarray, crosses: bool = False) -> tuple[np.ndarray, Sticks]:
    """Points in the world, (times, points, 3) m, at q (times, nq), and the pairs of points with a stick.

    The landmarks; else the joints, and the centres of mass after the last joints; the slides of a free joint
    are left out. crosses: with the axes of balls at the end of a chain, to show their rotation.
    """
    if robot.landmarks:
        landmarks = [along_run(point, q) for point in robot.landmarks(q)]
        sticks = [(k, k + 1) for k in range(len(landmarks) - 1)]
        return np.stack(landmarks, axis=1).astype(float), sticks
    tree, free = robot.tree, {i + k for i in free_joints(robot.tree) for k in range(4)}
    frames = method.joint_frames(tree, list(q.T))
    points = [along_run(frame.origin, q) for frame in frames]
    links = [(up, j) for j, up in enumerate(tree.parent) if up >= 0 and not {j, up} <= free]
    coms = literal.com_positions(tree, q)
    for body, joint in enumerate(tree.body_joint):
        if joint >= 0 and joint not in tree.parent:
            ends = [coms[:, body]]
            if crosses and tree.kind[joint] == "ball":  # radius of a solid sphere of this mass and inertia
                radius = np.sqrt(np.trace(tree.inertia[body]) / (1.2 * tree.mass[body]))
                ends += [points[joint] + radius * along_run(axis, q) for axis in frames[joint].axes]
            links += [(joint, len(points) + k) for k in range(len(ends))]
            points += ends
    joined = sorted({point for link in links for point in link})
    pairs = [(joined.index(start), joined.index(end)) for start, end in links]
    return np.stack([points[k] for k in joined], axis=1).astype(float), pairs


def along_run(vector: Iterable[ArrayLike], q: np.ndarray) -> np.ndarray:
    """A vector whose parts are numbers or arrays (times,), as (times, 3)."""
    return np.stack([np.broadcast_to(part, len(q)) for part in vector], axis=-1)


def as_seen(points: np.ndarray) -> np.ndarray:
    """Points in the world, (..., 3) m, in the view: right and up, (..., 2) m."""
    return points @ np.stack([RIGHTWARD, UPWARD], axis=1)
