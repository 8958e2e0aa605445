"""Functions in C99: a source file that needs math.h alone, and its header."""

import math
import re
from collections.abc import Sequence

from .statements import Function, Program, Syntax, statements

LEAST = 1.2e-38  # of floats: what keeps a root from zero must not become zero


def source(program: Program) -> str:
    parts = [comment(program.head), "#include <math.h>"]
    parts += [f"{declared(program, f)}\n{{\n{body(f, program.single)}\n}}" for f in program.functions]
    return "\n\n".join(parts) + "\n"


def header(program: Program) -> str:
    name, sizes, guard = program.name, program.functions[0].sizes, f"{program.name.upper()}_H"
    note = "Arrays of more than one dimension are stored by rows; they may not overlap."
    parts = [
        comment([*program.head, "", note]),
        f"#ifndef {guard}\n#define {guard}",
        '#ifdef __cplusplus\nextern "C" {\n#endif',
        f"enum {{ {name}_nq = {sizes['q']}, {name}_nv = {sizes['qd']} }};",
        *(f"{declared(program, function)};" for function in program.functions),
        "#ifdef __cplusplus\n}\n#endif",
        "#endif",
    ]
    return "\n\n".join(parts) + "\n"


def kind(single: bool) -> str:
    return "float" if single else "double"


def comment(lines: Sequence[str]) -> str:
    """A comment, which no name of a joint can end: neither by its signs nor by a trigraph."""
    text = "\n * ".join(re.sub(r"\*(?=/)|/(?=\*)|\?(?=\?)", r"\g<0> ", line) for line in lines)
    return "/* " + "\n".join(line.rstrip() for line in text.split("\n")) + " */"


def declared(program: Program, function: Function) -> str:
    """What a function returns, and its declaration."""
    number = kind(program.single)
    arguments = [f"const {number} {x}[{function.sizes[x]}]" for x in function.takes]
    arguments += [f"{number} {x}[{function.size}]" for x in function.results]
    declaration = f"void {program.name}_{function.name}({', '.join(arguments)})"
    return f"{comment([function.title])}\n{declaration}"


def body(function: Function, single: bool) -> str:
    used = {x for x, _ in function.used}
    lines = [f"(void){x};" for x in function.takes if x not in used]
    syntax = Syntax(
        input="{x}[{k}]",
        assignment=f"const {kind(single)} {{name}} = {{value}};",
        result="{x}[{k}] = {value};",
        function="{}f" if single else "{}",
        number=float_literal if single else repr,
    )
    assignments, results = statements(function, syntax)
    return "\n".join(f"    {line}" for line in [*lines, *assignments, *results])


def float_literal(value: float) -> str:
    size = max(abs(value), LEAST) if value else 0.0
    return f"{math.copysign(size, value)!r}f"
