"""Every quantity of a state, in one table: what it takes, its shape and unit, how it follows from the bodies.

The literal form (literal.py), the compiled one (compiled/evaluator.py) and the truth in many digits
(exact/values.py) are all served from it.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

from tmt.derivation.scalar import Scalar

from . import method
from .mechanism import AnyTree
from .vectors import ZERO, Scalars, solve


class State:
    """A state of a tree, by default at rest and without torque, and what follows from it: each part once."""

    def __init__(self, tree: AnyTree, q: Scalars, qd: Scalars | None = None, tau: Scalars | None = None):
        nothing = [0.0] * len(tree.axis)
        self.tree, self.q, self.moves = tree, q, qd is not None
        self.qd, self.tau = qd or nothing, tau or nothing

    @cached_property
    def bodies(self) -> list[method.Body]:
        return method.bodies(self.tree, self.q, self.qd if self.moves else None)

    @cached_property
    def mass_matrix(self) -> list[list[Scalar]]:
        return method.mass_matrix(self.bodies, self.tree.armature)

    @cached_property
    def bias(self) -> list[Scalar]:
        return method.bias(self.bodies, self.tree.gravity)

    @property
    def gravity_balance(self) -> list[Scalar]:
        at_rest = [b._replace(omega=ZERO, v_conv=ZERO, w_conv=ZERO) for b in self.bodies]
        return method.bias(at_rest, self.tree.gravity)

    @property
    def acceleration(self) -> list[Scalar]:
        Qbar = method.reduced_force(self.tree, self.bias, self.q, self.qd, self.tau)
        return solve(self.mass_matrix, Qbar)

    @property
    def potential_energy(self) -> Scalar:
        return method.potential(self.bodies, self.tree.gravity) + method.spring_energy(self.tree, self.q)

    @property
    def energy(self) -> Scalar:
        return self.potential_energy + method.kinetic(self.bodies, self.qd, self.tree.armature)


class Quantity(NamedTuple):
    """A quantity of a state."""

    takes: tuple[str, ...]  # of "q", "qd", "tau"
    shape: tuple[int | str, ...]  # m bodies, nv speeds
    unit: str
    of: Callable[[State], Any]  # -> nested lists of scalars in that shape
    parts: tuple[str, ...] = ()  # the names of the arrays of which there are several, in that order


Q, QD, TAU = ("q",), ("q", "qd"), ("q", "qd", "tau")
QUANTITIES = {
    "com_positions": Quantity(Q, ("m", 3), "m", lambda s: [list(b.x) for b in s.bodies]),
    "angular_velocities": Quantity(QD, ("m", 3), "rad/s", lambda s: [list(b.omega) for b in s.bodies]),
    "jacobians": Quantity(
        Q, (2, "m", 3, "nv"), "m/rad; 1",
        lambda s: [[list(zip(*b.T)) for b in s.bodies], [list(zip(*b.B)) for b in s.bodies]], ("T", "B"),
    ),
    "convective_terms": Quantity(
        QD, (2, "m", 3), "m/s2; rad/s2",
        lambda s: [[list(b.v_conv) for b in s.bodies], [list(b.w_conv) for b in s.bodies]],
        ("v_conv", "w_conv"),
    ),
    "mass_matrix": Quantity(Q, ("nv", "nv"), "kg m2", lambda s: s.mass_matrix),
    "bias": Quantity(QD, ("nv",), "N m", lambda s: s.bias),
    "gravity_balance": Quantity(Q, ("nv",), "N m", lambda s: s.gravity_balance),
    "spring_torque": Quantity(Q, ("nv",), "N m", lambda s: method.spring_torque(s.tree, s.q)),
    "acceleration": Quantity(TAU, ("nv",), "rad/s2", lambda s: s.acceleration),
    "potential_energy": Quantity(Q, (), "J", lambda s: s.potential_energy),
    "energy": Quantity(QD, (), "J", lambda s: s.energy),
}  # fmt: skip


def shape_of(name: str, tree: AnyTree) -> tuple[int, ...]:
    sizes = {"m": len(tree.mass), "nv": len(tree.axis)}
    return tuple(size if isinstance(size, int) else sizes[size] for size in QUANTITIES[name].shape)
