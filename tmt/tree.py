"""A kinematic tree of joints that carry rigid bodies, as plain numbers."""

import math
import reprlib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from . import singular
from .coordinates import KINDS, Coordinates, coordinates_of
from .space import IDENTITY, ZERO, Matrix, Vector, rotation, turn_of


CLOSE_TO_ONE = 1e-6  # how far the length of a quaternion may be from 1
OPTIONAL = ("reference", "armature", "stiffness", "rest")  # fields that may be left out


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

    def __new__(cls, *values, **named):
        known = [field.name for field in fields(cls)]
        if unknown := [name for name in named if name not in known]:
            raise ValueError(f"a Tree has no field {unknown[0]!r}; its fields are {', '.join(known)}")
        return super().__new__(cls)

    def __post_init__(self):
        for name in ("hinge_names", "body_names"):
            object.__setattr__(self, name, _names(name, getattr(self, name)))
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
            object.__setattr__(self, name, _numbers(name, value, shape))
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
        return f"Tree({', '.join(f'{field.name}={getattr(self, field.name)}' for field in fields(self))})"

    @property
    def coordinates(self) -> Coordinates:
        """The places of the joints in q (nq) and qd (nv)."""
        return coordinates_of(self.kind)

    @property
    def has_springs(self) -> bool:
        return any(self.stiffness)

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
        or if no joint is left.
        """
        names, joints = self.hinge_names, self.coordinates.joints
        if not isinstance(angles, Mapping):
            raise ValueError(
                f"lock is given {shown(angles)}; a dict of angles in rad by the names of hinges is expected"
            )
        if unknown := [name for name in angles if name not in names]:
            raise ValueError(f"there is no hinge {shown(unknown[0])} to lock; the hinges are {', '.join(names)}")
        if len(angles) == len(names):
            raise ValueError(f"all hinges ({', '.join(names)}) are locked; at least one must be free")
        locked = {name: _position(self.kind[names.index(name)], value) for name, value in angles.items()}
        free = [i for i, name in enumerate(names) if name not in locked]

        # of each joint's frame: the free joint that carries it now, and where it is in the frame of that one
        frames = []

        def frame(joint):
            return frames[joint] if joint >= 0 else (-1, ZERO, IDENTITY)

        for i, name in enumerate(names):
            carrier, origin, turn = frame(self.parent[i])
            if i in free:
                frames.append((free.index(i), ZERO, turn))
            else:
                shift, turned = self._placed(i, locked[name])
                frames.append((carrier, _moved(origin, turn, shift), turn if turned is None else turn @ turned))

        before = {i: frame(self.parent[i]) for i in free}
        carried = [frame(joint) for joint in self.body_hinge]
        at = [k for i in free for k in range(*joints[i].q.indices(len(self.rest)))]
        by = [(i, k) for i in free for k in range(*joints[i].qd.indices(len(self.axis)))]
        return replace(
            self,
            hinge_names=[names[i] for i in free],
            parent=[before[i][0] for i in free],
            offset=[tuple(_moved(*before[i][1:], self.offset[i])) for i in free],
            axis=[tuple(_moved(ZERO, before[i][2], self.axis[k])) for i, k in by],
            damping=[self.damping[k] for _, k in by],
            body_hinge=[carrier for carrier, _, _ in carried],
            com=[tuple(_moved(origin, turn, com)) for com, (_, origin, turn) in zip(self.com, carried)],
            inertia=[_turned(turn, inertia) for inertia, (_, _, turn) in zip(self.inertia, carried)],
            kind=[self.kind[i] for i in free],
            armature=[self.armature[k] for _, k in by],
            stiffness=[self.stiffness[i] for i in free],
            rest=[self.rest[k] for k in at],
            reference=[self.reference[i] for i in free],
        )

    def _placed(self, i, position):
        """Where joint i at a position puts the frame that it carries, in the parent's frame: origin, and turn if there is one."""
        kind, _, by = self.coordinates.joints[i]
        if kind == "ball":
            own = Matrix(self.axis[by]).transposed
            return self.offset[i], own @ turn_of(position) @ own.transposed if any(position[1:]) else None
        off, axis = position - self.reference[i], self.axis[by.start]
        if kind == "slide" and off:
            return Vector(*self.offset[i]) + Vector(*axis) * off, None
        return self.offset[i], rotation(axis, off) if off and kind == "hinge" else None

    def moves(self, body: int) -> list[bool]:
        """Which of the n joints move the body: those on its path to the world."""
        on_path = [False] * len(self.parent)
        joint = self.body_hinge[body]
        while joint >= 0:
            on_path[joint] = True
            joint = self.parent[joint]
        return on_path


