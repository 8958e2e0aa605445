"""Symbolic equations as a LaTeX document, an HTML page with MathML, and Python text with SymPy."""

import html
import re
from collections.abc import Sequence
from typing import NamedTuple

from .symbols import Symbolic

WIDTH = 75  # characters of a formula that fit on a line
TITLES = {
    "mass_matrix": ("M", "mass matrix"),
    "bias": ("h", "bias: Coriolis, centrifugal and gravity terms"),
    "gravity_balance": ("G", "torque or force that balances gravity"),
}


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
        of_symbol = 0 if name.startswith("m_") else 1 if name.startswith("g") else 3 if name.startswith("\\dot") else 2
        return (
            (5 if base.is_Add else 4 if base.is_Function else of_symbol),
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
        result = [] if number == 1 else tokens(number, display)
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
                formula = tokens(entry, symbolic.display) if entry or gravity is None or not gravity[i] else []
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
    return sum(max(map(width, column)) for column in zip(*rows)) + 4 * len(rows[0]) <= WIDTH and len(rows[0]) > 1


def head(symbolic: Symbolic) -> list[str]:
    """The conventions in sentences."""
    sizes = "; ".join(f"{letter}: {title}" for letter, title, _ in formulas(symbolic))
    note = [f"{symbolic.note[0].upper()}{symbolic.note[1:]}."] if symbolic.note else []
    return [f"{sizes}.", "Forces of dampers D and springs K are not in h.", *note]


# LaTeX

LATEX = r"""% {comment}
\documentclass[10pt]{article}
\usepackage[a4paper, margin=18mm]{geometry}
\usepackage{amsmath}
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
            equations += [rf"\entry{{{name} = {in_latex(formula)}}}" for name, formula in labelled(letter, entries)]
    joints = [(f"${symbolic.display[q]}$", escaped(text)) for q, text in zip(symbolic.q, symbolic.joints)]
    rows = [
        (f"${symbolic.display[symbol]}$", f"{row.value:.6g}", row.unit.replace("2", "$^2$"), escaped(row.meaning))
        for symbol, row in symbolic.parameters.items()
    ]
    parts = {
        "comment": "\n% ".join(head_lines) or "Equations of motion",
        "text": f"$${MOTION}$$\n" + " ".join(map(escaped, head(symbolic))),
        "tables": tabular("ll", joints) + "\n\n" + tabular("lrll", rows),
        "equations": "\n\n".join(equations),
    }
    text = LATEX
    for name, part in parts.items():
        text = text.replace(f"{{{name}}}", part)
    return text


def in_latex(formula) -> str:
    parts = []
    for token in formula:
        text = rf"\{token.text}" if token.kind == "function" else token.text
        parts.append(f"{text}^{{{token.power}}}" if token.power else text)
    return " ".join(parts) or "0"


def escaped(text: str) -> str:
    """Text in LaTeX."""
    return re.sub(r"([_&%$#{}])", r"\\\1", text).replace("~", r"\textasciitilde{}").replace("^", r"\textasciicircum{}")


def tabular(columns, rows) -> str:
    body = " \\\\\n".join(" & ".join(row) for row in rows)
    return f"\\begin{{tabular}}{{{columns}}}\n{body}\n\\end{{tabular}}" if rows else ""


# HTML

HTML = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Equations of motion</title>
<!-- {comment} -->
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }}
td {{ padding: 0 1rem 0 0; }} td.value {{ text-align: right; }} h2 {{ font-size: 1.1rem; margin-top: 1.5rem; }}
.entry {{ padding-left: 2rem; text-indent: -2rem; margin: .5rem 0; line-height: 1.9; }} math {{ font-size: 1.05em; }}
</style></head><body>
<h1>Equations of motion</h1>
<p>{motion}</p><p>{text}</p>
{tables}
{equations}
</body></html>
"""


def page(symbolic: Symbolic, head_lines: Sequence[str] = ()) -> str:
    """An HTML page with MathML that needs no network: what `latex` shows."""
    equations = []
    for letter, title, entries in formulas(symbolic):
        equations.append(f"<h2>{html.escape(title[0].upper() + title[1:])}</h2>")
        if fits(entries):
            rows = "".join(f"<mtr>{''.join(f'<mtd>{mathml(e)}</mtd>' for e in row)}</mtr>" for row in entries)
            matrix = f"<mi>{letter}</mi><mo>=</mo><mo>(</mo><mtable>{rows}</mtable><mo>)</mo>"
            equations.append(f"<p><math>{matrix}</math></p>")
        else:
            equations += [
                f'<p class="entry"><math>{in_mathml(Token(name))}<mo>=</mo></math> {in_lines(formula)}</p>'
                for name, formula in labelled(letter, entries)
            ]
    joints = [(mathml_of(symbolic.display[q]), html.escape(text)) for q, text in zip(symbolic.q, symbolic.joints)]
    rows = [
        (mathml_of(symbolic.display[symbol]), f"{row.value:.6g}", row.unit.replace("2", "²"), html.escape(row.meaning))
        for symbol, row in symbolic.parameters.items()
    ]
    tables = [
        f"<table>{''.join('<tr>' + ''.join(f'<td>{cell}</td>' for cell in row) + '</tr>' for row in part)}</table>"
        for part in (joints, rows)
        if part
    ]
    return HTML.format(
        comment=html.escape("\n".join(head_lines)).replace("--", "- -"),
        motion=MOTION_IN_HTML,
        text=html.escape(" ".join(head(symbolic))),
        tables="\n".join(tables),
        equations="\n".join(equations),
    )


MOTION_IN_HTML = (
    "<i>M</i>(<i>q</i>) <i>q̈</i> + <i>h</i>(<i>q</i>, <i>q̇</i>) = "
    "<i>τ</i> − <i>D q̇</i> − <i>K</i> (<i>q − q</i><sub>0</sub>)"
)


def mathml_of(display: str) -> str:
    return f"<math>{in_mathml(Token(display))}</math>"


def mathml(formula) -> str:
    """A formula with a narrow space between factors."""
    text = ""
    for token, before in zip(formula, [Token("", "open"), *formula]):
        factors = token.kind not in ("operator", "close") and before.kind not in ("operator", "open")
        text += "<mspace width='0.17em'/>" * factors + in_mathml(token)
    return f"<mrow>{text or '<mn>0</mn>'}</mrow>"


def in_lines(formula) -> str:
    """A formula in pieces that end where a line may be broken: before an operator."""
    pieces = [[]]
    for token in formula:
        if token.kind == "operator" and pieces[-1]:
            pieces.append([])
        pieces[-1].append(token)
    return "<wbr>".join(f"<math>{mathml(piece)}</math>" for piece in pieces)


def in_mathml(token) -> str:
    """A token; symbols are read from their LaTeX, such as \\dot{q}_{1}."""
    if token.kind == "symbol":
        dot, name, index = re.fullmatch(r"(\\dot)?[{\\]*(\w+?)}?(?:_\{?(.*?)\}?)?", token.text).groups()
        text = f"<mi>{f'&{name};' if len(name) > 1 else name}</mi>"
        text = f'<mover accent="true">{text}<mo>˙</mo></mover>' if dot else text
        text = f"<msub>{text}<mrow><mi mathvariant='normal'>{index}</mi></mrow></msub>" if index else text
    elif token.kind == "function":
        text = f"<mi>{token.text}</mi>"
    elif token.kind == "number":
        text = f"<mn>{token.text}</mn>"
    else:
        space = 0.25 * (token.kind == "operator")
        sign = token.text.replace("-", "\N{MINUS SIGN}")
        text = f'<mo stretchy="false" lspace="{space}em" rspace="{space}em">{sign}</mo>'
    return f"<msup>{text}<mn>{token.power}</mn></msup>" if token.power else text


# Python

PYTHON = """{comment}
import sympy
from sympy import cos, sin

q = {q} = sympy.symbols({q_names!r}, seq=True)
qd = {qd} = sympy.symbols({qd_names!r}, seq=True)
joint_names = {joint_names!r}
{parameters}
{matrices}
"""


def python_source(symbolic: Symbolic, head_lines: Sequence[str] = ()) -> str:
    """Python text with SymPy: the symbols, `parameters` {{symbol: value}}, the matrices M, h and G with the symbols, and pairs of
    a matrix with numbers and the list of its symbols, as compare.assert_agrees takes them: mass_matrix, bias, gravity."""
    from sympy.printing.str import StrPrinter

    class Printer(StrPrinter):
        def _print_Float(self, expr):
            return repr(float(expr))

    lines = [
        f"{symbol} = sympy.Symbol({str(symbol)!r})  # {row.meaning}, {row.unit}"
        for symbol, row in symbolic.parameters.items()
    ]
    values = ", ".join(f"{symbol}: {row.value!r}" for symbol, row in symbolic.parameters.items())
    lines.append(f"parameters = {{{values}}}")
    matrices = []
    for name, matrix in symbolic.entries.items():
        letter, title = TITLES[name]
        rows = [",\n".join(f"    [{', '.join(Printer().doprint(entry) for entry in row)}]" for row in matrix.tolist())]
        symbols = "[*q, *qd]" if name == "bias" else "[*q]"
        own = {"gravity_balance": "gravity"}.get(name, name)
        matrices.append(
            f"# {title}\n{letter} = sympy.Matrix([\n{rows[0]},\n])\n{own} = ({letter}.subs(parameters), {symbols})"
        )
    return PYTHON.format(
        comment="\n".join(f"# {line}" for line in head_lines),
        q=", ".join(map(str, symbolic.q)) + ",",
        qd=", ".join(map(str, symbolic.qd)) + ",",
        q_names=" ".join(map(str, symbolic.q)),
        qd_names=" ".join(map(str, symbolic.qd)),
        joint_names=list(symbolic.joint_names),
        parameters="\n".join(lines),
        matrices="\n".join(matrices),
    )
