"""A user's equations as functions, from an object, a module, a mapping, a Tree or SymPy matrices; and their values as arrays."""

import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np

import tmt
from tmt.model.values import real_numbers, shown

from ...robots.case import Coordinates

# the number of arguments of each, of q, qd, tau
ARGUMENTS = {
    "mass_matrix": 1,
    "bias": 2,
    "gravity": 1,
    "acceleration": 3,
    "energy": 2,
    "com_positions": 1,
    "jacobians": 1,
}
STATE = ("q", "qd", "tau")
QUICK = 1e-3  # s per state: functions that are as fast as this are called some hundred times more
SAME = 1e-12  # of the largest value: values of a batch and of single states are equal except for rounding
MOST_SHOWN = 8  # numbers of a state in a message
OF_A_TREE = {"gravity": "gravity_balance"}  # where tmt has another name


class OwnError(ValueError):
    """A user's equations that cannot be used at all; the message is one line."""

    def __str__(self):
        return " ".join(super().__str__().split())


def functions_of(source: object, coordinates: Coordinates, required: Sequence[str]) -> dict[str, Callable]:
    """The functions of ARGUMENTS that a source has, by name; OwnError if a required one is missing."""
    if isinstance(source, tmt.Tree):
        return of_tree(source, coordinates)
    functions, symbols = {}, attribute(source, "symbols")
    for name in ARGUMENTS:
        value = attribute(source, name)
        if value is not None:
            functions[name] = function_of(name, value, symbols, coordinates)
    if missing := [name for name in required if name not in functions]:
        raise OwnError(
            f"{source_name(source)} has no {missing[0]}; expected {' and '.join(map(call, required))}"
        )
    if not functions:
        raise OwnError(f"{source_name(source)} has none of {', '.join(map(call, ARGUMENTS))}")
    return functions


def call(name: str) -> str:
    """The signature of a function."""
    return f"{name}({', '.join(STATE[: ARGUMENTS[name]])})"


def attribute(source: object, name: str) -> object:
    return source.get(name) if isinstance(source, Mapping) else getattr(source, name, None)


def source_name(source: object) -> str:
    """A source in a message."""
    if isinstance(source, type):
        return f"the class {source.__name__}"
    file = Path(getattr(source, "__file__", None) or "__init__.py").name
    if isinstance(source, ModuleType) and file != "__init__.py":  # a user's file has no other name
        return file
    name = getattr(source, "__name__", None)
    return name if isinstance(name, str) else f"the {type(source).__name__}"


def names_of(source: object) -> Sequence[str] | None:
    """The joints that the source states, in its own order; None if it states none."""
    names = source.joint_names if isinstance(source, tmt.Tree) else attribute(source, "joint_names")
    try:
        return names if names is None or isinstance(names, str) else list(names)
    except TypeError:
        raise OwnError(f"joint_names is {shown(names)}; expected a list of names") from None


def of_tree(tree: tmt.Tree, coordinates: Coordinates) -> dict[str, Callable]:
    own = tree.coordinates
    if (own.nq, own.nv) != (coordinates.nq, coordinates.nv):
        raise OwnError(
            f"the Tree has {own.nq} positions and {own.nv} speeds ({', '.join(tree.joint_names)}); "
            f"expected {coordinates.nq} and {coordinates.nv} ({', '.join(coordinates.names)})"
        )
    return {name: partial(getattr(tmt, OF_A_TREE.get(name, name)), model=tree) for name in ARGUMENTS}


def is_function(value: object) -> bool:
    """Whether a value is a function, or an expression in symbols; else it is numbers."""
    return callable(value) or bool(getattr(value, "free_symbols", None)) or is_pair(value)


def is_pair(value: object) -> bool:
    """Whether a value is a SymPy matrix with the list of its symbols, not two expressions."""
    if not isinstance(value, tuple | list) or len(value) != 2 or not hasattr(value[0], "free_symbols"):
        return False
    return isinstance(value[1], tuple | list) or hasattr(value[1], "shape")


def function_of(name: str, value: object, symbols: object, coordinates: Coordinates) -> Callable:
    if callable(value) and not hasattr(value, "free_symbols"):
        return value
    if is_pair(value):
        value, symbols = value
    if symbols is None:
        wanted = f"a function {call(name)}, or a SymPy matrix with the list of its symbols"
        raise OwnError(f"{name} is {shown(value)}; expected {wanted}")
    return of_symbols(name, value, symbols, coordinates)


