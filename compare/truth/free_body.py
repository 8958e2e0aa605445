"""The exact rotation of a free rigid body, by Jacobi's elliptic functions."""

from collections.abc import Sequence

import mpmath
import numpy as np

from tmt.exact.values import DIGITS

GUARD = 10  # extra digits in the calculation
BESIDE_SEPARATRIX = 1e-20  # L2 - 2 E I2 over the sum of its terms: below, too few digits are left


def free_turning(
    t: Sequence, moments: Sequence, omega: Sequence, quaternion: Sequence
) -> tuple[np.ndarray, np.ndarray]:
    """Angular velocity, rad/s in body axes, (k, 3), and orientation, (k, 4), at times t, (k,) in s: numbers of mpmath.

    moments: (3,) kg m2 about the CoM, in any order, the body axes being principal; omega: (3,) rad/s in body axes
    and quaternion: (4,) w first, body to world, both at t = 0. No torque. The quaternion is scaled to length 1 and
    moves without a change of sign. omega: Landau and Lifshitz, Mechanics, section 37; the precession about the
    angular momentum: an elliptic integral of the third kind (van Zon and Schofield, J. Comput. Phys. 225, 2007).
    Raises ValueError if a moment is not positive, or on the separatrix, where there is no elliptic function.
    """
    with mpmath.workdps(DIGITS + GUARD):
        t, moments, omega, start = ([mpmath.mpmathify(v) for v in values] for values in (t, moments, omega, quaternion))
        if min(moments) <= 0:
            raise ValueError(
                f"moments of inertia are {', '.join(map(str, map(float, moments)))}; expected positive values"
            )
        length = mpmath.norm(start)
        start = [v / length for v in start]
        (I1, I2, I3), (w1, w2, w3) = moments, omega
        if (I2 - I3) * w2 * w3 == (I3 - I1) * w3 * w1 == (I1 - I2) * w1 * w2 == 0:
            turns = [(list(omega), turned_about(omega, time)) for time in t]
        else:
            turns = tumbling(t, moments, omega)
        speeds, quaternions = zip(*((speed, composed(start, turn)) for speed, turn in turns)) if t else ((), ())
        return np.array(speeds, dtype=object).reshape(-1, 3), np.array(quaternions, dtype=object).reshape(-1, 4)


def tumbling(t: list, moments: list, omega: list) -> list[tuple[list, list]]:
    """For each time: the angular velocity and the rotation since t = 0, a quaternion in the body axes of t = 0.

    The axes in an order in which the third keeps its sign: omega = (a cn, b sn, c dn)(p t + begin, m).
    """
    order = sorted(range(3), key=lambda axis: moments[axis])
    terms = [I * (I - moments[order[1]]) * w**2 for I, w in zip(moments, omega)]
    excess = mpmath.fsum(terms)  # L2 - 2 E I2
    if abs(excess) <= BESIDE_SEPARATRIX * mpmath.fsum(terms, absolute=True):
        raise ValueError(
            "the body starts on the separatrix (2 E I2 = L2), where the motion is not an elliptic function"
        )
    order = order if excess > 0 else order[::-1]
    i, j, k = order
    signs = 1, (j - i) * (k - i) * (k - j) // 2, 1  # right-handed again
    I1, I2, I3 = (moments[axis] for axis in order)
    w1, w2, w3 = (omega[axis] * sign for axis, sign in zip(order, signs))

    # squares as sums of positive terms: L2 - 2 E I3 and L2 - 2 E I1 by the speeds
    ratio = mpmath.sqrt(I1 * (I1 - I3) / (I2 * (I2 - I3)))
    a = mpmath.hypot(w1, w2 / ratio)
    c = mpmath.sign(w3) * mpmath.sqrt(w3**2 + I2 * (I2 - I1) / (I3 * (I3 - I1)) * w2**2)
    b = mpmath.sign((I3 - I1) * c) * ratio * a
    p = abs((I3 - I2) / I1 * ratio * c)
    m = I1 * (I2 - I1) * a**2 / (I3 * (I3 - I2) * c**2)
    L = mpmath.norm([I1 * w1, I2 * w2, I3 * w3])
    n = I3 * (I2 - I1) / (I1 * (I2 - I3))
    quarter, whole = mpmath.ellipk(m), mpmath.ellippi(n, m)
    begin = mpmath.ellipf(mpmath.atan2(w2 / b, w1 / a), m)

    def state(time):
        """Angular velocity, and the rotation from the body to axes whose third is L: spin, nutation, precession."""
        u = p * time + begin
        halves = mpmath.nint(u / (2 * quarter))
        sn, cn, dn = (mpmath.ellipfun(name, u=u - 2 * quarter * halves, m=m) for name in ("sn", "cn", "dn"))
        third = 2 * halves * whole + mpmath.ellippi(n, mpmath.atan2(sn, cn), m)
        precession = L / I3 * (time + (I3 - I1) / (I1 * p) * third)
        nutation = mpmath.atan2(mpmath.hypot(I1 * a * cn, I2 * b * sn), I3 * c * dn)
        spin = mpmath.atan2(I2 * b * sn, I1 * a * cn) + mpmath.pi * halves * mpmath.sign(b)
        turn = composed(turned_about((0, -1, 0), nutation), turned_about((0, 0, -1), spin))
        side = -1 if halves % 2 else 1
        return (side * a * cn, side * b * sn, c * dn), composed(turned_about((0, 0, 1), precession), turn)

    def as_given(vector):
        return [vector[order.index(axis)] * signs[order.index(axis)] for axis in range(3)]

    w, *vector = state(mpmath.mpf(0))[1]
    back = [w, *(-v for v in vector)]
    states = [(speed, composed(back, turn)) for speed, turn in map(state, t)]
    return [(as_given(speed), [w, *as_given(vector)]) for speed, (w, *vector) in states]


def turned_about(omega: Sequence, time: mpmath.mpf) -> list:
    """The quaternion, w first, of a rotation with a constant angular velocity."""
    half = mpmath.norm(omega) * time / 2
    return [mpmath.cos(half), *(mpmath.sinc(half) * time / 2 * v for v in omega)]


def composed(p: Sequence, q: Sequence) -> list:
    """The quaternion p o q, w first."""
    (a, b, c, d), (e, f, g, h) = p, q
    return [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]
