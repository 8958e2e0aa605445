"""Functions in one file for MATLAB and Octave, which takes any number of states as columns."""

from .statements import Function, Program, Syntax, statements

SYNTAX = Syntax(
    input="{x}({n}, :)",
    assignment="{name} = {value};",
    result="{x}({n}, :) = {value};",
    times=".*",
    over="./",
)
STATES = (
    "States are columns: q (nq, N), qd and tau (nv, N). "
    "The last dimension of each result is that of the states."
)


def source(program: Program) -> str:
    lines = [f"function varargout = {program.name}(quantity, varargin)"]
    lines += [f"% {line}".rstrip() for line in [*program.head, "", STATES]]
    cases = []
    for function in program.functions:
        call = f"{program.name}('{function.name}', {', '.join(function.takes)})"
        lines += [f"% [{', '.join(function.results)}] = {call}", f"%   {function.title}"]
        results = f"[varargout{{1:{len(function.results)}}}]"
        cases += [f"    case '{function.name}'", f"      {results} = {function.name}(varargin{{:}});"]
    lines += ["  switch quantity", *cases]
    lines += ["    otherwise", "      error('unknown quantity %s', quantity);", "  end", "end"]
    return "\n".join(lines) + "\n" + "".join(f"\n{text(function)}\n" for function in program.functions)


def text(function: Function) -> str:
    takes, results, sizes, dimensions = function.takes, function.results, function.sizes, len(function.shape)
    lines = [f"assert(size({x}, 1) == {sizes[x]}, '{x} has {sizes[x]} rows');" for x in takes]
    lines += [f"{result} = zeros({function.size}, size({takes[-1]}, 2));" for result in results]
    lines += [line.text for line in statements(function, SYNTAX)]
    if dimensions > 1:  # stored by rows
        shape = ", ".join(map(str, reversed(function.shape)))
        order = ", ".join(map(str, [*range(dimensions, 0, -1), dimensions + 1]))
        lines += [f"{result} = permute(reshape({result}, {shape}, []), [{order}]);" for result in results]
    head = f"function [{', '.join(results)}] = {function.name}({', '.join(takes)})"
    return "\n".join([head, *(f"  {line}" for line in lines), "end"])
