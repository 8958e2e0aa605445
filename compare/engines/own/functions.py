"""What a user brings as equations, as functions: of an object, a module, a mapping, a Tree or SymPy matrices."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np

import tmt
from tmt.model.values import shown

from ...robots.case import Coordinates

# how many of q, qd, tau each takes
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
QUICK = 1e-3  # s a state: functions that take no longer are asked some hundred times more
OF_A_TREE = {"gravity": "gravity_balance"}  # where tmt has another name


class OwnError(ValueError):
    """Equations of one's own that cannot be used at all; the message is one line."""

    def __str__(self):
        return " ".join(super().__str__().split())


def functions_of(source: object, coordinates: Coordinates, required: Sequence[str]) -> dict[str, Callable]:
    """The functions of a source by their names, those of ARGUMENTS that it has; OwnError if a required one is not there."""
    if isinstance(source, tmt.Tree):
        return of_tree(source, coordinates)
    found, symbols = {}, attribute(source, "symbols")
    for name in ARGUMENTS:
        value = attribute(source, name)
        if value is not None:
            found[name] = function_of(name, value, symbols, coordinates)
    if lacking := [name for name in required if name not in found]:
        expected = " and ".join(map(call, required))
        raise OwnError(f"{source_name(source)} has no {lacking[0]}; {expected} are expected")
    if not found:
        raise OwnError(f"{source_name(source)} has none of {', '.join(map(call, ARGUMENTS))}")
    return found


def call(name: str) -> str:
    """How a function is called."""
    return f"{name}({', '.join(STATE[: ARGUMENTS[name]])})"


def attribute(source: object, name: str) -> object:
    return source.get(name) if isinstance(source, Mapping) else getattr(source, name, None)


def source_name(source: object) -> str:
    """What a message calls a source."""
    if isinstance(source, type):
        return f"the class {source.__name__}"
    file = Path(getattr(source, "__file__", None) or "__init__.py").name
    if isinstance(source, ModuleType) and file != "__init__.py":  # a file of one's own has no other name
        return file
    name = getattr(source, "__name__", None)
    return name if isinstance(name, str) else f"the {type(source).__name__}"


def names_of(source: object) -> Sequence[str] | None:
    """The joints as the source states them, in its own order; None if it does not."""
    names = source.hinge_names if isinstance(source, tmt.Tree) else attribute(source, "joint_names")
    try:
        return names if names is None or isinstance(names, str) else list(names)
    except TypeError:
        raise OwnError(f"joint_names is {shown(names)}; a list of names is expected") from None


def of_tree(tree: tmt.Tree, coordinates: Coordinates) -> dict[str, Callable]:
    own = tree.coordinates
    if (own.nq, own.nv) != (coordinates.nq, coordinates.nv):
        raise OwnError(
            f"the Tree has {own.nq} positions and {own.nv} speeds ({', '.join(tree.hinge_names)}); "
            f"{coordinates.nq} and {coordinates.nv} are expected ({', '.join(coordinates.names)})"
        )
    return {name: partial(getattr(tmt, OF_A_TREE.get(name, name)), model=tree) for name in ARGUMENTS}


def is_function(value: object) -> bool:
    """Whether a value is brought as a function, or in symbols; else it is numbers."""
    return callable(value) or hasattr(value, "free_symbols") or is_pair(value)


def is_pair(value: object) -> bool:
    """Whether it is a SymPy matrix with the list of its symbols, and not two expressions."""
    if not isinstance(value, tuple | list) or len(value) != 2 or not hasattr(value[0], "free_symbols"):
        return False
    return isinstance(value[1], tuple | list) or hasattr(value[1], "shape")


def function_of(name: str, value: object, symbols: object, coordinates: Coordinates) -> Callable:
    """One quantity as a function: as it is, or of a SymPy matrix, or of a pair of one and its symbols."""
    if callable(value) and not hasattr(value, "free_symbols"):
        return value
    if is_pair(value):
        value, symbols = value
    if symbols is None:
        raise OwnError(
            f"{name} is {shown(value)}; a function {call(name)} is expected, or a SymPy matrix with the list of its symbols"
        )
    return of_symbols(name, value, symbols, coordinates)


def of_symbols(name: str, matrix: object, symbols: object, coordinates: Coordinates) -> Callable:
    """The function of a SymPy matrix or expression. symbols: of q, or of q and qd, or of q, qd and tau, in order."""
    import sympy

    try:
        symbols = list(sympy.flatten(symbols))
        entries = [sympy.sympify(entry) for entry in sympy.flatten([matrix])]
    except Exception as error:  # whatever SymPy makes of what is given
        raise OwnError(f"{name} is {shown(matrix)}; a SymPy matrix is expected ({shown(str(error))})") from None
    nq, nv = coordinates.nq, coordinates.nv
    counts = [nq, nq + nv, nq + 2 * nv]
    if len(symbols) not in counts or len(set(symbols)) < len(symbols):
        raise OwnError(
            f"{name} has the symbols {', '.join(map(str, symbols))}; {nq} of q, or {counts[1]} of q and qd in order "
            "are expected, each once"
        )
    # symbols may be functions of time, and qd their derivatives
    plain = [sympy.Dummy() for _ in symbols]
    entries = [entry.xreplace(dict(zip(symbols, plain))) for entry in entries]
    taken = counts[ARGUMENTS[name] - 1]
    if left := sorted({str(s) for entry in entries for s in entry.free_symbols - set(plain)}):
        raise OwnError(
            f"{name} has the symbol {left[0]}; a number is expected in its place, or that it is among the symbols"
        )
    used = {symbols[plain.index(s)] for entry in entries for s in entry.free_symbols & set(plain)}
    if more := [str(s) for s in symbols[taken:] if s in used]:
        raise OwnError(f"{name} depends on {more[0]}; {call(name)} is expected")
    shape = {"mass_matrix": (nv, nv), "energy": (), "com_positions": (-1, 3)}.get(name, (nv,))
    if name == "jacobians" or (-1 not in shape and len(entries) != int(np.prod(shape))):
        raise OwnError(f"{name} is a SymPy object of {len(entries)} entries; shape {shape} is expected")
    try:
        evaluated = sympy.lambdify(plain, entries, "numpy", cse=True)
    except Exception as error:  # of expressions that have no numbers, such as zoo
        raise OwnError(f"{name} cannot be made a function of {', '.join(map(str, plain))}: {error!r}") from None

    def function(*states: np.ndarray) -> np.ndarray:
        columns = [column for state in states for column in np.moveaxis(state, -1, 0)][: len(plain)]
        columns += [np.zeros_like(columns[0])] * (len(plain) - len(columns))  # nothing depends on these
        values = np.broadcast_arrays(*evaluated(*columns), columns[0])[:-1]
        return np.stack(values, axis=-1).reshape((*states[0].shape[:-1], *shape))

    function.__name__ = name
    return function
