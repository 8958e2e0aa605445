"""Functions of JAX, which take any batch of states; they can be jitted, mapped and differentiated."""

from .python import docstring
from .statements import Function, Program, Syntax, statements

SYNTAX = Syntax(
    input="{x}[..., {k}]",
    assignment="{name} = {value}",
    result="{x}[{k}] = {value}",
    function="jnp.{}",
    arctan="arctan",
)
NOTE = "Numbers are float32 unless JAX is set to 64 bits: jax.config.update('jax_enable_x64', True)."
HEAD = """

import jax.numpy as jnp


def arrays(sizes, *states):
    states = [jnp.asarray(x) for x in states]
    for x, size in zip(states, sizes):
        if x.shape[-1:] != (size,):
            raise ValueError(f"shape {x.shape}; expected (..., {size})")
    return *states, jnp.broadcast_shapes(*(x.shape[:-1] for x in states))


def stacked(entries, batch, *shape):
    entries = [jnp.broadcast_to(x, batch) for x in entries]
    return jnp.stack(entries, axis=-1).reshape(*batch, *shape)
"""


def source(program: Program) -> str:
    texts = "".join(f"\n\n{text(function)}\n" for function in program.functions)
    return docstring([*program.head, "", NOTE]) + HEAD + texts


def text(function: Function) -> str:
    takes, sizes = ", ".join(function.takes), [function.sizes[x] for x in function.takes]
    shape = ", ".join(["batch", *map(str, function.shape)])
    lines = [
        f'"""{function.title}"""',
        f"{takes}, batch = arrays({sizes}, {takes})",
        *(f"{x} = [0.0] * {function.size}" for x in function.results),
        *(line.text for line in statements(function, SYNTAX)),
        f"return {', '.join(f'stacked({x}, {shape})' for x in function.results)}",
    ]
    return "\n".join([f"def {function.name}({takes}):", *(f"    {line}" for line in lines)])
