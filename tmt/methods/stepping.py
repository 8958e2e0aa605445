"""What a method of integration is, `Method`, and the `Dynamics` that its `slope` asks for accelerations.

Another way to have accelerations is a subclass of Dynamics: with calls in compiled code (forms.py), with
derivatives by those of the linear system (derivatives.py). What a method is able to do is said by its fields;
nothing asks for its type.
"""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

from tmt.derivation import method
from tmt.derivation.coordinates import FLAT, Coordinates, Flat
from tmt.derivation.mechanism import AnyTree
from tmt.derivation.method import Terms
from tmt.derivation.vectors import Rows, Scalar, Scalars, Values, solve, solve_any

Slope = Callable[[Values, Values], Values]
State = tuple[Values, Values]
Joints = Coordinates | Flat
DIVERGED, NEWTON, SMALL = 1, 2, 3  # why a run ends; 0: it does not


class Implicit(NamedTuple):
    """What a method takes at the end of its step: (Mbar + matrix [+ dt dh/dqd in rows]) a = Qbar - pull."""

    matrix: Rows  # (nv, nv)
    pull: Values  # (nv,), N m
    dt: Scalar  # s
    bias_rows: frozenset[int]  # speeds of whose bias it takes the change

    @property
    def acts_at_single_joints(self) -> bool:
        """Whether all of it is diagonal."""
        across = [x for i, row in enumerate(self.matrix) for j, x in enumerate(row) if i != j]
        return not self.bias_rows and all(isinstance(x, float) and x == 0.0 for x in across)


Held = Implicit | None


class Dynamics:
    """Accelerations from Mbar and h, which `terms` gives."""

    def __init__(self, terms: Terms = method.mass_matrix_and_bias):
        self.terms = terms

    def acceleration(
        self, tree: AnyTree, q: Values, qd: Values, tau: Values, implicit: Held = None
    ) -> Values:
        """a (nv,) from Mbar a = Qbar, or from the linear system of an implicit method."""
        M, h = self.terms(tree, q, qd)
        force = method.reduced_force(tree, h, q, qd, tau)
        if implicit is None:
            return solve(M, force)
        matrix = [plus(*rows) for rows in zip(M, implicit.matrix)]
        if implicit.bias_rows:
            rates = self.bias_rates(tree, q, qd)
            for i in implicit.bias_rows:
                matrix[i] = plus(matrix[i], [implicit.dt * rate for rate in rates[i]])
        return self.solve_any(matrix, minus(force, implicit.pull))

    def bias_rates(self, tree: AnyTree, q: Values, qd: Values) -> Rows:
        return method.bias_rates(tree, q, qd, self.terms)

    def solve_any(self, matrix: Rows, right: Values) -> Values:
        return solve_any(matrix, right)


LITERAL = Dynamics()


class Method:
    """A method of integration. Another one is a subclass with a `step`; it must be hashable, as a frozen dataclass is.

    `step(slope, q, qd, dt)` returns the state (q, qd) one dt later, each a list of n scalars of any type; it
    asks `slope(q, qd)` for accelerations, a list of n. Which accelerations these are is said by the method's
    own `slope`. For a tree with balls it is given their coordinates too (coordinates.py), `step(slope, q, qd,
    dt, joints)`: q is longer than qd.
    """

    order: int = 1  # the error of a run falls with dt to this power
    adaptive = False  # chooses its own steps, takes a tolerance and has an `attempt`, see AdaptiveRungeKutta
    solves_stages = False  # its stages solve an equation: it has `stage_states` and `finish`, see implicit.py

    @cached_property
    def stages(self) -> int:
        """Evaluations of the dynamics in one step; of a method that solves its stages, in one iteration."""
        positions = []

        def slope(q: Values, qd: Values) -> Values:
            positions.append(q)
            return [0.0]

        self.step(slope, [0.0], [0.0], 1.0)
        return len(positions)

    def slope(
        self, tree: AnyTree, q: Values, qd: Values, tau: Values, dt: Scalar, dynamics: Dynamics = LITERAL
    ) -> Values:
        """qdd from Mbar qdd = tau - D qd - h."""
        return dynamics.acceleration(tree, q, qd, tau)

    def step(self, slope: Slope, q: Values, qd: Values, dt: Scalar, joints: Joints = FLAT) -> State:
        """The state (q, qd) one dt later, from `slope(q, qd)`."""
        raise NotImplementedError


def stepped(stepping: Method, tree: AnyTree, slope: Slope, q: Values, qd: Values, dt: Scalar) -> State:
    """The state (q, qd) of a tree one dt later by a method that asks `slope(q, qd)`."""
    joints = tree.coordinates
    return stepping.step(slope, q, qd, dt, joints) if joints.balls else stepping.step(slope, q, qd, dt)


def increments(dt: Scalar, weights: Sequence[float], slopes: Sequence[Values], n: int) -> Values:
    """dt * sum of weights * slopes, (n,); 0.0 where there are none."""
    return advance([0.0] * n, dt, weights, slopes)


def advance(start: Values, dt: Scalar, weights: Sequence[float], slopes: Sequence[Values]) -> Values:
    """start + dt * sum of weights * slopes, component by component."""
    result = []
    for k, value in enumerate(start):
        terms = [slope[k] if w == 1.0 else w * slope[k] for w, slope in zip(weights, slopes) if w != 0.0]
        result.append(value + dt * sum(terms[1:], terms[0]) if terms else value)
    return result


def plus(first: Scalars, second: Scalars) -> Values:
    return [a + b for a, b in zip(first, second)]


def minus(first: Scalars, second: Scalars) -> Values:
    return [a - b for a, b in zip(first, second)]
