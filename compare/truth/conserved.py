"""Momenta that a robot conserves without gravity and torque.

The first joint is fixed to the world. A rotation about its axis, or a translation along it, moves the whole robot as one body
without a change of the kinetic energy: that row of Mbar qd changes only by the torque at that joint. For a ball it is the angular
momentum about its centre, in the world's axes; for a free body (three slides and a ball) the linear momentum, and the angular
momentum about the origin.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import tmt
from tmt.equations import method
from tmt.equations.vectors import ZERO, Vector

FREE = ("slide", "slide", "slide", "ball")


class Conserved(NamedTuple):
    """One momentum, from the first rows of Mbar qd."""

    tree: tmt.Tree
    name: str
    kind: str  # "row": one of Mbar qd; "linear": three of them; "angular": about a ball's centre, or about the origin
    unit: str

    def of_rows(self, frames: Sequence, p: Sequence) -> list:
        """The momentum, in the world's axes, from rows p of Mbar qd, or its rate from forces p at the joints. Any scalars."""
        if self.kind == "row":
            return [p[0]]
        if self.kind == "linear":
            return list(p[:3])
        free = self.tree.kind[:4] == FREE
        ball = frames[3] if free else frames[0]
        turned = sum((axis * part for axis, part in zip(ball.axes, p[-3:])), ZERO)
        return list(turned + ball.origin.cross(Vector(*p[:3])) if free else turned)

    @property
    def rows(self) -> int:
        """The number of rows of Mbar qd that it needs."""
        joints = self.tree.coordinates.joints
        return 6 if self.tree.kind[:4] == FREE else joints[0].qd.stop

    def momentum(self, q: Sequence, qd: Sequence) -> list:
        """The momentum, over any scalars, N m s or N s."""
        parts = method.bodies(self.tree, q, qd)
        p = [rotor * v for rotor, v in zip(self.tree.armature[: self.rows], qd)]
        for body in parts:
            impulse = sum((column * v for column, v in zip(body.T, qd)), ZERO) * body.mass
            spin = body.inertia @ body.omega
            p = [x + T.dot(impulse) + B.dot(spin) for x, T, B in zip(p, body.T, body.B)]
        return self.of_rows(method.joint_frames(self.tree, q), p)

    def effect(self, q: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Its rate of change under forces at the joints, (states, nv) -> (states, rows)."""
        frames = method.joint_frames(self.tree, list(q.T))
        rates = self.of_rows(frames, list(force.T[: self.rows]))
        return np.stack(np.broadcast_arrays(*rates), axis=-1)

    def size(self, q: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The largest effect of forces of these sizes, (states, nv) -> (states, 1) or (states, rows); (states,) stays."""
        if force.ndim == 1:
            return force
        if self.kind != "angular":
            return force[:, : 1 if self.kind == "row" else 3]
        total = force[:, self.rows - 3 : self.rows].sum(axis=1)
        if self.rows == 6:
            total = total + np.linalg.norm(q[:, :3], axis=1) * force[:, :3].sum(axis=1)
        return total[:, None]


def conserved(tree: tmt.Tree) -> tuple[Conserved, ...]:
    """The momenta that a tree conserves; none if a controller acts at the first joint.

    The angular one is left out if a ball's armature differs between its axes, as armature does not rotate.
    """
    free = tree.kind[:4] == FREE and tree.parent[:4] == (-1, 0, 1, 2)
    name = tree.hinge_names[0]
    carrying = slice(0, tree.coordinates.joints[3 if free else 0].qd.stop)
    if any(np.any(gain[carrying]) for gain in (tree.position_gain, tree.speed_gain)):
        return ()
    if not free and tree.kind[0] != "ball":
        return (Conserved(tree, f"p_{name}", "row", "N" if tree.kind[0] == "slide" else "N m"),)
    rotors = tree.armature[3:6] if free else tree.armature[:3]
    linear = (Conserved(tree, "linear momentum", "linear", "N"),) if free else ()
    if len(set(rotors)) > 1 or (free and len(set(tree.armature[:3])) > 1):
        return linear
    return (*linear, Conserved(tree, "angular momentum", "angular", "N m"))


def floats(tree: tmt.Tree) -> bool:
    """Whether a joint to the world is free (three slides and a ball): such a robot has no rest under gravity."""
    return any(tree.parent[i] == -1 and tree.kind[i : i + 4] == FREE for i in range(len(tree.kind) - 3))
