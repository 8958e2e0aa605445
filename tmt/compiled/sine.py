"""Sine and cosine together, without a branch, so that many can be computed side by side; for compiled code.

x is reduced to r = x - n pi/2 in [-pi/4, pi/4] by two fused multiply-adds (pi/2 as the sum of two doubles: the first
difference is rounded once, however large n is), then the minimax polynomials of fdlibm (Sun, 1993), then n modulo 4 swaps
the two and sets their signs by bits. Off by at most 2.2e-16 up to |x| = LIMIT. Beyond, where neighbouring doubles are
an eighth of a radian apart, both are NaN.
"""

import math

from .ir import INDEX, Value, wide, width_of

LIMIT = 2.0**49  # rad


def sincos(x: Value) -> tuple[Value, Value]:
    """(sin x, cos x) for |x| <= LIMIT, x in rad, of one or several; else NaN."""
    bits = wide(INDEX, width_of(x.kind))
    unit = x.function("fabs").compare("le", LIMIT).choose(x.like(1.0), math.nan)
    # the sum with 1.5 * 2^52 rounds to an integer, which is then in the last bits
    shifted = x.fma(0.6366197723675814, 6755399441055744.0)
    n = shifted - 6755399441055744.0
    r = n.fma(-6.123233995736766e-17, n.fma(-1.5707963267948966, x))
    z = r * r
    w = z * z
    top = z.fma(1.58969099521155010221e-10, -2.50507602534068634195e-08)
    high = w.fma(top, z.fma(2.75573137070700676789e-06, -1.98412698298579493134e-04))
    s = high.fma(w, z.fma(8.33333333332248946124e-03, -1.66666666666666324348e-01)).fma(z * r, r * unit)
    top = z.fma(-1.13596475577881948265e-11, 2.08757232129817482790e-09)
    high = w.fma(top, z.fma(-2.75573143513906633035e-07, 2.48015872894767294178e-05))
    c = high.fma(w, z.fma(-1.38888888888741095749e-03, 4.16666666666666019037e-02)).fma(w, z.fma(-0.5, unit))
    turns = shifted.cast("bitcast", bits)
    swap = turns.bits("and", 1).compare("ne", 0)

    def signed(value: Value, turns: Value) -> Value:
        flip = turns.bits("and", 2).bits("shl", 62)
        return value.cast("bitcast", bits).bits("xor", flip).cast("bitcast", x.kind)

    return signed(swap.choose(c, s), turns), signed(swap.choose(s, c), turns + 1)
