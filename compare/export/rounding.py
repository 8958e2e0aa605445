"""How far rounding may take the results of a row of operations: a bound of first order, carried along.

Each operation adds the rounding of its own result to what its operands bring (Higham, Accuracy and Stability
of Numerical Algorithms, 2002, section 3.3). In units of eps, twice the unit of rounding, so that fused
operations and functions that are off by one unit are within it.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from tmt.compiled.straight import Traced

Array = NDArray[np.float64]


# the result of an operation, and its derivatives by its operands
OPERATIONS: dict[str, tuple[Callable[..., Array], Callable[..., Sequence[Array | float]]]] = {
    "+": (np.add, lambda x, y: (1.0, 1.0)),
    "-": (np.subtract, lambda x, y: (1.0, 1.0)),
    "*": (np.multiply, lambda x, y: (y, x)),
    "/": (np.divide, lambda x, y: (1.0 / y, x / (y * y))),
    "neg": (np.negative, lambda x: (1.0,)),
    "sqrt": (np.sqrt, lambda x: (0.5 / np.sqrt(x),)),
    "arctan": (np.arctan, lambda x: (1.0 / (1.0 + x * x),)),
}


def running_error(traced: Traced, inputs: Array, errors: Array) -> Array:
    """The bounds, (results, states), for inputs and their errors (numbers, states)."""
    zero = np.zeros(inputs.shape[1])
    value: dict[int, Array] = {x.i: numbers for x, numbers in zip(traced.inputs, inputs)}
    error: dict[int, Array] = {x.i: numbers for x, numbers in zip(traced.inputs, errors)}
    outputs = [traced.tape.lift(x).i for x in traced.outputs]
    for i in traced.nodes:
        kind, arguments = traced.tape.nodes[i]
        if kind == "number":
            value[i] = zero + float(arguments[0])
            error[i] = np.abs(value[i])
        elif kind == "item":
            (angle,) = traced.tape.operands(arguments[0])
            both = np.sin(value[angle]), np.cos(value[angle])
            value[i] = both[arguments[1]]
            error[i] = np.abs(both[1 - arguments[1]]) * error[angle] + np.abs(value[i])
        elif kind not in ("input", "sincos"):
            result, slopes = OPERATIONS[kind]
            operands = [value[a] for a in arguments]
            value[i] = result(*operands)
            brought = [np.abs(slope) * error[a] for slope, a in zip(slopes(*operands), arguments)]
            error[i] = sum(brought, np.abs(value[i]))
    return np.array([error[i] for i in outputs])
