"""Numbers of some 32 digits: the sum of a pair of doubles (high, low), low at most half an ulp of high.

Sums and products after Knuth and Dekker, exact where they must be by `fma`; over the values of compiled code.
"""

import mpmath

from tmt.compiled.ir import INDEX, Value
from tmt.derivation.vectors import Scalar

Both = tuple[Scalar, Scalar]  # high and low
TERMS = 16  # of the series of sine and cosine up to pi/4: the next is below 1e-36


def pair(x: mpmath.mpf) -> tuple[float, float]:
    high = float(x)
    return high, float(x - high)


with mpmath.workdps(80):
    FACTORIALS = [pair(1 / mpmath.factorial(k)) for k in range(2 * TERMS)]
    HIGH, LOW = pair(mpmath.pi / 2)
    QUARTER = HIGH, LOW, float(mpmath.pi / 2 - HIGH - LOW)  # a quarter turn in three doubles


def two_sum(a: Scalar, b: Scalar) -> Both:
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def joined(a: Scalar, b: Scalar) -> Both:
    """The same for |a| >= |b|: the pair that is a + b."""
    s = a + b
    return s, b - (s - a)


def add(ah: Scalar, al: Scalar, bh: Scalar, bl: Scalar) -> Both:
    s, e = two_sum(ah, bh)
    t, f = two_sum(al, bl)
    s, e = joined(s, e + t)
    return joined(s, e + f)


def multiply(ah: Scalar, al: Scalar, bh: Scalar, bl: Scalar) -> Both:
    p = ah * bh
    return joined(p, ah.fma(bh, -p) + ah.fma(bl, al * bh))


def divide(ah: Scalar, al: Scalar, bh: Scalar, bl: Scalar) -> Both:
    first = ah / bh
    rh, rl = less(ah, al, bh, bl, first)
    second = rh / bh
    rh, rl = less(rh, rl, bh, bl, second)
    qh, ql = joined(first, second)
    return add(qh, ql, rh / bh, 0.0)


def less(ah: Scalar, al: Scalar, bh: Scalar, bl: Scalar, times: Scalar) -> Both:
    ph, pl = multiply(bh, bl, times, 0.0)
    return add(ah, al, -ph, -pl)


def root(ah: Value, al: Value) -> tuple[Value, Value]:
    first = high = ah.function("sqrt")
    low = 0.0 * high
    for _ in range(2):
        ph, pl = multiply(high, low, high, low)
        rh, _ = add(ah, al, -ph, -pl)
        high, low = add(high, low, rh / (2.0 * high), 0.0)
    nothing = first.compare("eq", 0.0)
    return nothing.choose(first, high), nothing.choose(0.0, low)


def sincos(xh: Value, xl: Value) -> list[Value]:
    """sin x and cos x of a pair, x in rad, by their series after turning x into [-pi/4, pi/4]."""
    n = (xh / HIGH).function("rint")
    for part in QUARTER:
        p = n * part
        xh, xl = add(xh, xl, -p, -n.fma(part, -p))
    zh, zl = multiply(-xh, -xl, xh, xl)
    sh = sl = ch = cl = 0.0 * xh
    for k in range(TERMS - 1, -1, -1):
        sh, sl = add(*multiply(sh, sl, zh, zl), *FACTORIALS[2 * k + 1])
        ch, cl = add(*multiply(ch, cl, zh, zl), *FACTORIALS[2 * k])
    sh, sl = multiply(sh, sl, xh, xl)
    turns = n.cast("fptosi", INDEX)
    odd, back = (turns.bits("and", bit).compare("ne", 0) for bit in (1, 2))
    sh, sl, ch, cl = odd.choose(ch, sh), odd.choose(cl, sl), odd.choose(-sh, ch), odd.choose(-sl, cl)
    return [back.choose(-x, x) for x in (sh, sl, ch, cl)]
