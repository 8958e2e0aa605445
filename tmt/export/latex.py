"""Symbolic equations as a LaTeX document."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from .symbols import TITLES, Symbolic

WIDTH = 75  # characters of a formula that fit on a line


class Token(NamedTuple):
    """A part of a formula: a symbol of LaTeX, number, operator, bracket or function, and its exponent."""

    text: str
    kind: str = "symbol"
    power: str = ""


def tokens(expr, display) -> list[Token]:
    """A formula as a list, its factors in the order of textbooks; brackets are tokens too, so that a line may break in them."""
    import sympy

    places = {symbol: i for i, symbol in enumerate(display)}

    def rank(factor):
        base = factor.as_base_exp()[0]
        name = display.get(base, "")
        of_symbol = (
            0
            if name.startswith("m_")
            else 1
            if name.startswith("g")
            else 3
            if name.startswith("\\dot")
            else 2
        )
        return (  # a sum before a function: cos q (a + b) could be the cosine of a product
            (4 if base.is_Add else 5 if base.is_Function else of_symbol),
            order(base),
            base.is_Function and base.func == sympy.cos,
        )

    def order(term):
        return sorted(places[symbol] for symbol in term.free_symbols)

    def sum_of(terms):
        result = []
        terms = sorted(terms, key=lambda t: (minus(t), t.has(sympy.sin, sympy.cos), t.count_ops(), order(t)))
        for i, term in enumerate(terms):
            sign = [Token("-" if minus(term) else "+", "operator")] * (i > 0 or minus(term))
            result += sign + tokens(-term if minus(term) else term, display)
        return result

    def minus(term):
        return bool(term.as_coeff_Mul()[0].is_negative)

    if expr.is_Add:
        return sum_of(expr.args)
    if minus(expr):
        return sum_of([expr])
    if expr.is_Mul:
        number, rest = expr.as_coeff_Mul()
        factors = sorted(sympy.Mul.make_args(rest), key=rank)
        result = [token for token in tokens(number, display) if token.text != "1"]
        return result + [token for factor in factors for token in bracketed(factor, display)]
    if expr.is_Number:
        return [Token(str(expr) if expr.is_Rational else f"{float(expr):.6g}", "number")]
    base, power = expr.as_base_exp()
    power = "" if power == 1 else str(power)
    if base.is_Function:
        argument = tokens(base.args[0], display)
        return [
            Token(base.func.__name__, "function", power),
            *(argument if len(argument) == 1 else in_brackets(argument)),
        ]
    if base.is_Symbol:
        return [Token(display[base], "symbol", power)]
    return in_brackets(tokens(base, display), power)


def bracketed(factor, display):
    return in_brackets(tokens(factor, display)) if factor.is_Add else tokens(factor, display)


def in_brackets(inner, power="") -> list[Token]:
    return [Token("(", "open"), *inner, Token(")", "close", power)]


def width(formula) -> int:
    """About the number of characters that a formula prints."""
    return sum(len(re.sub(r"\\(dot|[a-z]+)|[{}_]", "x", token.text)) + len(token.power) for token in formula)


def formulas(symbolic: Symbolic) -> list:
    """Of each quantity: its symbol, what it is, and its entries as rows of formulas; a bias refers to gravity by its symbol."""
    result = []
    for name, matrix in symbolic.entries.items():
        gravity = symbolic.entries.get("gravity_balance") if name == "bias" else None
        rows = []
        for i in range(matrix.rows):
            rows.append([])
            for j in range(matrix.cols):
                entry = matrix[i, j] - gravity[i] if gravity is not None else matrix[i, j]
                formula = (
                    tokens(entry, symbolic.display) if entry or gravity is None or not gravity[i] else []
                )
                if gravity is not None and gravity[i]:
                    formula += [Token("+", "operator")] * bool(formula) + [Token(f"G_{{{i + 1}}}")]
                rows[-1].append(formula)
        result.append((*TITLES[name], rows))
    return result


def labelled(letter, rows) -> list:
    """Entries with their names: those of a symmetric matrix from the diagonal on."""
    if len(rows[0]) == 1:
        return [(f"{letter}_{{{i + 1}}}", row[0]) for i, row in enumerate(rows)]
    size = range(len(rows))
    comma = "," * (len(rows) > 9)
    return [(f"{letter}_{{{i + 1}{comma}{j + 1}}}", rows[i][j]) for i in size for j in size if j >= i]


def fits(rows) -> bool:
    """Whether the entries fit on a line side by side."""
    return (
        sum(max(map(width, column)) for column in zip(*rows)) + 4 * len(rows[0]) <= WIDTH and len(rows[0]) > 1
    )


def head(symbolic: Symbolic) -> list[str]:
    """The conventions in sentences."""
    sizes = "; ".join(f"{letter}: {title}" for letter, title, _ in formulas(symbolic))
    note = [f"{symbolic.note[0].upper()}{symbolic.note[1:]}."] if symbolic.note else []
    return [
        f"{sizes}.",
        "Forces of dampers D and springs K are not in h.",
        "Numbers are shown with six digits.",
        *note,
    ]


# LaTeX

LATEX = r"""% {comment}
\documentclass[10pt]{article}
\usepackage[a4paper, margin=18mm]{geometry}
\usepackage{amsmath, longtable}
\setlength{\LTpre}{3pt}
\setlength{\LTpost}{0pt}
\setlength{\parindent}{0pt}
\setlength{\parskip}{3pt}
\pagestyle{empty}
\relpenalty=10000
\newcommand{\entry}[1]{\par\hangindent=2em\hangafter=1\raggedright$#1$}
\begin{document}
{\large\textbf{Equations of motion}}

{text}

{tables}

{equations}
\end{document}
"""
MOTION = r"M(q)\,\ddot{q} + h(q, \dot{q}) = \tau - D\,\dot{q} - K (q - q_0)"


def latex(symbolic: Symbolic, head_lines: Sequence[str] = ()) -> str:
    """A LaTeX document (article, amsmath): symbols in words, a table of parameters, then each quantity.

    head_lines: lines of text, such as where the equations are from; they are comments at the top.
    """
    equations = []
    for letter, title, entries in formulas(symbolic):
        equations.append(rf"\medskip\textbf{{{escaped(title[0].upper() + title[1:])}}}")
        if fits(entries):
            body = r" \\ ".join(" & ".join(map(in_latex, row)) for row in entries)
            equations.append(rf"\[ {letter} = \begin{{pmatrix}} {body} \end{{pmatrix}} \]")
        else:
            equations += [
                rf"\entry{{{name} = {in_latex(formula)}}}" for name, formula in labelled(letter, entries)
            ]
    joints = [(f"${symbolic.display[q]}$", escaped(text)) for q, text in zip(symbolic.q, symbolic.joints)]
    rows = [
        (
            f"${symbolic.display[symbol]}$",
            f"{row.value:.6g}",
            row.unit.replace("2", "$^2$"),
            escaped(row.meaning),
        )
        for symbol, row in symbolic.parameters.items()
    ]
    parts = {
        "comment": "\n% ".join(head_lines),
        "text": f"$${MOTION}$$\n" + " ".join(map(escaped, head(symbolic))),
        "tables": tabular("ll", joints) + "\n\n" + tabular("lrll", rows),
        "equations": "\n\n".join(equations),
    }
    return re.sub(r"\{(comment|text|tables|equations)\}", lambda found: parts[found[1]], LATEX)


def in_latex(formula) -> str:
    parts = []
    for token in formula:
        text = rf"\{token.text}" if token.kind == "function" else token.text
        if token.kind == "number":
            text = re.sub(r"e([+-]\d+)", lambda found: rf" \cdot 10^{{{int(found[1])}}}", text)
        parts.append(f"{text}^{{{token.power}}}" if token.power else text)
    return " ".join(parts) or "0"


def escaped(text: str) -> str:
    """Text in LaTeX."""
    named = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
    plain = text.encode("latin-1", "replace").decode("latin-1")  # what pdflatex has letters for
    return re.sub(r"[_&%$#{}\\~^]", lambda found: named.get(found[0], f"\\{found[0]}"), plain)


def tabular(columns, rows) -> str:
    body = " \\\\\n".join(" & ".join(row) for row in rows)
    return f"\\begin{{longtable}}[l]{{{columns}}}\n{body}\n\\end{{longtable}}" if rows else ""
