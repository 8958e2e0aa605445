"""Taylor series of a motion in pairs of doubles (pairs.py), by rules for each operation: an interpreter, compiled once for all.

Row r of `high` and `low` (rows, order + 1) has the coefficients of one number over time: x(t) = sum_k x_k t^k. The first rows are
the state, numbers that are constant follow, then the results of the operations in `code`, rows of (operation, row of the
result, rows of its operands). With c = a b, c_k is the sum of a_j b_(k-j); quotients, roots, sines and cosines have rules of
this kind too (Jorba and Zou, Experimental Mathematics 14, 2005), from c b = a, c c = a, s' = c x', c' = -s x'.
"""

import numpy as np
from numba import njit

from tmt.exact.pairs import add, divide, joined, multiply, root, sincos, two_sum
from tmt.machine_code import compiled
from tmt.sine import fma

ADD, SUBTRACT, NEGATIVE, SCALE, SLOPE, MULTIPLY, ROOT, DIVIDE, SINE, COSINE, RATE = range(11)


@njit(forceinline=True, error_model="numpy")
def convolution(high, low, a, b, first, last):
    """sum of a_j b_(k-j) for j from first to last, as if in pairs (Ogita, Rump and Oishi, SIAM J. Sci. Comput. 26, 2005).

    a: where a_0 stands in the flat arrays, b: where b_k does.
    """
    total = error = 0.0
    for j in range(first, last + 1):
        i, m = np.uint64(a + j), np.uint64(b - j)  # unsigned: of signed ones the sign would be looked at
        x, y = high[i], high[m]
        p = x * y
        total, e = two_sum(total, p)
        error += e + fma(x, low[m], fma(low[i], y, fma(x, y, -p)))
    return joined(total, error)


@compiled
def expand(code, width, high, low):
    """Write the coefficients of the state (its first are there) and of all that it is computed by.

    width: of a row; high, low: flat. The last operations are those that make the state's next coefficients from their rates.
    """
    for k in range(width - 1):
        for n in range(len(code)):
            operation, row, of_a, of_b = code[n]
            r, a, b = row * width, of_a * width, of_b * width
            c, ah, al = r + k, high[a + k], low[a + k]
            if operation in (ADD, SUBTRACT):
                sign = 1.0 if operation == ADD else -1.0
                high[c], low[c] = add(ah, al, sign * high[b + k], sign * low[b + k])
                continue
            if operation == NEGATIVE:
                high[c], low[c] = -ah, -al
                continue
            if operation in (SCALE, SLOPE):  # by a number; of the slope of an angle, times t
                bh, bl = (high[b], low[b]) if operation == SCALE else (float(k), 0.0)
                high[c], low[c] = multiply(ah, al, bh, bl)
                continue
            if operation == ROOT and k == 0:
                high[c], low[c] = root(ah, al)
                continue
            if operation in (SINE, COSINE) and k == 0:
                sh, sl, ch, cl = sincos(ah, al)
                high[c], low[c] = (sh, sl) if operation == SINE else (ch, cl)
                continue

            first, last = 0, k
            if operation == ROOT:
                a, b, first, last = r, r, 1, k - 1
            elif operation == DIVIDE:
                a, b, first = b, r, 1
            elif operation in (
                SINE,
                COSINE,
            ):  # the slope of the angle stands before the sine, and that before the cosine
                a, b, first = (r - width, r + width, 1) if operation == SINE else (r - 2 * width, r - width, 1)
            elif operation == RATE:
                c, last = c + 1, -1
            h, l = convolution(high, low, a, b + k, first, last)

            if operation > MULTIPLY:
                bh, bl = -float(k) if operation == COSINE else float(k), 0.0
                if operation == RATE:
                    h, l, bh = ah, al, float(k + 1)
                elif operation in (ROOT, DIVIDE):
                    h, l = add(ah, al, -h, -l)
                    of = 2.0 if operation == ROOT else 1.0
                    bh, bl = of * high[a], of * low[a]
                h, l = divide(h, l, bh, bl)
            high[c], low[c] = h, l


@compiled
def values_at(high, low, th, tl, state):
    """Write the state (2, n) at the time (th, tl), s after that of the series."""
    for i in range(state.shape[1]):
        h = l = 0.0
        for k in range(high.shape[1] - 1, -1, -1):
            h, l = multiply(h, l, th, tl)
            h, l = add(h, l, high[i, k], low[i, k])
        state[0, i], state[1, i] = h, l
