"""The shortest form of a polynomial of trigonometry.py as a SymPy expression: the one that a textbook would print."""

import itertools
from collections import Counter, defaultdict
from functools import reduce

from .trigonometry import NOISE, Ring

FEW_TERMS, FEW_FACTORED = 40, 6  # of a polynomial of which every form is tried, of one that is factored


class Forms:
    """Expressions of polynomials of a Ring.

    symbols: those of the ring. masses, speeds: those of them that are taken out of sums; others are where all terms have them.
    angles: SymPy expressions. parallel: {i: (j, sign)} where hinge i turns on hinge j about sign times its axis.
    """

    def __init__(self, ring: Ring, symbols, masses, speeds, angles, parallel):
        self.ring, self.symbols, self.masses, self.speeds = ring, symbols, set(masses), set(speeds)
        self.angles, self.parallel, self.sums = angles, parallel, list(angles)
        for i, (j, sign) in parallel.items():
            self.sums[i] = angles[i] + sign * self.sums[j]
        self.found, self.multiples = {}, {(): (ring.functions.one, ring.functions.zero)}

    def shortest(self, poly):
        """The shortest expression that is found for a polynomial in symbols, sines and cosines."""
        from sympy import Mul

        count, parts, terms, products = (
            len(self.symbols),
            defaultdict(lambda: self.ring.functions.zero),
            [],
            set(),
        )
        for monomial, number in poly.items():
            parts[monomial[:count]][monomial[count:]] = number
        for monomial, part in parts.items():
            number = part.content() if self.ring.exact else self.ring.ring.domain.one
            factors = {s: power for s, power in zip(self.symbols, monomial) if power and s not in self.speeds}
            speeds = Mul(*(s**power for s, power in zip(self.symbols, monomial) if s in self.speeds))
            if speeds != 1:  # a product of speeds is one factor
                factors[speeds] = 1
                products.add(speeds)
            terms.append(term(self.number(number), self.form(part.quo_ground(number)), factors))
        last = set(self.symbols) - self.masses
        return min((grouped(terms, first, last) for first in (self.masses, products, ())), key=cost)

    def form(self, poly):
        """The shortest form of a polynomial in sines and cosines alone."""
        if poly not in self.found:
            self.found[poly] = min(self.candidates(poly), key=cost)
        return self.found[poly]

    def candidates(self, poly):
        """Forms of a polynomial in sines and cosines: of the angles, of sums of parallel hinges' angles, and its harmonics."""
        few, harmonics = len(poly) <= FEW_TERMS, self.harmonics(poly)
        spaces = [(poly, self.angles)] + [(self.of_sums(harmonics), self.sums)] * bool(self.parallel)
        for poly, angles in spaces:
            squared = [
                pair for pair in self.ring.places if few and any(monomial[pair[1]] > 1 for monomial in poly)
            ]
            for turned in itertools.product([False, True], repeat=len(squared)):
                self.ring.check_time()
                pairs = [pair[::-1] for pair, turn in zip(squared, turned) if turn]
                yield from self.expressions(self.ring.reduced(poly, pairs), angles)
        yield self.of_harmonics(harmonics)

    def expressions(self, poly, angles):
        """A polynomial with its common factors taken out, and as a product of polynomials."""
        from sympy import Mul

        yield self.expression(poly, angles)
        if self.ring.exact and len(poly) <= FEW_FACTORED:
            number, factors = poly.factor_list()
            if len(factors) > 1 and angles is self.angles:  # each factor may have a shorter form of its own
                forms = [
                    self.form(self.ring.reduced(factor, self.ring.places)) ** power
                    for factor, power in factors
                ]
                yield Mul(self.number(number), *forms)

    def expression(self, poly, angles):
        from sympy import cos, sin

        functions = {
            place: of(angle)
            for pair, angle in zip(self.ring.places, angles)
            for place, of in zip(pair, (sin, cos))
        }
        terms = []
        for monomial, number in poly.items():
            factors = {of: monomial[place] for place, of in functions.items() if monomial[place]}
            terms.append((self.number(number), factors))
        return grouped(terms, (), ())

    def number(self, value):
        from sympy import Float, Integer, Rational

        if self.ring.exact:
            return Rational(int(value.numerator), int(value.denominator))
        value = float(value)
        return Integer(int(value)) if value.is_integer() else Float(value)

    def harmonics(self, poly) -> dict:
        """A polynomial as a sum of sines and cosines of sums of k_i times angle i, {(is_sine, k): number}."""
        one, result = self.ring.ring.domain.one, Counter()
        for monomial, number in poly.items():
            sines = sum(monomial[place] for place, _ in self.ring.places)
            parts = {
                (): number * (-1) ** (sines // 2)
            }  # of exp(i k q), divided by i where the number of sines is odd
            for s, c in self.ring.places:
                own = {0: one}
                # 2 i sin = z - 1/z, 2 cos = z + 1/z with z = exp(i q)
                for sign in [-1] * monomial[s] + [1] * monomial[c]:
                    turned = Counter()
                    for k, part in own.items():
                        turned[k + 1] += part / 2
                        turned[k - 1] += sign * part / 2
                    own = turned
                parts = {
                    (*k, more): part * factor for k, part in parts.items() for more, factor in own.items()
                }
            for k, part in parts.items():
                sign = next((1 if x > 0 else -1 for x in k if x), 1)
                result[sines % 2 == 1, tuple(sign * x for x in k)] += part * (sign if sines % 2 else 1)
        least = 0 if self.ring.exact else NOISE * max(map(abs, result.values()), default=0)
        return {harmonic: number for harmonic, number in result.items() if abs(number) > least}

    def of_harmonics(self, harmonics):
        from sympy import Add, Mul, cos, sin

        waves = {
            (is_sine, k): (sin if is_sine else cos)(Add(*map(Mul, k, self.angles)))
            for is_sine, k in harmonics
        }
        return Add(*(self.number(number) * waves[harmonic] for harmonic, number in harmonics.items()))

    def of_sums(self, harmonics):
        """Harmonics as a polynomial in sines and cosines of the sums of angles of parallel hinges."""
        result = self.ring.functions.zero
        for (is_sine, k), number in harmonics.items():
            k = list(k)
            for i, (j, sign) in self.parallel.items():
                k[j] -= sign * k[i]
            result += self.multiple(tuple(k))[is_sine] * number
        return self.ring.reduced(result, self.ring.places)

    def multiple(self, k):
        """Cosine and sine of a sum of k_i times angle i."""
        if k not in self.multiples:
            cosine, sine = self.multiple(k[:-1])
            s, c = (self.ring.functions.gens[place] for place in self.ring.places[len(k) - 1])
            s = s if k[-1] > 0 else -s
            for _ in range(abs(k[-1])):
                cosine, sine = cosine * c - sine * s, sine * c + cosine * s
            self.multiples[k] = (
                self.ring.reduced(cosine, self.ring.places),
                self.ring.reduced(sine, self.ring.places),
            )
        return self.multiples[k]


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
        return Add(
            *(Mul(number, *(base**power for base, power in factors.items())) for number, factors in terms)
        )
    base, power = max(shared, key=shared.get)
    size = content([number for number, factors in terms if factors.get(base) == power])
    inside = [
        (n / size, {b: p for b, p in fs.items() if b != base}) for n, fs in terms if fs.get(base) == power
    ]
    outside = [(number, factors) for number, factors in terms if factors.get(base) != power]
    rest = [grouped(outside, first, last)] if outside else []
    return Add(Mul(size, base**power, grouped(inside, first, last)), *rest)


def content(numbers):
    """What is taken out of a sum with these coefficients: their common divisor, with the sign of most of them."""
    from sympy import Integer, gcd

    size = reduce(gcd, numbers) if all(number.is_Rational for number in numbers) else Integer(1)
    return size if sum(1 if number > 0 else -1 for number in numbers) >= 0 else -size
