"""Polynomials in sines and cosines as scalars of the method, and their shortest forms as SymPy expressions.

The method of tmt.derivation runs over `Trig`. Its polynomials are reduced by sin^2 = 1 - cos^2, so that equal functions are equal
polynomials; `Ring.shortest` then looks for the form that a textbook would print.
"""

import itertools
import time
from collections import Counter, defaultdict
from functools import reduce

from tmt.derivation.vectors import Vector, cos, sin

PRECISION = 120  # bits of coefficients that are not rational: the rounding of a sum is far below that of its doubles
NOISE = 1e-25  # of the largest coefficient of a polynomial
LARGEST_PRODUCT = 3_000_000  # pairs of terms in one product: some seconds
FEW_TERMS, FEW_FACTORED = 40, 6  # of a polynomial of which every form is tried, of one that is factored


class TooLong(Exception):
    """The time is up."""


class Ring:
    """Polynomials in symbols and in sines and cosines of angles, until a deadline (of time.monotonic).

    symbols: SymPy symbols, among them masses and speeds, which are taken out of sums; others only of sums that have them in all
    terms. angles: SymPy expressions.
    parallel: {i: (j, sign)} where the hinge of angle i turns, on that of angle j, about sign times its axis.
    exact: whether all numbers are integers; else coefficients have PRECISION bits.
    """

    def __init__(self, symbols, masses, speeds, angles, parallel, exact, deadline):
        from sympy import QQ, Dummy, RealField
        from sympy.polys.rings import PolyRing

        n, domain = len(angles), QQ if exact else RealField(prec=PRECISION)
        functions = [Dummy() for _ in range(2 * n)]  # sines, then cosines
        self.ring, self.functions = PolyRing([*symbols, *functions], domain, "lex"), PolyRing(functions, domain, "lex")
        self.symbols, self.masses, self.speeds, self.angles, self.parallel = symbols, masses, speeds, angles, parallel
        self.exact, self.deadline, self.forms = exact, deadline, {}
        self.places = [(i, n + i) for i in range(n)]  # of sine and cosine in self.functions
        self.pairs = [(len(symbols) + s, len(symbols) + c) for s, c in self.places]  # and in self.ring
        self.multiples = {(): (self.functions.one, self.functions.zero)}

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
        """The polynomial without coefficients below `noise` times the largest."""
        least = noise * max(map(abs, poly.values()), default=0)
        return poly.ring.from_dict({monomial: number for monomial, number in poly.items() if abs(number) > least})

    def shortest(self, poly):
        """The shortest expression that is found for a polynomial."""
        from sympy import Mul

        count, parts, terms = len(self.symbols), defaultdict(lambda: self.functions.zero), []
        products = set()
        for monomial, number in poly.items():
            parts[monomial[:count]][monomial[count:]] = number
        for monomial, part in parts.items():
            number = part.content() if self.exact else self.ring.domain.one
            powers = [(s, power) for s, power in zip(self.symbols, monomial) if power]
            speeds = Mul(*(s**power for s, power in powers if s in self.speeds))  # one factor, as in textbooks
            factors = dict(power for power in powers if power[0] not in self.speeds) | (
                {speeds: 1} if speeds != 1 else {}
            )
            products.add(speeds)
            terms.append(term(self.number(number), self.form(part.quo_ground(number)), factors))
        last = set(self.symbols).difference(self.masses)
        return min((grouped(terms, first, last) for first in (self.masses, products, ())), key=cost)

    def form(self, poly):
        """The shortest form of a polynomial in sines and cosines alone."""
        if poly not in self.forms:
            self.forms[poly] = min(self.candidates(poly), key=cost)
        return self.forms[poly]

    def candidates(self, poly):
        """Forms of a polynomial in sines and cosines alone: in the angles, in sums of parallel hinges' angles, as waves."""
        sums = list(self.angles)
        for i, (j, sign) in self.parallel.items():
            sums[i] = self.angles[i] + sign * sums[j]
        few, waves = len(poly) <= FEW_TERMS, self.waves(poly)
        spaces = [(poly, self.angles), (self.of_sums(waves), sums)]
        for poly, angles in spaces[: 2 if self.parallel else 1]:
            squared = [pair for pair in self.places if few and any(monomial[pair[1]] > 1 for monomial in poly)]
            for turned in itertools.product([False, True], repeat=len(squared)):
                self.check_time()
                pairs = [pair[::-1] for pair, turn in zip(squared, turned) if turn]
                yield from self.expressions(self.reduced(poly, pairs), angles)
        yield self.of_waves(waves)

    def expressions(self, poly, angles):
        """A polynomial with its common factors taken out, and as a product of polynomials."""
        from sympy import Mul

        yield self.expression(poly, angles)
        if self.exact and len(poly) <= FEW_FACTORED:
            number, factors = poly.factor_list()
            if len(factors) > 1 and angles is self.angles:
                forms = [self.form(self.reduced(factor, self.places)) ** power for factor, power in factors]
                yield Mul(self.number(number), *forms)

    def expression(self, poly, angles):
        from sympy import cos, sin

        functions = {
            place: of(angle) for pair, angle in zip(self.places, angles) for place, of in zip(pair, (sin, cos))
        }
        terms = []
        for monomial, number in poly.items():
            factors = {of: monomial[place] for place, of in functions.items() if monomial[place]}
            terms.append((self.number(number), factors))
        return grouped(terms, (), ())

    def number(self, value):
        from sympy import Float, Integer, Rational

        if self.exact:
            return Rational(int(value.numerator), int(value.denominator))
        value = float(value)
        return Integer(int(value)) if value.is_integer() else Float(value)

    def waves(self, poly) -> dict:
        """A polynomial as a sum of waves, {(is_sine, k): number}: sines and cosines of sums of k_i times angle i."""
        waves = defaultdict(lambda: self.ring.domain.zero)
        for monomial, number in poly.items():
            sines = sum(monomial[place] for place, _ in self.places)
            parts = {(): number * (-1) ** (sines // 2)}  # of exp(i k q), times i where the number of sines is odd
            for s, c in self.places:
                own = {0: self.ring.domain.one}
                for sign in [-1] * monomial[s] + [1] * monomial[
                    c
                ]:  # 2 i sin = z - 1/z, 2 cos = z + 1/z with z = exp(i q)
                    turned = defaultdict(lambda: self.ring.domain.zero)
                    for k, part in own.items():
                        turned[k + 1] += part / 2
                        turned[k - 1] += sign * part / 2
                    own = turned
                parts = {(*k, more): part * factor for k, part in parts.items() for more, factor in own.items()}
            for k, part in parts.items():
                sign = next((1 if x > 0 else -1 for x in k if x), 1)
                waves[sines % 2 == 1, tuple(sign * x for x in k)] += part * (sign if sines % 2 else 1)
        return {wave: number for wave, number in waves.items() if number}

    def of_waves(self, waves):
        from sympy import Add, Mul, cos, sin

        return Add(
            *(
                self.number(number) * (sin if is_sine else cos)(Add(*map(Mul, k, self.angles)))
                for (is_sine, k), number in waves.items()
            )
        )

    def of_sums(self, waves):
        """A sum of waves as a polynomial in sines and cosines of the sums of angles of parallel hinges."""
        result = self.functions.zero
        for (is_sine, k), number in waves.items():
            k = list(k)
            for i, (j, sign) in self.parallel.items():
                k[j] -= sign * k[i]
            result += self.multiple(tuple(k))[is_sine] * number
        return self.reduced(result, self.places)

    def multiple(self, k):
        """Cosine and sine of a sum of k_i times angle i."""
        if k not in self.multiples:
            cosine, sine = self.multiple(k[:-1])
            s, c = (self.functions.gens[place] for place in self.places[len(k) - 1])
            s = s if k[-1] > 0 else -s
            for _ in range(abs(k[-1])):
                cosine, sine = cosine * c - sine * s, sine * c + cosine * s
            self.multiples[k] = self.reduced(cosine, self.places), self.reduced(sine, self.places)
        return self.multiples[k]


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


def cost(form) -> int:
    """The number of operations in an expression; a minus in front of a product is free."""
    return form.count_ops() - bool(form.as_coeff_Mul()[0].is_negative)


def term(number, form, factors):
    """A term of a sum, (number, {factor: power}), of a number, an expression and further factors."""
    from sympy import Mul

    factors = dict(factors)
    for factor in Mul.make_args(form):
        if factor.is_number:
            number *= factor
        else:
            base, power = factor.as_base_exp()
            factors[base] = power
    return number, factors


def grouped(terms, first, last):
    """The sum of terms, a factor that several of them have taken out: of `first` if possible, of `last` only if all have it."""
    from sympy import Add, Mul

    counts = Counter(factor for _, factors in terms for factor in factors.items())
    shared = {
        factor: (count == len(terms), factor[0] in first, count)
        for factor, count in counts.items()
        if count > 1 and (count == len(terms) or factor[0] not in last)
    }
    if not shared:
        return Add(*(Mul(number, *(base**power for base, power in factors.items())) for number, factors in terms))
    base, power = max(shared, key=shared.get)
    size = content([number for number, factors in terms if factors.get(base) == power])
    inside = [(n / size, {b: p for b, p in fs.items() if b != base}) for n, fs in terms if fs.get(base) == power]
    outside = [(number, factors) for number, factors in terms if factors.get(base) != power]
    rest = [grouped(outside, first, last)] if outside else []
    return Add(Mul(size, base**power, grouped(inside, first, last)), *rest)


def content(numbers):
    """What is taken out of a sum with these coefficients: their common divisor, with the sign of most of them."""
    from sympy import Integer, gcd

    size = reduce(gcd, numbers) if all(number.is_Rational for number in numbers) else Integer(1)
    return size if sum(1 if number > 0 else -1 for number in numbers) >= 0 else -size
