"""The methods of integration, each a `Method` (see stepping.py) with one step that is written over any scalar.

The same lines integrate floats, dual numbers (their exact Jacobian), mpmath numbers and traced expressions (the compiled
loop of kernels.py). METHODS may be given further ones, and objects of a user's own that have a `slope` and a `step`.
"""

from dataclasses import dataclass, field

import numpy as np

from . import dop853
from .dual import seeded
from .implicit import ImplicitRungeKutta
from .method import bias_rates, mass_matrix_and_bias, reduced_force
from .space import solve_any
from .stepping import Method, checked_sums, checked_tableau, completed
from .tree import shown


@dataclass(frozen=True)
class RungeKutta(Method):
    """An explicit Runge-Kutta method, given by its Butcher tableau.

    Applied to (q, qd) as one first-order system, like MuJoCo's RK4. Raises ValueError if the tableau
    is not explicit, a row of A does not sum to c, or b does not sum to 1.
    """

    order: int = field()  # it must be given, though Method has a default
    A: tuple  # row i: the weights of stages 0 .. i-1 in stage i
    b: tuple  # the weights of the stages in the step
    c: tuple  # the time of each stage in units of dt

    loop = True

    def __post_init__(self):
        checked_tableau(self, "A")
        if not len(self.A) == len(self.b) == len(self.c):
            raise ValueError("A, b and c must have one entry for each stage")
        for i, row in enumerate(self.A):
            if len(row) != i:
                raise ValueError(f"row {i} of A has {len(row)} entries; an explicit method has {i}")
        checked_sums(self)

    def matrix(self, tree, q, qd, dt, terms=mass_matrix_and_bias):
        """The matrix of the linear system for the slope: Mbar."""
        return terms(tree, q, [0.0] * len(q))[0]

    def step(self, slope, q, qd, dt):
        """The state (q, qd) one dt later, from `slope(q, qd)` at each stage."""
        return self.combined(self.stage_slopes(slope, q, qd, dt), q, qd, dt)

    def stage_slopes(self, slope, q, qd, dt):
        """The rates and the accelerations of all stages."""
        rates, changes = [], []
        for row in self.A:
            q_i, qd_i = advance(q, dt, row, rates), advance(qd, dt, row, changes)
            rates.append(qd_i)
            changes.append(slope(q_i, qd_i))
        return rates, changes

    def combined(self, slopes, q, qd, dt):
        """The state one dt later, from the rates and accelerations of all stages."""
        rates, changes = slopes
        return advance(q, dt, self.b, rates), advance(qd, dt, self.b, changes)


@dataclass(frozen=True)
class AdaptiveRungeKutta(RungeKutta):
    """A Runge-Kutta method that chooses its own steps, by two embedded estimates of the error of each.

    Between two recorded states it takes steps for which the error, in units of tolerance * (1 + |value|), stays below 1;
    the estimates e5 and e3 combine to e5^2 / sqrt(e5^2 + 0.01 e3^2) (Hairer, Norsett, Wanner, section II.10).
    """

    errors: tuple = ()  # weights of the stages in the two estimates

    adaptive = True

    def __post_init__(self):
        super().__post_init__()
        checked_tableau(self, "errors")
        if len(self.errors) != 2 or any(len(row) != len(self.b) for row in self.errors):
            raise ValueError("errors must be two rows of one weight for each stage")

    def attempt(self, slope, q, qd, dt):
        """A step, and the two estimates of its error, each for q and qd."""
        slopes = self.stage_slopes(slope, q, qd, dt)
        estimates = [[*advance([0.0] * len(q), dt, e, part)] for e in self.errors for part in slopes]
        return *self.combined(slopes, q, qd, dt), *estimates


@dataclass(frozen=True)
class SemiImplicitEuler(Method):
    """qd+ = qd + dt a, then q+ = q + dt qd+, with (Mbar + dt D [+ dt dh/dqd]) a = tau - D qd - h.

    Joint damping is implicit in the rates, and so is the bias if `implicit_bias`: what MuJoCo calls Euler,
    implicitfast and discrete (without), and implicit (with). MuJoCo documentation, numerical integration.
    """

    implicit_bias: bool

    damps_implicitly = True

    def matrix(self, tree, q, qd, dt, terms=mass_matrix_and_bias):
        """The matrix of the linear system for the slope: Mbar + dt D [+ dt dh/dqd]."""
        n = len(q)
        matrix = terms(tree, q, [0.0] * n)[0]
        matrix = [[matrix[i][j] + (dt * tree.damping[i] if i == j else 0.0) for j in range(n)] for i in range(n)]
        if self.implicit_bias:
            rates = bias_rates(tree, q, qd, terms)
            matrix = [[matrix[i][j] + dt * rates[i][j] for j in range(n)] for i in range(n)]
        return matrix

    def slope(self, tree, q, qd, tau, dt, terms=mass_matrix_and_bias):
        """a from the linear system above."""
        force = reduced_force(tree, terms(tree, q, qd)[1], qd, tau)
        return solve_any(self.matrix(tree, q, qd, dt, terms), force)

    def step(self, slope, q, qd, dt):
        """The state (q, qd) one dt later."""
        qd = advance(qd, dt, (1.0,), [slope(q, qd)])
        return advance(q, dt, (1.0,), [qd]), qd


