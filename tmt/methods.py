"""The methods of integration, each a `Method` (see stepping.py) with one step that is written over any scalar.

The same lines integrate floats, dual numbers (their exact Jacobian), mpmath numbers and traced expressions (the compiled
loop of kernels.py). METHODS may be given further ones, and objects of a user's own that have a `slope` and a `step`.
"""

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from . import dop853, generic
from .coordinates import FLAT
from .derivatives import amplification as amplification
from .derivatives import one_step as one_step
from .implicit import ImplicitRungeKutta
from .method import bias_rates, mass_matrix_and_bias, reduced_force
from .space import solve_any
from .stepping import Method, checked_sums, checked_tableau, completed
from .values import shown


@dataclass(frozen=True)
class RungeKutta(Method):
    """An explicit Runge-Kutta method, given by its Butcher tableau.

    Applied to (q, qd) as one first-order system, like MuJoCo's RK4; to balls as Munthe-Kaas does, who keeps the order: what is
    integrated is the movement from the start of the step. Raises ValueError if the tableau is not explicit, a row of A does not
    sum to c, or b does not sum to 1.
    """

    order: int = field()  # it must be given, though Method has a default
    A: tuple  # row i: the weights of stages 0 .. i-1 in stage i
    b: tuple  # the weights of the stages in the step
    c: tuple  # the time of each stage in units of dt
    # balls turn by the weighted mean of their speeds, as MuJoCo's RK4 up to 3.17: then of order 2
    mean_speed: bool = False

    loop = "run_tableau"

    def looped(self, tree):
        """A, b and `mean_speed` for the compiled loop."""
        return square(self.A), np.array(self.b), self.mean_speed

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
        return terms(tree, q, [0.0] * len(tree.axis))[0]

    def residual(self, tree, a, q, qd, tau, dt, terms=mass_matrix_and_bias):
        """Mbar a - Qbar (nv,): zero where a is the slope, and linear in a."""
        M, h = terms(tree, q, qd)
        return left_over(M, a, reduced_force(tree, h, q, qd, tau))

    def step(self, slope, q, qd, dt, joints=FLAT):
        """The state (q, qd) one dt later, from `slope(q, qd)` at each stage."""
        return self.combined(self.stage_slopes(slope, q, qd, dt, joints), q, qd, dt, joints)

    def stage_slopes(self, slope, q, qd, dt, joints):
        """The rates and the accelerations of all stages; the rates are those of the movement from q, see coordinates.py."""
        rates, changes = [], []
        for row in self.A:
            u, qd_i = increments(dt, row, rates, len(qd)), advance(qd, dt, row, changes)
            rates.append(qd_i if self.mean_speed else joints.rates(u, qd_i))
            changes.append(slope(joints.move(q, u), qd_i))
        return rates, changes

    def combined(self, slopes, q, qd, dt, joints):
        """The state one dt later, from the rates and accelerations of all stages."""
        rates, changes = slopes
        return joints.move(q, increments(dt, self.b, rates, len(qd))), advance(qd, dt, self.b, changes)


@dataclass(frozen=True)
class AdaptiveRungeKutta(RungeKutta):
    """A Runge-Kutta method that chooses its own steps, by two embedded estimates of the error of each.

    Between two recorded states it takes steps for which the error, in units of tolerance * (1 + |value|), stays below 1;
    the estimates e5 and e3 combine to e5^2 / sqrt(e5^2 + 0.01 e3^2) (Hairer, Norsett, Wanner, section II.10).
    """

    errors: tuple = ()  # weights of the stages in the two estimates, of the movement and of the speeds

    adaptive = True
    loop = "run_adaptive"

    def looped(self, tree):
        """A, b, the weights of the errors and the order for the compiled loop."""
        return square(self.A), np.array(self.b), np.array(self.errors), float(self.order)

    def __post_init__(self):
        super().__post_init__()
        checked_tableau(self, "errors")
        if len(self.errors) != 2 or any(len(row) != len(self.b) for row in self.errors):
            raise ValueError("errors must be two rows of one weight for each stage")

    def attempt(self, slope, q, qd, dt, joints=FLAT):
        """A step, and the two estimates of its error, each for the movement and qd."""
        slopes = self.stage_slopes(slope, q, qd, dt, joints)
        estimates = [[*advance([0.0] * len(qd), dt, e, part)] for e in self.errors for part in slopes]
        return *self.combined(slopes, q, qd, dt, joints), *estimates


