"""Numbers of the model and of forces that can be wrong.

A change x of one adds x times a coefficient to numbers of the tree, or x times a column to entries of Mbar or
h.
"""

from collections.abc import Iterable, Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

import tmt

from ...core.words import listed
from ...robots.coordinates import Coordinates
from ..hypothesis import OF_ZERO, RARE, Hypothesis, number
from ..layout import MOST_SPEEDS
from ..model import WHOLE, Equations, Frame, Path

XYZ = "xyz"
INERTIA = (("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2))
# costs: a force of another joint, a force in h, damping of all joints, the zero of a joint
CROSS, IN_BIAS, OF_ALL, ZERO = 0.3, 0.2, 0.1, 0.05
ONE = np.array(1.0)
OF_FORCES = ("N m s/rad", "N m/rad", "N m", "rad")  # units of damping, stiffness, a force, a rest position
OF_SLIDES = {"N m s/rad": "N s/m", "N m/rad": "N/m", "N m": "N", "kg m2": "kg", "rad": "m"}  # units


class Owners(NamedTuple):
    """Bodies or joints in which a slip is made, and how they are said together."""

    name: str
    at: list[int]


def owners_of(names: list[str], every: str, together: Iterable[list[int]] = ()) -> list[Owners]:
    """Each, some together, and all."""
    sets = [*([k] for k in range(len(names))), *(those for those in together if 1 < len(those) < len(names))]
    owners = [Owners(listed([names[k] for k in those]), those) for those in sets]
    return owners + [Owners(every, list(range(len(names))))] * (len(names) > 1)


def sets_of_bodies(tree: tmt.Tree) -> list[Owners]:
    """Each body, and all."""
    return owners_of(list(tree.body_names), "every body")


def sets_of_joints(tree: tmt.Tree) -> list[Owners]:
    """Each joint, hinges about equal axes, and all."""
    axes: dict[tuple[float, ...], list[int]] = {}
    for i, joint in enumerate(tree.coordinates.joints):
        if joint.kind == "hinge":
            axes.setdefault(tuple(tree.axis[joint.qd.start]), []).append(i)
    return owners_of(list(tree.joint_names), "every joint", axes.values())


def unit_of(unit: str, kind: str) -> str:
    """The unit of a number of a joint: as given, for a joint that turns, or its counterpart for a slide."""
    return OF_SLIDES.get(unit, unit) if kind == "slide" else unit


def forces(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> Iterator[Hypothesis]:
    """Damping, spring, friction and a constant force of each joint, and damping of all together."""
    names = Coordinates(tree.joint_names, tree.kind).speeds
    for i, joint in enumerate(tree.coordinates.joints):
        of_damping, of_stiffness, of_force, of_angle = (unit_of(unit, joint.kind) for unit in OF_FORCES)
        for v in range(joint.qd.start, joint.qd.stop):
            name, speed, one = names[v], qd * np.eye(qd.shape[1])[v], 0.0 * qd + np.eye(qd.shape[1])[v]
            constant = number(f"constant force at {name}", 0.0, of_force, column=one)
            yield number(f"damping of {name}", tree.damping[v], of_damping, column=speed, least=0.0)
            yield number(f"friction of {name}", 0.0, of_force, column=np.sign(speed), least=0.0)
            if joint.kind != "ball":
                stiffness, rest = tree.stiffness[i], tree.reference[i]
                if stiffness > 0.0:
                    rest = tree.rest[joint.q.start]
                    constant = number(f"springref of {name}", rest, of_angle, column=-stiffness * one)
                moved = (q[:, joint.q] - rest) * one
                yield number(f"stiffness of {name}", stiffness, of_stiffness, column=moved, least=0.0)
            yield constant
    yield from forces_of_others(tree, q, qd)
    if len(tree.joint_names) > 1:
        yield number("damping added to every joint", 0.0, "N m s/rad", OF_ALL, column=qd, least=0.0)


def forces_of_others(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> Iterator[Hypothesis]:
    """Forces at a hinge or slide of the speed or displacement of another one, or of the cube of its own."""
    straight = [(i, joint) for i, joint in enumerate(tree.coordinates.joints) if joint.kind != "ball"]
    for (i, joint), (k, other) in product(straight, straight) if len(straight) <= MOST_SPEEDS else ():
        name, unit, force = tree.joint_names[k], unit_of("rad", other.kind), unit_of("N m", joint.kind)
        moved, speed = q[:, other.q] - tree.reference[k], qd[:, other.qd]
        laws = [(f"the speed of {name}", f"{force} s/{unit}", speed), (name, f"{force}/{unit}", moved)]
        if i == k:
            laws = [(f"{name}^3", f"{force}/{unit}3", moved**3)]
        for what, of_number, column in laws:
            column = column * np.eye(qd.shape[1])[joint.qd.start]
            yield number(
                f"force at {tree.joint_names[i]} of {what}", 0.0, of_number, CROSS, "cross", column=column
            )


def forces_in_bias(equations: Equations) -> Iterator[Hypothesis]:
    """Damping and springs of joints that were added to h."""
    none, zero = 0.0 * equations.parts[0], 0.0 * equations.qd
    for one in forces(equations.tree, equations.q, equations.qd):
        quantity = one.cause.place.partition(" ")[0]
        if one.cause.kind == "number" and quantity in ("damping", "stiffness"):
            parts = (one.column, zero) if quantity == "damping" else (zero, one.column)
            column = equations.layout.packed(none, *parts)
            place, unit = f"{one.cause.place} in h", one.cause.unit
            yield number(place, 0.0, unit, IN_BIAS, "force", column=column, least=0.0)


def numbers(equations: Equations) -> Iterator[Hypothesis]:
    """Every number of the tree. "anchor": the joint moves, all that it carries stays in place."""
    tree, stated = equations.tree, equations.stated
    length = max(1e-3, float(np.abs(stated["offset"]).max()), float(np.abs(stated["com"]).max()))
    heaviest = stated["mass"].max()

    def component(
        name: str, unit: str, size: float, path: Path, along: np.ndarray = ONE,
        origin: np.ndarray | float = 0.0, least: float = -np.inf, kind: str = "number", cost: float = 0.0,
    ) -> Hypothesis:  # fmt: skip
        """A number, or a component of a vector or tensor along an axis, or the product of two, of a frame."""
        now = float((along * (stated[path.field][path.at] - origin)).sum() / (along * along).sum())
        moves = [(Path(path.field, (*path.at, *at)), float(x)) for at, x in np.ndenumerate(along) if x]
        now = 0.0 if abs(now) < WHOLE * size else now
        return number(name, now, unit, cost, kind, size=float(size), moves=tuple(moves), least=least)

    def triple(name: str, unit: str, size: float, path: Path, frame: Frame) -> list[Hypothesis]:
        axes = zip(XYZ, frame.axes.T)
        return [component(name.format(axis), unit, size, path, along, frame.origin) for axis, along in axes]

    for b, body in enumerate(tree.body_names):
        heavy = stated["mass"][b] or heaviest
        yield component(f"mass of {body}", "kg", heavy, Path("mass", (b,)), least=0.0)
        frame = equations.frame_of(b)
        yield from triple(f"CoM {{}} of {body}", "m", length, Path("com", (b,)), frame)
        size = np.abs(stated["inertia"][b]).max() or heavy * length**2
        for name, i, j in INERTIA:
            along = np.outer(frame.axes[:, i], frame.axes[:, j])
            along, least = (along, 0.0) if i == j else (along + along.T, -np.inf)
            called = f"inertia {name} of {body}"
            yield component(called, "kg m2", size, Path("inertia", (b,)), along, least=least)
    for i, (name, joint) in enumerate(equations.joints.items()):
        carried = [("com", b) for b, of_joint in enumerate(tree.body_joint) if of_joint == i]
        carried += [("offset", j) for j, parent in enumerate(tree.parent) if parent == i]
        of_parent = Frame(np.zeros(3), equations.axes_at(tree.parent[i]))
        offsets = triple(f"offset {{}} of {name}", "m", length, Path("offset", (i,)), of_parent)
        for axis, one in zip(XYZ, offsets):
            yield one
            if joint.kind != "slide":
                pairs = product(carried, one.moves)
                stays = [(Path(field, (index, path.at[1])), -x) for (field, index), (path, x) in pairs]
                moves, stated_at = (*one.moves, *stays), float(one.cause.stated)
                yield number(f"anchor {axis} of {name}", stated_at, "m", RARE, size=one.size, moves=moves)
        if joint.kind != "ball":
            size = length if joint.kind == "slide" else 1.0
            unit, path = unit_of("rad", joint.kind), Path("reference", (i,))
            yield component(f"zero of {name}", unit, size, path, kind=OF_ZERO, cost=ZERO)
            own = Frame(np.zeros(3), equations.axes_at(i))
            yield from triple(f"axis {{}} of {name}", "", 0.5, Path("axis", (joint.qd.start,)), own)
        for speed in range(joint.qd.start, joint.qd.stop):
            size = heaviest * (1.0 if joint.kind == "slide" else length**2)
            path, unit = Path("armature", (speed,)), unit_of("kg m2", joint.kind)
            yield component(f"armature of {equations.speeds[speed]}", unit, size, path, least=0.0)
    yield from triple("gravity {}", "m/s2", 9.81, Path("gravity", ()), Frame(np.zeros(3), np.eye(3)))
