"""A user's equations as functions, in whatever form they are given, and their values as arrays."""

import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import prod
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import tmt
from tmt.model.values import real_numbers, shown

from ...robots.coordinates import Coordinates

STATE = ("q", "qd", "tau")
Function = Callable[..., Any]  # a user's own
Shape = tuple[int | str, ...]  # the lengths of axes; a word for any length


class Quantity(NamedTuple):
    """What a user's function of this name takes and returns."""

    arguments: int  # how many of q, qd, tau
    shape: Shape  # of one state

    def shape_for(self, nv: int) -> Shape:
        return tuple(nv if axis == "nv" else axis for axis in self.shape)

    @property
    def state(self) -> Sequence[str]:
        return STATE[: self.arguments]


QUANTITIES = {
    "mass_matrix": Quantity(1, ("nv", "nv")),
    "bias": Quantity(2, ("nv",)),
    "coriolis_matrix": Quantity(2, ("nv", "nv")),
    "gravity": Quantity(1, ("nv",)),
    "acceleration": Quantity(3, ("nv",)),
    "energy": Quantity(2, ()),
    "com_positions": Quantity(1, ("bodies", 3)),
    "jacobians": Quantity(1, (2, "bodies", 3, "nv")),
}
METHOD_NAMES = {name: name for name in QUANTITIES} | {"gravity": "gravity_balance"}  # of engines and tmt
INVERSE = "inverse_dynamics"  # the name of a function that brings Mbar and h
PUSH = 2.0**20  # rad/s2: gravity, which is subtracted, rounds little of what it needs
QUICK = 1e-3  # s per state: functions that are as fast as this are called some hundred times more
MODULE = "compare_own_"  # how the name of the module of a user's file begins
MOST_SHOWN = 8  # numbers of a state in a message


class OwnError(ValueError):
    """A user's equations that cannot be loaded or used; the message is one line."""

    def __str__(self) -> str:
        return " ".join(super().__str__().split())


def functions_of(source: object, coordinates: Coordinates, required: Sequence[str]) -> dict[str, Function]:
    """The functions of QUANTITIES that a source has, by name; OwnError if a required one is missing."""
    if isinstance(source, tmt.Tree):
        return of_tree(source, coordinates)
    symbols, forces = attribute(source, "symbols"), attribute(source, INVERSE)
    functions = {}
    for name in QUANTITIES:
        if (value := attribute(source, name)) is not None:
            functions[name] = function_of(name, value, symbols, coordinates)
    if callable(forces) and not functions:
        functions = of_inverse_dynamics(forces, coordinates)
    name = str(getattr(source, "__name__", type(source).__name__)).removeprefix(MODULE)
    missing = [name for name in required if name not in functions]
    if missing and "acceleration" not in functions:
        others = f"or {call('acceleration')}, or {INVERSE}(q, qd, qdd)"
        raise OwnError(f"{name} has no {missing[0]}; expected {' and '.join(map(call, required))}, {others}")
    if not functions:
        raise OwnError(f"{name} has none of {', '.join(map(call, QUANTITIES))}")
    return functions


def of_inverse_dynamics(forces: Function, coordinates: Coordinates) -> dict[str, Function]:
    """Mbar and h of a function tau = Mbar qdd + h of q, qd, qdd."""
    still = np.zeros(coordinates.nv)

    def mass_matrix(q: np.ndarray) -> np.ndarray:
        pushes = [still, *(PUSH * np.eye(coordinates.nv))]
        at_rest, *pushed = (np.asarray(forces(q, still, push), float).ravel() for push in pushes)
        return np.stack([values - at_rest for values in pushed], axis=1) / PUSH

    return {"mass_matrix": mass_matrix, "bias": lambda q, qd: forces(q, qd, still)}


def call(name: str) -> str:
    """The signature of a function."""
    return f"{name}({', '.join(QUANTITIES[name].state)})"


def attribute(source: object, name: str) -> Any:
    return source.get(name) if isinstance(source, Mapping) else getattr(source, name, None)


def names_of(source: object) -> Sequence[str] | None:
    """The joints that the source states, in its own order; None if it states none."""
    names = attribute(source, "joint_names")
    try:
        return names if names is None or isinstance(names, str) else list(names)
    except TypeError:
        raise OwnError(f"joint_names is {shown(names)}; expected a list of names") from None


def of_tree(tree: tmt.Tree, coordinates: Coordinates) -> dict[str, Function]:
    if (tree.nq, tree.nv) != (coordinates.nq, coordinates.nv):
        has = f"{tree.nq} positions and {tree.nv} speeds ({', '.join(tree.joint_names)})"
        wanted = f"{coordinates.nq} and {coordinates.nv} ({', '.join(coordinates.names)})"
        raise OwnError(f"the Tree has {has}; expected {wanted}")
    return {name: partial(getattr(tmt, method), tree) for name, method in METHOD_NAMES.items()}


def is_function(value: object) -> bool:
    """Whether a value is a function, or an expression in symbols; else it is numbers."""
    return callable(value) or bool(getattr(value, "free_symbols", None)) or is_pair(value)


def is_pair(value: object) -> bool:
    """Whether a value is a SymPy matrix with the list of its symbols, not two expressions."""
    if not isinstance(value, tuple | list) or len(value) != 2 or not hasattr(value[0], "free_symbols"):
        return False
    return isinstance(value[1], tuple | list) or hasattr(value[1], "shape")


