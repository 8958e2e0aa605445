"""Polynomials in sines and cosines as scalars, reduced by sin^2 = 1 - cos^2: equal functions are equal."""

from collections.abc import Iterable, Sequence
from typing import Any

from sympy import QQ, Dummy, RealField
from sympy.polys.rings import PolyRing

from tmt.derivation.vectors import Scalar, Vector, cos, sin

# bits of coefficients that are not rational: the rounding of a sum is far below that of its doubles
PRECISION = 120
NOISE = 1e-25  # of the largest coefficient of a polynomial
LARGEST_PRODUCT = 3_000_000  # pairs of terms in one product: some seconds
# work, s of a core of 2026: of a product, of each of its pairs of terms, of a term whose form is sought
OF_PRODUCT, OF_PAIR, OF_TERM = 4e-4, 4e-6, 1e-3
Polynomial = Any  # of SymPy
Expression = Any  # of SymPy


class TooLong(Exception):
    """The work is more than the limit."""


class Ring:
    """Polynomials in symbols, sines and cosines of n angles; exact: rational coefficients.

    Work is counted, so that the same is done on every machine under any load: TooLong where it is more than
    the limit, s.
    """

    def __init__(self, symbols: Sequence[Expression], n: int, exact: bool, limit: float):
        domain = QQ if exact else RealField(prec=PRECISION)
        functions = [Dummy() for _ in range(2 * n)]  # sines, then cosines
        self.ring = PolyRing([*symbols, *functions], domain, "lex")
        self.functions = PolyRing(functions, domain, "lex")
        self.symbols, self.exact, self.limit, self.work = symbols, exact, limit, 0.0
        self.places = [(i, n + i) for i in range(n)]  # of sine and cosine in self.functions
        self.pairs = [(len(symbols) + s, len(symbols) + c) for s, c in self.places]  # and in self.ring

    def count(self, work: float) -> None:
        self.work += work
        if self.work > self.limit:
            raise TooLong

    def scalar(self, value: Expression) -> "Trig":
        return Trig(self, self.ring.from_expr(value) if hasattr(value, "free_symbols") else self.ring(value))

    def angle(self, i: int) -> "Angle":
        return Angle(*(Trig(self, self.ring.gens[place]) for place in self.pairs[i]))

    def reduced(self, poly: Polynomial, pairs: Iterable[tuple[int, int]]) -> Polynomial:
        """The polynomial with squares of each pair's first generator replaced by 1 - that of the second."""
        for first, second in pairs:
            if any(monomial[first] > 1 for monomial in poly):
                low, high, cosine = poly.ring.zero, poly.ring.zero, poly.ring.gens[second]
                for monomial, number in poly.items():
                    if monomial[first] > 1:
                        rest = (*monomial[:first], monomial[first] - 2, *monomial[first + 1 :])
                        high[rest] = number
                    else:
                        low[monomial] = number
                poly = low + self.reduced(high * (1 - cosine**2), [(first, second)])
        return poly if self.exact else self.without_noise(poly, NOISE)

    def without_noise(self, poly: Polynomial, noise: float) -> Polynomial:
        least = noise * max(map(abs, poly.values()), default=0)
        left = {monomial: number for monomial, number in poly.items() if abs(number) > least}
        return poly.ring.from_dict(left)


class Trig:
    __slots__ = ("poly", "ring")

    def __init__(self, ring: Ring, poly: Polynomial):
        self.ring, self.poly = ring, poly

    def new(self, poly: Polynomial) -> "Trig":
        return Trig(self.ring, poly)

    def other(self, value: Scalar) -> Polynomial:
        return value.poly if isinstance(value, Trig) else self.ring.ring(self.ring.ring.domain.convert(value))

    def __add__(self, other: Scalar) -> "Trig":
        return self.new(self.poly + self.other(other))

    def __sub__(self, other: Scalar) -> "Trig":
        return self.new(self.poly - self.other(other))

    def __rsub__(self, other: Scalar) -> "Trig":
        return self.new(self.other(other) - self.poly)

    def __mul__(self, other: Scalar) -> Scalar:
        if isinstance(other, Vector):
            return other * self
        other = self.other(other)
        pairs = len(self.poly) * len(other)
        self.ring.count(OF_PRODUCT + pairs * OF_PAIR)
        if pairs > LARGEST_PRODUCT:
            raise TooLong
        return self.new(self.ring.reduced(self.poly * other, self.ring.pairs))

    __radd__, __rmul__ = __add__, __mul__

    def derivative(self, variable: "Angle | Trig") -> "Trig":
        if isinstance(variable, Angle):
            s, c = variable.sine.poly, variable.cosine.poly
            return self.new(self.ring.reduced(self.poly.diff(s) * c - self.poly.diff(c) * s, self.ring.pairs))
        return self.new(self.poly.diff(variable.poly))


class Angle:
    def __init__(self, sine: Trig, cosine: Trig):
        self.sine, self.cosine = sine, cosine

    def __sub__(self, reference: Scalar) -> "Angle":
        return self


sin.register(Angle, lambda angle: angle.sine)
cos.register(Angle, lambda angle: angle.cosine)
