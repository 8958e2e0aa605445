"""Symbolic equations as a LaTeX document, and as an HTML page with MathML."""

import html
import re
from collections.abc import Sequence

from .formulas import Formula, Token, introduction, sections, tables
from .symbols import Symbolic

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
td {{ padding: 0 1rem 0 0; }} td.value {{ text-align: right; }} h2 {{ font-size: 1.1rem; margin-top: 1.5rem; }}
.entry {{ padding-left: 2rem; text-indent: -2rem; margin: .5rem 0; line-height: 1.9; }}
pre {{ font-size: .75rem; color: #555; white-space: pre-wrap; margin-top: 3rem; }} math {{ font-size: 1.05em; }}
</style></head><body>
<h1>Equations of motion</h1>
<p><i>M</i>(<i>q</i>) <i>q̈</i> + <i>h</i>(<i>q</i>, <i>q̇</i>) = <i>τ − D q̇ − K</i> (<i>q − q</i><sub>0</sub>)</p>
<p>{text}</p>
{tables}
{equations}
<pre>{lines}</pre>
</body></html>
"""


def latex(symbolic: Symbolic, head_lines: Sequence[str] = ()) -> str:
    """A LaTeX document (article, amsmath): head_lines as comments, symbols, parameters, each quantity."""
    equations = []
    for section in sections(symbolic):
        equations.append(rf"\medskip\textbf{{{escaped(section.heading)}}}")
        if section.fits:
            body = r" \\ ".join(" & ".join(map(in_latex, row)) for row in section.rows)
            equations.append(rf"\[ {section.letter} = \begin{{pmatrix}} {body} \end{{pmatrix}} \]")
        else:
            equations += [rf"\entry{{{name} = {in_latex(formula)}}}" for name, formula in section.labelled]
    parts = {
        "comment": "\n% ".join(head_lines),
        "text": f"$${MOTION}$$\n{escaped(introduction(symbolic))}",
        "tables": "\n\n".join(map(tabular, tables(symbolic))),
        "equations": "\n\n".join(equations),
    }
    return re.sub(r"\{(comment|text|tables|equations)\}", lambda found: parts[found[1]], LATEX)


def in_latex(formula: Formula) -> str:
    parts = []
    for token in formula:
        text = rf"\{token.text}" if token.kind == "function" else token.text
        if token.kind == "number":
            text = re.sub(r"e([+-]\d+)", lambda found: rf" \cdot 10^{{{int(found[1])}}}", text)
        parts.append(f"{text}^{{{token.power}}}" if token.power else text)
    return " ".join(parts) or "0"


def escaped(text: str) -> str:
    named = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "²": "$^2$"}
    plain = text.encode("latin-1", "replace").decode("latin-1")  # what pdflatex has letters for
    return re.sub(r"[_&%$#{}\\~^²]", lambda found: named.get(found[0], f"\\{found[0]}"), plain)


def tabular(rows: Sequence[Sequence[str]]) -> str:
    """A table of a symbol and texts; of four columns the second are numbers."""
    cells = [[f"${symbol}$", *map(escaped, texts)] for symbol, *texts in rows]
    body = " \\\\\n".join(map(" & ".join, cells))
    columns = "lrll" if len(cells[0]) == 4 else "ll"
    return f"\\begin{{longtable}}[l]{{{columns}}}\n{body}\n\\end{{longtable}}"


def page(symbolic: Symbolic, head_lines: Sequence[str] = ()) -> str:
    """An HTML page with MathML that needs no network: what `latex` shows."""
    equations = []
    for section in sections(symbolic):
        equations.append(f"<h2>{html.escape(section.heading)}</h2>")
        if section.fits:
            rows = "".join(map(matrix_row, section.rows))
            matrix = f"<mi>{section.letter}</mi><mo>=</mo><mo>(</mo><mtable>{rows}</mtable><mo>)</mo>"
            equations.append(f"<p><math>{matrix}</math></p>")
        else:
            equations += [entry(Token(name), formula) for name, formula in section.labelled]
    return HTML.format(
        lines=html.escape("\n".join(head_lines)),
        text=html.escape(introduction(symbolic)),
        tables="\n".join(map(table, tables(symbolic))),
        equations="\n".join(equations),
    )


def entry(name: Token, formula: Formula) -> str:
    return f'<p class="entry"><math>{in_mathml(name)}<mo>=</mo></math> {in_lines(formula)}</p>'


def table(rows: Sequence[Sequence[str]]) -> str:
    lines = []
    for symbol, *texts in rows:
        cells = [f"<math>{in_mathml(Token(symbol))}</math>", *map(html.escape, texts)]
        lines.append(f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>")
    return f"<table>{''.join(lines)}</table>"


def matrix_row(entries: Sequence[Formula]) -> str:
    return f"<mtr>{''.join(f'<mtd>{mathml(formula)}</mtd>' for formula in entries)}</mtr>"


def mathml(formula: Formula) -> str:
    """A formula with a narrow space between factors."""
    text = ""
    for token, before in zip(formula, [Token("", "open"), *formula]):
        factors = token.kind not in ("operator", "close") and before.kind not in ("operator", "open")
        text += "<mspace width='0.17em'/>" * factors + in_mathml(token)
    return f"<mrow>{text or '<mn>0</mn>'}</mrow>"


def in_lines(formula: Formula) -> str:
    """A formula in pieces that end where a line may be broken: before an operator."""
    pieces: list[Formula] = [[]]
    for token in formula:
        if token.kind == "operator" and pieces[-1]:
            pieces.append([])
        pieces[-1].append(token)
    return "<wbr>".join(f"<math>{mathml(piece)}</math>" for piece in pieces)


def in_mathml(token: Token) -> str:
    """A token; symbols are read from their LaTeX, such as \\dot{q}_{1}."""
    if token.kind == "symbol":
        dot, name, index = re.findall(r"^(\\dot)?[{\\]*(\w+?)}?(?:_\{?(.*?)\}?)?$", token.text)[0]
        text = f"<mi>{f'&{name};' if len(name) > 1 else name}</mi>"
        text = f'<mover accent="true">{text}<mo>˙</mo></mover>' if dot else text
        text = f"<msub>{text}<mrow><mi mathvariant='normal'>{index}</mi></mrow></msub>" if index else text
    elif token.kind == "function":
        text = f"<mi>{token.text}</mi>"
    elif token.kind == "number":
        number, _, power = token.text.partition("e")
        text = f"<mn>{number}</mn>"
        text += f"<mo>·</mo><msup><mn>10</mn><mn>{int(power)}</mn></msup>" if power else ""
    else:
        space = 0.25 * (token.kind == "operator")
        sign = token.text.replace("-", "\N{MINUS SIGN}")
        text = f'<mo stretchy="false" lspace="{space}em" rspace="{space}em">{sign}</mo>'
    return f"<msup>{text}<mn>{token.power}</mn></msup>" if token.power else text
