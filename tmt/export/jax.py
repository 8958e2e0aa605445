"""Functions of JAX, which take any batch of states; they can be jitted, mapped and differentiated.

A function is a table of operations, level by level: those of a kind whose operands are known are one on rows
of an array. Single statements, which XLA copies into each other, took minutes for a robot of seven joints.
"""

from collections import defaultdict
from textwrap import fill

from tmt.compiled.straight import Traced

from .scripts import defined, docstring
from .statements import Function, Program

NAMES = {
    "+": "add", "-": "subtract", "*": "multiply", "/": "divide", "neg": "negative", "sqrt": "sqrt",
    "sign": "sign",
}  # fmt: skip
NOTE = "Numbers are float32 unless JAX is set to 64 bits: jax.config.update('jax_enable_x64', True)."
HEAD = '''

import jax
import jax.numpy as jnp
import numpy as np


def evaluated(table, numbers, places, shape, sizes, *states):
    """The results at these places of the values: inputs, numbers, then operations on earlier values."""
    states = [jnp.asarray(x) for x in states]
    for x, size in zip(states, sizes):
        if x.shape[-1:] != (size,):
            raise ValueError(f"shape {x.shape}; expected (..., {size})")
    batch = jnp.broadcast_shapes(*(x.shape[:-1] for x in states))
    rows = [jnp.moveaxis(jnp.broadcast_to(x, (*batch, x.shape[-1])), -1, 0) for x in states]
    kind = jnp.result_type(float, *states)
    numbers = jnp.asarray(numbers, kind).reshape(-1, *[1] * len(batch))
    rows.append(jnp.broadcast_to(numbers, (len(numbers), *batch)))
    first = sum(map(len, rows))
    count = sum(len(operands[0]) for _, *operands in table)
    values = jnp.concatenate([*rows, jnp.zeros((count, *batch), kind)])
    for name, *operands in table:
        rows = [values[np.array(part)] for part in operands]
        new = jnp.where(rows[0] < 0.0, -1.0, 1.0) if name == "sign" else getattr(jnp, name)(*rows)
        values = jax.lax.dynamic_update_slice_in_dim(values, new, first, 0)
        first += len(new)
    results = [jnp.moveaxis(values[np.array(part)], 0, -1).reshape([*batch, *shape]) for part in places]
    return results[0] if len(results) == 1 else tuple(results)
'''


def source(program: Program) -> str:
    texts = "".join(f"\n\n{text(function)}" for function in program.functions)
    return docstring([*program.head, "", NOTE]) + HEAD + texts


def text(function: Function) -> str:
    inputs = {x.i: place for x, place in zip(function.traced.inputs, function.inputs)}
    order = [(name, k) for name in function.takes for k in range(function.sizes[name])]
    row = {i: order.index(place) for i, place in inputs.items() if place[0] in function.takes}
    outputs = [function.traced.tape.lift(x).i for x in function.traced.outputs]
    nodes = function.traced.tape.nodes
    constants = [i for i in function.traced.nodes if nodes[i][0] == "number"]
    row |= {i: len(order) + k for k, i in enumerate(constants)}
    table = []
    for name, steps in by_level(function.traced):
        row |= {i: len(row) + k for k, i in enumerate(steps)}
        operands = [function.traced.tape.operands(i) for i in steps]
        if name in ("sin", "cos"):
            operands = [function.traced.tape.operands(pair) for (pair,) in operands]
        table.append((name, *([row[i] for i in part] for part in zip(*operands))))
    size = function.size
    places = [[row[i] for i in outputs[k : k + size]] for k in range(0, len(outputs), size)]
    numbers, takes = [float(nodes[i][1][0]) for i in constants], ", ".join(function.takes)
    sizes, upper = [function.sizes[name] for name in function.takes], function.name.upper()
    data = [f"{upper} = (", *(f"{entry!r}," for entry in table), ")"]
    data += [f"{upper}_NUMBERS = {numbers!r}", f"{upper}_PLACES = {places!r}"]
    lines = [
        f'"""{function.title}"""',
        f"table = {upper}, {upper}_NUMBERS, {upper}_PLACES, {function.shape}, {sizes}",
        f"return evaluated(*table, {takes})",
    ]
    return "\n".join(map(filled, data)) + defined(f"def {function.name}({takes}):", lines)


def filled(line: str) -> str:
    return fill(line, 120, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)


def by_level(traced: Traced) -> list[tuple[str, list[int]]]:
    tape, level = traced.tape, defaultdict[int, int](int)
    groups = defaultdict[tuple[int, str], list[int]](list)
    for i in traced.nodes:
        kind, arguments = tape.nodes[i]
        if kind not in ("number", "input", "sincos"):
            name = ("sin", "cos")[arguments[1]] if kind == "item" else NAMES[kind]
            operands = tape.operands(arguments[0]) if kind == "item" else tape.operands(i)
            level[i] = 1 + max(level[operand] for operand in operands)
            groups[level[i], name].append(i)
    return [(name, groups[step, name]) for step, name in sorted(groups)]
