"""A Tree with its numbers in another type, so that none is rounded on the way: for many digits."""

from collections.abc import Callable
from types import SimpleNamespace

from .space import Vector, sqrt
from .tree import Tree

NUMBERS = (
    "offset", "damping", "mass", "com", "inertia", "gravity", "armature", "stiffness", "rest", "reference",
    "position_gain", "speed_gain",
)  # fmt: skip


def exact_tree(tree: Tree, number: Callable) -> SimpleNamespace:
    """What the method asks of a Tree, each number made by `number` from its double; directions have length 1 in all digits.

    number: mpmath.mpf, or what lifts a float into a trace. Turns about an axis that is a little longer than 1 would not be
    turns, and regrouped sums
    would differ from the literal ones by that.
    """

    def lifted(value):
        return tuple(map(lifted, value)) if isinstance(value, tuple) else number(value)

    axis = []
    for kind, _, by in tree.coordinates.joints:
        own = [Vector(*map(number, direction)) for direction in tree.axis[by]]
        axis.append(_unit(own[0]))
        if kind == "ball":
            axis.append(_unit(own[1] - axis[-1] * axis[-1].dot(own[1])))
            axis.append(axis[-2].cross(axis[-1]))
    return SimpleNamespace(
        **{name: lifted(getattr(tree, name)) for name in NUMBERS},
        axis=tuple(map(tuple, axis)),
        parent=tree.parent,
        kind=tree.kind,
        body_hinge=tree.body_hinge,
        coordinates=tree.coordinates,
        moves=tree.moves,
        has_springs=tree.has_springs,
        has_gains=tree.has_gains,
    )


def _unit(vector) -> Vector:
    """The vector at length 1."""
    return vector * (1 / sqrt(vector.dot(vector)))