def function_of(name: str, value: Any, symbols: object, coordinates: Coordinates) -> Function:
    """A user's function, or that of a SymPy matrix; symbols: of all matrices that do not bring their own."""
    if callable(value) and not hasattr(value, "free_symbols"):
        return value
    matrix, symbols = value if is_pair(value) else (value, symbols)
    if symbols is None:
        wanted = f"a function {call(name)}, or a SymPy matrix with the list of its symbols"
        raise OwnError(f"{name} is {shown(value)}; expected {wanted}")
    return of_symbols(name, matrix, symbols, coordinates)


def of_symbols(name: str, matrix: object, given_symbols: object, coordinates: Coordinates) -> Function:
    """The function of a SymPy matrix or expression of these symbols, in order; they may be functions of time."""
    import sympy

    def flat(value: Any) -> list[Any]:
        return sympy.flatten([value.tolist() if hasattr(value, "tolist") else value])

    try:
        symbols, entries = flat(given_symbols), [sympy.sympify(entry) for entry in flat(matrix)]
    except Exception as error:  # whatever SymPy makes of what is given
        raise OwnError(f"{name} is {shown(matrix)}; expected a SymPy matrix ({shown(str(error))})") from None
    nq, nv = coordinates.nq, coordinates.nv
    counts = [nq, nq + nv, nq + 2 * nv]  # of the symbols of q, of q and qd, of q, qd and tau
    if len(symbols) not in counts or len(set(symbols)) < len(symbols):
        wanted = f"{nq} of q, or {counts[1]} of q and qd in order, each once"
        raise OwnError(f"{name} has the symbols {', '.join(map(str, symbols))}; expected {wanted}")
    plain = [sympy.Dummy() for _ in symbols]
    entries = [entry.xreplace(dict(zip(symbols, plain))) for entry in entries]
    used = {symbol for entry in entries for symbol in entry.free_symbols}
    if unknown := sorted(map(str, used - set(plain))):
        why = f"has the symbol {unknown[0]}, which is not in the list of symbols"
        raise OwnError(f"{name} {why}; list it, or insert a number")
    taken = counts[QUANTITIES[name].arguments - 1]
    if more := [symbol for symbol, dummy in zip(symbols[taken:], plain[taken:]) if dummy in used]:
        raise OwnError(f"{name} depends on {more[0]}; expected {call(name)}")
    axes = QUANTITIES[name].shape_for(nv)
    shape = tuple(axis if isinstance(axis, int) else -1 for axis in axes)
    if name == "jacobians" or (-1 not in shape and len(entries) != prod(shape)):
        raise OwnError(f"{name} is a SymPy object of {len(entries)} entries; expected shape {in_words(axes)}")
    try:
        evaluated = sympy.lambdify(plain[:taken], entries, "numpy", cse=True)
    except Exception as error:  # of expressions that have no numbers, such as zoo
        raise OwnError(f"{name} cannot be evaluated as a function of {plain}: {error!r}") from None

    def function(*states: np.ndarray) -> np.ndarray:
        return np.array(evaluated(*np.concatenate(states)[: len(plain)]), dtype=float).reshape(shape)

    return function


# values


class Problem(NamedTuple):
    """An error in equations that can still be used."""

    quantity: str
    what: str
    state: str  # the first at which it occurs, in the function's own joints
    states: set[int]  # hashes of all

    @property
    def text(self) -> str:
        """In one line."""
        more = len(self.states) - 1
        others = f", and at {more} more state{'s' * (more > 1)}" if more else ""
        return f"{self.what} at {self.state}{others}"


def in_words(shape: Shape) -> str:
    """A shape, such as (bodies, 3) or (4,)."""
    return f"({', '.join(map(str, shape))}{',' * (len(shape) == 1)})"


def converted(name: str, value: object, shape: Shape, or_else: str = "", at_which: str = "") -> np.ndarray:
    """The value called `name` as floats of a shape; OwnError, with one of these ends, if its type or shape is wrong."""
    array = numbers_of(value)
    if array is None:
        raise OwnError(f"{name} is {shown(value)}; expected real numbers of shape {in_words(shape)}{or_else}")
    lengths = array.shape if array.ndim == len(shape) else (-1,) * len(shape)
    fitted = in_shape(array, tuple(n if isinstance(n, int) else m for n, m in zip(shape, lengths)))
    if fitted is None:
        raise OwnError(f"{name} has shape {array.shape}; expected {in_words(shape)}{at_which}")
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


def state_in_words(state: Sequence[Sequence[float] | np.ndarray]) -> str:
    """q, qd and tau, those that are given, as they can be typed."""
    return ", ".join(f"{symbol} = {typed(part)}" for symbol, part in zip(STATE, state))


def typed(values: Sequence[float] | np.ndarray) -> str:
    more = ", ..." if len(values) > MOST_SHOWN else ""
    return f"[{', '.join(f'{value:.6g}' for value in values[:MOST_SHOWN])}{more}]"


def as_raised(error: BaseException) -> str:
    """An error that a user's function raised, with the line of the user's file."""
    text = f"{type(error).__name__}: {error}".rstrip(": ")
    frames = traceback.extract_tb(error.__traceback__)[1:]
    own = [frame for frame in frames if frame.filename == frames[0].filename]
    return f"{text} ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else text
