"""Functions in C99: a source file that needs math.h alone, and its header."""

import math
from collections.abc import Sequence
from math import prod

from .statements import Assignment, Syntax, Writer

DOUBLE = Syntax()
LEAST = 1.2e-38  # of floats: what keeps a root from zero must not become zero
SINGLE = Syntax(
    number=lambda value: f"{math.copysign(max(abs(value), LEAST), value) if value else 0.0!r}f",
    sqrt="sqrtf",
    arctan="atanf",
)
SOLVE = """/* The solution of n equations, by L U without pivots, in place of the right-hand side, after the n x n numbers. */
static void solve(int n, {kind} *a)
{{
    {kind} *b = a + n * n;
    for (int k = 0; k < n; k++) {{
        for (int i = k + 1; i < n; i++) {{
            const {kind} factor = a[n * i + k] / a[n * k + k];
            for (int j = k + 1; j < n; j++)
                a[n * i + j] -= factor * a[n * k + j];
            b[i] -= factor * b[k];
        }}
    }}
    for (int i = n - 1; i >= 0; i--) {{
        for (int j = i + 1; j < n; j++)
            b[i] -= a[n * i + j] * b[j];
        b[i] /= a[n * i + i];
    }}
}}"""


def source(name: str, head: Sequence[str], functions: Sequence, single: bool) -> str:
    """The source file: all functions, and what they need."""
    parts = [comment(head), "#include <math.h>"]
    bodies = [body(function, single) for function in functions]
    if any(" solve(" in text for text in bodies):
        parts.append(SOLVE.format(kind=kind(single)))
    for function, text in zip(functions, bodies):
        parts.append(f"{comment([function.title])}\n{declaration(name, function, single)}\n{{\n{text}\n}}")
    return "\n\n".join(parts) + "\n"


def header(name: str, head: Sequence[str], functions: Sequence, single: bool) -> str:
    """The declarations, for C and C++."""
    guard, (nq, nv, _) = f"{name.upper()}_H", functions[0].sizes
    parts = [
        comment([*head, "", "Arrays of more than one dimension are stored by rows; they may not overlap."]),
        f"#ifndef {guard}\n#define {guard}",
        '#ifdef __cplusplus\nextern "C" {\n#endif',
        f"enum {{ {name}_nq = {nq}, {name}_nv = {nv} }};",
        *(f"{comment([function.title])}\n{declaration(name, function, single)};" for function in functions),
        "#ifdef __cplusplus\n}\n#endif",
        "#endif",
    ]
    return "\n\n".join(parts) + "\n"


def kind(single: bool) -> str:
    return "float" if single else "double"


def comment(lines: Sequence[str]) -> str:
    """A comment, which no name of a joint can end."""
    text = "\n * ".join(line.replace("*/", "* /").replace("/*", "/ *") for line in lines)
    return "/* " + "\n".join(line.rstrip() for line in text.split("\n")) + " */"


def declaration(name: str, function, single: bool) -> str:
    taken = [f"const {kind(single)} {x}[{size}]" for x, size in zip(function.takes, function.sizes)]
    made = [f"{kind(single)} {x}[{prod(function.shape)}]" for x in function.results]
    return f"void {name}_{function.name}({', '.join(taken + made)})"


def body(function, single: bool) -> str:
    """The lines of a function, whose results are written last."""
    writer = Writer(function.traced, [f"{x}[{k}]" for x, k in function.inputs], SINGLE if single else DOUBLE)
    lines = [line for assignment in writer.assignments for line in statements(assignment, single)]
    size = prod(function.shape)
    lines += [f"{function.results[k // size]}[{k % size}] = {text};" for k, text in enumerate(writer.results)]
    return "\n".join(f"    {line}" for line in lines)


def statements(assignment: Assignment, single: bool) -> list[str]:
    names, values, number = assignment.names, assignment.expressions, f"const {kind(single)}"
    if assignment.kind == "sincos":
        sine, cosine = ("sinf", "cosf") if single else ("sin", "cos")
        return [f"{number} {names[0]} = {sine}({values[0]}), {names[1]} = {cosine}({values[0]});"]
    if assignment.kind == "solve":
        array, n = f"a{names[0]}", len(names)
        found = ", ".join(f"{name} = {array}[{n * n + k}]" for k, name in enumerate(names))
        return [f"{kind(single)} {array}[] = {{{', '.join(values)}}};", f"solve({n}, {array});", f"{number} {found};"]
    return [f"{number} {names[0]} = {values[0]};"]