@dataclass(frozen=True)
class SemiImplicitEuler(Method):
    """qd+ = qd + dt a, then q+ = q moved by dt qd+, with a from the linear system

        (Mbar + dt D [+ dt dh/dqd] [+ dt S] [+ dt^2 (k + P)]) a = tau - D qd - k (q - rest) - P q - S qd - h [- dt (k + P) qd].

    Joint damping is implicit in the speeds, and so is the bias if `implicit_bias`, or that of `lone_bodies`, which have no
    other body on them or under them; `implicit_gains`: so is a controller's S, in the entries whose two joints lie on one path
    to the world; `implicit_springs`: so are springs, and all entries of S and P. What MuJoCo calls Euler (none of these),
    implicit (bias, gains), implicitfast (lone bodies, gains) and discrete (lone bodies, springs, gains). MuJoCo documentation,
    numerical integration; which gains are implicit was measured.
    """

    implicit_bias: bool
    lone_bodies: bool = False
    implicit_springs: bool = False
    implicit_gains: bool = False

    damps_implicitly = True
    loop = "run_semi_implicit"

    def looped(self, tree):
        """For the compiled loop: whose bias is implicit, (nv,), whether springs are, and which gains, of position and speed."""
        lone = lone_speeds(tree) if self.lone_bodies else set()
        own = np.array([self.implicit_bias or v in lone for v in range(len(tree.axis))])
        return own, self.implicit_springs and tree.has_springs, *map(generic.matrix, self.gains_held(tree))

    def gains_held(self, tree) -> tuple:
        """The implicit entries of a controller's gains, of position and of speed: (nv, nv) each, () where there are none."""
        if self.implicit_springs:
            return tree.position_gain, tree.speed_gain
        if not (self.implicit_gains and tree.speed_gain):
            return (), ()
        return (), tuple(
            tuple(gain if one else 0.0 for gain, one in zip(*rows)) for rows in zip(tree.speed_gain, on_one_path(tree))
        )

    def matrix(self, tree, q, qd, dt, terms=mass_matrix_and_bias):
        """The matrix of the linear system for the slope: Mbar + dt D [+ dt dh/dqd] [+ dt S] [+ dt^2 k + dt^2 P]."""
        n = len(qd)
        matrix = terms(tree, q, [0.0] * n)[0]
        held = [dt * d for d in tree.damping]
        if self.implicit_springs and tree.has_springs:
            held = [x + dt * dt * k for x, k in zip(held, by_speed(tree, tree.stiffness))]
        matrix = [[matrix[i][j] + (held[i] if i == j else 0.0) for j in range(n)] for i in range(n)]
        lone = lone_speeds(tree) if self.lone_bodies else set()
        if self.implicit_bias or lone:
            rates = bias_rates(tree, q, qd, terms)
            own = range(n) if self.implicit_bias else lone
            added = [[dt * rate if i in own else 0.0 for rate in row] for i, row in enumerate(rates)]
            matrix = [[x + y for x, y in zip(*rows)] for rows in zip(matrix, added)]
        for gain, power in zip(self.gains_held(tree), (2, 1)):
            if gain:
                share = dt * dt if power == 2 else dt
                matrix = [[x + share * g if g else x for x, g in zip(*rows)] for rows in zip(matrix, gain)]
        return matrix

    def residual(self, tree, a, q, qd, tau, dt, terms=mass_matrix_and_bias):
        """What a leaves of the linear system above, (nv,): zero where it is the slope, and linear in a.

        dh/dqd a is (h(qd + a) - h(qd - a)) / 2, as h is quadratic in the speeds.
        """
        M, h = terms(tree, q, qd)
        force = reduced_force(tree, h, q, qd, tau)
        held = [dt * d for d in tree.damping]
        if self.implicit_springs and tree.has_springs:
            stiffness = by_speed(tree, tree.stiffness)
            force = [f - dt * k * v for f, k, v in zip(force, stiffness, qd)]
            held = [x + dt * dt * k for x, k in zip(held, stiffness)]
        left = [x + d * y for x, d, y in zip(left_over(M, a, force), held, a)]
        position_gain, speed_gain = self.gains_held(tree)
        if position_gain:
            left = [
                x + weighted(row, [dt * (v + dt * y) for v, y in zip(qd, a)]) for x, row in zip(left, position_gain)
            ]
        if speed_gain:
            left = [x + weighted(row, [dt * y for y in a]) for x, row in zip(left, speed_gain)]
        if own := set(range(len(qd))) if self.implicit_bias else lone_speeds(tree) if self.lone_bodies else ():
            ahead, behind = (terms(tree, q, [v + sign * x for v, x in zip(qd, a)])[1] for sign in (1.0, -1.0))
            left = [x + 0.5 * dt * (ahead[i] - behind[i]) if i in own else x for i, x in enumerate(left)]
        return left

    def slope(self, tree, q, qd, tau, dt, terms=mass_matrix_and_bias):
        """a from the linear system above."""
        force = reduced_force(tree, terms(tree, q, qd)[1], q, qd, tau)
        if self.implicit_springs and tree.has_springs:
            force = [f - dt * k * v for f, k, v in zip(force, by_speed(tree, tree.stiffness), qd)]
        if position_gain := self.gains_held(tree)[0]:
            force = [f - weighted(row, [dt * v for v in qd]) for f, row in zip(force, position_gain)]
        return solve_any(self.matrix(tree, q, qd, dt, terms), force)

    def step(self, slope, q, qd, dt, joints=FLAT):
        """The state (q, qd) one dt later."""
        qd = advance(qd, dt, (1.0,), [slope(q, qd)])
        return joints.move(q, increments(dt, (1.0,), [qd], len(qd))), qd


