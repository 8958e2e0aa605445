"""The exported equations as programs: compiled or run in their language, they give values at states."""

import ctypes
import os
import runpy
import shlex
import shutil
import subprocess
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import tmt
from tmt.derivation.quantities import quantity_of, shape_of
from tmt.export import identifier
from tmt.export import traced as traced_of
from tmt.export.parameters import Parameters

from ..engines.own.functions import functions_of
from ..robots import Robot

MOST_SECONDS = 900.0  # of a compiler, or of a run in another language
FLAGS = ("-std=c99", "-O2", "-Wall", "-fPIC", "-shared")

Array = NDArray[np.floating[Any]]
States = Sequence[Array]  # q (states, nq), qd and tau or qdd (states, nv), dt (states, 1)


class NotRun(RuntimeError):
    """The text was not run; the message says why."""


class WrongProgram(RuntimeError):
    """The text does not compile or does not run; the message is the first line that says why."""


@dataclass
class Program(ABC):
    """The files of a folder, for a Tree; `values` runs a function of them."""

    folder: Path
    name: str
    tree: tmt.Tree
    quantities: Sequence[str]
    single: bool = False
    chosen: Parameters | None = None  # numbers that are arguments; values of `parameters` stand for them
    file = ""  # that is run, where there are others with the same expressions

    def __post_init__(self) -> None:
        stated = self.chosen.values if self.chosen else {}
        self.parameters = {name: np.array(value) for name, value in stated.items()}
        self.start()

    @abstractmethod
    def start(self) -> None:
        """Compile or load the text; NotRun or WrongProgram."""

    @abstractmethod
    def values(self, quantity: str, states: States) -> Array:
        """A quantity at states, (states, *shape), shape as in `tmt`, its parts one after another."""

    def operations(self, quantity: str) -> int:
        """+ - * / of an evaluation; a sine, a cosine, a root count as one each."""
        return traced_of(self.tree, quantity, self.chosen.words if self.chosen else ()).operations

    def run(self, *command: str) -> None:
        try:
            done = subprocess.run(
                command, cwd=self.folder, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                errors="replace", timeout=MOST_SECONDS, check=False,
            )  # fmt: skip
        except (subprocess.TimeoutExpired, OSError) as error:
            raise NotRun(f"{command[0]}: {getattr(error, 'strerror', '') or error}") from None
        if done.returncode:
            lines = [line for line in (done.stderr or done.stdout).splitlines() if "error" in line]
            raise WrongProgram(f"{command[0]}: {[*lines, f'exit status {done.returncode}'][0]}")


def found(*names: str) -> list[str]:
    return [name for name in names if shutil.which(name)][:1]


class CProgram(Program):
    """Compiled with -O2, called for many states by a loop in C."""

    def start(self) -> None:
        compiler = shlex.split(os.environ.get("CC", "")) or found("gcc", "cc", "clang")
        if not compiler or not shutil.which(compiler[0]):
            raise NotRun(f"no C compiler was found ({' '.join(compiler) or 'gcc, cc, clang'})")
        try:
            self.compiled(compiler, "none", "#include <math.h>\nint none;")
        except (WrongProgram, OSError) as error:  # of the compiler or the folder, not of the equations
            raise NotRun(f"a C library cannot be made or loaded: {error}") from None
        loops = "\n".join([f'#include "{self.name}.h"', *map(self.loop, self.quantities)])
        # the header before the source: the declarations must be those of the functions
        self.library = self.compiled(
            compiler, "states", loops, "-include", f"{self.name}.h", f"{self.name}.c"
        )

    def compiled(self, compiler: Sequence[str], name: str, text: str, *more: str) -> ctypes.CDLL:
        (self.folder / f"_{name}.c").write_text(f"{text}\n", encoding="utf-8")
        self.run(*compiler, *FLAGS, *more, f"_{name}.c", "-o", f"_{name}.so", "-lm")
        return ctypes.CDLL(str(self.folder / f"_{name}.so"))

    def loop(self, quantity: str) -> str:
        """A function in C that evaluates a quantity at n states."""
        kind, row, size = "float" if self.single else "double", quantity_of(quantity), self.size(quantity)
        sizes = {"q": self.tree.nq, "qd": self.tree.nv, "tau": self.tree.nv, "dt": 1}
        count = len(row.parts) or 1
        given = [f"{x} + {size_of} * i" for x, size_of in sizes.items()][: len(row.takes)]
        given += [*self.parameters, *(f"out + {size} * i + {size // count * k}" for k in range(count))]
        arguments = ", ".join(f"const {kind} *{x}" for x in (*sizes, *self.parameters))
        call = f"{self.name}_{identifier(quantity)}({', '.join(given)});"
        head = f"void states_{identifier(quantity)}({arguments}, {kind} *out, long n)"
        return f"{head} {{ for (long i = 0; i < n; i++) {call} }}"

    def size(self, quantity: str) -> int:
        return prod(shape_of(quantity, self.tree))

    def call(self, quantity: str, states: States) -> tuple[Callable[[], None], Array]:
        """A call without arguments that evaluates all states, and its output (states, *shape)."""
        kind, count = np.float32 if self.single else float, len(states[0])
        arrays = [np.ascontiguousarray(x, dtype=kind) for x in (*states, *self.parameters.values())]
        arrays.append(np.empty((count, *shape_of(quantity, self.tree)), dtype=kind))
        function = self.library[f"states_{identifier(quantity)}"]

        def call() -> None:
            function(*(ctypes.c_void_p(x.ctypes.data) for x in arrays), ctypes.c_long(count))

        return call, arrays[-1]

    def values(self, quantity: str, states: States) -> Array:
        call, out = self.call(quantity, states)
        call()
        return out.astype(float)


