"""Functions in C99: a source file that needs math.h alone, and its header."""

import math
import re
from collections.abc import Sequence

from tmt.compiled.straight import live_out_places

from .statements import Function, Line, Program, Syntax, statements

# assignments of one function: the time of a compiler grows with the square of their number
LONGEST = 1_000
NOT_INLINED = "#ifdef __GNUC__\n__attribute__((noinline))\n#endif"
LEAST, MOST = 1.2e-38, 3.4e38  # of floats: what keeps a root from zero must not become zero


def source(program: Program) -> str:
    parts = [comment(program.head), "#include <math.h>"]
    for function in program.functions:
        parts += definitions(program, function)
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
    return f"{comment([function.title])}\nvoid {program.name}_{function.name}({arguments(program, function)})"


def arguments(program: Program, function: Function) -> str:
    number = kind(program.single)
    arrays = [f"const {number} {x}[{function.sizes[x]}]" for x in function.takes]
    return ", ".join([*arrays, *(f"{number} {x}[{function.size}]" for x in function.results)])


def definitions(program: Program, function: Function) -> list[str]:
    number = kind(program.single)
    syntax = Syntax(
        input="{x}[{k}]",
        assignment=f"const {number} {{name}} = {{value}};",
        result="{x}[{k}] = {value};",
        function="{}f" if program.single else "{}",
        number=float_literal if program.single else repr,
    )
    lines, arrays = statements(function, syntax), (*function.takes, *function.results)
    if len(lines) <= LONGEST:
        return [f"{declared(program, function)}\n{block(arrays, [line.text for line in lines])}"]
    sections = [lines[k : k + LONGEST] for k in range(0, len(lines), LONGEST)]
    texts, size = with_live_out(sections, number)
    handed, name = f"{number} w[{size}]", f"{program.name}_{function.name}"
    parts = [f"{name}_{k}" for k in range(1, 1 + len(sections))]
    heads = [f"static void {part}({arguments(program, function)}, {handed})" for part in parts]
    defined = [f"{NOT_INLINED}\n{head}\n{block((*arrays, 'w'), text)}" for head, text in zip(heads, texts)]
    calls = [f"{part}({', '.join(arrays)}, w);" for part in parts]
    return [*defined, f"{declared(program, function)}\n{block((), [f'{handed};', *calls])}"]


def block(arrays: Sequence[str], lines: Sequence[str]) -> str:
    """The lines of a function; arrays: its arguments, which it may not all use."""
    unused = f"    {' '.join(f'(void){x};' for x in arrays)}\n" if arrays else ""
    return "\n".join(["{", unused + "\n".join(f"    {line}" for line in lines), "}"])


def with_live_out(sections: Sequence[Sequence[Line]], number: str) -> tuple[list[list[str]], int]:
    """The lines of each part of a function, with what it takes from earlier ones and hands to later ones in w; its size."""
    last = {name: k for k, lines in enumerate(sections) for line in lines for name in line.takes}
    made = [[line.name for line in lines if line.name] for lines in sections]
    places, size = live_out_places(made, last)
    texts = []
    for names, lines in zip(made, sections):
        taken = sorted(
            frozenset().union(*(line.takes for line in lines)).difference(names), key=places.__getitem__
        )
        texts.append([
            *(f"const {number} {name} = w[{places[name]}];" for name in taken),
            *(line.text for line in lines),
            *(f"w[{places[name]}] = {name};" for name in names if name in places),
        ])  # fmt: skip
    return texts, size


def float_literal(value: float) -> str:
    size = max(abs(value), LEAST) if value else 0.0
    if size > MOST:
        raise ValueError(f"{value:g} stands in these equations; single precision has numbers up to {MOST:g}")
    return f"{math.copysign(size, value)!r}f"
