"""The equations of motion as functions of a tree's numbers, for many changes of the numbers at once.

Mbar and h are TMT's sum over the bodies, by the functions of tmt. The numbers may be arrays (changes, 1) that broadcast with
positions (states,), real or complex; the derivative by a number is the imaginary part after an imaginary change of 1e-100, exact
to rounding. Each term of each body has a factor, 1 in the right equations.
"""

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

import tmt
from tmt.equations import method
from tmt.equations.vectors import Vector

from ..robots.coordinates import Coordinates
from ..robots.joint_map import JointMap

FIELDS = ("offset", "axis", "com", "inertia", "mass", "gravity", "reference", "armature")
BODY_TERMS = (
    "translation",
    "rotation",
    "gravity",
    "convective",
    "Euler",
    "gyroscopic",
)  # of each body; the first two of Mbar
TINY = 1e-100  # an imaginary change, whose square vanishes


class Path(NamedTuple):
    """One entry of a field of a Tree, or the factor of a term ("factor", (body, term))."""

    field: str
    index: tuple[int, ...]


class Equations:
    """Mbar and h of a tree at states q (states, nq), qd (states, nv).

    One array of numbers for each state: the lower triangle of Mbar by rows, then h; see `entries`. With `joints` the states,
    Mbar and h are in the user's joints, see joint_map.py.
    """

    def __init__(self, tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, joints: JointMap | None = None):
        self.tree, self.joints = tree, joints
        self.q, self.qd = np.asarray(q, float), np.asarray(qd, float)
        if joints is not None:
            self.q, self.qd = joints.positions(self.q), joints.speeds(self.qd)
        self.nv = len(tree.axis)
        self.stated = {name: np.array(getattr(tree, name), float) for name in FIELDS}
        self.stated["factor"] = np.ones((len(tree.mass), len(BODY_TERMS)))
        self.triangle = np.tril_indices(self.nv)

    @property
    def names(self) -> tuple[str, ...]:
        return Coordinates(self.tree.hinge_names, self.tree.kind).speeds

    @property
    def entries(self) -> list[tuple]:
        """The entries of a state: ("M", i, j) or ("h", i)."""
        return [*(("M", int(i), int(j)) for i, j in zip(*self.triangle)), *(("h", i) for i in range(self.nv))]

    def values(self, changes: dict | None = None) -> np.ndarray:
        """Mbar and h, (changes, states, entries), with entries of the tree changed; (1, states, entries) without changes.

        changes: {Path: what is added, (changes,)}. Changed axes are normalized.
        """
        return self.packed(*self.summed(self.parts(changes or {})))

    def parts(self, changes: dict) -> SimpleNamespace:
        """Bodies of the changed tree, with its numbers."""
        numbers = {name: value.tolist() for name, value in self.stated.items()}
        for path, added in changes.items():
            row, (*places, last) = numbers[path.field], path.index
            for place in places:
                row = row[place]
            row[last] = row[last] + np.asarray(added)[:, None]
        turned = {path.index[0] for path in changes if path.field == "axis"}
        numbers["axis"] = [unit_direction(axis) if k in turned else axis for k, axis in enumerate(numbers["axis"])]
        tree = self.tree
        changed = SimpleNamespace(
            **numbers, parent=tree.parent, coordinates=tree.coordinates, body_hinge=tree.body_hinge, moves=tree.moves
        )
        return SimpleNamespace(tree=changed, bodies=method.bodies(changed, list(self.q.T), list(self.qd.T)))

    def summed(self, parts: SimpleNamespace) -> tuple[list, list]:
        """Mbar, rows of its lower triangle, and h of bodies, each term times its factor."""
        tree, bodies = parts.tree, parts.bodies
        g, of = Vector(*tree.gravity), range(self.nv)
        M = [[0.0] * (i + 1) for i in of]
        h = [0.0] * self.nv
        for b, factor in zip(bodies, tree.factor):
            translation, rotation, weight, convective, Euler, gyroscopic = factor
            force = (b.v_conv * convective - g * weight) * b.mass
            moment = (b.inertia @ b.w_conv) * Euler + b.omega.cross(b.inertia @ b.omega) * gyroscopic
            turned = [b.inertia @ column for column in b.B]
            for i in of:
                h[i] = h[i] + b.T[i].dot(force) + b.B[i].dot(moment)
                for j in range(i + 1):
                    M[i][j] = M[i][j] + b.mass * translation * b.T[i].dot(b.T[j]) + rotation * b.B[i].dot(turned[j])
        for i, rotor in enumerate(tree.armature):
            M[i][i] = M[i][i] + rotor
        return M, h

    def packed(self, M: list, h: list) -> np.ndarray:
        """Rows of the lower triangle of Mbar and h as one array, (changes, states, entries)."""
        flat = [*(M[i][j] for i, j in zip(*self.triangle)), *h]
        if self.joints is not None:
            flat = [flat[k] * s for k, s in zip(*packing(self.joints, self))]
        states = len(self.q)
        count = max([np.shape(value)[0] for value in flat if np.ndim(value) == 2], default=1)
        return np.stack([np.broadcast_to(value, (count, states)) for value in flat], axis=-1)


def packing(joints: JointMap, equations: Equations) -> tuple[list[int], np.ndarray]:
    """The index and sign, in the model's joints, of each entry in the user's joints."""
    v, sense, (i, j) = joints.v, joints.sense, equations.triangle
    high, low = np.maximum(v[i], v[j]), np.minimum(v[i], v[j])
    index = np.concatenate([high * (high + 1) // 2 + low, len(i) + v])
    return index.tolist(), np.concatenate([sense[i] * sense[j], sense])


def unit_direction(axis: list) -> list:
    """A direction at length 1."""
    x, y, z = axis
    length = np.sqrt(x * x + y * y + z * z)
    length = np.where(length == 0.0, 1.0, length)  # of a change that leaves no direction
    return [x / length, y / length, z / length]
