"""Numbers of about 32 digits for compiled code: the sum of a pair of doubles (high, low), low at most half an ulp of high.

Sums and products after Knuth and Dekker, exact where they must be by `fma`; the compiler may regroup nothing. They are written in
the place of their calls (inlined.py): typed one by one, they would take as long to compile as the series that they are for.
"""

from fractions import Fraction

import mpmath
import numpy as np
from numba import njit

from tmt.eight import Number
from tmt.inlined import inlined
from tmt.sine import fma

TERMS = 16  # of the series of sine and cosine up to pi/4: the next is below 1e-36


def pair(x: mpmath.mpf) -> tuple[float, float]:
    """The pair that is nearest to a number of many digits."""
    high = float(x)
    return high, float(x - high)


with mpmath.workdps(80):
    FACTORIALS = np.array([pair(1 / mpmath.factorial(k)) for k in range(2 * TERMS)])
    QUARTER = pair(mpmath.pi / 2)
    QUARTER = (*QUARTER, float(mpmath.pi / 2 - QUARTER[0] - QUARTER[1]))  # a quarter turn in three doubles


@inlined
def two_sum(a, b):
    """a + b and what it is rounded by."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@inlined
def joined(a, b):
    """The same for |a| >= |b|: the pair that is a + b."""
    s = a + b
    return s, b - (s - a)


@inlined
def add(ah, al, bh, bl):
    s, e = two_sum(ah, bh)
    t, f = two_sum(al, bl)
    s, e = joined(s, e + t)
    return joined(s, e + f)


@inlined
def multiply(ah, al, bh, bl):
    p = rounded(ah * bh)
    return joined(p, fused(ah, bh, -p) + fused(ah, bl, al * bh))


@inlined
def divide(ah, al, bh, bl):
    first = ah / bh
    rh, rl = less(ah, al, bh, bl, first)
    second = rh / bh
    rh, rl = less(rh, rl, bh, bl, second)
    qh, ql = joined(first, second)
    return add(qh, ql, rh / bh, 0.0)


def less(ah, al, bh, bl, times):
    """The pair a - times b."""
    ph, pl = multiply(bh, bl, times, 0.0)
    return add(ah, al, -ph, -pl)


def rounded(product):
    """A product as a number of its own, which no sum takes up."""
    return product.made(product.of, lambda: product.value) if isinstance(product, Number) else product


def fused(a, b, c):
    """a b + c, rounded once."""
    if not isinstance(a, Number):
        return float(Fraction(a) * Fraction(b) + Fraction(c))
    return a.fma(*(x if isinstance(x, Number) else a.plain(x) for x in (b, c)))


@njit(error_model="numpy")
def root(ah, al):
    """The square root: from that of the double on, by Newton's method."""
    high, low = np.sqrt(ah), 0.0
    if high == 0.0:
        return high, low
    for _ in range(2):
        ph, pl = multiply(high, low, high, low)
        rh, _ = add(ah, al, -ph, -pl)
        high, low = add(high, low, rh / (2.0 * high), 0.0)
    return high, low


@njit(error_model="numpy")
def sincos(xh, xl):
    """sin x and cos x, x in rad: by their series, after turning x into [-pi/4, pi/4]."""
    n = np.rint(xh / QUARTER[0])
    for part in QUARTER:
        p = n * part
        xh, xl = add(xh, xl, -p, -fma(n, part, -p))
    zh, zl = multiply(-xh, -xl, xh, xl)
    sh = sl = ch = cl = 0.0
    for k in range(TERMS - 1, -1, -1):
        sh, sl = multiply(sh, sl, zh, zl)
        sh, sl = add(sh, sl, FACTORIALS[2 * k + 1, 0], FACTORIALS[2 * k + 1, 1])
        ch, cl = multiply(ch, cl, zh, zl)
        ch, cl = add(ch, cl, FACTORIALS[2 * k, 0], FACTORIALS[2 * k, 1])
    sh, sl = multiply(sh, sl, xh, xl)
    quarter = int(n) % 4
    if quarter % 2:
        sh, sl, ch, cl = ch, cl, -sh, -sl
    if quarter >= 2:
        sh, sl, ch, cl = -sh, -sl, -ch, -cl
    return sh, sl, ch, cl
