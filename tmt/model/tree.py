"""A kinematic tree of joints that carry rigid bodies, as plain numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from textwrap import shorten
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmt.derivation.coordinates import Joint
from tmt.derivation.mechanism import Mechanism

from . import checks, singular
from .joint import Joint as JointOfTree
from .joint import fields_of
from .lock import locked
from .values import names, numbers_of, require

# fields that may be left out
OPTIONAL = ("reference", "armature", "stiffness", "rest", "site_offset", "site_rotation")
ABSENT = {"site_rotation": np.eye(3)}  # what stands for them, where it is not zero
GAINS = ("position_gain", "speed_gain")  # and those of a controller, which are () where there is none
NOT_NEGATIVE = {"mass": "kg", "damping": "N m s/rad", "armature": "kg m2", "stiffness": "N m/rad"}
NAMES_SHOWN = 60  # characters


@dataclass(frozen=True, init=False, match_args=False)
class Tree(Mechanism):
    """A tree of n joints and m rigid bodies; at the reference of all joints the frames are parallel to the inertial one.

    A joint is a hinge, a slide or a ball; a free joint is three slides and a ball. Each has a frame that
    moves with it, with its origin on the axis of a hinge, at the centre of a ball. Several joints in one body
    are joints in a row with no body between them. There are nv speeds, one of a hinge or slide and three of a
    ball, and nq numbers in a position. All fields are nested tuples, made of arrays and lists; those from
    `kind` on may be left out, as (). ValueError if the numbers cannot be a tree or a rigid body.

    Parameters
    ----------
    joint_names, body_names : (n,) and (m,)
    parent : (n,) index of the joint before this one, always a smaller one; -1: fixed to the world
    offset : (n, 3), m, from the origin of the parent's frame to this joint, in the parent's frame
    axis : (nv, 3) directions of the speeds; of a ball three at right angles, which turn with it
    damping : (nv,), N m s/rad or N s/m, force -damping * qd
    body_joint : (m,) index of the last joint that moves the body; -1: fixed to the world
    mass, com : (m,), kg, and (m, 3), m, centre of mass in the frame of its joint
    inertia : (m, 3, 3), kg m2, about the centre of mass, in the frame of its joint
    gravity : (3,), m/s2, inertial frame
    kind : (n,) "hinge", "slide" or "ball"; (): all are hinges
    armature : (nv,), kg m2 or kg, inertia of a rotor, on the diagonal of Mbar alone
    stiffness : (n,), N m/rad or N/m, of a spring at each joint
    rest : (nq,), rad, m and quaternions, where the springs are without force; (): at the reference
    reference : (n,), rad or m, where the joint leaves frames parallel; 0 for a ball
    position_gain, speed_gain : (nv, nv), N m/rad or N/m, and N m s/rad or N s/m, of hinges and slides
        Of a linear controller: torque = tau - position_gain @ q - speed_gain @ qd, q as it stands.
    site_names, site_joint : (k,) of further frames for `frame`, and the index of their joint; -1: the world
    site_offset : (k, 3), m, from the origin of the joint's frame to the site's, in the frame of the joint
    site_rotation : (k, 3, 3) the axes of the site as columns, in the frame of the joint; (): parallel to it

    >>> pendulum = tmt.Tree(
    ...     joint_names=["hip"], parent=[-1], offset=[(0, 0, 0)], axis=[(0, 1, 0)], damping=[0.1],
    ...     body_names=["rod"], body_joint=[0], mass=[1.0], com=[(0, 0, -0.5)],
    ...     inertia=[np.diag([0.1, 0.1, 0.01])], gravity=(0, 0, -9.81),
    ... )
    >>> print(tmt.mass_matrix(pendulum, [0.0]))  # 0.1 + 1 kg (0.5 m)^2
    [[0.35]]
    """

    def __init__(
        self, joint_names: Sequence[str], parent: ArrayLike, offset: ArrayLike, axis: ArrayLike, damping: ArrayLike,
        body_names: Sequence[str], body_joint: ArrayLike, mass: ArrayLike, com: ArrayLike, inertia: ArrayLike,
        gravity: ArrayLike, kind: Sequence[str] = (), armature: ArrayLike = (), stiffness: ArrayLike = (),
        rest: ArrayLike = (), reference: ArrayLike = (), position_gain: ArrayLike = (), speed_gain: ArrayLike = (),
        site_names: Sequence[str] = (), site_joint: ArrayLike = (), site_offset: ArrayLike = (),
        site_rotation: ArrayLike = (),
    ) -> None:  # fmt: skip
        given = locals()
        for name in ("joint_names", "body_names", "site_names"):
            self._set(name, names(name, given[name]))
        n, m, k = len(self.joint_names), len(self.body_names), len(self.site_names)
        self._set("kind", checks.kinds(kind, n))
        nq, nv = self.nq, self.nv
        shapes = {
            "parent": (n,), "offset": (n, 3), "axis": (nv, 3), "damping": (nv,),
            "body_joint": (m,), "mass": (m,), "com": (m, 3), "inertia": (m, 3, 3), "gravity": (3,),
            "reference": (n,), "armature": (nv,), "stiffness": (n,), "rest": (nq,),
            "site_joint": (k,), "site_offset": (k, 3), "site_rotation": (k, 3, 3),
        }  # fmt: skip
        for name, shape in shapes.items():
            value = given[name]
            if name in OPTIONAL and isinstance(value, tuple | list) and not value:
                value = self.zero if name == "rest" else np.broadcast_to(ABSENT.get(name, 0.0), shape)
            self._set(name, numbers_of(name, value, shape))
        for name in GAINS:
            self._set(name, checks.gain(name, given[name], self.coordinates))
        if n == 0 or m == 0:
            raise ValueError("a Tree needs at least one joint and one body")
        self._set("parent", checks.indices("parent", self.parent, range(n)))
        self._set("body_joint", checks.indices("body_joint", self.body_joint, [n] * m))
        self._set("site_joint", checks.indices("site_joint", self.site_joint, [n] * k))
        for name, rotation in zip(self.site_names, self.site_rotation):
            checks.check_axes(f"Tree.site_rotation of {name!r}", np.array(rotation).T)
        self._set("axis", tuple(checks.direction(i, axis) for i, axis in enumerate(self.axis)))
        for name, unit in NOT_NEGATIVE.items():
            values = getattr(self, name)
            require(min(values) >= 0.0, f"Tree.{name}", values, f"values of at least 0 {unit} are")
        for i, joint in enumerate(self.coordinates.joints):
            if joint.kind == "ball":
                checks.check_ball(i, np.array(self.axis[joint.qd]), self.reference[i], self.rest[joint.q])
        for name, inertia in zip(self.body_names, self.inertia):
            checks.check_inertia(name, np.array(inertia))
        singular.check_tree(self)

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def __hash__(self) -> int:
        return hash((self.joint_names, self.mass))  # a key in each call: all fields take as long as M

    def __repr__(self) -> str:
        n, m = len(self.joint_names), len(self.body_names)
        names = shorten(", ".join(self.joint_names), NAMES_SHOWN, placeholder=" ...")
        return f"Tree({n} joint{'s' if n > 1 else ''}: {names}; {m} {'bodies' if m > 1 else 'body'})"

    @classmethod
    def from_joints(
        cls, joints: Iterable[JointOfTree], gravity: ArrayLike = (0.0, 0.0, -9.81), **fields: Any
    ) -> Tree:
        """The tree of joints, each written with the body that it moves; at its zero all frames are parallel.

        Parameters
        ----------
        joints : sequence of tmt.Joint
            Each after the joint that carries it.
        gravity : (3,), m/s2, inertial frame
        fields : further fields of a Tree, such as site_names

        >>> double = tmt.Tree.from_joints([
        ...     tmt.Joint("hip", axis=(0, 1, 0), mass=1.0, com=(0, 0, -0.5), inertia=(0.1, 0.1, 0.01)),
        ...     tmt.Joint("knee", offset=(0, 0, -1), axis=(0, 1, 0), mass=0.5, com=(0, 0, -0.4)),
        ... ])
        >>> print(tmt.mass_matrix(double, [0.0, 0.0])[1, 1].round(9))  # 0.5 kg (0.4 m)^2
        0.08
        """
        return cls(gravity=gravity, **fields_of(joints) | fields)

    @property
    def nq(self) -> int:
        """How many numbers a position has."""
        return self.coordinates.nq

    @property
    def nv(self) -> int:
        """How many speeds there are."""
        return self.coordinates.nv

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Of each joint its kind and the slices of q and qd that are its own."""
        return self.coordinates.joints

    @property
    def inertial_parameters(self) -> NDArray[np.float64]:
        """Theta (10 m,) of `regressor`: of each body kg; kg m, x y z; kg m2, xx yy zz xy xz yz; in its joint's frame."""
        rows = []
        for mass, com, inertia in zip(self.mass, np.array(self.com), np.array(self.inertia)):
            J = inertia + mass * (com @ com * np.eye(3) - np.outer(com, com))
            rows.append([mass, *mass * com, *np.diag(J), J[0, 1], J[0, 2], J[1, 2]])
        return np.array(rows).ravel()

    @property
    def never_singular(self) -> bool:
        """Whether Mbar is known to be regular at every q; else it may be singular at some."""
        return singular.never(self)

    def lock(self, angles: Mapping[str, ArrayLike]) -> Tree:
        """The tree of the other joints and all bodies; those named in `angles` stay there, at rest.

        What hangs on a locked joint is carried by the joint before it. A joint locked at its reference rounds
        nothing. ValueError for an unknown joint, a position that is none, if no joint is left, or if a
        controller takes the position of a locked joint for the torque at a free one.

        Parameters
        ----------
        angles : {name: position}, rad, of a slide m, of a ball a quaternion

        >>> forearm = tmt.ARM.lock({"alpha": 0.0, "beta": 0.0})
        >>> print(forearm.joint_names, tmt.mass_matrix(forearm, [0.0]).round(9))
        ('gamma',) [[0.05275]]
        """
        return replace(self, **locked(self, angles))


def checked_model(model: Any) -> None:
    require(isinstance(model, Tree), "model", model, "a tmt.Tree is")


def stated(value: Any) -> str:
    """All fields of a Tree or another dataclass: equal for equal ones of a class alone."""
    return repr([getattr(value, field.name) for field in fields(value)])
