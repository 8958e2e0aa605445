"""Polynomials in sines and cosines as scalars of the method, reduced by sin^2 = 1 - cos^2: those of equal functions are equal."""

import time

from tmt.derivation.vectors import Vector, cos, sin

PRECISION = (
    120  # bits of coefficients that are not rational: the rounding of a sum is far below that of its doubles
)
NOISE = 1e-25  # of the largest coefficient of a polynomial
LARGEST_PRODUCT = 3_000_000  # pairs of terms in one product: some seconds


class TooLong(Exception):
    """The time is up."""


class Ring:
    """Polynomials in SymPy symbols and in the sines and cosines of n angles, until a deadline (of time.monotonic).

    exact: whether coefficients are rational; else they have PRECISION bits. functions: the ring of sines and cosines alone.
    """

    def __init__(self, symbols, n, exact, deadline):
        from sympy import QQ, Dummy, RealField
        from sympy.polys.rings import PolyRing

        domain = QQ if exact else RealField(prec=PRECISION)
        functions = [Dummy() for _ in range(2 * n)]  # sines, then cosines
        self.ring, self.functions = (
            PolyRing([*symbols, *functions], domain, "lex"),
            PolyRing(functions, domain, "lex"),
        )
        self.exact, self.deadline = exact, deadline
        self.places = [(i, n + i) for i in range(n)]  # of sine and cosine in self.functions
        self.pairs = [(len(symbols) + s, len(symbols) + c) for s, c in self.places]  # and in self.ring

    def check_time(self) -> None:
        if time.monotonic() > self.deadline:
            raise TooLong

    def scalar(self, value) -> "Trig":
        """A number, or an expression in the symbols."""
        return Trig(self, self.ring.from_expr(value) if hasattr(value, "free_symbols") else self.ring(value))

    def angle(self, i) -> "Angle":
        return Angle(*(Trig(self, self.ring.gens[place]) for place in self.pairs[i]))

    def reduced(self, poly, pairs):
        """The polynomial with squares of the first generator of each pair replaced by 1 - the square of the second."""
        for first, second in pairs:
            if any(monomial[first] > 1 for monomial in poly):
                low, high, cosine = poly.ring.zero, poly.ring.zero, poly.ring.gens[second]
                for monomial, number in poly.items():
                    power = monomial[first]
                    rest = (*monomial[:first], power - 2 * (power > 1), *monomial[first + 1 :])
                    (high if power > 1 else low)[rest] = number
                poly = low + self.reduced(high * (1 - cosine**2), [(first, second)])
        return poly if self.exact else self.without_noise(poly, NOISE)

    def without_noise(self, poly, noise):
        """The polynomial without coefficients of at most `noise` times the largest."""
        least = noise * max(map(abs, poly.values()), default=0)
        return poly.ring.from_dict(
            {monomial: number for monomial, number in poly.items() if abs(number) > least}
        )


class Trig:
    """A reduced polynomial of a Ring."""

    __slots__ = ("poly", "ring")

    def __init__(self, ring, poly):
        self.ring, self.poly = ring, poly

    def new(self, poly) -> "Trig":
        return Trig(self.ring, poly)

    def other(self, value):
        return value.poly if isinstance(value, Trig) else self.ring.ring(self.ring.ring.domain.convert(value))

    def __add__(self, other):
        return self.new(self.poly + self.other(other))

    def __sub__(self, other):
        return self.new(self.poly - self.other(other))

    def __rsub__(self, other):
        return self.new(self.other(other) - self.poly)

    def __mul__(self, other):
        if isinstance(other, Vector):
            return other * self
        self.ring.check_time()
        other = self.other(other)
        if len(self.poly) * len(other) > LARGEST_PRODUCT:
            raise TooLong
        return self.new(self.ring.reduced(self.poly * other, self.ring.pairs))

    __radd__, __rmul__ = __add__, __mul__

    def derivative(self, variable) -> "Trig":
        """By an Angle, or by a Trig that is a symbol."""
        if isinstance(variable, Angle):
            s, c = variable.sine.poly, variable.cosine.poly
            return self.new(self.ring.reduced(self.poly.diff(s) * c - self.poly.diff(c) * s, self.ring.pairs))
        return self.new(self.poly.diff(variable.poly))


class Angle:
    """The angle of a hinge from its reference: its sine and cosine."""

    def __init__(self, sine, cosine):
        self.sine, self.cosine = sine, cosine

    def __sub__(self, reference):
        return self


sin.register(Angle, lambda angle: angle.sine)
cos.register(Angle, lambda angle: angle.cosine)
