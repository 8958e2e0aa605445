"""Symbolic equations as formulas of tokens, which latex.py and page.py write."""

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import sympy

from .symbols import TITLES, Symbolic
from .trigonometry import Expression

WIDTH = 75  # characters of a formula that fit on a line


class Token(NamedTuple):
    """A part of a formula: a symbol of LaTeX, number, operator, bracket or function, and its exponent."""

    text: str
    kind: str = "symbol"
    power: str = ""


Formula = list[Token]
Row = tuple[str, ...]


class Section(NamedTuple):
    """A quantity: its symbol, what it is, and its entries."""

    letter: str
    title: str
    rows: list[list[Formula]]

    @property
    def heading(self) -> str:
        return self.title[0].upper() + self.title[1:]

    @property
    def fits(self) -> bool:
        columns = list(zip(*self.rows))
        widths = [max(map(width, column)) for column in columns]
        return len(columns) > 1 and sum(widths) + 4 * len(columns) <= WIDTH

    @property
    def labelled(self) -> list[tuple[str, Formula]]:
        """Entries with their names: those of a symmetric matrix from the diagonal on."""
        n = len(self.rows)
        if len(self.rows[0]) == 1:
            return [(f"{self.letter}_{{{i + 1}}}", self.rows[i][0]) for i in range(n)]
        comma = "," if n > 9 else ""
        upper = [(i, j) for i in range(n) for j in range(i, n)]
        return [(f"{self.letter}_{{{i + 1}{comma}{j + 1}}}", self.rows[i][j]) for i, j in upper]


def sections(symbolic: Symbolic) -> list[Section]:
    """All quantities; a bias refers to gravity by its symbol."""
    result = []
    for name, matrix in symbolic.entries.items():
        gravity = symbolic.entries.get("gravity_balance") if name == "bias" else None
        if gravity is None:
            rows = [[tokens(entry, symbolic.display) for entry in row] for row in matrix.tolist()]
        else:
            rows = [[beside(h, G, i, symbolic.display)] for i, (h, G) in enumerate(zip(matrix, gravity))]
        result.append(Section(*TITLES[name], rows))
    return result


def beside(h: Expression, gravity: Expression, i: int, display: Mapping[Expression, str]) -> Formula:
    """An entry of the bias as a sum with that of gravity, whose symbol stands for it."""
    if not gravity:
        return tokens(h, display)
    rest = h - gravity
    terms = [*tokens(rest, display), Token("+", "operator")] if rest else []
    return [*terms, Token(f"G_{{{i + 1}}}")]


def tokens(expression: Expression, display: Mapping[Expression, str]) -> Formula:
    """A formula, its factors in the order of textbooks; brackets are tokens: a line may break in them."""
    if expression.is_Add or is_negative(expression):
        return sum_of(expression.args if expression.is_Add else [expression], display)
    if expression.is_Mul:
        number, product = expression.as_coeff_Mul()
        factors = sorted(expression.func.make_args(product), key=lambda factor: factor_rank(factor, display))
        result = [token for token in tokens(number, display) if token.text != "1"]
        for factor in factors:
            formula = tokens(factor, display)
            result += in_brackets(formula) if factor.is_Add else formula
        return result
    if expression.is_Number:
        return [Token(str(expression) if expression.is_Rational else f"{float(expression):.6g}", "number")]
    base, exponent = expression.as_base_exp()
    power = "" if exponent == 1 else str(exponent)
    if base.is_Function:
        argument = tokens(base.args[0], display)
        function = Token(base.func.__name__, "function", power)
        return [function, *(argument if len(argument) == 1 else in_brackets(argument))]
    if base.is_Symbol:
        return [Token(display[base], "symbol", power)]
    return in_brackets(tokens(base, display), power)


def sum_of(terms: Sequence[Expression], display: Mapping[Expression, str]) -> Formula:
    """Terms with their signs: those without a minus first, and short ones before long ones."""

    def rank(term: Expression) -> tuple[bool, bool, int, list[int]]:
        return is_negative(term), term.has(sympy.sin, sympy.cos), term.count_ops(), order(term, display)

    result: Formula = []
    for term in sorted(terms, key=rank):
        minus = is_negative(term)
        if result or minus:
            result.append(Token("-" if minus else "+", "operator"))
        result += tokens(-term if minus else term, display)
    return result


def factor_rank(factor: Expression, display: Mapping[Expression, str]) -> tuple[int, list[int], bool]:
    """The place of a factor: masses, gravity, other symbols, speeds, sums, functions.

    A sum stands before a function: cos q (a + b) could be the cosine of a product.
    """
    base, _ = factor.as_base_exp()
    if base.is_Add or base.is_Function:
        kind = 4 if base.is_Add else 5
    else:
        begin = display.get(base, "").partition("_")[0].partition("{")[0]
        kind = {"m": 0, "g": 1, "\\dot": 3}.get(begin, 2)
    return kind, order(base, display), base.is_Function and base.func.__name__ == "cos"


def order(term: Expression, display: Mapping[Expression, str]) -> list[int]:
    places = {symbol: i for i, symbol in enumerate(display)}
    return sorted(places[symbol] for symbol in term.free_symbols)


def is_negative(term: Expression) -> bool:
    return bool(term.as_coeff_Mul()[0].is_negative)


def in_brackets(inner: Formula, power: str = "") -> Formula:
    return [Token("(", "open"), *inner, Token(")", "close", power)]


def width(formula: Formula) -> int:
    return sum(len(re.sub(r"\\(dot|[a-z]+)|[{}_]", "x", token.text)) + len(token.power) for token in formula)


def tables(symbolic: Symbolic) -> list[list[Row]]:
    """Rows of joints (symbol, meaning), and of parameters (symbol, value, unit, meaning); no empty table."""
    joints: list[Row] = [(symbolic.display[q], text) for q, text in zip(symbolic.q, symbolic.joints)]
    parameters: list[Row] = [
        (symbolic.display[symbol], f"{row.value:.6g}", row.unit.replace("2", "²"), row.meaning)
        for symbol, row in symbolic.parameters.items()
    ]
    return [rows for rows in (joints, parameters) if rows]


def introduction(symbolic: Symbolic) -> str:
    quantities = "; ".join(": ".join(TITLES[name]) for name in symbolic.entries)
    note = [f"{symbolic.note[0].upper()}{symbolic.note[1:]}."] if symbolic.note else []
    fixed = ["Forces of dampers D and springs K are not in h.", "Numbers are shown with six digits."]
    return " ".join([f"{quantities}.", *fixed, *note])
