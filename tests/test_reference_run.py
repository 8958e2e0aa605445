"""Decimal numbers as one more scalar: their sine and cosine."""

import mpmath

from tmt import reference_run


def test_decimal_sine_and_cosine():
    with reference_run.localcontext() as context, mpmath.workdps(60):
        context.prec = reference_run.DIGITS
        for x in ("0", "0.7853981633974483", "-1.6", "3.2", "-100.25", "4.712388980384689857693965"):
            values = reference_run.sincos(reference_run.Decimal(x))
            for value, exact in zip(values, (mpmath.sin(mpmath.mpf(x)), mpmath.cos(mpmath.mpf(x)))):
                assert abs(mpmath.mpf(str(value)) - exact) < mpmath.mpf(10) ** -33
