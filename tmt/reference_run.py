"""The true motion, from which the error of every method is measured: Taylor's method in pairs of doubles, some 32 digits.

The method is traced on numbers of many digits; series.py computes the series of its straight line, so that nothing is compiled
for a robot. What is lost is rounding, 1e-30 or so, times the growth of a small difference along the motion. Two runs that
share neither the form of the equations nor the order show how much it is, see `truth`.
"""

import math
from fractions import Fraction
from functools import partial
from typing import NamedTuple

import mpmath
import numpy as np

from . import composite, method, series
from .coordinates import Coordinates, conjugate, normalized, product
from .exact import exact_tree
from .pairs import pair
from .space import sqrt
from .trace import Tape

DIGITS = 60  # of the numbers that are traced
FORMS = {
    "composite": partial(composite.mass_matrix_and_bias, number=mpmath.mpf),
    "literal": method.mass_matrix_and_bias,
}
OPERATIONS = {
    "+": series.ADD, "-": series.SUBTRACT, "*": series.MULTIPLY, "/": series.DIVIDE, "neg": series.NEGATIVE,
    "sqrt": series.ROOT,
}  # fmt: skip
ORDER, OTHER_ORDER = 32, 28
TOLERANCE = 1e-33  # of the last coefficients in a step, in units of 1 + |value|
MOST_STEPS = 20_000
LOOKED_AT = 200  # steps after which a run that would take more than those ends at once
HALVINGS = 4  # of a turn of at most pi, until its half is below 0.1 rad
# of arcsin(x) / x as a polynomial in x^2, the highest first: the next is below 1e-36
ARC_SINE = [Fraction(math.comb(2 * k, k), 4**k * (2 * k + 1)) for k in reversed(range(18))]


class TooManySteps(ValueError):
    """The model is too stiff for a series."""


class Truth(NamedTuple):
    """A motion at equal times: q and qd, each number as the sum of two doubles."""

    high: np.ndarray  # (records + 1, nq + nv) rad, rad/s
    low: np.ndarray  # (records + 1, nq + nv)
    steps: int


class Lines(NamedTuple):
    """The equations of one tree under one torque, as series.py reads them."""

    code: np.ndarray  # (operations, 4)
    rates: np.ndarray  # (nq + nv,) the row that is the rate of each number of the state
    numbers: np.ndarray  # (2, numbers), in the rows after the state
    rows: int


def lines(tree, tau, form: str) -> Lines:
    """The equations of a tree under constant torque (nv,), N m, in one of FORMS."""
    tape, coordinates = Tape(mpmath.mpf), tree.coordinates
    with mpmath.workdps(DIGITS):
        exact = exact_tree(tree, mpmath.mpf)
        exact.rest, exact.coordinates = of_length_1(coordinates, exact.rest), Smooth(*coordinates)
        q, qd = (tape.inputs(*(f"{name}{i}" for i in range(size))) for name, size in zip(("q", "qd"), coordinates[1:]))
        qdd = method.acceleration(exact, q, qd, [mpmath.mpf(v) for v in tau], FORMS[form])
        rates = [tape.lift(rate) for rate in (*coordinates.component_rates(q, qd), *qdd)]

        order = tape.needed(rates)
        row = {x.i: k for k, x in enumerate((*q, *qd))}
        numbers = [i for i in order if tape.nodes[i][0] == "number"]
        row |= {i: k for k, i in enumerate(numbers, start=len(row))}
        code, rows = [], len(row)
        for i in order:
            operation, arguments = tape.nodes[i]
            if operation == "item":
                row[i] = row[arguments[0]] + 1 + arguments[1]
            elif i not in row:
                row[i] = rows
                operands = [row[a] for a in arguments]
                made = [series.SLOPE, series.SINE, series.COSINE]
                if operation != "sincos":
                    made = [kind(operation, operands, range(len(rates), len(rates) + len(numbers)))]
                code += [(made_, rows + k, operands[0], operands[-1]) for k, made_ in enumerate(made)]
                rows += len(made)
        pairs = np.array([pair(tape.nodes[i][1][0]) for i in numbers]).reshape(-1, 2).T.copy()
    return Lines(np.array(code).reshape(-1, 4), np.array([row[rate.i] for rate in rates]), pairs, rows)


def kind(operation, operands, numbers) -> int:
    """What series.py does for an operation of a trace; numbers: the rows in which these stand, the second operand if any."""
    if operation == "*" and operands[0] in numbers:
        operands.reverse()
    if operation == "*" and operands[1] in numbers:
        return series.SCALE
    return series.SQUARE if operation == "*" and operands[0] == operands[1] else OPERATIONS[operation]


