"""A short motion in many digits, by the method as it stands on numbers of mpmath: no trace, no pairs, no series."""

import mpmath

from tmt.equations.method import acceleration
from tmt.exact.tree import exact_tree, of_length_1

DIGITS, COLUMNS = 45, 9  # of the extrapolation: order 18


def short_run(tree, q, qd, tau, duration, steps=1) -> list:
    """The state q, qd at the end: Gragg's midpoint rule, extrapolated (Bulirsch and Stoer) in every step."""
    with mpmath.workdps(DIGITS):
        exact, torque = exact_tree(tree, mpmath.mpf), [mpmath.mpf(float(v)) for v in tau]
        start = of_length_1(tree.coordinates, [mpmath.mpf(float(v)) for v in q])
        state, nq = mpmath.matrix([*start, *(mpmath.mpf(float(v)) for v in qd)]), len(q)

        def rate(state):
            q, qd = list(state[:nq]), list(state[nq:])
            return mpmath.matrix([*exact.coordinates.component_rates(q, qd), *acceleration(exact, q, qd, torque)])

        for _ in range(steps):
            state = extrapolated(rate, state, mpmath.mpf(float(duration)) / steps)
        return list(state)


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
            row.append(row[-1] + (row[-1] - value) * (mpmath.mpf((j - k) ** 2) / (j**2 - (j - k) ** 2)))
    return row[-1]
