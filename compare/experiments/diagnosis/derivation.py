"""A second derivation of Mbar and h, in the world's axes and in NumPy alone, in which single steps can be done wrongly.

It shares nothing with tmt or with the search but the numbers of the Tree: faults that are made here are not made by what
looks for them.
"""

from collections.abc import Mapping

import numpy as np

import tmt

ALL_TERMS = ("translation", "rotation", "gravity", "convective", "Euler", "gyroscopic")


class Walk:
    """Every body's place and motion at qdd = 0, at states q, qd (states, nv) of hinges and slides, in the world's axes."""

    def __init__(self, tree: tmt.Tree, q: np.ndarray, qd: np.ndarray):
        states, nv = q.shape
        self.tree, self.states, self.nv = tree, states, nv
        zero = np.zeros((states, 3))
        world = (zero, np.broadcast_to(np.eye(3), (states, 3, 3)), zero, zero, zero)
        self.joints = []  # origin, turn, angular velocity, acceleration of the origin, angular acceleration
        self.axes, self.slides = [], [kind == "slide" for kind in tree.kind]
        for i, parent in enumerate(tree.parent):
            x, R, w, a, spin_up = self.joints[parent] if parent >= 0 else world
            axis, angle, rate = R @ np.array(tree.axis[i]), q[:, i] - tree.reference[i], qd[:, i, None]
            arm = R @ np.array(tree.offset[i])
            if self.slides[i]:
                arm = arm + axis * angle[:, None]
            x, a = x + arm, a + np.cross(spin_up, arm) + np.cross(w, np.cross(w, arm))
            if self.slides[i]:
                a = a + 2.0 * np.cross(w, axis * rate)
                self.joints.append((x, R, w, a, spin_up))
            else:
                spin_up = spin_up + np.cross(w, axis * rate)
                self.joints.append((x, R @ turning_by(np.array(tree.axis[i]), angle), w + axis * rate, a, spin_up))
            self.axes.append(axis)
        self.world = world

    def body(self, b: int):
        """CoM, turn, angular velocity, acceleration of the CoM, angular acceleration, and the columns of T and B."""
        joint = self.tree.body_hinge[b]
        x, R, w, a, spin_up = self.joints[joint] if joint >= 0 else self.world
        arm = R @ np.array(self.tree.com[b])
        x, a = x + arm, a + np.cross(spin_up, arm) + np.cross(w, np.cross(w, arm))
        T, B = np.zeros((2, self.states, 3, self.nv))
        while joint >= 0:
            axis = self.axes[joint]
            if self.slides[joint]:
                T[:, :, joint] = axis
            else:
                T[:, :, joint], B[:, :, joint] = np.cross(axis, x - self.joints[joint][0]), axis
            joint = self.tree.parent[joint]
        return R, w, a, spin_up, T, B


def turning_by(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rodrigues' rotation, (states, 3, 3)."""
    K = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * K + (1.0 - c) * (K @ K)


def derived(
    tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, factors: Mapping = {}, slip: str = "", bodies: tuple = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Mbar (states, nv, nv) and h (states, nv), with factors {(body, term): number} and one slip in some bodies."""
    walk, g = Walk(tree, q, qd), np.array(tree.gravity)
    M, h = np.zeros((len(q), walk.nv, walk.nv)), np.zeros((len(q), walk.nv))
    M += np.diag(tree.armature)
    single = (
        [Walk(tree, q, np.where(np.arange(walk.nv) == j, qd, 0.0)) for j in range(walk.nv)] if "rates" in slip else []
    )
    for b, mass in enumerate(tree.mass):
        R, w, a, spin_up, T, B = walk.body(b)
        factor = {term: factors.get((b, term), 1.0) for term in ALL_TERMS}
        inertia = np.array(tree.inertia[b])
        Rt, here = np.swapaxes(R, 1, 2), b in bodies
        I = R @ inertia @ Rt
        if here and slip == "not turned":
            I = np.broadcast_to(inertia, I.shape)
        elif here and slip == "turned the wrong way":
            I = Rt @ inertia @ R
        elif here and slip == "about the joint":
            c = np.array(tree.com[b])
            I = R @ (inertia + mass * (c @ c * np.eye(3) - np.outer(c, c))) @ Rt
        elif here and slip == "R for R'":  # the components in body axes are taken by R where R' is right
            w, spin_up, B = (R @ R @ w[..., None])[..., 0], (R @ R @ spin_up[..., None])[..., 0], R @ R @ B
        elif here and slip.startswith("exchanged"):
            order = [0, 1, 2]
            i, j = map("xyz".index, slip.split()[1:])
            order[i], order[j] = j, i
            I = R @ inertia[order][:, order] @ Rt
        elif here and "rates" in slip:
            alone = [one.body(b) for one in single]
            a_alone, spin_up_alone = sum(one[2] for one in alone), sum(one[3] for one in alone)
            a = {"products of rates out of v": a_alone, "half the products of rates in v": (a + a_alone) / 2.0,
                 "squares of rates out of v": a - a_alone, "products of rates out of both": a_alone}.get(slip, a)  # fmt: skip
            spin_up = (
                spin_up_alone if slip in ("products of rates out of w", "products of rates out of both") else spin_up
            )
        M += factor["translation"] * mass * np.swapaxes(T, 1, 2) @ T + factor["rotation"] * np.swapaxes(B, 1, 2) @ I @ B
        force = mass * (factor["convective"] * a - factor["gravity"] * g)
        spin = np.cross(w, (I @ w[..., None])[..., 0])
        moment = factor["Euler"] * (I @ spin_up[..., None])[..., 0] + factor["gyroscopic"] * spin
        h += (np.swapaxes(T, 1, 2) @ force[..., None] + np.swapaxes(B, 1, 2) @ moment[..., None])[..., 0]
    return M, h


def by_lagrange(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, of_rate: float, of_gradient: float):
    """Mbar and h = of_rate Mdot qd - of_gradient d(qd' Mbar qd / 2)/dq + dV/dq; derivatives by differences of high order."""
    nv = q.shape[1]
    M, weight = derived(tree, q, np.zeros_like(qd))
    slopes = np.stack([slope(lambda t, k=k: derived(tree, q + t * np.eye(nv)[k], qd)[0]) for k in range(nv)], axis=1)
    rate = np.einsum("skij,sk,sj->si", slopes, qd, qd)
    gradient = np.einsum("skij,si,sj->sk", slopes, qd, qd) / 2.0
    return M, of_rate * rate - of_gradient * gradient + weight


def slope(function) -> np.ndarray:
    """The derivative at 0 of a trigonometric polynomial of second degree in angles: exact except for rounding, by four angles.

    f = a + b cos t + c sin t + d cos 2t + e sin 2t gives f' = c + 2 e.
    """
    first = function(np.pi / 2.0) - function(-np.pi / 2.0)  # 2 c
    second = function(np.pi / 4.0) - function(-np.pi / 4.0)  # sqrt(2) c + 2 e
    c = first / 2.0
    return c + (second - np.sqrt(2.0) * c)
