"""Functions in Python that need NumPy alone and take any batch of states."""

from collections.abc import Sequence
from math import prod

from .statements import Syntax, Writer

SYNTAX = Syntax(sqrt="np.sqrt", arctan="np.arctan")
HEAD = '''import numpy as np

NQ, NV = {nq}, {nv}


def arrays(*states):
    """q (..., nq) and then qd, tau (..., nv) as arrays, and the shape of their batch."""
    states = [np.asarray(x, dtype=float) for x in states]
    for x, size in zip(states, (NQ, NV, NV)):
        if x.shape[-1:] != (size,):
            raise ValueError(f"shape {{x.shape}}; expected (..., {{size}})")
    return *states, np.broadcast_shapes(*(x.shape[:-1] for x in states))
'''


def source(name: str, head: Sequence[str], functions: Sequence) -> str:
    """The module; its functions have the names of the quantities."""
    lines = "\n".join(line.rstrip().replace("\\", "\\\\").replace('"""', "'''") for line in head).strip()
    nq, nv, _ = functions[0].sizes
    texts = "".join(f"\n\n{text(function)}\n" for function in functions)
    return f'"""{lines}\n"""\n\n{HEAD.format(nq=nq, nv=nv)}{texts}'


def text(function) -> str:
    """One function."""
    takes, results, size = function.takes, function.results, prod(function.shape)
    writer = Writer(function.traced, [f"{x}{k}" for x, k in function.inputs], SYNTAX)
    lines = [f'"""{function.title}"""', f"{', '.join(takes)}, batch = arrays({', '.join(takes)})"]
    lines += [f"{x}{k} = {x}[..., {k}]" for x, k in function.inputs if (x, k) in function.used]
    lines += [f"{name} = {f'np.{of}({value})' if of else value}" for name, value, of in writer.assignments]
    lines += [f"{', '.join(results)} = {', '.join([f'np.empty((*batch, {size}))'] * len(results))}"]
    lines += [f"{results[k // size]}[..., {k % size}] = {value}" for k, value in enumerate(writer.results)]
    shape = ", ".join(["*batch", *map(str, function.shape)])
    lines.append(f"return {', '.join(f'{result}.reshape({shape})' for result in results)}")
    return f"def {function.name}({', '.join(takes)}):\n" + "\n".join(f"    {line}" for line in lines)
