"""The semi-implicit Euler method: what MuJoCo calls Euler, implicitfast, implicit and discrete."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

from tmt.derivation.coordinates import Coordinates
from tmt.derivation.form import LITERAL, Form, Implicit
from tmt.derivation.mechanism import Mechanism
from tmt.derivation.method import with_diagonal
from tmt.derivation.vectors import Scalar, Values, weighted

from .stepping import Method, Slope, State, advance, increments

T = TypeVar("T")
Gains = Sequence[Sequence[float]]


@dataclass(frozen=True)
class SemiImplicitEuler(Method):
    """qd+ = qd + dt a, then q+ = q moved by dt qd+, with a from the linear system

        (Mbar + dt D [+ dt dh/dqd] [+ dt S] [+ dt^2 (k + P)]) a = Qbar [- dt (k + P) qd].

    Joint damping is implicit in the speeds, and so is the bias if `implicit_bias`, or that of
    `isolated_bodies`, which have no other body on them or under them; `implicit_gains`: so is a controller's
    S, in the entries whose two joints lie on one path to the world; `implicit_springs`: so are springs, and
    all entries of S and P. What MuJoCo calls Euler (none of these), implicit (bias, gains), implicitfast
    (lone bodies, gains) and discrete (lone bodies, springs, gains). MuJoCo documentation, numerical
    integration; which gains are implicit was measured.
    """

    implicit_bias: bool
    isolated_bodies: bool = False
    implicit_springs: bool = False
    implicit_gains: bool = False

    def stiffness_and_damping(self, tree: Mechanism) -> tuple[Gains, Gains]:
        """What is implicit of the torques that are linear in q and in qd, (nv, nv) each."""
        stiffness, nothing = [0.0] * len(tree.axis), tuple[tuple[float, ...], ...]()
        gain, damping = nothing, nothing
        if self.implicit_springs:
            gain, damping, stiffness = tree.position_gain, tree.speed_gain, by_speed(tree, tree.stiffness)
        elif self.implicit_gains:
            connected = zip(tree.speed_gain, on_one_path(tree))
            damping = tuple(tuple(S if is_on else 0.0 for S, is_on in zip(*rows)) for rows in connected)
        return with_diagonal(gain, stiffness), with_diagonal(damping, tree.damping)

    def implicit(self, tree: Mechanism, qd: Values, dt: Scalar) -> Implicit:
        (stiff, damped), powers, moved = self.stiffness_and_damping(tree), (dt, dt * dt), [dt * v for v in qd]
        matrix = [[weighted(entry, powers) for entry in zip(*rows)] for rows in zip(damped, stiff)]
        force = [weighted(row, moved) for row in stiff]
        alone = isolated_speeds(tree) if self.isolated_bodies else frozenset()
        return Implicit(matrix, force, dt, frozenset(range(len(qd))) if self.implicit_bias else alone)

    def slope(
        self, tree: Mechanism, q: Values, qd: Values, tau: Values, dt: Scalar, form: Form = LITERAL
    ) -> Values:
        return form.acceleration(tree, q, qd, tau, self.implicit(tree, qd, dt))

    def step(self, slope: Slope, q: Values, qd: Values, dt: Scalar, joints: Coordinates) -> State:
        qd = advance(qd, dt, (1.0,), [slope(q, qd)])
        return joints.move(q, increments(dt, (1.0,), [qd], len(qd))), qd


def by_speed(tree: Mechanism, of_joints: Iterable[T]) -> list[T]:
    pairs = zip(of_joints, tree.coordinates.joints)
    return [value for value, joint in pairs for _ in joint.speeds]


@lru_cache(maxsize=64)
def on_one_path(tree: Mechanism) -> list[list[bool]]:
    before = [tree.path(i) for i in range(len(tree.parent))]
    joint = by_speed(tree, range(len(tree.parent)))
    return [[i in before[j] or j in before[i] for j in joint] for i in joint]


@lru_cache(maxsize=64)
def isolated_speeds(tree: Mechanism) -> frozenset[int]:
    """The speeds of free bodies (three slides and a ball from the world) that carry nothing."""
    lone: set[int] = set()
    for i in range(3, len(tree.kind)):
        chain = [i - 3, i - 2, i - 1, i]
        is_free = [tree.kind[j] for j in chain] == ["slide", "slide", "slide", "ball"]
        from_world = [tree.parent[j] for j in chain] == [-1, *chain[:3]]
        carries_one_body = i not in tree.parent and [b for b in tree.body_joint if b in chain] == [i]
        if is_free and from_world and carries_one_body:
            lone.update(range(tree.coordinates.joints[i - 3].qd.start, tree.coordinates.joints[i].qd.stop))
    return frozenset(lone)
