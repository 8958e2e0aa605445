"""Symbolic equations as a LaTeX document and as an HTML page with MathML, formulas by SymPy's printers."""

import html
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple
from xml.dom.minidom import parseString

import sympy
from sympy.printing.mathml import MathMLPresentationPrinter

from .symbols import TITLES, Symbolic
from .trigonometry import Expression

WIDTH = 75  # characters of a matrix that fit on a line
DIGITS = 6
Row = tuple[str, ...]
Display = Mapping[Expression, str]

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
HTML = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Equations of motion</title>
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }}
td {{ padding: 0 1rem 0 0; }} h2 {{ font-size: 1.1rem; margin-top: 1.5rem; }} math {{ font-size: 1.05em; }}
.entry {{ padding-left: 2rem; text-indent: -2rem; margin: .5rem 0; line-height: 1.9; }}
pre {{ font-size: .75rem; color: #555; white-space: pre-wrap; margin-top: 3rem; }}
</style></head><body>
<h1>Equations of motion</h1>
<p><i>M</i>(<i>q</i>) <i>q̈</i> + <i>h</i>(<i>q</i>, <i>q̇</i>) =
<i>τ − D q̇ − K</i> (<i>q − q</i><sub>0</sub>)</p>
<p>{text}</p>
{tables}
{equations}
<pre>{lines}</pre>
</body></html>
"""


class Section(NamedTuple):
    letter: str
    title: str
    rows: list[list[Expression]]

    @property
    def heading(self) -> str:
        return self.title[0].upper() + self.title[1:]

    @property
    def fits(self) -> bool:
        columns = list(zip(*self.rows))
        widths = [max(len(re.sub("_[a-z]*", "_", str(entry))) for entry in column) for column in columns]
        return len(columns) > 1 and sum(widths) + 4 * len(columns) <= WIDTH

    @property
    def labelled(self) -> list[tuple[str, Expression]]:
        """Entries with their names: those of a symmetric matrix from the diagonal on."""
        n = len(self.rows)
        if len(self.rows[0]) == 1:
            return [(f"{self.letter}_{{{i + 1}}}", self.rows[i][0]) for i in range(n)]
        comma = "," if n > 9 else ""
        upper = [(i, j) for i in range(n) for j in range(i, n)]
        return [(f"{self.letter}_{{{i + 1}{comma}{j + 1}}}", self.rows[i][j]) for i, j in upper]


def sections(symbolic: Symbolic) -> list[Section]:
    """All quantities, numbers with six digits; a bias refers to gravity by its symbol."""
    result = []
    for name, matrix in symbolic.entries.items():
        rows = matrix.tolist()
        if name == "bias" and "gravity_balance" in symbolic.entries:
            gravity = symbolic.entries["gravity_balance"]
            symbols = [sympy.Symbol(f"G_{{{i + 1}}}") for i in range(len(rows))]
            rows = [[h - G + symbol if G else h] for (h,), G, symbol in zip(rows, gravity, symbols)]
        rows = [
            [x.xreplace({n: sympy.Float(n, DIGITS) for n in x.atoms(sympy.Float)}) for x in row]
            for row in rows
        ]
        result.append(Section(*TITLES[name], rows))
    return result


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


def latex(symbolic: Symbolic, head_lines: Sequence[str] = ()) -> str:
    equations, display = [], symbolic.display
    for section in sections(symbolic):
        equations.append(rf"\medskip\textbf{{{escaped(section.heading)}}}")
        if section.fits:
            body = r" \\ ".join(" & ".join(in_latex(entry, display) for entry in row) for row in section.rows)
            equations.append(rf"\[ {section.letter} = \begin{{pmatrix}} {body} \end{{pmatrix}} \]")
        else:
            for name, entry in section.labelled:
                equations.append(rf"\entry{{{name} = {in_latex(entry, display)}}}")
    parts = {
        "comment": "\n% ".join(head_lines),
        "text": f"$${MOTION}$$\n{escaped(introduction(symbolic))}",
        "tables": "\n\n".join(map(tabular, tables(symbolic))),
        "equations": "\n\n".join(equations),
    }
    return re.sub(r"\{(comment|text|tables|equations)\}", lambda found: parts[found[1]], LATEX)


def in_latex(expression: Expression, display: Display) -> str:
    options = {"symbol_names": dict(display), "fold_func_brackets": True, "long_frac_ratio": 2}
    text: str = sympy.latex(expression, **options)
    return re.sub(r"\\(left|right)(?=[()])", "", text)


def escaped(text: str) -> str:
    named = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "²": "$^2$"}
    plain = text.encode("latin-1", "replace").decode("latin-1")  # what pdflatex has letters for
    return re.sub(r"[_&%$#{}\\~^²]", lambda found: named.get(found[0], f"\\{found[0]}"), plain)


def tabular(rows: Sequence[Sequence[str]]) -> str:
    cells = [[f"${symbol}$", *map(escaped, texts)] for symbol, *texts in rows]
    body = " \\\\\n".join(map(" & ".join, cells))
    columns = "lrll" if len(cells[0]) == 4 else "ll"
    return f"\\begin{{longtable}}[l]{{{columns}}}\n{body}\n\\end{{longtable}}"


def page(symbolic: Symbolic, head_lines: Sequence[str] = ()) -> str:
    equations, printer = [], Printer(symbolic.display)
    for section in sections(symbolic):
        equations.append(f"<h2>{html.escape(section.heading)}</h2>")
        if section.fits:
            cells = ["".join(f"<mtd>{printer.doprint(entry)}</mtd>" for entry in row) for row in section.rows]
            rows = "".join(f"<mtr>{row}</mtr>" for row in cells)
            matrix = f"<mi>{section.letter}</mi><mo>=</mo><mo>(</mo><mtable>{rows}</mtable><mo>)</mo>"
            equations.append(f"<p><math>{matrix}</math></p>")
        else:
            for name, entry in section.labelled:
                label = f"<math>{in_mathml(name)}<mo>=</mo></math>"
                equations.append(f'<p class="entry">{label} {printer.in_lines(entry)}</p>')
    return HTML.format(
        lines=html.escape("\n".join(head_lines)),
        text=html.escape(introduction(symbolic)),
        tables="\n".join(map(table, tables(symbolic))),
        equations="\n".join(equations),
    )


class Printer(MathMLPresentationPrinter):  # type: ignore[misc]  # SymPy has no types
    def __init__(self, display: Display):
        super().__init__()
        self.display = display

    def _print_Symbol(self, symbol: Expression) -> Any:
        return parseString(in_mathml(self.display.get(symbol, symbol.name))).documentElement

    def doprint(self, expression: Expression) -> str:
        """Brackets are those that browsers show: mfenced, which SymPy 1.12 writes, is none."""
        text: str = super().doprint(expression)
        return text.replace("<mfenced>", "<mrow><mo>(</mo>").replace("</mfenced>", "<mo>)</mo></mrow>")

    def in_lines(self, expression: Expression) -> str:
        pieces = ""
        for term in expression.as_ordered_terms():
            minus = term.could_extract_minus_sign()
            sign = "\N{MINUS SIGN}" if minus else "+" if pieces else ""
            sign = f"<mo>{sign}</mo>" if sign else ""
            pieces += f"<math>{sign}{self.doprint(-term if minus else term)}</math><wbr>"
        return pieces.removesuffix("<wbr>")


def table(rows: Sequence[Sequence[str]]) -> str:
    lines = []
    for symbol, *texts in rows:
        cells = [f"<math>{in_mathml(symbol)}</math>", *map(html.escape, texts)]
        lines.append(f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>")
    return f"<table>{''.join(lines)}</table>"


def in_mathml(symbol: str) -> str:
    """A symbol, read from its LaTeX, such as \\dot{q}_{1}."""
    dot, name, index = re.findall(r"^(\\dot)?[{\\]*(\w+?)}?(?:_\{?(.*?)\}?)?$", symbol)[0]
    text = f"<mi>{html.unescape(f'&{name};') if len(name) > 1 else name}</mi>"
    text = f'<mover accent="true">{text}<mo>˙</mo></mover>' if dot else text
    return f"<msub>{text}<mrow><mi mathvariant='normal'>{index}</mi></mrow></msub>" if index else text
