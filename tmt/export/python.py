"""Functions in Python that need NumPy alone and take any batch of states."""

from collections.abc import Sequence

from .statements import Function, Program, Syntax, statements

SYNTAX = Syntax(
    input="{x}{k}",
    assignment="{name} = {value}",
    result="{x}[..., {k}] = {value}",
    function="np.{}",
    arctan="arctan",
)
HEAD = '''import numpy as np

NQ, NV = {nq}, {nv}


def arrays(sizes, *states):
    """Arrays whose last dimension has these sizes, and the shape of their batch."""
    states = [np.asarray(x, dtype=float) for x in states]
    for x, size in zip(states, sizes):
        if x.shape[-1:] != (size,):
            raise ValueError(f"shape {{x.shape}}; expected (..., {{size}})")
    return *states, np.broadcast_shapes(*(x.shape[:-1] for x in states))
'''


def source(program: Program) -> str:
    sizes = program.functions[0].sizes
    texts = "".join(f"\n\n{text(function)}\n" for function in program.functions)
    return f"{docstring(program.head)}\n\n{HEAD.format(nq=sizes['q'], nv=sizes['qd'])}{texts}"


def docstring(lines: Sequence[str]) -> str:
    text = "\n".join(line.rstrip().replace("\\", "\\\\").replace('"""', "'''") for line in lines)
    return f'"""{text.strip()}\n"""'


def text(function: Function) -> str:
    takes, results = ", ".join(function.takes), ", ".join(function.results)
    empty = ", ".join([f"np.empty((*batch, {function.size}))"] * len(function.results))
    shape = ", ".join(["*batch", *map(str, function.shape)])
    lines = [
        f'"""{function.title}"""',
        f"{takes}, batch = arrays({[function.sizes[x] for x in function.takes]}, {takes})",
        *(f"{x}{k} = {x}[..., {k}]" for x, k in function.used),
        f"{results} = {empty}",
        *(line.text for line in statements(function, SYNTAX)),
        f"return {', '.join(f'{result}.reshape({shape})' for result in function.results)}",
    ]
    return "\n".join([f"def {function.name}({takes}):", *(f"    {line}" for line in lines)])