def advance(start, dt, weights, slopes):
    """start + dt * sum of weights * slopes, component by component."""
    result = []
    for k, value in enumerate(start):
        terms = [slope[k] if w == 1.0 else w * slope[k] for w, slope in zip(weights, slopes) if w != 0.0]
        result.append(value + dt * sum(terms[1:], terms[0]) if terms else value)
    return result


def one_step(stepping, tree, q, qd, tau, dt):
    """The state (q, qd) of a tree one dt later by a method, over any scalar."""
    return stepping.step(lambda q, qd: stepping.slope(tree, q, qd, tau, dt), q, qd, dt)


def amplification(stepping, tree, q, qd, tau, dt) -> np.ndarray:
    """The exact Jacobian of one step of a method, d(q, qd)+/d(q, qd), shape (..., 2n, 2n).

    q, qd: states (..., n), rad and rad/s; tau: torque (n,), N m; dt: step in s, one for all or (...). At an equilibrium
    it is what a step does to a small deviation: its eigenvalues are the growth of each mode per step. By dual numbers,
    all directions at once; so it holds for partitioned and implicit methods too.
    """
    n = len(tree.parent)
    batch = np.broadcast_shapes(np.shape(q)[:-1], np.shape(qd)[:-1], np.shape(dt))
    start = [np.broadcast_to(values, (*batch, n))[..., i] for values in (q, qd) for i in range(n)]
    directions = np.eye(2 * n).reshape(2 * n, 2 * n, *(1 for _ in batch))  # component, direction, state
    state = seeded(start, directions)
    new_q, new_qd = one_step(stepping, tree, state[:n], state[n:], [float(t) for t in tau], dt)
    slopes = [np.broadcast_to(component.slope, (2 * n, *batch)) for component in (*new_q, *new_qd)]
    return np.moveaxis(np.array(slopes), (0, 1), (-2, -1)).copy()


ROOT = 3**0.5 / 6
METHODS = {
    "rk4": RungeKutta(  # the classical method of Kutta (1901), the assignment's part i
        order=4,
        A=((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)),
        b=(1 / 6, 1 / 3, 1 / 3, 1 / 6),
        c=(0.0, 0.5, 0.5, 1.0),
    ),
    "dopri8": RungeKutta(order=8, A=dop853.A, b=dop853.B, c=dop853.C),  # Dormand and Prince, fixed step
    "dopri8_adaptive": AdaptiveRungeKutta(8, dop853.A, dop853.B, dop853.C, (dop853.ERROR_5, dop853.ERROR_3)),
    "explicit_euler": RungeKutta(order=1, A=((),), b=(1.0,), c=(0.0,)),
    "semi_implicit_euler": SemiImplicitEuler(implicit_bias=False),
    "implicit": SemiImplicitEuler(implicit_bias=True),
    "implicit_midpoint": ImplicitRungeKutta(order=2, A=((0.5,),), b=(1.0,), c=(0.5,)),
    "gauss_legendre_4": ImplicitRungeKutta(  # Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7
        order=4,
        A=((1 / 4, 1 / 4 - ROOT), (1 / 4 + ROOT, 1 / 4)),
        b=(1 / 2, 1 / 2),
        c=(1 / 2 - ROOT, 1 / 2 + ROOT),
    ),
}


def method_named(name: str) -> Method:
    """The method of that name in METHODS, as it is there now, with all fields; ValueError if there is none, or no method."""
    if not isinstance(name, str) or name not in METHODS:
        raise ValueError(f"unknown method {shown(name)}; known are {', '.join(METHODS)}")
    try:
        return completed(METHODS[name])
    except ValueError as error:
        raise ValueError(f"METHODS[{name!r}] is {shown(METHODS[name])}; {error}") from None
