"""The equations of motion as functions of a tree's numbers, for many changes of the numbers at once.

Mbar and h are TMT's sum over the bodies, by the functions of tmt. The numbers may be arrays (changes, 1) that
broadcast with positions (states,), real or complex; the derivative by a number is the imaginary part after an
imaginary change of 1e-100, exact to rounding.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from functools import cached_property
from itertools import chain, islice
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy import ndarray

import tmt
from tmt.derivation import method
from tmt.derivation.mechanism import Mechanism
from tmt.derivation.vectors import ZERO, Vector

from ..robots.coordinates import Coordinates
from .layout import Entry, Layout, coefficients_of

FIELDS = ("offset", "axis", "com", "inertia", "mass", "gravity", "reference", "armature")
OF_TERM = {  # T' m T and B' I B of Mbar; T' m g, T' m v_conv, B' I w_conv and B' (omega x I omega) of h
    "translation": "translational inertia of {}",
    "rotation": "rotational inertia of {}",
    "gravity": "gravity of {}",
    "convective": "centripetal and Coriolis forces of {}",
    "Euler": "moment I alpha at constant rates of {}",
    "gyroscopic": "gyroscopic moment omega x I omega of {}",
}
WHOLE = 1e-12  # of components of axes from whole numbers
TINY = 1e-100  # an imaginary change, whose square vanishes


class Path(NamedTuple):
    """One entry of a field of a Tree."""

    field: str
    at: tuple[int, ...]


class Frame(NamedTuple):
    """A body's frame in the file, which has its numbers; a Tree's is parallel to the world at zero."""

    origin: ndarray  # in the frame of the joint
    axes: ndarray  # as columns


T = TypeVar("T")
Changes = Mapping[Path, ndarray]  # what is added to a number, (changes,)


class Equations:
    """Mbar and h of a tree at states q (states, nq), qd (states, nv); a row of a Layout for each state."""

    def __init__(self, tree: tmt.Tree, q: ndarray, qd: ndarray, layout: Layout | None = None):
        self.tree, self.q, self.qd = tree, q, qd
        self.nv = len(tree.axis)
        self.layout = layout or Layout(self.nv)
        self.in_M, self.in_h = self.layout.in_M, self.layout.in_h
        self.coordinates = Coordinates(tree.joint_names, tree.kind)
        self.speeds = self.coordinates.speeds
        self.joints = dict(zip(tree.joint_names, tree.coordinates.joints))
        self.stated = {name: np.array(getattr(tree, name), float) for name in FIELDS}

    def at(self, states: ndarray) -> "Equations":
        """The same at some of the states."""
        qdd = self.layout.qdd
        layout = self.layout if qdd is None else self.layout._replace(qdd=qdd[states])
        return Equations(self.tree, self.q[states], self.qd[states], layout)

    @cached_property
    def entries(self) -> list[Entry]:
        """The entries of Mbar and h, those of Mbar first."""
        of_M = [Entry("M", (int(i), int(j))) for i, j in zip(*self.layout.places)]
        if self.layout.is_symmetric:
            of_M = [entry._replace(at=entry.at[::-1]) for entry in of_M]
        return of_M + [Entry("h", (i,)) for i in range(self.nv)]

    @cached_property
    def bodies(self) -> list[method.Body]:
        return method.bodies(self.tree, list(self.q.T), list(self.qd.T))

    def frame_of(self, body: int) -> Frame:
        site = self.tree.site_of(self.tree.body_names[body])
        return Frame(np.array(site.offset), whole(np.array(site.rotation, float)))

    def axes_at(self, joint: int) -> ndarray:
        """The axes of the file's body that a joint moves, as columns; else of the body that it carries."""
        of_joints = dict(zip(self.tree.site_joint[::-1], self.tree.site_rotation[::-1]))
        carried = (k for k in sorted(of_joints) if joint in self.tree.path(k))
        turn = of_joints.get(next(carried, -1)) if joint >= 0 else None
        return np.eye(3) if turn is None else whole(np.array(turn))

    @cached_property
    def terms(self) -> dict[str, ndarray]:
        """What each term of all bodies adds, (bodies, states, entries)."""
        count, I = len(self.q), self.stated["inertia"]
        T, B = (vectors([getattr(b, name) for b in self.bodies], count) for name in "TB")
        motion = [[b.v_conv, b.w_conv, b.omega] for b in self.bodies]
        a, alpha, w = vectors(motion, count).swapaxes(0, 1)
        zero, mass = np.zeros((len(I), count, self.nv)), self.stated["mass"][:, None, None]
        none = np.zeros((*zero.shape, self.nv))
        gyroscopic = np.cross(w, np.einsum("bij,bsj->bsi", I, w))
        euler = np.einsum("bij,bsj->bsi", I, alpha)

        def along(columns: ndarray, forces: ndarray) -> ndarray:
            return np.einsum("bnsc,bsc->bsn", columns, forces)

        gravity = np.broadcast_to(-mass * self.stated["gravity"], a.shape)
        parts = {
            "translation": (np.einsum("bnsc,bmsc->bsnm", T * mass[..., None], T), zero, zero),
            "rotation": (np.einsum("bnsc,bcd,bmsd->bsnm", B, I, B), zero, zero),
            "gravity": (none, zero, along(T, gravity)),
            "convective": (none, along(T, mass * a), zero),
            "Euler": (none, along(B, euler), zero),
            "gyroscopic": (none, along(B, gyroscopic), zero),
        }
        return {name: self.layout.packed(*part) for name, part in parts.items()}

    @cached_property
    def parts(self) -> tuple[ndarray, ndarray, ndarray]:
        """Mbar (states, nv, nv), velocity terms of h and h at rest (states, nv), without changes."""
        return self.summed(self.bodies, self.tree.gravity, self.tree.armature)

    @cached_property
    def right(self) -> ndarray:
        """The values without changes, (states, entries)."""
        return self.layout.packed(*self.parts)

    @cached_property
    def h(self) -> ndarray:
        return self.parts[1] + self.parts[2]

    @cached_property
    def coefficients(self) -> dict[Entry, ndarray]:
        """The entries of Mbar, and the coefficients of h, (states,) each."""

        def bias(speeds: ndarray) -> ndarray:
            q, qd = np.tile(self.q, (len(speeds), 1)), np.repeat(speeds, len(self.q), axis=0)
            return Equations(self.tree, q, qd).h.reshape(len(speeds), *self.qd.shape)

        return dict(zip(self.entries[self.in_M], self.right.T)) | coefficients_of(bias, self.nv)

    def values(self, changes: Changes) -> ndarray:
        """Mbar and h with numbers of the tree changed, (changes, states, entries); axes are normalized."""
        numbers: dict[str, Any] = {field.name: getattr(self.tree, field.name) for field in fields(Mechanism)}
        numbers |= {name: value.tolist() for name, value in self.stated.items()}
        for path, added in changes.items():
            row, (*places, last) = numbers[path.field], path.at
            for place in places:
                row = row[place]
            row[last] = row[last] + np.asarray(added)[:, None]
        for k in {path.at[0] for path in changes if path.field == "axis"}:
            x, y, z = numbers["axis"][k]
            length = np.sqrt(x * x + y * y + z * z)
            length = np.where(length == 0.0, 1.0, length)  # of a change that leaves no direction
            numbers["axis"][k] = [x / length, y / length, z / length]
        bodies = method.bodies(Mechanism(**numbers), list(self.q.T), list(self.qd.T))
        values = self.layout.packed(*self.summed(bodies, numbers["gravity"], numbers["armature"]))
        return values.reshape(-1, *self.right.shape)

    def with_bias(self, velocity_terms: ndarray | float, rest: ndarray | float) -> ndarray:
        """The right values with another h, whose parts are (states, nv)."""
        zero = 0.0 * self.qd
        return self.layout.packed(self.parts[0], velocity_terms + zero, rest + zero)

    def summed(
        self, bodies: Sequence[method.Body], gravity: Iterable[Any], armature: Sequence[Any]
    ) -> tuple[ndarray, ndarray, ndarray]:
        """Mbar, velocity terms of h and h at rest of some bodies, (changes, states, ...) or (states, ...)."""
        M, velocity_terms = method.mass_matrix(bodies), method.bias(bodies, ZERO)
        for i, rotor in enumerate(armature):
            M[i][i] = M[i][i] + rotor
        still = [b._replace(v_conv=ZERO, w_conv=ZERO, omega=ZERO) for b in bodies]
        flat = [*chain.from_iterable(M), *velocity_terms, *method.bias(still, gravity)]
        table, nv = np.stack(np.broadcast_arrays(*flat, np.zeros(len(self.q))), axis=-1)[..., :-1], self.nv
        M_flat, of_velocity, of_gravity = np.split(table, [nv * nv, nv * nv + nv], axis=-1)
        return M_flat.reshape(*table.shape[:-1], nv, nv), of_velocity, of_gravity


def blocks(items: Iterable[T], size: int) -> Iterator[list[T]]:
    """Items that are evaluated together."""
    rest = iter(items)
    while block := list(islice(rest, size)):
        yield block


def whole(numbers: ndarray) -> ndarray:
    """Numbers with those that are whole, except for rounding, rounded."""
    near = np.round(numbers)
    return np.where(np.abs(numbers - near) < WHOLE, near, numbers)


def vectors(rows: Sequence[Sequence[Vector]], count: int) -> ndarray:
    """Vectors of scalars or (count,), as an array (rows, columns, count, 3)."""
    return np.array([[[np.broadcast_to(x, count) for x in v] for v in row] for row in rows]).swapaxes(2, 3)
