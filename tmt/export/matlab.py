"""Functions in one file for MATLAB and Octave, which takes any number of states as columns."""

from collections.abc import Sequence
from math import prod

from .statements import Syntax, Writer

SYNTAX = Syntax(times=".*", over="./")


def source(name: str, head: Sequence[str], functions: Sequence) -> str:
    """The file: a function that is called with the name of a quantity."""
    lines = [f"function varargout = {name}(quantity, varargin)"]
    lines += [f"% {line}".rstrip() for line in head]
    lines += [
        "%",
        "% States are columns: q (nq, N), qd and tau (nv, N). The last dimension of each result is that of the states.",
    ]
    for function in functions:
        call = f"{name}('{function.name}', {', '.join(function.takes)})"
        lines += [f"% [{', '.join(function.results)}] = {call}", f"%   {function.title}"]
    lines.append("  switch quantity")
    for function in functions:
        lines += [
            f"    case '{function.name}'",
            f"      [varargout{{1:{len(function.results)}}}] = {function.name}(varargin{{:}});",
        ]
    lines += ["    otherwise", "      error('unknown quantity %s', quantity);", "  end", "end"]
    return "\n".join(lines) + "\n" + "".join(f"\n{text(function)}\n" for function in functions)


def text(function) -> str:
    """One function."""
    takes, results, size = function.takes, function.results, prod(function.shape)
    sizes, dimensions = dict(zip(("q", "qd", "tau"), function.sizes)), len(function.shape)
    writer = Writer(function.traced, [f"{x}({k + 1}, :)" for x, k in function.inputs], SYNTAX)
    lines = [f"assert(size({x}, 1) == {sizes[x]}, '{x} has {sizes[x]} rows');" for x in takes]
    lines += [f"{name} = {f'{of}({value})' if of else value};" for name, value, of in writer.assignments]
    lines += [f"{result} = zeros({size}, size({takes[-1]}, 2));" for result in results]
    lines += [f"{results[k // size]}({k % size + 1}, :) = {value};" for k, value in enumerate(writer.results)]
    if dimensions > 1:  # stored by rows
        shape = ", ".join(map(str, reversed(function.shape)))
        order = ", ".join(map(str, [*range(dimensions, 0, -1), dimensions + 1]))
        lines += [f"{result} = permute(reshape({result}, {shape}, []), [{order}]);" for result in results]
    head = f"function [{', '.join(results)}] = {function.name}({', '.join(takes)})"
    return "\n".join([head, *(f"  {line}" for line in lines), "end"])
