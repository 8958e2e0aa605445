"""Functions in Python that need NumPy alone and take any batch of states."""

from collections.abc import Sequence
from math import prod

from .statements import Assignment, Syntax, Writer

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
SOLVE = '''

def solve(n, values):
    """The solution of n equations: n rows of n numbers, then the right-hand side."""
    a = np.stack(np.broadcast_arrays(*values), axis=-1)
    matrix, right = a[..., : n * n].reshape(*a.shape[:-1], n, n), a[..., n * n :, None]
    return np.moveaxis(np.linalg.solve(matrix, right)[..., 0], -1, 0)
'''


def source(name: str, head: Sequence[str], functions: Sequence) -> str:
    """The module; its functions have the names of the quantities."""
    lines = "\n".join(line.rstrip().replace("\\", "\\\\").replace('"""', "'''") for line in head).strip()
    nq, nv, _ = functions[0].sizes
    texts = [text(function) for function in functions]
    solve = SOLVE if any(" = solve(" in text for text in texts) else ""
    return f'"""{lines}\n"""\n\n{HEAD.format(nq=nq, nv=nv)}{solve}' + "".join(f"\n\n{text}\n" for text in texts)


def text(function) -> str:
    """One function."""
    takes, results, size = function.takes, function.results, prod(function.shape)
    writer = Writer(function.traced, [f"{x}{k}" for x, k in function.inputs], SYNTAX)
    lines = [f'"""{function.title}"""', f"{', '.join(takes)}, batch = arrays({', '.join(takes)})"]
    used = {x.i for x in function.traced.inputs} & set(function.traced.nodes)
    for (x, k), node in zip(function.inputs, function.traced.inputs):
        lines += [f"{x}{k} = {x}[..., {k}]"] * (node.i in used)
    lines += [line for assignment in writer.assignments for line in statements(assignment)]
    lines += [f"{', '.join(results)} = {', '.join([f'np.empty((*batch, {size}))'] * len(results))}"]
    lines += [f"{results[k // size]}[..., {k % size}] = {value}" for k, value in enumerate(writer.results)]
    shape = ", ".join(["*batch", *map(str, function.shape)])
    lines.append(f"return {', '.join(f'{result}.reshape({shape})' for result in results)}")
    return f"def {function.name}({', '.join(takes)}):\n" + "\n".join(f"    {line}" for line in lines)


def statements(assignment: Assignment) -> list[str]:
    names, values = assignment.names, assignment.expressions
    if assignment.kind == "sincos":
        return [f"{', '.join(names)} = np.sin({values[0]}), np.cos({values[0]})"]
    if assignment.kind == "solve":
        return [f"{', '.join(names)}, = solve({len(names)}, [{', '.join(values)}])"]
    return [f"{names[0]} = {values[0]}"]
