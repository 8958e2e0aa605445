"""The true motion, which errors of methods are measured from: Taylor's method in pairs of doubles.

The method is traced on numbers of many digits, and series.py reads what it traced: nothing is compiled for a
robot. What is lost is rounding, about 1e-30 times the growth of a small difference along the motion; `truth`
shows it by a second run. The torque is constant: where it jumps a run ends and another begins.
"""

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import mpmath
import numpy as np

from tmt.compiled.trace import Expression, Tape
from tmt.derivation import composite, method
from tmt.derivation.coordinates import Coordinates
from tmt.exact import series
from tmt.exact.pairs import pair
from tmt.exact.tree import exact_tree, of_length_1
from tmt.model.tree import Tree

Numbers = Sequence[float] | np.ndarray
Nodes = list[Expression]

DIGITS = 60  # of the numbers that are traced
FORMS: dict[str, Callable[..., Any]] = {
    "composite": partial(composite.mass_matrix_and_bias, number=mpmath.mpf),
    "literal": method.mass_matrix_and_bias,
}
ORDER, OTHER_ORDER = 40, 34
MOST_LITERAL = 40  # speeds: the literal form of a tree of more takes minutes to trace
TOLERANCE = 1e-33  # of the last terms in a step, in units of 1 + |value|
MOST_OPERATIONS = 5_000_000  # of all steps of a run: some 5 s
BESIDE = 100  # operations, as long as the rest of a step takes
SEEN, PART_SEEN = (
    200,
    20,
)  # steps, or this part of the most, by which it is seen whether a run would take more
OPERATIONS = {
    "+": [series.ADD], "-": [series.SUBTRACT], "neg": [series.NEGATIVE], "*": [series.MULTIPLY],
    "/": [series.DIVIDE], "sqrt": [series.ROOT], "sign": [series.SIGN],
    "sincos": [series.SLOPE, series.SINE, series.COSINE],
}  # fmt: skip


class TooManySteps(ValueError):
    """The motion is too fast, or the model too stiff, for a series."""


class Path(NamedTuple):
    high: np.ndarray  # (records + 1, nq + nv) q and qd, rad and rad/s
    low: np.ndarray  # (records + 1, nq + nv)
    steps: int


class Equations(NamedTuple):
    code: np.ndarray  # (operations, 4)
    numbers: np.ndarray  # (2, numbers), in the rows after the inputs
    rows: int

    def tables(self, inputs: int, width: int) -> tuple[np.ndarray, np.ndarray]:
        high, low = np.zeros((2, self.rows, width))
        constant = slice(inputs, inputs + self.numbers.shape[1])
        high[constant, 0], low[constant, 0] = self.numbers
        return high, low


def truth(
    tree: Tree, q: Numbers, qd: Numbers, tau: Numbers, dt: float, steps: int, every: int = 1
) -> tuple[Path, float]:
    """The motion, see `trajectory`, and its largest difference from a second run, rad or rad/s.

    The two share neither the order nor, up to 40 speeds, the form of the equations.
    """
    form = "literal" if len(qd) <= MOST_LITERAL else "composite"
    second = trajectory(
        tree, q, qd, tau, dt, steps, every, form, OTHER_ORDER
    )  # which would take too long sooner
    first = trajectory(tree, q, qd, tau, dt, steps, every)
    return first, float(np.abs((first.high - second.high) + (first.low - second.low)).max())


def trajectory(
    tree: Tree, q: Numbers, qd: Numbers, tau: Numbers, dt: float, steps: int, every: int = 1,
    form: str = "composite", order: int = ORDER,
) -> Path:  # fmt: skip
    """The motion under constant torque at the exact times 0, every dt, 2 every dt ... up to steps dt.

    q (nq,), qd, tau (nv,): rad, rad/s, N m, taken as what their doubles are exactly, quaternions at length 1;
    dt: s, which says no more than these times. form: of FORMS. Raises TooManySteps if a run would take too
    long, ValueError if its numbers overflow.
    """
    path, count, error = followed(tree, q, qd, tau, dt, steps, every, form, order)
    if error:
        raise error
    high, low = path.transpose(1, 0, 2)
    return Path(high, low, count)


