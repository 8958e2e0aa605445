"""Sine and cosine together, without a branch, so that many can be computed side by side; for the compiled kernels.

x is reduced to r = x - n pi/2 in [-pi/4, pi/4] by two fused multiply-adds (pi/2 as the sum of two doubles: the first
difference is rounded once, however large n is), then the minimax polynomials of fdlibm (Sun, 1993), then n modulo 4 swaps
the two and sets their signs by bits. Off by at most 2.2e-16 up to |x| = LIMIT. Beyond, where neighbouring doubles are
an eighth of a radian apart, both are NaN, so that a caller can take the library's.
"""

import math

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

LIMIT = 2.0**49  # rad
NAN = float("nan")


@intrinsic
def fma(typingctx, a, b, c):
    """a b + c, rounded once."""

    def generate(context, builder, signature, arguments):
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


@intrinsic
def bits(typingctx, x):
    """The 64 bits of a double as an integer."""

    def generate(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], ir.IntType(64))

    return types.int64(types.float64), generate


@intrinsic
def from_bits(typingctx, i):
    """The double with these 64 bits."""

    def generate(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], ir.DoubleType())

    return types.float64(types.int64), generate


@intrinsic
def widest(typingctx):
    """Lets the compiler take the widest registers in the function that calls this: left alone, it may take half of them."""

    def generate(context, builder, signature, arguments):
        # an attribute with a value, which llvmlite writes but does not add of itself
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.none(), generate


@intrinsic(prefer_literal=True)
def block(typingctx, size):
    """A pointer to so many doubles of the function's own, a literal number: the compiler knows that no other leads there."""

    def generate(context, builder, signature, arguments):
        place = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), size.literal_value))
        place.align = 64  # of a widest register
        return builder.bitcast(place, ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(size), generate


@njit(forceinline=True, error_model="numpy")
def sincos(x):
    """(sin x, cos x) for |x| <= LIMIT, x in rad; else NaN."""
    one = 1.0 if abs(x) <= LIMIT else NAN
    # the sum with 1.5 * 2^52 rounds to an integer, which is then in the last bits
    shifted = fma(x, 0.6366197723675814, 6755399441055744.0)
    n = shifted - 6755399441055744.0
    r = fma(n, -6.123233995736766e-17, fma(n, -1.5707963267948966, x))
    z = r * r
    w = z * z
    s = fma(fma(w, fma(z, 1.58969099521155010221e-10, -2.50507602534068634195e-08),
                fma(z, 2.75573137070700676789e-06, -1.98412698298579493134e-04)), w,
            fma(z, 8.33333333332248946124e-03, -1.66666666666666324348e-01))  # fmt: skip
    s = fma(s, z * r, r * one)
    c = fma(fma(w, fma(z, -1.13596475577881948265e-11, 2.08757232129817482790e-09),
                fma(z, -2.75573143513906633035e-07, 2.48015872894767294178e-05)), w,
            fma(z, -1.38888888888741095749e-03, 4.16666666666666019037e-02))  # fmt: skip
    c = fma(c, w, fma(z, -0.5, one))
    k = bits(shifted)
    swap = (k & 1) != 0
    sine, cosine = (c if swap else s), (s if swap else c)
    return from_bits(bits(sine) ^ ((k & 2) << 62)), from_bits(bits(cosine) ^ (((k + 1) & 2) << 62))


# here and not in the generated modules: numba takes functions of the same lines for one, and what calls it would be kept with the
# name of the module in which it was first met, without which no other process can read it
@njit(error_model="numpy")
def library_sincos(x):
    """(sin x, cos x) by the library, for any x in rad."""
    return math.sin(x), math.cos(x)
