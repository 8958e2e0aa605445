"""Functions of CasADi: each is a casadi.Function, which takes SX, MX or numbers and can be differentiated."""

from .python import docstring
from .statements import Function, Program, Syntax, statements

SYNTAX = Syntax(
    input="{x}[{k}]",
    assignment="{name} = {value}",
    result="{x}[{k}] = {value}",
    function="casadi.{}",
)
NOTE = "Each is a casadi.Function of columns; of a result of three dimensions the matrices are one below the other."


def source(program: Program) -> str:
    head = docstring([*program.head, "", NOTE])
    return f"{head}\n\nimport casadi\n" + "".join(f"\n\n{text(f)}\n" for f in program.functions)


def text(function: Function) -> str:
    takes, results, size = ", ".join(function.takes), ", ".join(function.results), function.size
    columns = function.shape[-1] if len(function.shape) > 1 else 1
    by_rows = f"casadi.reshape(casadi.vertcat(*{{x}}), {columns}, {size // columns}).T"
    names = f"{list(function.takes)!r}, {list(function.results)!r}"
    lines = [
        f'"""{function.title}"""',
        *(f'{x} = casadi.SX.sym("{x}", {function.sizes[x]})' for x in function.takes),
        *(f"{x} = [0.0] * {size}" for x in function.results),
        *(line.text for line in statements(function, SYNTAX)),
        *(f"{x} = {by_rows.format(x=x)}" for x in function.results),
        f'return casadi.Function("{function.name}", [{takes}], [{results}], {names})',
    ]
    body = "\n".join([f"def {function.name}():", *(f"    {line}" for line in lines)])
    return f"{body}\n\n\n{function.name} = {function.name}()"