class PythonProgram(Program):
    """A module whose functions are called with all states at once."""

    def start(self) -> None:
        try:
            self.functions = runpy.run_path(str(self.folder / f"{self.name}.py"))
        except ImportError as error:
            raise NotRun(f"{error.name} cannot be imported: {error}") from None

    def arguments(self, quantity: str, states: States) -> list[Array]:
        return [*states[: len(quantity_of(quantity).takes)], *self.parameters.values()]

    def values(self, quantity: str, states: States) -> Array:
        values = self.functions[identifier(quantity)](*self.arguments(quantity, states))
        return np.stack(values, axis=1) if quantity_of(quantity).parts else np.asarray(values)


class CasadiProgram(PythonProgram):
    """Functions of CasADi, called with numbers, state after state."""

    def values(self, quantity: str, states: States) -> Array:
        function, shape = self.functions[identifier(quantity)], shape_of(quantity, self.tree)
        rows = [function.call(self.arguments(quantity, state)) for state in zip(*states)]
        return np.array([[part.full() for part in row] for row in rows]).reshape(-1, *shape)


class JaxProgram(PythonProgram):
    """Functions of JAX, jitted, with 64 bits, called with all states at once."""

    def start(self) -> None:
        super().start()
        import jax

        names = map(identifier, self.quantities)
        self.functions = {name: jax.jit(self.functions[name]) for name in names}

    def values(self, quantity: str, states: States) -> Array:
        import jax

        with jax.enable_x64(True):
            return super().values(quantity, states)


class SymbolicProgram(PythonProgram):
    """The matrices of SymPy, as functions of states."""

    def start(self) -> None:
        super().start()
        self.file, self.matrices = f"{self.name}.py", self.functions
        self.functions = functions_of(self.matrices, Robot("", Path(), self.tree, {}, ()).coordinates, ())

    def operations(self, quantity: str) -> int:
        import sympy

        matrix, _ = self.matrices[quantity.removesuffix("_balance")]
        return int(sum(sympy.count_ops(entry) for entry in matrix))

    def values(self, quantity: str, states: States) -> Array:
        function = self.functions[quantity.removesuffix("_balance")]
        return np.array([function(*state) for state in zip(*self.arguments(quantity, states))], dtype=float)


class MatlabProgram(Program):
    """Run by Octave; states and values go through files of doubles."""

    def start(self) -> None:
        if not found("octave-cli", "octave"):
            raise NotRun("Octave was not found")

    def values(self, quantity: str, states: States) -> Array:
        row, shape, lines = quantity_of(quantity), shape_of(quantity, self.tree), ["1;"]
        results = [f"r{k}" for k in range(len(row.parts) or 1)]
        for x, values in zip(row.takes, states):
            np.ascontiguousarray(values).tofile(self.folder / f"{x}.bin")
            read = f"fread(f, [{values.shape[1]}, Inf], 'double')"
            lines.append(f"f = fopen('{x}.bin'); {x} = {read}; fclose(f);")
        given = [*row.takes, *(f"[{'; '.join(map(repr, x.tolist()))}]" for x in self.parameters.values())]
        lines.append(f"[{', '.join(results)}] = {self.name}('{identifier(quantity)}', {', '.join(given)});")
        lines += [f"f = fopen('{r}.bin', 'w'); fwrite(f, {r}, 'double'); fclose(f);" for r in results]
        (self.folder / "_states.m").write_text("\n".join(lines) + "\n", encoding="utf-8")
        self.run(*found("octave-cli", "octave"), "--norc", "--quiet", "_states.m")
        columns = *shape[bool(row.parts) :], len(states[0])
        arrays = [np.fromfile(self.folder / f"{r}.bin").reshape(columns, order="F") for r in results]
        return np.moveaxis(np.array(arrays), -1, 0).reshape(-1, *shape)


PROGRAMS: dict[str, type[Program]] = {
    "c": CProgram, "python": PythonProgram, "matlab": MatlabProgram, "casadi": CasadiProgram, "jax": JaxProgram,
    "latex": SymbolicProgram,
}  # fmt: skip
