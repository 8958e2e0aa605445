"""Every quantity of a state, in one table: what it takes, its shape and unit, how it follows from the bodies.

The literal form, the compiled one and the truth in many digits (exact/many.py) are all served from it.
"""

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from . import method, whole
from .dual import jacobian, unit_vectors, values_of
from .form import LITERAL, Form, Rates
from .mechanism import Mechanism
from .vectors import ZERO, Factors, Rows, Scalar, Scalars, Values, added

# (q, qd, tau, dt): q, qd one dt later
Step = Callable[[Values, Values, Values, Scalar], tuple[Values, Values]]


class State:
    """A state of a tree, and what follows from it: each part once.

    given: q and, by default at rest and without torque, qd and tau; qdd, by default those under tau; dt of a
    step. name: of the frame that is asked for.
    """

    def __init__(
        self, tree: Mechanism, given: Mapping[str, Scalars], form: Form = LITERAL, name: str = "",
        step: Step | None = None,
    ):  # fmt: skip
        nothing = [0.0] * len(tree.axis)
        self.tree, self.q, self.moves = tree, given["q"], "qd" in given
        self.qd, self.tau = given.get("qd", nothing), given.get("tau", nothing)
        self.form, self.name, self.step, self.given = form, name, step, given
        self.at_once = all(isinstance(x, float | np.ndarray) for x in (*self.q, *self.qd))

    @cached_property
    def bodies(self) -> list[method.Body]:
        return method.bodies(self.tree, self.q, self.qd if self.moves else None)

    @cached_property
    def mass_matrix(self) -> Rows:
        if self.form is LITERAL:
            return method.mass_matrix(self.bodies, self.tree.armature)
        return self.form.terms(self.tree, self.q, self.qd)[0]

    @cached_property
    def bias(self) -> Values:
        if self.form is LITERAL:
            return method.bias(self.bodies, self.tree.gravity)
        return self.form.terms(self.tree, self.q, self.qd)[1]

    @property
    def gravity_balance(self) -> Values:
        if self.form is not LITERAL:
            return self.form.terms(self.tree, self.q, [0.0] * len(self.qd))[1]
        at_rest = [b._replace(omega=ZERO, v_conv=ZERO, w_conv=ZERO) for b in self.bodies]
        return method.bias(at_rest, self.tree.gravity)

    @cached_property
    def factors(self) -> Factors:
        return Factors(self.mass_matrix)

    @property
    def acceleration(self) -> Values:
        return self.form.acceleration(self.tree, list(self.q), list(self.qd), list(self.tau))

    @cached_property
    def qdd(self) -> Values:
        return list(self.given["qdd"]) if "qdd" in self.given else self.acceleration

    @property
    def inverse_dynamics(self) -> Values:
        return method.inverse_dynamics(self.tree, self.q, self.qd, self.force(self.q, self.qd))

    def force(self, q: Scalars, qd: Scalars) -> Values:
        return self.form.generalized_force(self.tree, q, qd, self.qdd)

    @property
    def force_rates(self) -> Rates:
        """Derivatives of Mbar qdd + h by tangent vectors of q and by qd, (nv, nv) each."""
        if self.form.rates is None:
            by_tangent = self.by_tangent(lambda q: self.force(q, self.qd))
            by_speed = jacobian(lambda qd: self.force(self.q, qd), list(self.qd), at_once=self.at_once)
            return by_tangent, by_speed
        return self.form.rates(self.tree, self.q, self.qd, self.qdd)

    @cached_property
    def torque_rates(self) -> Rates:
        by_tangent, by_speed = self.force_rates
        nothing, qd = [0.0] * len(self.qd), list(self.qd)
        if self.tree.has_springs or self.tree.position_gain:
            pulled = self.by_tangent(lambda q: method.inverse_dynamics(self.tree, q, qd, nothing))
            by_tangent = added(by_tangent, pulled)
        damped = method.with_diagonal(self.tree.speed_gain, self.tree.damping)
        return by_tangent, added(by_speed, damped)

    def by_tangent(self, function: Callable[[Values], Values]) -> Rows:
        moved = [self.tree.coordinates.component_rates(self.q, u) for u in unit_vectors(len(self.qd))]
        return jacobian(function, list(self.q), moved, self.at_once)

    @property
    def derivatives(self) -> list[Rows]:
        solved = [self.factors.solve_columns(rows) for rows in self.torque_rates]
        changes = [[[x * -1.0 for x in row] for row in rows] for rows in solved]
        return [*changes, self.factors.inverted(), *self.torque_rates]

    @property
    def coriolis_matrix(self) -> Rows:
        rates = self.form.bias_rates(self.tree, list(self.q), list(self.qd))
        return whole.coriolis_matrix(self.tree, self.qd, self.mass_matrix, rates)

    @property
    def potential_energy(self) -> Scalar:
        return method.potential(self.bodies, self.tree.gravity) + method.spring_energy(self.tree, self.q)

    @property
    def energy(self) -> Scalar:
        return self.potential_energy + method.kinetic(self.bodies, self.qd, self.tree.armature)

    @cached_property
    def frame(self) -> tuple[Rows, Rows, Values]:
        return method.placed_frame(self.tree, self.name, self.q, self.qd if self.moves else None)

    def step_derivatives(self, by_torque: bool = True) -> Rows:
        """[A B], (2 nv, 3 nv): the state after a step by that before it (tangent, qd) and by the torque."""
        assert self.step is not None
        step, coordinates, dt = self.step, self.tree.coordinates, self.given["dt"][0]
        nq, n, x = len(self.q), len(self.qd), [*self.q, *self.qd, *self.tau]
        others = n + n * by_torque  # that are differentiated by, beside the position
        directions = [[*coordinates.component_rates(self.q, u), *[0.0] * others] for u in unit_vectors(n)]
        directions += [[*[0.0] * nq, *u] for u in unit_vectors(others)]
        reached: Values = []

        def after(some: Values) -> Values:
            y = [*some, *x[len(some) :]]
            new_q, new_qd = step(y[:nq], y[nq : nq + n], y[nq + n :], dt)
            reached[:] = values_of(new_q)
            return [*new_q, *new_qd]

        columns = zip(*jacobian(after, x[: nq + others], directions, self.at_once))
        moved = [[*coordinates.tangent(reached, list(column[:nq])), *column[nq:]] for column in columns]
        return [list(row) for row in zip(*moved)]


