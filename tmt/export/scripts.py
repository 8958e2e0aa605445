"""Functions in Python with NumPy alone, for CasADi, and in one file for MATLAB and Octave."""

from collections.abc import Iterable, Sequence

from .statements import Function, Program, Syntax, statements

NAMED = "{name} = {value}"
PYTHON = Syntax("{x}{k}", NAMED, "{x}[..., {k}] = {value}", function="np.{}")
CASADI = Syntax("{x}[{k}]", NAMED, "{x}[{k}] = {value}", function="casadi.{}")
MATLAB = Syntax("{x}({n}, :)", f"{NAMED};", "{x}({n}, :) = {value};", times=".*", over="./")
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
NOTE = "Each is a casadi.Function of columns; of three dimensions the matrices are one below the other."
COLUMNS = """\
States are columns: q (nq, N), qd and tau (nv, N); what is the same for all may be one column.
The last dimension of each result is that of the states."""


def docstring(lines: Sequence[str]) -> str:
    text = "\n".join(line.rstrip().replace("\\", "\\\\").replace('"""', "'''") for line in lines)
    return f'"""{text.strip()}\n"""'


def defined(head: str, lines: Iterable[str]) -> str:
    return "\n".join([f"\n\n{head}", *(f"    {line}" for line in lines)]) + "\n"


def python(program: Program) -> str:
    sizes = program.functions[0].sizes
    head = HEAD.format(nq=sizes["q"], nv=sizes["qd"])
    return f"{docstring(program.head)}\n\n{head}" + "".join(map(python_function, program.functions))


def python_function(function: Function) -> str:
    takes, results = ", ".join(function.takes), ", ".join(function.results)
    empty = ", ".join([f"np.empty((*batch, {function.size}))"] * len(function.results))
    shape = f"[{', '.join(['*batch', *map(str, function.shape)])}]"
    lines = [
        f'"""{function.title}"""',
        f"{takes}, batch = arrays({[function.sizes[x] for x in function.takes]}, {takes})",
        *(f"{x}{k} = {x}[..., {k}]" for x, k in function.used),
        f"{results} = {empty}",
        *(line.text for line in statements(function, PYTHON)),
        f"return {', '.join(f'{result}.reshape({shape})' for result in function.results)}",
    ]
    return defined(f"def {function.name}({takes}):", lines)


def casadi(program: Program) -> str:
    head = docstring([*program.head, "", NOTE])
    return f"{head}\n\nimport casadi\n" + "".join(map(casadi_function, program.functions))


def casadi_function(function: Function) -> str:
    takes, results, size = ", ".join(function.takes), ", ".join(function.results), function.size
    columns = function.shape[-1] if len(function.shape) > 1 else 1
    by_rows = f"casadi.reshape(casadi.vertcat(*{{x}}), {columns}, {size // columns}).T"
    names = f"{list(function.takes)!r}, {list(function.results)!r}"
    lines = [
        f'"""{function.title}"""',
        *(f'{x} = casadi.SX.sym("{x}", {function.sizes[x]})' for x in function.takes),
        *(f"{x} = [0.0] * {size}" for x in function.results),
        *(line.text for line in statements(function, CASADI)),
        *(f"{x} = {by_rows.format(x=x)}" for x in function.results),
        f'return casadi.Function("{function.name}", [{takes}], [{results}], {names})',
    ]
    return f"{defined(f'def {function.name}():', lines)}\n\n{function.name} = {function.name}()\n"


def matlab(program: Program) -> str:
    lines = [f"function varargout = {program.name}(quantity, varargin)"]
    lines += [f"% {line}".rstrip() for line in [*program.head, "", *COLUMNS.splitlines()]]
    cases = []
    for function in program.functions:
        call = f"{program.name}('{function.name}', {', '.join(function.takes)})"
        lines += [f"% [{', '.join(function.results)}] = {call}", f"%   {function.title}"]
        results = f"[varargout{{1:{len(function.results)}}}]"
        cases += [f"    case '{function.name}'", f"      {results} = {function.name}(varargin{{:}});"]
    lines += ["  switch quantity", *cases]
    lines += ["    otherwise", "      error('unknown quantity %s', quantity);", "  end", "end"]
    return "\n".join(lines) + "\n" + "".join(map(matlab_function, program.functions))


def matlab_function(function: Function) -> str:
    takes, results, sizes, dimensions = function.takes, function.results, function.sizes, len(function.shape)
    lines = [f"assert(size({x}, 1) == {sizes[x]}, '{x} has {sizes[x]} rows');" for x in takes]
    lines.append(f"N = max([{', '.join(f'size({x}, 2)' for x in takes)}]);")
    lines += [f"{result} = zeros({function.size}, N);" for result in results]
    lines += [line.text for line in statements(function, MATLAB)]
    if dimensions > 1:  # stored by rows
        shape = ", ".join(map(str, reversed(function.shape)))
        order = ", ".join(map(str, [*range(dimensions, 0, -1), dimensions + 1]))
        lines += [f"{result} = permute(reshape({result}, {shape}, []), [{order}]);" for result in results]
    head = f"\nfunction [{', '.join(results)}] = {function.name}({', '.join(takes)})"
    return "\n".join([head, *(f"  {line}" for line in lines), "end\n"])