class Smooth(Coordinates):
    """Coordinates whose `difference` has a series where it is zero too: no root of what vanishes there."""

    def difference(self, q1, q0) -> list:
        return [
            value
            for kind, at, _ in self.joints
            for value in (
                logarithm(product(conjugate(q0[at]), q1[at])) if kind == "ball" else [q1[at.start] - q0[at.start]]
            )
        ]


def logarithm(p) -> list:
    """coordinates.logarithm for |p| = 1: by halving the turn until a series of the arc sine takes it."""
    w, *v = p
    size = sqrt(w * w)
    scale = w / size
    for _ in range(HALVINGS):
        size = sqrt((1.0 + size) * 0.5)
        scale = scale / (2.0 * size)
    x, y, z = (component * scale for component in v)
    square, share = x * x + y * y + z * z, 0.0
    for factor in ARC_SINE:
        share = share * square + mpmath.mpf(factor.numerator) / factor.denominator
    return [component * (share * 2.0 ** (HALVINGS + 1)) for component in (x, y, z)]


def of_length_1(coordinates, q) -> list:
    """A position with each quaternion at length 1 in all digits."""
    q = list(q)
    for joint in coordinates.balls:
        q[joint.q] = normalized(q[joint.q])
    return q


def trajectory(
    tree, q, qd, tau, dt: float, steps: int, every: int = 1, form: str = "composite", order: int = ORDER,
    tolerance: float = TOLERANCE,
) -> Truth:  # fmt: skip
    """The motion under constant torque at t = 0, every dt, 2 every dt ... steps dt, these products exact.

    q (nq,), qd, tau (nv,): rad, rad/s, N m, taken as what their doubles are exactly (quaternions at length 1); dt in s, of
    which nothing else depends. Raises TooManySteps where MOST_STEPS would not do, ValueError if the numbers overflow.
    """
    code, rates, numbers, rows = lines(tree, [float(v) for v in tau], form)
    high, low = np.zeros((2, rows, order + 1))
    n = len(rates)
    high[n : n + numbers.shape[1], 0], low[n : n + numbers.shape[1], 0] = numbers
    with mpmath.workdps(DIGITS):
        start = of_length_1(tree.coordinates, [mpmath.mpf(float(v)) for v in q]) + [mpmath.mpf(float(v)) for v in qd]
        state = np.array([pair(x) for x in start]).T.copy()
    times = [Fraction(dt) * k for k in range(0, steps + 1, every)]
    t, path, count = Fraction(0), [state.copy()], 0
    while len(path) < len(times):
        high[:n, 0], low[:n, 0] = state
        series.expand(code, rates, order + 1, high.reshape(-1), low.reshape(-1))
        h = step_size(high[:n], tolerance)
        if not h > 0.0:
            raise ValueError(f"the motion diverges: at t = {float(t):g} s its numbers overflow")
        count, end = count + 1, times[-1] if h == math.inf else t + Fraction(h)
        while len(path) < len(times) and times[len(path)] <= end:
            path.append(at(times[len(path)] - t, high, low, state.shape))
        left = float((times[-1] - t) / (end - t))
        if count + left > MOST_STEPS and (count >= LOOKED_AT):
            raise TooManySteps(
                f"the series takes steps of {h:.1e} s at t = {float(t):.3g} s; more than {MOST_STEPS} would be needed"
            )
        state, t = at(end - t, high, low, state.shape), end
    high, low = np.array(path).transpose(1, 0, 2)
    return Truth(high, low, count)


def step_size(high: np.ndarray, tolerance: float) -> float:
    """The step with which the last two terms of every series are at most so large, in units of 1 + |value|; NaN: none is."""
    last = (np.abs(high[:, -2:]) / (1.0 + np.abs(high[:, :1]))).max(axis=0)
    order = high.shape[1] - 1
    with np.errstate(divide="ignore"):
        return float(np.min((tolerance / last) ** (1.0 / np.array([order - 1, order]))))


def at(time: Fraction, high, low, shape) -> np.ndarray:
    """The state (2, n) at a time after that of the series, s."""
    state, th = np.empty(shape), float(time)
    series.values_at(high, low, th, float(time - Fraction(th)), state)
    return state


def truth(tree, q, qd, tau, dt: float, steps: int, every: int = 1) -> tuple[Truth, float]:
    """The motion, see `trajectory`; and its largest difference, rad, rad/s, from a run in the literal form, of another order."""
    first = trajectory(tree, q, qd, tau, dt, steps, every)
    other = trajectory(tree, q, qd, tau, dt, steps, every, "literal", OTHER_ORDER)
    return first, float(np.abs((first.high - other.high) + (first.low - other.low)).max())
