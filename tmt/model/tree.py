"""A kinematic tree of joints that carry rigid bodies, as plain numbers."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from tmt.model import singular
from tmt.model.coordinates import KINDS, Coordinates, coordinates_of
from tmt.model.lock import CLOSE_TO_ONE, locked
from tmt.model.values import names, numbers_of, shown

OPTIONAL = ("reference", "armature", "stiffness", "rest")  # fields that may be left out
GAINS = ("position_gain", "speed_gain")  # and those of a controller, which are () where there is none


@dataclass(frozen=True)
class Tree:
    """A tree of n joints and m rigid bodies; at their reference positions every frame is parallel to the inertial frame.

    A joint is a hinge, a slide or a ball; a free joint is three slides and a ball. Each has a frame that moves with it, with
    its origin on the axis of a hinge, at the centre of a ball. Several joints in one body are joints in a row with no body
    between them. There are nv speeds, one of a hinge or slide and three of a ball, and nq numbers in a position: see
    coordinates.py. All fields are nested tuples; arrays and lists are converted. `dataclasses.replace(tree, mass=(2.0, 1.5))`
    makes another model. Raises ValueError where the numbers cannot be a tree or a rigid body.
    """

    hinge_names: tuple  # (n,) of all joints
    parent: tuple  # (n,) index of the joint before this one, always a smaller one; -1: fixed to the world
    offset: tuple  # (n, 3) m, from the origin of the parent's frame to this joint, in the parent's frame
    axis: tuple  # (nv, 3) direction of each speed, scaled to length 1; a ball has three at right angles, which turn with it
    damping: tuple  # (nv,) N m s/rad or N s/m, force -damping * qd
    body_names: tuple  # (m,)
    body_hinge: tuple  # (m,) index of the last joint that moves the body; -1: fixed to the world
    mass: tuple  # (m,) kg
    com: tuple  # (m, 3) m, centre of mass in the frame of its joint
    inertia: tuple  # (m, 3, 3) kg m2, about the centre of mass, in the frame of its joint
    gravity: tuple  # (3,) m/s2, inertial frame
    kind: tuple = ()  # (n,) of "hinge", "slide", "ball"; (): all are hinges
    armature: tuple = ()  # (nv,) kg m2 or kg, inertia of a rotor, on the diagonal of Mbar alone; (): none
    stiffness: tuple = ()  # (n,) N m/rad or N/m, of a spring at each joint; (): none
    rest: tuple = ()  # (nq,) rad, m and quaternions: where the springs are without force; (): at the reference
    reference: tuple = ()  # (n,) rad or m, where the joint leaves frames parallel; 0 for a ball; (): all 0
    # of a linear controller of hinges and slides: torque = tau - position_gain @ q - speed_gain @ qd; (): none
    position_gain: tuple = ()  # (nv, nv) N m/rad or N/m, q in rad and m as it stands
    speed_gain: tuple = ()  # (nv, nv) N m s/rad or N s/m

    def __new__(cls, *values, **named):
        known = [field.name for field in fields(cls)]
        if unknown := [name for name in named if name not in known]:
            raise ValueError(f"a Tree has no field {unknown[0]!r}; its fields are {', '.join(known)}")
        return super().__new__(cls)

    def __post_init__(self):
        for name in ("hinge_names", "body_names"):
            object.__setattr__(self, name, names(name, getattr(self, name)))
        n, m = len(self.hinge_names), len(self.body_names)
        object.__setattr__(self, "kind", _kinds(self.kind, n))
        nq, nv = self.coordinates.nq, self.coordinates.nv
        shapes = {
            "parent": (n,), "offset": (n, 3), "axis": (nv, 3), "damping": (nv,),
            "body_hinge": (m,), "mass": (m,), "com": (m, 3), "inertia": (m, 3, 3), "gravity": (3,),
            "reference": (n,), "armature": (nv,), "stiffness": (n,), "rest": (nq,),
        }  # fmt: skip
        for name, shape in shapes.items():
            value = getattr(self, name)
            if name in OPTIONAL and isinstance(value, tuple | list) and not value:
                value = self.zero if name == "rest" else (0.0,) * shape[0]
            object.__setattr__(self, name, numbers_of(name, value, shape))
        for name in GAINS:
            object.__setattr__(self, name, _gain(name, getattr(self, name), self.coordinates))
        if n == 0 or m == 0:
            raise ValueError("a Tree needs at least one joint and one body")
        for name, hinges, before in (("parent", self.parent, range(n)), ("body_hinge", self.body_hinge, [n] * m)):
            for i, (hinge, end) in enumerate(zip(hinges, before)):
                if hinge != int(hinge) or not -1 <= hinge < end:
                    raise ValueError(f"Tree.{name}[{i}] is {hinge:g}; a whole number from -1 to {end - 1} is expected")
            object.__setattr__(self, name, tuple(int(hinge) for hinge in hinges))
        object.__setattr__(self, "axis", tuple(_direction(i, axis) for i, axis in enumerate(self.axis)))
        if min(self.mass) < 0.0:
            raise ValueError(f"Tree.mass is {shown(self.mass)}; masses of at least 0 kg are expected")
        for name, unit in (("damping", "N m s/rad"), ("armature", "kg m2"), ("stiffness", "N m/rad")):
            if min(getattr(self, name)) < 0.0:
                values = shown(getattr(self, name))
                raise ValueError(f"Tree.{name} is {values}; values of at least 0 {unit} are expected")
        for i, (kind, at, by) in enumerate(self.coordinates.joints):
            if kind == "ball":
                _check_ball(i, np.array(self.axis[by]), self.reference[i], self.rest[at])
        for name, inertia in zip(self.body_names, self.inertia):
            _check_inertia(name, np.array(inertia))
        for i, name in enumerate(self.hinge_names):
            moved = [b for b in range(m) if self.moves(b)[i]]
            massive = any(self.mass[b] or np.any(self.inertia[b]) for b in moved)
            if not massive and not any(self.armature[self.coordinates.joints[i].qd]):
                kind = self.kind[i]
                raise ValueError(f"{kind} {name!r} moves nothing that has mass or inertia; Mbar would be singular")
        singular.check_tree(self)

    def __repr__(self):
        """The fields, without those that may be left out and say nothing."""
        n, nv = len(self.parent), len(self.axis)
        nothing, plain = (0.0,) * n, {"kind": ("hinge",) * n, "armature": (0.0,) * nv, "rest": self.zero}
        plain |= {"stiffness": nothing, "reference": nothing} | dict.fromkeys(GAINS, ())
        said = {field.name: getattr(self, field.name) for field in fields(self)}
        return f"Tree({', '.join(f'{name}={value}' for name, value in said.items() if value != plain.get(name))})"

    @property
    def coordinates(self) -> Coordinates:
        """The places of the joints in q (nq) and qd (nv)."""
        return coordinates_of(self.kind)

    @property
    def has_springs(self) -> bool:
        return any(self.stiffness)

    @property
    def has_gains(self) -> bool:
        return bool(self.position_gain or self.speed_gain)

    @property
    def zero(self) -> tuple:
        """The reference position, (nq,): every frame is parallel to the inertial frame."""
        return tuple(
            value
            for kind, reference in zip(self.kind, self.reference)
            for value in ((1.0, 0.0, 0.0, 0.0) if kind == "ball" else (reference,))
        )

    @property
    def never_singular(self) -> bool:
        """Whether Mbar is known to be regular at every q; else it may be singular at some."""
        return singular.never(self)

    def lock(self, angles: Mapping) -> "Tree":
        """The tree without the joints that are named in `angles`, {name: position}: they stay there, at rest.

        A position is in rad, of a slide in m, of a ball a quaternion. What hangs on a locked joint is carried by the joint
        before it, its vectors turned so that all frames are again parallel to the inertial frame where the free joints are at
        their reference. A joint locked there rounds nothing. Raises ValueError for an unknown joint, a position that is none,
        if no joint is left, or if a controller takes the position of a locked joint for the torque at a free one.
        """
        return locked(self, angles)

    def moves(self, body: int) -> list[bool]:
        """Which of the n joints move the body: those on its path to the world."""
        on_path = [False] * len(self.parent)
        joint = self.body_hinge[body]
        while joint >= 0:
            on_path[joint] = True
            joint = self.parent[joint]
        return on_path


def _kinds(values, n) -> tuple:
    """The kinds of the joints; hinges where none is given."""
    listed = isinstance(values, (list, tuple)) or (isinstance(values, np.ndarray) and values.ndim == 1)
    kinds = tuple(values) if listed else (None,)
    if isinstance(values, (list, tuple)) and not kinds:
        return ("hinge",) * n
    if len(kinds) != n or not all(isinstance(kind, str) and kind in KINDS for kind in kinds):
        raise ValueError(f"Tree.kind is {shown(values)}; {n} of {', '.join(KINDS)} are expected")
    return tuple(map(str, kinds))


def _gain(name, values, coordinates) -> tuple:
    """The rows of a gain, (nv, nv); () where nothing is fed back."""
    if isinstance(values, tuple | list) and not values:
        return ()
    rows = numbers_of(name, values, (coordinates.nv, coordinates.nv))
    fed = np.array(rows) != 0.0
    for i, (kind, _, by) in enumerate(coordinates.joints):
        if kind == "ball" and (fed[by].any() or fed[:, by].any()):
            raise ValueError(
                f"Tree.{name} has an entry of joint {i}, a ball; of hinges and slides alone is it accepted"
            )
    return rows if fed.any() else ()


def _check_ball(i, axes, reference, rest):
    """Raise ValueError unless joint i can be a ball."""
    if np.abs(axes @ axes.T - np.eye(3)).max() > 1e-9 or np.linalg.det(axes) < 0.0:
        raise ValueError(f"the axes of joint {i}, a ball, are {axes.tolist()}; a right-handed frame is expected")
    if reference:
        raise ValueError(f"Tree.reference[{i}] is {reference:g}; 0 is expected of a ball")
    if abs(math.hypot(*rest) - 1.0) > CLOSE_TO_ONE:
        raise ValueError(f"Tree.rest of joint {i}, a ball, is {rest}; a quaternion of length 1 is expected")


def _direction(i, axis) -> tuple:
    """The axis of speed i at length 1, however long it is."""
    exponent = math.frexp(max(map(abs, axis)))[1]
    axis = [math.ldexp(a, -exponent) for a in axis]  # exact, and the squares neither overflow nor vanish
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        raise ValueError(f"Tree.axis[{i}] is zero; a direction is expected")
    return tuple(a / length for a in axis)


def _check_inertia(name, inertia):
    """Raise ValueError unless the 3 x 3 tensor can belong to a rigid body."""
    scale = np.abs(inertia).max()
    if np.abs(inertia - inertia.T).max() > 1e-12 * scale:
        raise ValueError(f"the inertia of {name!r} is not symmetric: {inertia.tolist()}")
    a, b, c = np.linalg.eigvalsh(inertia)
    if a + b < c - 1e-12 * scale:  # as b is at most c, this finds an a below 0 too
        raise ValueError(
            f"the inertia of {name!r} has principal values {a:g}, {b:g}, {c:g}; "
            "each must be at least 0 and none larger than the other two together"
        )
