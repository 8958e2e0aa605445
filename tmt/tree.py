"""A kinematic tree of hinges that carry rigid bodies, as plain numbers."""

import math
import reprlib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from . import singular
from .space import IDENTITY, ZERO, Matrix, Vector, rotation


@dataclass(frozen=True)
class Tree:
    """A tree of n hinges and m rigid bodies; at q = 0 every frame is parallel to the inertial frame.

    Each hinge has a frame that turns with it, with its origin on the hinge axis. Several hinges in one
    body are hinges in a row with no body between them. All fields are nested tuples; arrays and lists
    are converted. `dataclasses.replace(tree, mass=(2.0, 1.5))` makes another model.
    Raises ValueError where the numbers cannot be a tree or a rigid body.
    """

    hinge_names: tuple  # (n,)
    parent: tuple  # (n,) index of the hinge before this one, always a smaller one; -1: fixed to the world
    offset: tuple  # (n, 3) m, from the origin of the parent's frame to this hinge, in the parent's frame
    axis: tuple  # (n, 3) direction of the hinge, right-handed; scaled to length 1
    damping: tuple  # (n,) N m s/rad, torque -damping * qd
    body_names: tuple  # (m,)
    body_hinge: tuple  # (m,) index of the last hinge that moves the body; -1: fixed to the world
    mass: tuple  # (m,) kg
    com: tuple  # (m, 3) m, centre of mass in the frame of its hinge
    inertia: tuple  # (m, 3, 3) kg m2, about the centre of mass, in the frame of its hinge
    gravity: tuple  # (3,) m/s2, inertial frame

    def __new__(cls, *values, **named):
        known = [field.name for field in fields(cls)]
        if unknown := [name for name in named if name not in known]:
            raise ValueError(f"a Tree has no field {unknown[0]!r}; its fields are {', '.join(known)}")
        return super().__new__(cls)

    def __post_init__(self):
        for name in ("hinge_names", "body_names"):
            object.__setattr__(self, name, _names(name, getattr(self, name)))
        n, m = len(self.hinge_names), len(self.body_names)
        shapes = {
            "parent": (n,), "offset": (n, 3), "axis": (n, 3), "damping": (n,),
            "body_hinge": (m,), "mass": (m,), "com": (m, 3), "inertia": (m, 3, 3), "gravity": (3,),
        }  # fmt: skip
        for name, shape in shapes.items():
            object.__setattr__(self, name, _numbers(name, getattr(self, name), shape))
        if n == 0 or m == 0:
            raise ValueError("a Tree needs at least one hinge and one body")
        for name, hinges, before in (("parent", self.parent, range(n)), ("body_hinge", self.body_hinge, [n] * m)):
            for i, (hinge, end) in enumerate(zip(hinges, before)):
                if hinge != int(hinge) or not -1 <= hinge < end:
                    raise ValueError(f"Tree.{name}[{i}] is {hinge:g}; a whole number from -1 to {end - 1} is expected")
            object.__setattr__(self, name, tuple(int(hinge) for hinge in hinges))
        object.__setattr__(self, "axis", tuple(_direction(i, axis) for i, axis in enumerate(self.axis)))
        if min(self.mass) < 0.0:
            raise ValueError(f"Tree.mass is {shown(self.mass)}; masses of at least 0 kg are expected")
        if min(self.damping) < 0.0:
            raise ValueError(f"Tree.damping is {shown(self.damping)}; values of at least 0 N m s/rad are expected")
        for name, inertia in zip(self.body_names, self.inertia):
            _check_inertia(name, np.array(inertia))
        for i, name in enumerate(self.hinge_names):
            moved = [b for b in range(m) if self.moves(b)[i]]
            if not any(self.mass[b] or np.any(self.inertia[b]) for b in moved):
                raise ValueError(f"hinge {name!r} moves nothing that has mass or inertia; Mbar would be singular")
        singular.check_tree(self)

    def __repr__(self):
        return f"Tree({', '.join(f'{field.name}={getattr(self, field.name)}' for field in fields(self))})"

    @property
    def never_singular(self) -> bool:
        """Whether Mbar is known to be regular at every q; else it may be singular at some."""
        return singular.never(self)

    def lock(self, angles: Mapping) -> "Tree":
        """The tree without the hinges that are named in `angles`, {name: rad}: they stay at these angles, at rest.

        What hangs on a locked hinge is carried by the hinge before it, its vectors turned so that all frames are again
        parallel to the inertial frame where the free hinges are at zero. A hinge locked at 0 rounds nothing. Raises
        ValueError for an unknown hinge, an angle that is no finite number, or if no hinge is left.
        """
        names = self.hinge_names
        if not isinstance(angles, Mapping):
            raise ValueError(
                f"lock is given {shown(angles)}; a dict of angles in rad by the names of hinges is expected"
            )
        if unknown := [name for name in angles if name not in names]:
            raise ValueError(f"there is no hinge {shown(unknown[0])} to lock; the hinges are {', '.join(names)}")
        if len(angles) == len(names):
            raise ValueError(f"all hinges ({', '.join(names)}) are locked; at least one must be free")
        locked = dict(zip(angles, _numbers("lock", list(angles.values()), (len(angles),))))
        free = [i for i, name in enumerate(names) if name not in locked]

        # of each hinge's frame: the free hinge that carries it now, and where it is in the frame of that one
        frames = []

        def frame(hinge):
            return frames[hinge] if hinge >= 0 else (-1, ZERO, IDENTITY)

        for i, name in enumerate(names):
            carrier, origin, turn = frame(self.parent[i])
            if i in free:
                frames.append((free.index(i), ZERO, turn))
            else:
                turned = turn @ rotation(self.axis[i], locked[name]) if locked[name] else turn
                frames.append((carrier, _moved(origin, turn, self.offset[i]), turned))

        before = [frame(self.parent[i]) for i in free]
        carried = [frame(hinge) for hinge in self.body_hinge]
        return replace(
            self,
            hinge_names=[names[i] for i in free],
            parent=[carrier for carrier, _, _ in before],
            offset=[tuple(_moved(origin, turn, self.offset[i])) for i, (_, origin, turn) in zip(free, before)],
            axis=[tuple(_moved(ZERO, turn, self.axis[i])) for i, (_, _, turn) in zip(free, before)],
            damping=[self.damping[i] for i in free],
            body_hinge=[carrier for carrier, _, _ in carried],
            com=[tuple(_moved(origin, turn, com)) for com, (_, origin, turn) in zip(self.com, carried)],
            inertia=[_turned(turn, inertia) for inertia, (_, _, turn) in zip(self.inertia, carried)],
        )

    def moves(self, body: int) -> list[bool]:
        """Which of the n hinges move the body: those on its path to the world."""
        on_path = [False] * len(self.parent)
        hinge = self.body_hinge[body]
        while hinge >= 0:
            on_path[hinge] = True
            hinge = self.parent[hinge]
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


def _direction(i, axis) -> tuple:
    """The axis of hinge i at length 1, however long it is."""
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
