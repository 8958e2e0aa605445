"""What the scales of entries.py are made of: from the stated numbers and TMT's own terms, for each state."""

import numpy as np
from numpy.typing import ArrayLike

import tmt
from tmt.derivation import method
from tmt.literal import gather

EPS = float(np.finfo(float).eps)
FACTOR = 64


def levers(tree: tmt.Tree, q: ArrayLike | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Largest possible distances of centres of mass, m: from each hinge's axis or ball, and from the origin.

    Lengths added along the tree, (..., m, joints), 0 for a joint that does not turn the body, and (..., m).
    q: positions (..., nq), of which the displacements of slides are added; None: none are displaced.
    """
    q = np.array(tree.zero) if q is None else np.asarray(q, float)
    links = np.zeros((*q.shape[:-1], len(tree.kind)))  # of each joint, from the joint before it
    for i, joint in enumerate(tree.coordinates.joints):
        moved = np.abs(q[..., joint.q.start] - tree.reference[i]) if joint.kind == "slide" else 0.0
        links[..., i] = np.linalg.norm(tree.offset[i]) + moved
    from_joints = np.zeros((*q.shape[:-1], len(tree.mass), len(tree.kind)))
    from_origin = np.zeros((*q.shape[:-1], len(tree.mass)))
    for b, (i, com) in enumerate(zip(tree.body_joint, tree.com)):
        from_origin[..., b] = np.linalg.norm(com)
        while i >= 0:
            if tree.kind[i] != "slide":
                from_joints[..., b, i] = from_origin[..., b]
            from_origin[..., b] += links[..., i]
            i = tree.parent[i]
    return from_joints, from_origin


def from_centre(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """The largest distance of each centre of mass from that of all bodies, m, (m,), at q (states, nq)."""
    places, mass = tmt.com_positions(tree, q), np.array(tree.mass)
    apart = places - np.einsum("b,sbc->sc", mass / (mass.sum() or 1.0), places)[:, None]
    # a run that diverges has no distance
    return np.asarray(np.fmax.reduce(np.linalg.norm(apart, axis=2), axis=0, initial=0.0))


def gravity_scale(tree: tmt.Tree, q: ArrayLike | None = None) -> float | np.ndarray:
    """Sum of m g times the largest distance from the origin, N m or J; at q (..., nq): (...)."""
    sums = np.linalg.norm(tree.gravity) * (levers(tree, q)[1] @ np.array(tree.mass))
    return float(sums) if q is None else sums


def motion_scale(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Convective and Euler terms of each entry of the bias, absolute values, N m or N, (states, nv)."""
    bodies, inertia = method.bodies(tree, list(q.T), list(qd.T)), np.array(tree.inertia)
    terms = [[getattr(body, name) for body in bodies] for name in ("T", "B", "v_conv", "w_conv", "omega")]
    T, B, v_conv, w_conv, omega = (gather(term, q.shape[:1]) for term in terms)
    moments = np.abs(np.einsum("bij,sbj->sbi", inertia, w_conv))
    moments += np.abs(np.cross(omega, np.einsum("bij,sbj->sbi", inertia, omega)))
    newton = np.einsum("sbic,b,sbc->si", np.abs(T), tree.mass, np.abs(v_conv))
    euler = np.einsum("sbic,sbc->si", np.abs(B), moments)
    return newton + euler


def gain_scale(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """|P| |q| + |S| |qd| of a controller's gains, N m or N, (..., nv)."""
    scale, positions = np.zeros(np.shape(qd)), np.abs(q)[..., tree.coordinates.first_positions]
    for gain, values in ((tree.position_gain, positions), (tree.speed_gain, np.abs(qd))):
        if gain:
            scale += values @ np.abs(gain).T
    return scale


def spring_scale(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """k (|q| + |rest|) of the springs, N m or N, (..., nv); for a ball, which turns by pi at most, k pi."""
    scale = np.zeros((*q.shape[:-1], tree.coordinates.nv))
    for k, joint in zip(tree.stiffness, tree.coordinates.joints):
        is_ball = joint.kind == "ball"
        stretch = np.pi if is_ball else np.abs(q[..., joint.q]) + np.abs(tree.rest[joint.q.start])
        scale[..., joint.qd] = k * stretch
    return scale
