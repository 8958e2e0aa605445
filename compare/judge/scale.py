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


def reaches(tree: tmt.Tree, q: ArrayLike | None = None) -> np.ndarray:
    """Largest possible distance of each centre of mass from the origin, m, (m,): lengths added along the tree.

    q: positions (..., nq): the displacements of slides are added, and the shape is (..., m).
    """
    q = np.array(tree.zero) if q is None else np.asarray(q, float)
    to_joint = []
    for i, (kind, at, _) in enumerate(tree.coordinates.joints):
        moved = np.abs(q[..., at.start] - tree.reference[i]) if kind == "slide" else np.zeros(q.shape[:-1])
        before = to_joint[tree.parent[i]] if tree.parent[i] >= 0 else 0.0
        to_joint.append(before + np.linalg.norm(tree.offset[i]) + moved)
    to_joint.append(np.zeros(q.shape[:-1]))  # of the world, joint -1
    bodies = zip(tree.body_hinge, tree.com)
    return np.stack([to_joint[joint] + np.linalg.norm(com) for joint, com in bodies], axis=-1)


def gravity_scale(tree: tmt.Tree, q: ArrayLike | None = None) -> float | np.ndarray:
    """Sum of m g reach, N m or J; with q (..., nq) the reach at these positions of the slides, (...)."""
    sums = np.linalg.norm(tree.gravity) * (reaches(tree, q) @ np.array(tree.mass))
    return float(sums) if q is None else sums


def bias_scale(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Convective + Euler + gravity terms of the bias, each by its absolute value, N m, (states,)."""
    parts, shape = method.bodies(tree, list(q.T), list(qd.T)), q.shape[:1]
    T, B = (gather((zip(*columns) for columns in both), shape) for both in zip(*((b.T, b.B) for b in parts)))
    v_conv, w_conv, omega = (
        gather(map(list, vectors), shape) for vectors in zip(*((b.v_conv, b.w_conv, b.omega) for b in parts))
    )
    inertia = np.array(tree.inertia)
    moments = np.abs(np.einsum("bij,sbj->sbi", inertia, w_conv))
    moments += np.abs(np.cross(omega, np.einsum("bij,sbj->sbi", inertia, omega)))
    newton = np.einsum("sbci,b,sbc->si", np.abs(T), tree.mass, np.abs(v_conv))
    euler = np.einsum("sbci,sbc->si", np.abs(B), moments)
    return (newton + euler).max(axis=1) + gravity_scale(tree, q)


def mass_scale(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """Largest entry of Mbar, kg m2, (states,)."""
    return np.abs(literal.mass_matrix(q, tree)).max(axis=(1, 2))


def acceleration_scale(tree: tmt.Tree, q: np.ndarray, force: ArrayLike, size: ArrayLike | None = None) -> np.ndarray:
    """|Mbar^-1| (|Mbar| |qdd| + force), rad/s2, (states,): the effect of errors of eps in Mbar and in the force on qdd.

    force: scale of the forces, N m, (states,). size: |qdd|; None: its bound |Mbar^-1| force, for which the scale is
    (cond(Mbar) + 1) |Mbar^-1| force. Norms of Mbar are its eigenvalues.
    """
    eigenvalues = np.linalg.eigvalsh(literal.mass_matrix(q, tree))
    size = force / eigenvalues[:, 0] if size is None else size
    return (eigenvalues[:, -1] * size + force) / eigenvalues[:, 0]


def gain_scale(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """|P| |q| + |S| |qd| of a controller's gains, N m or N, (..., nv)."""
    positions = np.abs(q)[..., [at.start for at, by in tree.coordinates.places for _ in range(by.start, by.stop)]]
    gains = zip((tree.position_gain, tree.speed_gain), (positions, np.abs(qd)))
    return sum((values @ np.abs(gain).T for gain, values in gains if gain), np.zeros(np.shape(qd)))


def spring_scale(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """k (|q| + |rest|) of the springs, N m or N, (..., nv); for a ball, which turns by pi at most, k pi."""
    scale = np.zeros((*q.shape[:-1], tree.coordinates.nv))
    for k, (kind, at, by) in zip(tree.stiffness, tree.coordinates.joints):
        scale[..., by] = k * (np.pi if kind == "ball" else np.abs(q[..., at]) + np.abs(tree.rest[at.start]))
    return scale
