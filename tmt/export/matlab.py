"""Functions in one file for MATLAB and Octave, which takes any number of states as columns."""

from collections.abc import Sequence
from math import prod

from .statements import Assignment, Syntax, Writer

SYNTAX = Syntax(times=".*", over="./")
SOLVE = """
function x = solve(n, a)
  % The solution of n equations for each column: n rows of n numbers, then the right-hand side.
  x = zeros(n, size(a, 2));
  for k = 1:size(a, 2)
    x(:, k) = reshape(a(1:n * n, k), n, n).' \\ a(n * n + 1:end, k);
  end
end
"""


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
    texts = [text(function) for function in functions]
    solve = SOLVE if any(" = solve(" in text for text in texts) else ""
    return "\n".join(lines) + "\n" + solve + "".join(f"\n{text}\n" for text in texts)


def text(function) -> str:
    """One function."""
    takes, results, size = function.takes, function.results, prod(function.shape)
    sizes, dimensions = dict(zip(("q", "qd", "tau"), function.sizes)), len(function.shape)
    writer = Writer(function.traced, [f"{x}({k + 1}, :)" for x, k in function.inputs], SYNTAX)
    lines = [f"assert(size({x}, 1) == {sizes[x]}, '{x} has {sizes[x]} rows');" for x in takes]
    lines += [line for assignment in writer.assignments for line in statements(assignment)]
    lines += [f"{result} = zeros({size}, size({takes[-1]}, 2));" for result in results]
    lines += [f"{results[k // size]}({k % size + 1}, :) = {value};" for k, value in enumerate(writer.results)]
    if dimensions > 1:  # stored by rows
        shape = ", ".join(map(str, reversed(function.shape)))
        order = ", ".join(map(str, [*range(dimensions, 0, -1), dimensions + 1]))
        lines += [f"{result} = permute(reshape({result}, {shape}, []), [{order}]);" for result in results]
    head = f"function [{', '.join(results)}] = {function.name}({', '.join(takes)})"
    return "\n".join([head, *(f"  {line}" for line in lines), "end"])


def statements(assignment: Assignment) -> list[str]:
    names, values = assignment.names, assignment.expressions
    if assignment.kind == "sincos":
        return [f"{names[0]} = sin({values[0]}); {names[1]} = cos({values[0]});"]
    if assignment.kind == "solve":
        array, rows = f"a{names[0]}", "; ".join(f"{value} + zeros(1, size(q, 2))" for value in values)
        found = " ".join(f"{name} = {array}({k + 1}, :);" for k, name in enumerate(names))
        return [f"{array} = solve({len(names)}, [{rows}]);", found]
    return [f"{names[0]} = {values[0]};"]
