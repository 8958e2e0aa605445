"""A kinematic tree of joints that carry rigid bodies, as plain numbers."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tmt.model import singular
from tmt.model.coordinates import KINDS, Coordinates, coordinates_of
from tmt.model.lock import CLOSE_TO_ONE, locked
from tmt.model.renamed import accepts_former_names
from tmt.model.values import names, numbers_of, shown

OPTIONAL = ("reference", "armature", "stiffness", "rest")  # fields that may be left out
GAINS = ("position_gain", "speed_gain")  # and those of a controller, which are () where there is none


Numbers = tuple[float, ...]
Rows = tuple[Numbers, ...]


@accepts_former_names({"hinge_names": "joint_names", "body_hinge": "body_joint"})
@dataclass(frozen=True)
class Tree:
    """A tree of n joints and m rigid bodies; at their reference positions every frame is parallel to the inertial frame.

    A joint is a hinge, a slide or a ball; a free joint is three slides and a ball. Each has a frame that moves with it, with
    its origin on the axis of a hinge, at the centre of a ball. Several joints in one body are joints in a row with no body
    between them. There are nv speeds, one of a hinge or slide and three of a ball, and nq numbers in a position: see
    coordinates.py. All fields are nested tuples; arrays and lists are converted.

    Parameters
    ----------
    joint_names : (n,)
        Of all joints.
    parent : (n,)
        Index of the joint before this one, always a smaller one; -1: fixed to the world.
    offset : (n, 3), m
        From the origin of the parent's frame to this joint, in the parent's frame.
    axis : (nv, 3)
        Direction of each speed, scaled to length 1; a ball has three at right angles, which turn with it.
    damping : (nv,), N m s/rad or N s/m
        Force -damping * qd.
    body_names : (m,)
    body_joint : (m,)
        Index of the last joint that moves the body; -1: fixed to the world.
    mass : (m,), kg
    com : (m, 3), m
        Centre of mass in the frame of its joint.
    inertia : (m, 3, 3), kg m2
        About the centre of mass, in the frame of its joint.
    gravity : (3,), m/s2
        Inertial frame.
    kind : (n,), optional
        "hinge", "slide" or "ball"; (): all are hinges.
    armature : (nv,), kg m2 or kg, optional
        Inertia of a rotor, on the diagonal of Mbar alone.
    stiffness : (n,), N m/rad or N/m, optional
        Of a spring at each joint.
    rest : (nq,), rad, m and quaternions, optional
        Where the springs are without force; (): at the reference.
    reference : (n,), rad or m, optional
        Where the joint leaves frames parallel; 0 for a ball.
    position_gain, speed_gain : (nv, nv), N m/rad or N/m, and N m s/rad or N s/m, optional
        Of a linear controller of hinges and slides: torque = tau - position_gain @ q - speed_gain @ qd, q as it stands.

    Raises
    ------
    ValueError
        If the numbers cannot be a tree or a rigid body.

    Examples
    --------
    >>> pendulum = tmt.Tree(
    ...     joint_names=["hip"], parent=[-1], offset=[(0, 0, 0)], axis=[(0, 1, 0)], damping=[0.1],
    ...     body_names=["rod"], body_joint=[0], mass=[1.0], com=[(0, 0, -0.5)], inertia=[np.diag([0.1, 0.1, 0.01])],
    ...     gravity=(0, 0, -9.81),
    ... )
    >>> print(tmt.mass_matrix([0.0], pendulum))  # 0.1 + 1 kg (0.5 m)^2
    [[0.35]]
    >>> dataclasses.replace(pendulum, mass=[2.0]).mass
    (2.0,)
    """

    joint_names: tuple[str, ...]
    parent: tuple[int, ...]
    offset: Rows
    axis: Rows
    damping: Numbers
    body_names: tuple[str, ...]
    body_joint: tuple[int, ...]
    mass: Numbers
    com: Rows
    inertia: tuple[Rows, ...]
    gravity: Numbers
    kind: tuple[str, ...] = ()
    armature: Numbers = ()
    stiffness: Numbers = ()
    rest: Numbers = ()
    reference: Numbers = ()
    position_gain: Rows = ()
    speed_gain: Rows = ()

    def __post_init__(self) -> None:
        for name in ("joint_names", "body_names"):
            object.__setattr__(self, name, names(name, getattr(self, name)))
        n, m = len(self.joint_names), len(self.body_names)
        object.__setattr__(self, "kind", _kinds(self.kind, n))
        nq, nv = self.coordinates.nq, self.coordinates.nv
        shapes = {
            "parent": (n,), "offset": (n, 3), "axis": (nv, 3), "damping": (nv,),
            "body_joint": (m,), "mass": (m,), "com": (m, 3), "inertia": (m, 3, 3), "gravity": (3,),
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
        for name, joints, ends in (
            ("parent", self.parent, range(n)),
            ("body_joint", self.body_joint, [n] * m),
        ):
            for i, (joint, end) in enumerate(zip(joints, ends)):
                if joint != int(joint) or not -1 <= joint < end:
                    raise ValueError(
                        f"Tree.{name}[{i}] is {joint:g}; a whole number from -1 to {end - 1} is expected"
                    )
            object.__setattr__(self, name, tuple(int(joint) for joint in joints))
        object.__setattr__(self, "axis", tuple(_direction(i, axis) for i, axis in enumerate(self.axis)))
        if min(self.mass) < 0.0:
            raise ValueError(f"Tree.mass is {shown(self.mass)}; masses of at least 0 kg are expected")
        for name, unit in (("damping", "N m s/rad"), ("armature", "kg m2"), ("stiffness", "N m/rad")):
            if min(getattr(self, name)) < 0.0:
                values = shown(getattr(self, name))
                raise ValueError(f"Tree.{name} is {values}; values of at least 0 {unit} are expected")
        for i, joint in enumerate(self.coordinates.joints):
            if joint.kind == "ball":
                _check_ball(i, np.array(self.axis[joint.qd]), self.reference[i], self.rest[joint.q])
        for name, inertia in zip(self.body_names, self.inertia):
            _check_inertia(name, np.array(inertia))
        massive = [any(self.armature[joint.qd]) for joint in self.coordinates.joints]
        for mass, inertia, joint in zip(self.mass, self.inertia, self.body_joint):
            while joint >= 0 and (mass or np.any(inertia)):
                massive[joint], joint = True, self.parent[joint]
        for kind, name, moves_mass in zip(self.kind, self.joint_names, massive):
            if not moves_mass:
                raise ValueError(
                    f"{kind} {name!r} moves nothing that has mass or inertia; Mbar would be singular"
                )
        singular.check_tree(self)

    def __repr__(self) -> str:
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
    def zero(self) -> Numbers:
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

    def lock(self, angles: Mapping[str, ArrayLike]) -> "Tree":
        """The tree without the joints that are named in `angles`: they stay there, at rest.

        What hangs on a locked joint is carried by the joint before it, its vectors turned so that all frames are again parallel
        to the inertial frame where the free joints are at their reference. A joint locked there rounds nothing.

        Parameters
        ----------
        angles : {name: position}
            In rad, of a slide in m, of a ball a quaternion.

        Returns
        -------
        Tree
            Of the other joints, and all bodies.

        Raises
        ------
        ValueError
            For an unknown joint, a position that is none, if no joint is left, or if a controller takes the position of a
            locked joint for the torque at a free one.

        Examples
        --------
        >>> forearm = tmt.ARM.lock({"alpha": 0.0, "beta": 0.0})
        >>> print(forearm.joint_names, tmt.mass_matrix([0.0], forearm).round(9))
        ('gamma',) [[0.05275]]
        """
        return locked(self, angles)

    def moves(self, body: int) -> list[bool]:
        """Which of the n joints move the body: those on its path to the world."""
        on_path = [False] * len(self.parent)
        joint = self.body_joint[body]
        while joint >= 0:
            on_path[joint] = True
            joint = self.parent[joint]
        return on_path


def _kinds(values: Any, n: int) -> tuple[str, ...]:
    """The kinds of the joints; hinges where none is given."""
    listed = isinstance(values, (list, tuple)) or (isinstance(values, np.ndarray) and values.ndim == 1)
    kinds = tuple(values) if listed else (None,)
    if isinstance(values, (list, tuple)) and not kinds:
        return ("hinge",) * n
    if len(kinds) != n or not all(isinstance(kind, str) and kind in KINDS for kind in kinds):
        raise ValueError(f"Tree.kind is {shown(values)}; {n} of {', '.join(KINDS)} are expected")
    return tuple(map(str, kinds))


def _gain(name: str, values: Any, coordinates: Coordinates) -> Rows:
    """The rows of a gain, (nv, nv); () where nothing is fed back."""
    if isinstance(values, tuple | list) and not values:
        return ()
    rows = numbers_of(name, values, (coordinates.nv, coordinates.nv))
    fed = np.array(rows) != 0.0
    for i, joint in enumerate(coordinates.joints):
        if joint.kind == "ball" and (fed[joint.qd].any() or fed[:, joint.qd].any()):
            why = "a ball; of hinges and slides alone is it accepted"
            raise ValueError(f"Tree.{name} has an entry of joint {i}, {why}")
    return rows if fed.any() else ()


def _check_ball(i: int, axes: np.ndarray, reference: float, rest: Numbers) -> None:
    """Raise ValueError unless joint i can be a ball."""
    if np.abs(axes @ axes.T - np.eye(3)).max() > 1e-9 or np.linalg.det(axes) < 0.0:
        raise ValueError(
            f"the axes of joint {i}, a ball, are {axes.tolist()}; a right-handed frame is expected"
        )
    if reference:
        raise ValueError(f"Tree.reference[{i}] is {reference:g}; 0 is expected of a ball")
    if abs(math.hypot(*rest) - 1.0) > CLOSE_TO_ONE:
        raise ValueError(f"Tree.rest of joint {i}, a ball, is {rest}; a quaternion of length 1 is expected")


def _direction(i: int, axis: Numbers) -> Numbers:
    """The axis of speed i at length 1, however long it is."""
    exponent = math.frexp(max(map(abs, axis)))[1]
    axis = tuple(math.ldexp(a, -exponent) for a in axis)  # exact, and the squares neither overflow nor vanish
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        raise ValueError(f"Tree.axis[{i}] is zero; a direction is expected")
    return tuple(a / length for a in axis)


def _check_inertia(name: str, inertia: np.ndarray) -> None:
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
