"""A run with many digits, from which the error of every method is measured.

Python's decimal numbers are one more scalar: in C, and several times faster than mpmath's at this length.
"""

import math
from collections.abc import Callable
from decimal import Decimal, localcontext

import mpmath
import numpy as np

from .exact import exact_tree
from .method import acceleration
from .space import arctan, cos, sin, sqrt
from .trace import Tape

DIGITS = 36
COLUMNS = 10  # of the extrapolation: order 20
TERMS = 18  # of the series of sine and cosine up to pi/4: the next is below 1e-40
with mpmath.workdps(80):
    HALF_PI = Decimal(mpmath.nstr(mpmath.pi / 2, 75))
    FACTORIALS = [Decimal(mpmath.nstr(1 / mpmath.factorial(k), 60)) for k in range(2 * TERMS)]


def sincos(x: Decimal) -> tuple[Decimal, Decimal]:
    """(sin x, cos x), x in rad: by their series after turning x into [-pi/4, pi/4]."""
    n = (x / HALF_PI).to_integral_value()
    r = x - n * HALF_PI
    z, s, c = -r * r, Decimal(0), Decimal(0)
    for k in reversed(range(TERMS)):
        s, c = s * z + FACTORIALS[2 * k + 1], c * z + FACTORIALS[2 * k]
    s *= r
    return ((s, c), (c, -s), (-s, -c), (-c, s))[int(n) % 4]


sin.register(Decimal, lambda x: sincos(x)[0])
cos.register(Decimal, lambda x: sincos(x)[1])
sqrt.register(Decimal, Decimal.sqrt)


@arctan.register
def decimal_arctan(x: Decimal) -> Decimal:
    """From the double on: sin y - x cos y is sin(y - arctan x) / cos(arctan x), so that each turn triples the digits."""
    y = Decimal(math.atan(x))
    for _ in range(2):
        s, c = sincos(y)
        y -= (s - x * c) / (c + x * s)
    return y


def slope(tree) -> Callable:
    """slope(q, qd, tau) -> d(q, qd)/dt, sequences of decimal numbers: the method as it stands, traced, with exact numbers."""
    tape, coordinates = Tape(Decimal), tree.coordinates
    sizes = {"q": coordinates.nq, "qd": coordinates.nv, "tau": coordinates.nv}
    q, qd, tau = (tape.inputs(*(f"{name}{i}" for i in range(count))) for name, count in sizes.items())
    tree = exact_tree(tree, tape.lift)
    slopes = [*coordinates.component_rates(q, qd), *acceleration(tree, q, qd, tau)]
    code = tape.function("slope", [*q, *qd, *tau], slopes)
    scope = {"sincos": sincos, "sqrt": sqrt, "arctan": arctan, "fma": lambda a, b, c: a * b + c, **code.constants}
    exec(code.text, scope)
    return lambda q, qd, tau: scope["slope"](*q, *qd, *tau)


def trajectory(tree, q, qd, tau, duration: float, records: int, steps: int) -> np.ndarray:
    """The motion under constant torque at records + 1 equal times: (records + 1, nq + nv) decimal numbers, q and qd.

    q (nq,), qd, tau (nv,): rad, rad/s, N m, taken as what their doubles are exactly; duration in s; steps: a multiple of records.
    Gragg's modified midpoint rule, extrapolated (Bulirsch and Stoer) to order 20 in every step, in 36 digits. How many of
    them are right is seen from a second run with half the step.
    """
    if steps % records:
        raise ValueError(f"steps is {steps}; a multiple of {records} is expected")
    with localcontext() as context:
        context.prec = DIGITS
        torque, nq = [Decimal(float(v)) for v in tau], len(q)
        traced = slope(tree)

        def rate(state):
            return np.array(traced(state[:nq], state[nq:], torque))

        state = np.array([Decimal(float(v)) for v in (*q, *qd)])
        path, dt = [state], Decimal(duration) / steps
        for _ in range(records):
            for _ in range(steps // records):
                state = extrapolated(rate, state, dt)
            path.append(state)
    return np.array(path)


def extrapolated(rate, state, dt):
    """The state one dt later: midpoint rules with 2, 4, 6, ... substeps, extrapolated in the square of their step."""
    start, row = rate(state), []
    for j in range(1, COLUMNS + 1):
        h = dt / (2 * j)
        before, now = state, state + h * start
        for _ in range(2 * j - 1):
            before, now = now, before + 2 * h * rate(now)
        coarser, row = row, [(before + now + h * rate(now)) / 2]
        for k, value in enumerate(coarser, start=1):
            row.append(row[-1] + (row[-1] - value) * (j - k) ** 2 / (j**2 - (j - k) ** 2))
    return row[-1]