class Quantity(NamedTuple):
    takes: tuple[str, ...]  # of "q", "qd", "tau" or "qdd", "dt"
    shape: tuple[int | str, ...]  # m bodies, nv speeds; multiples of them
    unit: str
    of: Callable[[State], Any]  # -> nested lists of scalars in that shape
    parts: tuple[str, ...] = ()  # the names of the arrays of which there are several, in that order
    # what its full name says after a colon (frame_pose:hand, step_derivatives:rk4): a frame or a method
    argument: str = ""
    is_long: bool = False  # it has many operations: it is compiled only where it is asked for by name
    solves: bool = False  # Mbar must be regular; of a step: where its method takes nothing implicitly
    has_forms: bool = True  # it follows from Mbar or h, whose sums have several orders
    title: str = ""  # what it is, where no public function of its name says so


Q, QD, TAU, QDD = ("q",), ("q", "qd"), ("q", "qd", "tau"), ("q", "qd", "qdd")
BY_STATE = "dqdd_dq", "dqdd_dqd", "dqdd_dtau", "dtau_dq", "dtau_dqd"
QUANTITIES = {
    "com_positions": Quantity(Q, ("m", 3), "m", lambda s: [list(b.x) for b in s.bodies], has_forms=False),
    "angular_velocities": Quantity(
        QD, ("m", 3), "rad/s", lambda s: [list(b.omega) for b in s.bodies], has_forms=False
    ),
    "jacobians": Quantity(
        Q, (2, "m", 3, "nv"), "m/rad; 1",
        lambda s: [[list(zip(*b.T)) for b in s.bodies], [list(zip(*b.B)) for b in s.bodies]],
        ("T", "B"), has_forms=False,
    ),
    "convective_terms": Quantity(
        QD, (2, "m", 3), "m/s2; rad/s2",
        lambda s: [[list(b.v_conv) for b in s.bodies], [list(b.w_conv) for b in s.bodies]],
        ("v_conv", "w_conv"), has_forms=False,
    ),
    "mass_matrix": Quantity(Q, ("nv", "nv"), "kg m2", lambda s: s.mass_matrix),
    "inverse_mass_matrix": Quantity(Q, ("nv", "nv"), "1/(kg m2)", lambda s: s.factors.inverted(), solves=True),
    "bias": Quantity(QD, ("nv",), "N m", lambda s: s.bias),
    "gravity_balance": Quantity(Q, ("nv",), "N m", lambda s: s.gravity_balance),
    "spring_torque": Quantity(
        Q, ("nv",), "N m", lambda s: method.spring_torque(s.tree, s.q), has_forms=False
    ),
    "acceleration": Quantity(TAU, ("nv",), "rad/s2", lambda s: s.acceleration, solves=True),
    "inverse_dynamics": Quantity(QDD, ("nv",), "N m", lambda s: s.inverse_dynamics),
    "derivatives": Quantity(TAU, (5, "nv", "nv"), "SI", lambda s: s.derivatives, BY_STATE, is_long=True, solves=True),
    "inverse_dynamics_derivatives": Quantity(
        QDD, (2, "nv", "nv"), "N m/rad; N m s/rad", lambda s: list(s.torque_rates), BY_STATE[3:], is_long=True
    ),
    "coriolis_matrix": Quantity(QD, ("nv", "nv"), "N m s/rad", lambda s: s.coriolis_matrix, is_long=True),
    "com": Quantity(Q, (3,), "m", lambda s: list(whole.centre_of_mass(s.bodies)[0]), has_forms=False),
    "com_jacobian": Quantity(
        Q, (3, "nv"), "m/rad", lambda s: whole.centre_of_mass(s.bodies)[1], has_forms=False
    ),
    "centroidal_momentum_matrix": Quantity(
        Q, (6, "nv"), "kg m/rad; kg m2/rad", lambda s: whole.centroidal_momentum(s.bodies), has_forms=False
    ),
    "regressor": Quantity(
        QDD, ("nv", "10m"), "SI", lambda s: whole.regressor(s.tree, s.q, s.qd, s.qdd), is_long=True, has_forms=False
    ),
    "potential_energy": Quantity(Q, (), "J", lambda s: s.potential_energy, has_forms=False),
    "energy": Quantity(QD, (), "J", lambda s: s.energy, has_forms=False),
    "frame_pose": Quantity(
        Q, (3, 4), "1; m", lambda s: s.frame[0], argument="frame", has_forms=False,
        title="Axes of a frame as columns and its origin, m, inertial frame, shape (3, 4).",
    ),
    "frame_jacobian": Quantity(
        Q, (6, "nv"), "m/rad; 1", lambda s: s.frame[1], argument="frame", has_forms=False,
        title="Velocity of a frame's origin and angular one, for unit speeds, inertial frame, shape (6, nv).",
    ),
    "frame_convective": Quantity(
        QD, (6,), "m/s2; rad/s2", lambda s: s.frame[2], argument="frame", has_forms=False,
        title="Accelerations of a frame at qdd = 0, of its origin and angular, inertial frame, shape (6,).",
    ),
    "step_derivatives": Quantity(
        (*TAU, "dt"), ("2nv", "3nv"), "SI", lambda s: s.step_derivatives(), argument="method", is_long=True, solves=True,
        title="[A B] (2 nv, 3 nv) of one step, A = dx+/dx beside B = dx+/dtau, x = (tangent, qd), dt in s.",
    ),
}  # fmt: skip
PLAIN = tuple(name for name, quantity in QUANTITIES.items() if not quantity.argument)  # that need no argument


def quantity_of(name: str) -> Quantity:
    return QUANTITIES[name.partition(":")[0]]


def is_quantity(name: object) -> bool:
    if not isinstance(name, str) or name.partition(":")[0] not in QUANTITIES:
        return False
    return bool(quantity_of(name).argument) == (":" in name)


def what_is_known(name: object) -> str:
    if isinstance(name, str) and name in QUANTITIES:
        return f"{name}:NAME, with the name of a {QUANTITIES[name].argument}, is"
    return f"one of {', '.join(PLAIN)} is"


def argument_of(name: str) -> str:
    return name.partition(":")[2]


def shape_of(name: str, tree: Mechanism) -> tuple[int, ...]:
    n = len(tree.axis)
    sizes = {"m": len(tree.mass), "10m": 10 * len(tree.mass), "nv": n, "2nv": 2 * n, "3nv": 3 * n}
    return tuple(size if isinstance(size, int) else sizes[size] for size in quantity_of(name).shape)
