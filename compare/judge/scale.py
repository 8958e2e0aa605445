"""Scales of tolerances: from the stated numbers and TMT's own terms, for each state.

A tolerance is 64 x eps x scale. The scale of a quantity is the sum of the absolute values of the terms that are added in it,
times the condition number of Mbar where a linear system is solved; it is never the quantity itself, which may be zero.
"""

import numpy as np
from numpy.typing import ArrayLike

import tmt
from tmt import literal
from tmt.derivation import method
from tmt.literal import gather

EPS = float(np.finfo(float).eps)
FACTOR = 64


def levers(tree: tmt.Tree, q: ArrayLike | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Largest possible distances of each centre of mass, m: from each hinge's axis or ball, and from the world's origin.

    Lengths added along the tree, (..., m, joints), 0 for a joint that does not turn the body, and (..., m). q: positions
    (..., nq), of which the displacements of slides are added; None: none are displaced. The first have no leading shape where
    no slide comes after a hinge.
    """
    q = np.array(tree.zero) if q is None else np.asarray(q, float)
    lengths = []  # of each joint, from the joint before it
    for i, joint in enumerate(tree.coordinates.joints):
        moved = np.abs(q[..., joint.q.start] - tree.reference[i]) if joint.kind == "slide" else 0.0
        lengths.append(np.linalg.norm(tree.offset[i]) + moved)
    from_joints = [[0.0] * len(lengths) for _ in tree.mass]
    from_origin = np.zeros((*q.shape[:-1], len(tree.mass)))
    for b, (joint, com) in enumerate(zip(tree.body_joint, tree.com)):
        distance = np.linalg.norm(com)
        while joint >= 0:
            if tree.kind[joint] != "slide":
                from_joints[b][joint] = distance
            distance = distance + lengths[joint]
            joint = tree.parent[joint]
        from_origin[..., b] = distance
    shape = np.broadcast_shapes(*(np.shape(distance) for row in from_joints for distance in row))
    columns = [[np.broadcast_to(distance, shape) for distance in row] for row in from_joints]
    return np.moveaxis(np.array(columns), (0, 1), (-2, -1)), from_origin


def gravity_scale(tree: tmt.Tree, q: ArrayLike | None = None) -> float | np.ndarray:
    """Sum of m g times the largest distance from the origin, N m or J; with q (..., nq) that of these positions, (...)."""
    sums = np.linalg.norm(tree.gravity) * (levers(tree, q)[1] @ np.array(tree.mass))
    return float(sums) if q is None else sums


def motion_scale(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Convective and Euler terms of each entry of the bias, by their absolute values, N m or N, (states, nv)."""
    parts, shape = method.bodies(tree, list(q.T), list(qd.T)), q.shape[:1]
    T, B = (gather((zip(*columns) for columns in both), shape) for both in zip(*((b.T, b.B) for b in parts)))
    vectors = zip(*((b.v_conv, b.w_conv, b.omega) for b in parts))
    v_conv, w_conv, omega = (gather(map(list, of_bodies), shape) for of_bodies in vectors)
    inertia = np.array(tree.inertia)
    moments = np.abs(np.einsum("bij,sbj->sbi", inertia, w_conv))
    moments += np.abs(np.cross(omega, np.einsum("bij,sbj->sbi", inertia, omega)))
    newton = np.einsum("sbci,b,sbc->si", np.abs(T), tree.mass, np.abs(v_conv))
    euler = np.einsum("sbci,sbc->si", np.abs(B), moments)
    return newton + euler


def mass_scale(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """Largest entry of Mbar, kg m2, (states,)."""
    return np.abs(literal.mass_matrix(q, tree)).max(axis=(1, 2))


def acceleration_scale(
    tree: tmt.Tree, q: np.ndarray, force: ArrayLike, size: ArrayLike | None = None
) -> np.ndarray:
    """|Mbar^-1| (|Mbar| |qdd| + force), rad/s2, (states,): the effect of errors of eps in Mbar and in the force on qdd.

    force: scale of the forces, N m, (states,). size: |qdd|; None: its bound |Mbar^-1| force, for which the scale is
    (cond(Mbar) + 1) |Mbar^-1| force. Norms of Mbar are its eigenvalues.
    """
    eigenvalues = np.linalg.eigvalsh(literal.mass_matrix(q, tree))
    size = force / eigenvalues[:, 0] if size is None else size
    return (eigenvalues[:, -1] * size + force) / eigenvalues[:, 0]


def gain_scale(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """|P| |q| + |S| |qd| of a controller's gains, N m or N, (..., nv)."""
    positions = np.abs(q)[..., tree.coordinates.first_positions]
    gains = zip((tree.position_gain, tree.speed_gain), (positions, np.abs(qd)))
    return sum((values @ np.abs(gain).T for gain, values in gains if gain), np.zeros(np.shape(qd)))


def spring_scale(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """k (|q| + |rest|) of the springs, N m or N, (..., nv); for a ball, which turns by pi at most, k pi."""
    scale = np.zeros((*q.shape[:-1], tree.coordinates.nv))
    for k, joint in zip(tree.stiffness, tree.coordinates.joints):
        scale[..., joint.qd] = k * (
            np.pi if joint.kind == "ball" else np.abs(q[..., joint.q]) + np.abs(tree.rest[joint.q.start])
        )
    return scale