def of_symbols(name: str, matrix: object, symbols: object, coordinates: Coordinates) -> Callable:
    """The function of a SymPy matrix or expression. symbols: of q, or of q and qd, or of q, qd and tau, in order."""
    import sympy

    try:
        nested = [value.tolist() if hasattr(value, "tolist") else value for value in (symbols, matrix)]
        symbols, entries = (
            sympy.flatten([nested[0]]),
            [sympy.sympify(entry) for entry in sympy.flatten([nested[1]])],
        )
    except Exception as error:  # whatever SymPy makes of what is given
        raise OwnError(f"{name} is {shown(matrix)}; expected a SymPy matrix ({shown(str(error))})") from None
    nq, nv = coordinates.nq, coordinates.nv
    counts = [nq, nq + nv, nq + 2 * nv]
    if len(symbols) not in counts or len(set(symbols)) < len(symbols):
        raise OwnError(
            f"{name} has the symbols {', '.join(map(str, symbols))}; expected {nq} of q, or {counts[1]} of q and qd in order, "
            "each once"
        )
    # symbols may be functions of time, and qd their derivatives
    plain = [sympy.Dummy() for _ in symbols]
    entries = [entry.xreplace(dict(zip(symbols, plain))) for entry in entries]
    taken = counts[ARGUMENTS[name] - 1]
    if left := sorted({str(s) for entry in entries for s in entry.free_symbols - set(plain)}):
        why = f"has the symbol {left[0]}, which is not in the list of symbols"
        raise OwnError(f"{name} {why}; list it, or insert a number")
    used = {symbols[plain.index(s)] for entry in entries for s in entry.free_symbols & set(plain)}
    if more := [str(s) for s in symbols[taken:] if s in used]:
        raise OwnError(f"{name} depends on {more[0]}; expected {call(name)}")
    shape = {"mass_matrix": (nv, nv), "energy": (), "com_positions": (-1, 3)}.get(name, (nv,))
    if name == "jacobians" or (-1 not in shape and len(entries) != int(np.prod(shape))):
        raise OwnError(f"{name} is a SymPy object of {len(entries)} entries; expected shape {shape}")
    try:
        evaluated = sympy.lambdify(plain, entries, "numpy", cse=True)
    except Exception as error:  # of expressions that have no numbers, such as zoo
        raise OwnError(
            f"{name} cannot be evaluated as a function of {', '.join(map(str, plain))}: {error!r}"
        ) from None

    def function(*states: np.ndarray) -> np.ndarray:
        columns = [column for state in states for column in np.moveaxis(state, -1, 0)][: len(plain)]
        columns += [np.zeros_like(columns[0])] * (len(plain) - len(columns))  # nothing depends on these
        values = np.broadcast_arrays(*evaluated(*columns), columns[0])[:-1]
        return np.stack(values, axis=-1).reshape((*states[0].shape[:-1], *shape))

    function.__name__ = name
    return function


# values


class Problem(NamedTuple):
    """An error in equations that can still be used."""

    quantity: str
    state: str  # the first at which it occurs, in the function's own joints
    text: str  # one line


SHAPES: dict[str, Callable] = {  # of one state; None: the number of bodies, that of the first value
    "mass_matrix": lambda nv: (nv, nv),
    "bias": lambda nv: (nv,),
    "gravity": lambda nv: (nv,),
    "acceleration": lambda nv: (nv,),
    "energy": lambda nv: (),
    "com_positions": lambda nv: (None, 3),
    "jacobians": lambda nv: (2, None, 3, nv),
}


def converted(name: str, value: object, expected: tuple, count: int | None) -> np.ndarray:
    """The value of a function as an array of float; OwnError if its type or shape is wrong."""
    expected = expected if count is None else (count, *expected)
    shape = f"({', '.join('bodies' if n is None else str(n) for n in expected)}{',' * (len(expected) == 1)})"
    array = numbers_of(value)
    if array is None:
        raise OwnError(f"{name} is {shown(value)}; expected real numbers of shape {shape}")
    if None in expected and array.ndim == len(expected):
        expected = tuple(m if n is None else n for n, m in zip(expected, array.shape))
    fitted = in_shape(array, expected) if None not in expected else None
    if fitted is None:
        raise OwnError(f"{name} has shape {array.shape}; expected {shape}")
    return fitted


def numbers_of(value: object) -> np.ndarray | None:
    """Values as an array of float, also those of SymPy and other objects; None if they are anything else."""
    try:
        array = real_numbers(value)
        if array is None and value is not None and np.asarray(value).dtype.kind == "O":
            return np.asarray(value).astype(float)
        return array
    except (Exception, SystemExit):  # whatever the conversion of a user's own object raises
        return None


def in_shape(array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray | None:
    """An array in a shape that differs in axes of length 1 alone, as (n, 1) of a column; else None."""
    given, expected = ([n for n in axes if n != 1] for axes in (array.shape, shape))
    return array.reshape(shape) if given == expected else None


def same(together: np.ndarray, singles: np.ndarray) -> bool:
    """Whether a batch has the values of single states."""
    size = np.abs(singles[np.isfinite(singles)]).max(initial=0.0)
    within = {"rtol": 0.0, "atol": SAME * size, "equal_nan": True}
    return together.shape == singles.shape and np.allclose(together, singles, **within)


def state_in_words(state: list[np.ndarray]) -> str:
    """q, qd and tau, those that are given, as they can be typed."""
    return ", ".join(f"{symbol} = {typed(part)}" for symbol, part in zip(STATE, state))


def and_more(count: int) -> str:
    return f", and at {count} more state{'s' * (count > 1)}" if count else ""


def typed(values: np.ndarray) -> str:
    more = ", ..." if len(values) > MOST_SHOWN else ""
    return f"[{', '.join(f'{value:.6g}' for value in values[:MOST_SHOWN])}{more}]"


def as_raised(error: BaseException) -> str:
    """An error that a user's function raised, with the line of the user's file."""
    text = f"{type(error).__name__}: {error}".rstrip(": ")
    frames = traceback.extract_tb(error.__traceback__)[1:]
    own = [frame for frame in frames if frame.filename == frames[0].filename]
    return f"{text} ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else text