def left_over(M, a, force) -> list:
    """M a - force."""
    return [sum((m * x for m, x in zip(row, a)), f * -1.0) for row, f in zip(M, force)]


def by_speed(tree, of_joints) -> list:
    """For each speed the value of its joint."""
    return [
        value for value, joint in zip(of_joints, tree.coordinates.joints) for _ in range(joint.qd.start, joint.qd.stop)
    ]


def weighted(row, values):
    """The sum of the entries of a row times values; 0.0 where all are zero."""
    return sum((g * x for g, x in zip(row, values) if g), 0.0)


@lru_cache(maxsize=64)
def on_one_path(tree) -> list:
    """Whether the joints of two speeds lie on one path to the world, (nv, nv)."""
    before = [{i} for i in range(len(tree.parent))]
    for i, parent in enumerate(tree.parent):
        before[i] |= before[parent] if parent >= 0 else set()
    joint = by_speed(tree, range(len(tree.parent)))
    return [[i in before[j] or j in before[i] for j in joint] for i in joint]


@lru_cache(maxsize=64)
def lone_speeds(tree) -> set:
    """The speeds of free bodies that stand alone: three slides and a ball from the world, and nothing on them."""
    lone = set()
    for i, kind in enumerate(tree.kind):
        chain = [i - 3, i - 2, i - 1, i]
        free = kind == "ball" and i >= 3 and [tree.kind[j] for j in chain] == ["slide"] * 3 + ["ball"]
        alone = i not in tree.parent and tree.body_hinge.count(i) == 1 and not {*chain[:3]} & {*tree.body_hinge}
        if free and alone and [tree.parent[j] for j in chain] == [-1, *chain[:3]]:
            lone |= set(range(tree.coordinates.joints[i - 3].qd.start, tree.coordinates.joints[i].qd.stop))
    return lone


def square(A) -> np.ndarray:
    """The rows of an explicit tableau with zeros on and above its diagonal."""
    return np.array([[*row, *[0.0] * (len(A) - len(row))] for row in A])


def increments(dt, weights, slopes, n) -> list:
    """dt * sum of weights * slopes, (n,); 0.0 where there are none."""
    return advance([0.0] * n, dt, weights, slopes)


def advance(start, dt, weights, slopes):
    """start + dt * sum of weights * slopes, component by component."""
    result = []
    for k, value in enumerate(start):
        terms = [slope[k] if w == 1.0 else w * slope[k] for w, slope in zip(weights, slopes) if w != 0.0]
        result.append(value + dt * sum(terms[1:], terms[0]) if terms else value)
    return result


CLASSICAL = (  # Kutta (1901): A, b, c
    ((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)),
    (1 / 6, 1 / 3, 1 / 3, 1 / 6),
    (0.0, 0.5, 0.5, 1.0),
)
ROOT = 3**0.5 / 6
METHODS = {
    "rk4": RungeKutta(4, *CLASSICAL),  # the assignment's part i
    "rk4_mean_speed": RungeKutta(2, *CLASSICAL, mean_speed=True),  # of order 2 where a ball tumbles
    "dopri8": RungeKutta(order=8, A=dop853.A, b=dop853.B, c=dop853.C),  # Dormand and Prince, fixed step
    "dopri8_adaptive": AdaptiveRungeKutta(8, dop853.A, dop853.B, dop853.C, errors=(dop853.ERROR_5, dop853.ERROR_3)),
    "explicit_euler": RungeKutta(order=1, A=((),), b=(1.0,), c=(0.0,)),
    "semi_implicit_euler": SemiImplicitEuler(implicit_bias=False),
    "implicit": SemiImplicitEuler(implicit_bias=True, implicit_gains=True),
    "implicitfast": SemiImplicitEuler(implicit_bias=False, lone_bodies=True, implicit_gains=True),
    "discrete": SemiImplicitEuler(implicit_bias=False, lone_bodies=True, implicit_springs=True, implicit_gains=True),
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
