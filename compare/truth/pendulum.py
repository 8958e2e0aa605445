"""The exact motion of a pendulum, by elliptic functions."""

import numpy as np
from scipy.special import ellipj, ellipkinc

import tmt


def pendulum(tree: tmt.Tree) -> tuple[float, float]:
    """The hanging angle of a Tree with one hinge, rad, and the frequency of small swings about it, rad/s.

    Mechanics of a rigid body on a fixed axis, from the numbers of the Tree and not by the method:
    I qdd = -|sum m r| |g| sin(q - hanging), with r and g across the axis and I the moment of inertia.
    """
    axis, gravity = np.array(tree.axis[0]), np.array(tree.gravity)
    inertia, moment = tree.armature[0], np.zeros(3)
    bodies = zip(tree.body_joint, tree.mass, np.array(tree.com), np.array(tree.inertia))
    for hinge, mass, com, tensor in bodies:
        if hinge == 0:
            inertia += axis @ tensor @ axis + mass * np.sum(np.cross(axis, com) ** 2)
            moment += mass * com
    across, pull = (v - axis * (axis @ v) for v in (moment, gravity))
    hanging = np.arctan2(axis @ np.cross(across, pull), across @ pull)
    frequency = np.sqrt(np.linalg.norm(across) * np.linalg.norm(pull) / inertia)
    return float(hanging + tree.reference[0]), float(frequency)


def swing(t: np.ndarray, q: float, qd: float, hanging: float, frequency: float) -> np.ndarray:
    """Angle of a pendulum that started at q, qd (rad, rad/s), at times t in s: rad.

    sin(theta / 2) = k sn(frequency t + u, k), theta from hanging; k = sin(half the amplitude). NaN if it turns
    over (k of 1 or more). Whittaker, Analytical Dynamics, 44.
    """
    theta = np.remainder(q - hanging + np.pi, 2 * np.pi) - np.pi
    height, speed = np.sin(theta / 2), qd / (2 * frequency)
    k = np.hypot(height, speed)
    sn = ellipj(frequency * t + ellipkinc(np.arctan2(height, speed), k * k), k * k)[0]
    return q - theta + 2 * np.arcsin(k * sn) if k < 1.0 else np.full_like(t, np.nan)
