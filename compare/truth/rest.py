"""What holds a posture at rest: gravity and springs, their exact derivatives, and where a robot rests without torque."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

import tmt
from tmt import literal
from tmt.equations import method
from tmt.equations.dual import seeded

from ..robots.case import Coordinates

BALANCED = 1e-13  # of the largest torque of gravity and springs on the way: less is rounding
MOST_TRIED = 100  # postures on the way down
FARTHEST = 0.5  # rad or m of one joint in a step
ASIDE = 0.1  # rad or m, along the unstable mode of a saddle
FLAT = 1e-6  # of the largest stiffness over inertia: less is zero


def stiffness(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """d(holding torque)/dq at q, of gravity, springs and a controller, N m/rad, (nv, nv), by movements: exact.

    Of hinges without springs V is a + b cos q_i + c sin q_i in each angle; else by dual numbers.
    """
    if set(tree.kind) == {"hinge"} and not (tree.has_springs or tree.has_gains):
        quarter = np.pi / 2 * np.eye(len(q))
        return (literal.gravity_balance(q + quarter, tree) - literal.gravity_balance(q - quarter, tree)) / 2
    moved = moving(tree, q, np.eye(tree.coordinates.nv))
    return np.array(slopes(moved, holding(tree, moved)))


def moving(tree: tmt.Tree, q, directions) -> list:
    """The position q, (nq,) of any scalars, as dual numbers with these slopes of movements, directions (nv,): (nq,)."""
    start = [float(x) for x in q] if isinstance(q, np.ndarray) else q
    return seeded(start, tree.coordinates.component_rates(start, list(directions)))


def holding(tree: tmt.Tree, q) -> list:
    """The holding torque against gravity, springs and a controller, N m, (nv,), over any scalar."""
    torque = method.bias(method.bodies(tree, q), tree.gravity)
    if tree.has_springs:
        torque = [a + b for a, b in zip(torque, method.spring_torque(tree, q))]
    return [a + b for a, b in zip(torque, method.fed_back(tree, q, [0.0] * len(torque)))] if tree.has_gains else torque


def slopes(seeds, values) -> list:
    """The derivatives of values along the directions of these dual numbers."""
    shape = np.shape(seeds[0].slope)
    derivatives = [seeds[0].parts(value)[1] for value in values]
    return [np.broadcast_to(slope, shape) if np.ndim(slope) < len(shape) else slope for slope in derivatives]


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


def at_rest(tree: tmt.Tree, q: np.ndarray) -> np.ndarray | None:
    """The stable posture (nq,), rad or m, at which it rests without torque, downhill from q. None: there is none.

    Newton's method in the modes of the mass matrix at q, with the absolute value of each stiffness, so that it never climbs.
    """
    coordinates = Coordinates(tree.hinge_names, tree.kind)
    largest, height, inertia = 0.0, potential(tree, q), literal.mass_matrix(q, tree)
    for _ in range(MOST_TRIED):
        force = -literal.gravity_balance(q, tree) - literal.spring_torque(q, tree)
        K = stiffness(tree, q)
        squares, shapes = eigh(0.5 * (K + K.T), inertia)
        flat = FLAT * np.abs(squares).max()
        largest = max(largest, np.abs(force).max())
        if np.abs(force).max() <= BALANCED * largest:
            if squares[0] >= -flat:
                return q
            down = ASIDE * shapes[:, 0] / np.abs(shapes[:, 0]).max()
        else:
            down = shapes @ (shapes.T @ force / np.maximum(np.abs(squares), max(flat, 1e-300)))
            down *= min(1.0, FARTHEST / np.abs(down).max())
        for _ in range(40):
            lower = coordinates.move(q, down)
            if potential(tree, lower) < height:
                break
            down = 0.5 * down
        else:
            # doubles cannot represent a lower posture
            return q if squares[0] >= -flat and np.abs(force).max() <= 1e6 * BALANCED * largest else None
        q, height = lower, potential(tree, lower)
    return None


def potential(tree: tmt.Tree, q: np.ndarray) -> float:
    """Of gravity and springs, J."""
    return float(literal.potential_energy(q, tree))
