"""Functions in C99: a source file that needs math.h alone, and its header."""

import math
import re
from collections.abc import Sequence
from math import prod

from .statements import Syntax, Writer

DOUBLE = Syntax()
LEAST = 1.2e-38  # of floats: what keeps a root from zero must not become zero
SINGLE = Syntax(
    number=lambda value: f"{math.copysign(max(abs(value), LEAST), value) if value else 0.0!r}f",
    sqrt="sqrtf",
    arctan="atanf",
)


def source(name: str, head: Sequence[str], functions: Sequence, single: bool) -> str:
    """The source file: all functions, and what they need."""
    parts = [comment(head), "#include <math.h>"]
    for function in functions:
        begin = f"{comment([function.title])}\n{declaration(name, function, single)}"
        parts.append(f"{begin}\n{{\n{body(function, single)}\n}}")
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
    """A comment, which no name of a joint can end: neither by its signs nor by a trigraph."""
    text = "\n * ".join(re.sub(r"\*(?=/)|/(?=\*)|\?(?=\?)", r"\g<0> ", line) for line in lines)
    return "/* " + "\n".join(line.rstrip() for line in text.split("\n")) + " */"


def declaration(name: str, function, single: bool) -> str:
    taken = [f"const {kind(single)} {x}[{size}]" for x, size in zip(function.takes, function.sizes)]
    made = [f"{kind(single)} {x}[{prod(function.shape)}]" for x in function.results]
    return f"void {name}_{function.name}({', '.join(taken + made)})"


def body(function, single: bool) -> str:
    """The lines of a function, whose results are written last."""
    writer = Writer(function.traced, [f"{x}[{k}]" for x, k in function.inputs], SINGLE if single else DOUBLE)
    used = {x for x, k in function.inputs if (x, k) in function.used}
    lines = [f"(void){x};" for x in function.takes if x not in used]
    for name, text, of in writer.assignments:
        value = f"{of}{'f' * single}({text})" if of else text
        lines.append(f"const {kind(single)} {name} = {value};")
    size = prod(function.shape)
    lines += [f"{function.results[k // size]}[{k % size}] = {text};" for k, text in enumerate(writer.results)]
    return "\n".join(f"    {line}" for line in lines)
