"""Symbolic equations as a LaTeX document."""

import re
from collections.abc import Sequence

from .formulas import Formula, introduction, sections, tables
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