def _moved(origin, turn, point):
    """A point of a frame in the axes and from the origin of the one that carries it."""
    return origin + (turn @ Vector(*point) if turn is not IDENTITY else Vector(*point))


def _turned(turn, inertia):
    """A tensor in the axes of the frame that carries it, symmetric."""
    if turn is IDENTITY:
        return inertia
    tensor = np.array([list(row) for row in turn @ Matrix(inertia) @ turn.transposed])
    return (tensor + tensor.T) / 2.0


def shown(value) -> str:
    """What was given, in one short line."""
    try:
        return " ".join(reprlib.repr(value).split())
    except Exception:  # a repr that fails, an int of too many digits
        return f"a {type(value).__name__}"


def real_numbers(values) -> np.ndarray | None:
    """The values as an array of float, None if they are anything else but real numbers: truth values, masked ones, text."""
    try:
        if _masked(values):
            return None
        array = np.asarray(values)
        return array.astype(float) if array.dtype.kind in "fiu" else None
    except MemoryError:
        raise
    except Exception:  # whatever the conversion of a user's own object raises
        return None


def _masked(values) -> bool:
    """Whether an entry is masked: NumPy would ignore the mask."""
    if isinstance(values, (list, tuple)):
        return any(_masked(value) for value in values if not isinstance(value, float))
    return isinstance(values, np.ma.MaskedArray) and bool(np.ma.getmaskarray(values).any())


def _names(field, values):
    """The values as a tuple of different strings that can stand in a line."""
    listed = isinstance(values, (list, tuple)) or (isinstance(values, np.ndarray) and values.ndim == 1)
    names = tuple(values) if listed else (None,)
    if not all(isinstance(name, str) and name.isprintable() for name in names) or len(set(names)) < len(names):
        raise ValueError(f"Tree.{field} is {shown(values)}; different names are expected")
    return tuple(map(str, names))


def _numbers(name, values, shape):
    """The values as nested tuples of float, after a check of their shape."""
    array = real_numbers(values)
    if array is None:
        raise ValueError(f"Tree.{name} is {shown(values)}; numbers of shape {shape} are expected")
    if array.shape != shape:
        raise ValueError(f"Tree.{name} has shape {array.shape}; {shape} is expected")
    if not np.isfinite(array).all():
        raise ValueError(f"Tree.{name} is {shown(values)}; finite numbers are expected")

    def nested(item):
        return tuple(map(nested, item)) if isinstance(item, list) else item

    return nested(array.tolist())


def _kinds(values, n) -> tuple:
    """The kinds of the joints; hinges where none is given."""
    listed = isinstance(values, (list, tuple)) or (isinstance(values, np.ndarray) and values.ndim == 1)
    kinds = tuple(values) if listed else (None,)
    if isinstance(values, (list, tuple)) and not kinds:
        return ("hinge",) * n
    if len(kinds) != n or not all(isinstance(kind, str) and kind in KINDS for kind in kinds):
        raise ValueError(f"Tree.kind is {shown(values)}; {n} of {', '.join(KINDS)} are expected")
    return tuple(map(str, kinds))


def _position(kind, value):
    """A position that is given for one joint: a float, or a quaternion."""
    (position,) = _numbers("lock", [value], (1, 4) if kind == "ball" else (1,))
    if kind == "ball" and abs(math.hypot(*position) - 1.0) > CLOSE_TO_ONE:
        raise ValueError(f"lock is given {shown(value)}; a quaternion of length 1 is expected")
    return position


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