def followed(
    tree: Tree, q: Numbers, qd: Numbers, tau: Numbers, dt: float, steps: int, every: int = 1,
    form: str = "composite", order: int = ORDER, tolerance: float = TOLERANCE,
    most_operations: int | None = None,
) -> tuple[np.ndarray, int, ValueError | None]:  # fmt: skip
    """The records (k, 2, nq + nv) of a run, the number of its series, and why it ends early, or None."""
    traced, n = equations(tree, tau, form), tree.coordinates.nq + tree.coordinates.nv
    high, low = traced.tables(n, order + 1)
    most = (most_operations or MOST_OPERATIONS) // (BESIDE + len(traced.code))
    times = [Fraction(dt) * k for k in range(0, steps + 1, every)]
    state, t, count = first_state(tree.coordinates, q, qd), Fraction(0), 0
    path = [state]
    while len(path) < len(times):
        high[:n, 0], low[:n, 0] = state
        series.expand(traced.code, high, low)
        step = step_size(high[:n], tolerance)
        if not step > 0.0:
            why = "the motion diverges, is too fast, or Mbar is singular"
            error = ValueError(f"at t = {float(t):g} s numbers overflow: {why}")
            if np.isfinite(high[:n, 1]).all():
                why = "the terms of a series overflow: the motion is too fast for it"
                error = TooManySteps(f"at t = {float(t):.3g} s {why}")
            return np.array(path), count, error
        left, count = float((times[-1] - t) / Fraction(min(step, 2.0 * float(times[-1])))), count + 1
        if count - 1 + left > most and count >= min(SEEN, most // PART_SEEN):
            why = f"a series takes steps of {step:.1e} s, and in {float(times[-1]):g} s more than {most}"
            return np.array(path), count, TooManySteps(f"at t = {float(t):.3g} s {why}")
        end = times[-1] if step == math.inf else t + Fraction(step)
        while len(path) < len(times) and times[len(path)] <= end:
            path.append(after(times[len(path)] - t, high[:n], low[:n]))
        state, t = after(end - t, high[:n], low[:n]), end
    return np.array(path), count, None


def equations(tree: Tree, tau: Numbers, form: str) -> Equations:
    tape, coordinates = Tape(mpmath.mpf), tree.coordinates
    with mpmath.workdps(DIGITS):
        sizes = {"q": coordinates.nq, "qd": coordinates.nv}
        q, qd = (tape.inputs(*(f"{name}{i}" for i in range(size))) for name, size in sizes.items())
        exact = exact_tree(tree, mpmath.mpf)
        qdd = method.acceleration(exact, q, qd, [mpmath.mpf(float(v)) for v in tau], FORMS[form])
        rates = [tape.lift(rate) for rate in (*coordinates.component_rates(q, qd), *qdd)]
        traced, row = program(tape, [*q, *qd], rates)
        more = [(series.RATE, k, row[rate.i], 0) for k, rate in enumerate(rates)]
    return traced._replace(code=np.array([*traced.code, *more]))


def program(tape: Tape, inputs: Nodes, results: Nodes) -> tuple[Equations, dict[int, int]]:
    """The operations from inputs, in the first rows, to results; and the row of each node of the tape."""
    order = tape.needed(results)
    constant = {i: tape.nodes[i][1][0] for i in order if tape.nodes[i][0] == "number"}
    row = {i: k for k, i in enumerate([*(x.i for x in inputs), *constant])}
    code, rows = [], len(row)
    for i in order:
        operation, arguments = tape.nodes[i]
        if operation == "item":
            row[i] = row[arguments[0]] + 1 + arguments[1]
        elif i not in row:
            acts = OPERATIONS[operation]
            if operation == "*" and any(i in constant for i in arguments):  # the number is the second
                acts, arguments = [series.SCALE], tuple(sorted(arguments, key=lambda i: i in constant))
            a, b = row[arguments[0]], row[arguments[-1]]
            code += [(act, rows + k, a, b) for k, act in enumerate(acts)]
            row[i], rows = rows, rows + len(acts)
    numbers = np.array([pair(number) for number in constant.values()]).reshape(-1, 2)
    return Equations(np.array(code, dtype=np.int64).reshape(-1, 4), numbers.T.copy(), rows), row


def first_state(coordinates: Coordinates, q: Numbers, qd: Numbers) -> np.ndarray:
    with mpmath.workdps(DIGITS):
        q, qd = ([mpmath.mpf(float(v)) for v in values] for values in (q, qd))
        return np.array([pair(x) for x in (*of_length_1(coordinates, q), *qd)]).T.copy()


def step_size(high: np.ndarray, tolerance: float) -> float:
    """With which the last two terms of all series are within the tolerance: s; NaN if numbers overflow."""
    order = high.shape[1] - 1
    with np.errstate(all="ignore"):
        last = (np.abs(high[:, -2:]) / (1.0 + np.abs(high[:, :1]))).max(axis=0)
        return float(np.min((tolerance / last) ** (1.0 / np.array([order - 1, order]))))


def after(time: Fraction, high: np.ndarray, low: np.ndarray) -> np.ndarray:
    state, rounded = np.empty((2, len(high))), float(time)
    series.values_at(high, low, rounded, float(time - Fraction(rounded)), state)
    return state
