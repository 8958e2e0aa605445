"""The shortest form of a polynomial of trigonometry.py as a SymPy expression: that of a textbook."""

import itertools
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import reduce

from sympy import Add, Integer, Mul, Rational, cos, gcd, sin
from sympy.simplify.fu import TR8

from tmt.derivation.vectors import Scalar

from .names import Names
from .names import number as exact_number
from .trigonometry import OF_TERM, Expression, Polynomial, Ring

FEW_TERMS, FEW_FACTORED = 40, 6  # of a polynomial of which every form is tried, of one that is factored

Term = tuple[Expression, dict[Expression, Expression]]  # of a sum: a number, {factor: power}


class Forms:
    """Expressions of polynomials of a Ring, in SymPy's angles.

    Masses and speeds are taken out of sums, other symbols where all terms have them.
    """

    def __init__(self, ring: Ring, names: Names, angles: Sequence[Expression]):
        self.ring, self.symbols, self.masses, self.speeds = ring, ring.symbols, names.masses, set(names.qd)
        self.angles = angles
        self.known: dict[Polynomial, Expression] = {}

    def shortest(self, poly: Polynomial) -> Expression:
        count, terms, products = len(self.symbols), [], set()
        parts: dict[tuple[int, ...], Polynomial] = defaultdict(lambda: self.ring.functions.zero)
        for monomial, number in poly.items():
            parts[monomial[:count]][monomial[count:]] = number
        for monomial, part in parts.items():
            number = part.content() if self.ring.exact else self.ring.ring.domain.one
            powers = {symbol: power for symbol, power in zip(self.symbols, monomial) if power}
            factors = {symbol: power for symbol, power in powers.items() if symbol not in self.speeds}
            speeds = Mul(*(symbol**power for symbol, power in powers.items() if symbol in self.speeds))
            if speeds != 1:  # a product of speeds is one factor
                factors[speeds] = 1
                products.add(speeds)
            terms.append(term(self.number(number), self.form(part.quo_ground(number)), factors))
        last = set(self.symbols) - self.masses
        return min((grouped(terms, first, last) for first in (self.masses, products, ())), key=cost)

    def form(self, poly: Polynomial) -> Expression:
        if poly not in self.known:
            self.known[poly] = min(self.candidates(poly), key=cost)
        return self.known[poly]

    def candidates(self, poly: Polynomial) -> Iterator[Expression]:
        """A polynomial with its squares reduced in each way, as a product, and as waves."""
        few = len(poly) <= FEW_TERMS
        squared = [
            pair for pair in self.ring.places if few and any(monomial[pair[1]] > 1 for monomial in poly)
        ]
        for turned in itertools.product([False, True], repeat=len(squared)):
            self.ring.count(len(poly) * OF_TERM)
            pairs = [pair[::-1] for pair, turn in zip(squared, turned) if turn]
            yield from self.expressions(self.ring.reduced(poly, pairs))
        self.ring.count(len(poly) * OF_TERM)
        yield TR8(self.expression(poly).expand()).expand()  # products of sines and cosines as sums

    def expressions(self, poly: Polynomial) -> Iterator[Expression]:
        yield self.expression(poly)
        if self.ring.exact and len(poly) <= FEW_FACTORED:
            number, factors = poly.factor_list()
            if len(factors) > 1:  # each factor may have a shorter form of its own
                reduced = [(self.ring.reduced(factor, self.ring.places), power) for factor, power in factors]
                yield Mul(self.number(number), *(self.form(factor) ** power for factor, power in reduced))

    def expression(self, poly: Polynomial) -> Expression:
        functions: dict[int, Expression] = {}
        for (sine, cosine), angle in zip(self.ring.places, self.angles):
            functions |= {sine: sin(angle), cosine: cos(angle)}
        terms = []
        for monomial, number in poly.items():
            factors = {of: monomial[place] for place, of in functions.items() if monomial[place]}
            terms.append((self.number(number), factors))
        return grouped(terms, (), ())

    def number(self, value: Scalar) -> Expression:
        if self.ring.exact:
            return Rational(int(value.numerator), int(value.denominator))
        return exact_number(float(value))


def cost(form: Expression) -> int:
    return form.count_ops() - bool(form.as_coeff_Mul()[0].is_negative)


def term(number: Expression, form: Expression, symbols: Mapping[Expression, Expression]) -> Term:
    factors = dict(symbols)
    for factor in Mul.make_args(form):
        if factor.is_number:
            number *= factor
        else:
            base, power = factor.as_base_exp()
            factors[base] = power
    return number, factors


def grouped(terms: list[Term], first: Collection[Expression], last: Collection[Expression]) -> Expression:
    """The sum of terms, common factors taken out: of `first` if possible, of `last` only if all have it."""
    counts = Counter(factor for _, factors in terms for factor in factors.items())
    shared = {
        factor: (count == len(terms), factor[0] in first, count)
        for factor, count in counts.items()
        if count > 1 and (count == len(terms) or factor[0] not in last)
    }
    if not shared:
        products = [(number, *(base**power for base, power in factors.items())) for number, factors in terms]
        return Add(*(Mul(*product) for product in products))
    base, power = max(shared, key=lambda factor: shared[factor])
    having = [(number, dict(factors)) for number, factors in terms if factors.get(base) == power]
    size = content([number for number, _ in having])
    for _, factors in having:
        del factors[base]
    inside = [(number / size, factors) for number, factors in having]
    outside = [(number, factors) for number, factors in terms if factors.get(base) != power]
    rest = [grouped(outside, first, last)] if outside else []
    return Add(Mul(size, base**power, grouped(inside, first, last)), *rest)


def content(numbers: Sequence[Expression]) -> Expression:
    """What is taken out of a sum with these coefficients: their divisor, with the sign of most of them."""
    size = reduce(gcd, numbers) if all(number.is_Rational for number in numbers) else Integer(1)
    return size if sum(1 if number > 0 else -1 for number in numbers) >= 0 else -size
