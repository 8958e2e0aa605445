"""The exported equations as programs: compiled or run in their language, they give values at states."""

import ctypes
import os
import runpy
import shlex
import shutil
import subprocess
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from math import prod
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

import tmt
from tmt.derivation.quantities import quantity_of, shape_of
from tmt.export import identifier
from tmt.export import traced as traced_of
from tmt.export.parameters import Parameters

from ..engines.own.functions import functions_of
from ..robots import Robot
from .rounding import running_error

STATE = ("q", "qd", "tau", "dt")
ROUNDINGS = 16.0  # of a number on its way through MuJoCo's compiler, in units of eps
MOST_SECONDS = 900.0  # of a compiler, or of a run in another language
OF_PROCESSOR = "-mfma", "-march=native"  # which a user may add; GCC then needs -std=gnu99 or the like
FLAGS = ("-std=c99", "-O2", "-Wall", "-fPIC", "-shared")

Array = NDArray[np.floating[Any]]
Part = TypeVar("Part")
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
    single: bool
    parameters: Mapping[str, Array] = field(default_factory=dict)  # values of further arguments
    chosen: Parameters | None = None  # which these are
    file = ""  # that is run, where there are others with the same expressions

    def __post_init__(self) -> None:  # noqa: B027  # what a dataclass calls, where there is something to do
        """Compile or load the text."""

    @abstractmethod
    def values(self, quantity: str, states: States) -> list[Array]:
        """The arrays of a quantity at states, (states, ...) each: one, or one for each of its parts."""

    def operations(self, quantity: str) -> int:
        """+ - * / of an evaluation; a sine, a cosine, a root count as one each."""
        return traced_of(self.tree, quantity, self.chosen).operations

    def rounding(self, quantity: str, states: States) -> list[Array]:
        """In units of eps, how far rounding may take each number of the arrays of a quantity."""
        traced = traced_of(self.tree, quantity, self.chosen)
        count, numbers = len(states[0]), self.parameters.values()
        arrays = [*states, *(np.tile(x, (count, 1)) for x in numbers)]
        # those of the parameters in the compiled file have been turned to principal axes and back
        exact = [np.zeros_like(x) for x in states]
        errors = [*exact, *(np.full((count, len(x)), ROUNDINGS * np.abs(x).max()) for x in numbers)]
        bounds = running_error(traced, *(np.concatenate(part, axis=1).T for part in (arrays, errors)))
        shape = shape_of(quantity, self.tree)
        whole = np.moveaxis(bounds, 0, -1).reshape(-1, *shape)
        return [whole[:, k] for k in range(parts(quantity))] if parts(quantity) > 1 else [whole]

    def run(self, *command: str) -> str:
        try:
            done = subprocess.run(
                command, cwd=self.folder, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                errors="replace", timeout=MOST_SECONDS, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise NotRun(f"{command[0]} takes more than {MOST_SECONDS:g} s") from None
        except OSError as error:
            raise NotRun(f"{command[0]}: {error.strerror}") from None
        if done.returncode:
            lines = [line for line in (done.stderr or done.stdout).splitlines() if "error" in line]
            lines = lines or [f"exit status {done.returncode}"]
            raise WrongProgram(f"{command[0]}: {lines[0]}")
        return done.stdout


def taken(quantity: str, states: Sequence[Part]) -> list[Part]:
    """Those of q, qd, tau or qdd, and dt that a quantity takes."""
    return list(states[: len(quantity_of(quantity).takes)])


def parts(quantity: str) -> int:
    """How many arrays a quantity has."""
    return len(quantity_of(quantity).parts) or 1


class CProgram(Program):
    """Compiled with -O2, called for many states by a loop in C."""

    def __post_init__(self) -> None:
        compiler = shlex.split(os.environ.get("CC", ""))
        compiler = compiler or [name for name in ("gcc", "cc", "clang") if shutil.which(name)][:1]
        if not compiler or not shutil.which(compiler[0]):
            raise NotRun(f"no C compiler was found ({' '.join(compiler) or 'gcc, cc, clang'})")
        try:
            self.compiled(compiler, "none", "#include <math.h>\nint none;")
        except (WrongProgram, OSError) as error:  # of the compiler or the folder, not of the equations
            raise NotRun(f"a C library cannot be made or loaded: {error}") from None
        self.compiler = compiler
        self.library = self.of_states("states")

    def of_states(self, name: str, *flags: str) -> ctypes.CDLL:
        """The functions in loops over states."""
        loops = "\n".join([f'#include "{self.name}.h"', *map(self.loop, self.quantities)])
        # the header before the source: the declarations must be those of the functions
        texts = "-include", f"{self.name}.h", f"{self.name}.c"
        return self.compiled(self.compiler, name, loops, *flags, *texts)

    def faster(self) -> dict[str, ctypes.CDLL]:
        """The functions compiled for a processor that multiplies and adds at once, by each option for it."""
        cpu = Path("/proc/cpuinfo")
        if not cpu.is_file() or " fma " not in cpu.read_text(encoding="utf-8"):
            return {}

        def library(flag: str) -> ctypes.CDLL:
            return self.of_states(f"states{flag.replace('=', '_')}", "-ffp-contract=fast", flag)

        with ThreadPoolExecutor() as compilers:
            return dict(zip(OF_PROCESSOR, compilers.map(library, OF_PROCESSOR)))

    def compiled(self, compiler: Sequence[str], name: str, text: str, *more: str) -> ctypes.CDLL:
        (self.folder / f"_{name}.c").write_text(f"{text}\n", encoding="utf-8")
        self.run(*compiler, *FLAGS, *more, f"_{name}.c", "-o", f"_{name}.so", "-lm")
        return ctypes.CDLL(str(self.folder / f"_{name}.so"))

    def loop(self, quantity: str) -> str:
        kind, coordinates = "float" if self.single else "double", self.tree.coordinates
        sizes = {"q": coordinates.nq, "qd": coordinates.nv, "tau": coordinates.nv, "dt": 1}
        size = prod(shape_of(quantity, self.tree))
        given = [f"{x} + {sizes[x]} * i" for x in taken(quantity, STATE)]
        given += self.parameters
        given += [f"out + {size} * i + {size // parts(quantity) * k}" for k in range(parts(quantity))]
        arguments = ", ".join(f"const {kind} *{x}" for x in (*STATE, *self.parameters))
        call = f"{self.name}_{identifier(quantity)}({', '.join(given)});"
        head = f"void states_{identifier(quantity)}({arguments}, {kind} *out, long n)"
        return f"{head} {{ for (long i = 0; i < n; i++) {call} }}"

    def call(
        self, quantity: str, states: States, library: ctypes.CDLL | None = None
    ) -> tuple[Callable[[], None], Array]:
        """A call without arguments that evaluates all states, and its output (states, size)."""
        kind = np.float32 if self.single else float
        count = len(states[0])
        arrays = [np.ascontiguousarray(x, dtype=kind) for x in (*states, *self.parameters.values())]
        arrays.append(np.empty((count, prod(shape_of(quantity, self.tree))), dtype=kind))
        function = (library or self.library)[f"states_{identifier(quantity)}"]

        def call() -> None:
            function(*(ctypes.c_void_p(x.ctypes.data) for x in arrays), ctypes.c_long(count))

        return call, arrays[-1]

    def values(self, quantity: str, states: States) -> list[Array]:
        call, out = self.call(quantity, states)
        call()
        values = out.astype(float).reshape(len(out), *shape_of(quantity, self.tree))
        return [values[:, k] for k in range(parts(quantity))] if quantity_of(quantity).parts else [values]


class PythonProgram(Program):
    """A module whose functions are called with all states at once."""

    def __post_init__(self) -> None:
        try:
            self.functions = runpy.run_path(str(self.folder / f"{self.name}.py"))
        except ImportError as error:
            raise NotRun(f"{error.name} cannot be imported: {error}") from None

    def values(self, quantity: str, states: States) -> list[Array]:
        values = self.functions[identifier(quantity)](*taken(quantity, states), *self.parameters.values())
        return list(values) if quantity_of(quantity).parts else [values]


class CasadiProgram(PythonProgram):
    """Functions of CasADi, called with numbers, state after state."""

    def values(self, quantity: str, states: States) -> list[Array]:
        function = self.functions[identifier(quantity)]
        shape = shape_of(quantity, self.tree)[parts(quantity) > 1 :]
        rows = [function.call([*state, *self.parameters.values()]) for state in zip(*taken(quantity, states))]
        return [np.array([part.full().reshape(shape) for part in results]) for results in zip(*rows)]


class JaxProgram(PythonProgram):
    """Functions of JAX, jitted, with 64 bits, called with all states at once."""

    def values(self, quantity: str, states: States) -> list[Array]:
        import jax

        with jax.enable_x64(True):
            arguments = [*taken(quantity, states), *self.parameters.values()]
            values = jax.jit(self.functions[identifier(quantity)])(*arguments)
        return list(map(np.asarray, values if quantity_of(quantity).parts else [values]))


class SymbolicProgram(PythonProgram):
    """The matrices of SymPy, as functions of states."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.file, self.matrices = f"{self.name}.py", self.functions
        robot = Robot("", Path(), self.tree, {}, ())
        self.functions = functions_of(self.matrices, robot.coordinates, ())

    def operations(self, quantity: str) -> int:
        import sympy

        matrix, _ = self.matrices[quantity.removesuffix("_balance")]
        return int(sum(sympy.count_ops(entry) for entry in matrix))

    def values(self, quantity: str, states: States) -> list[Array]:
        function = self.functions[quantity.removesuffix("_balance")]
        return [np.array([function(*state) for state in zip(*taken(quantity, states))], dtype=float)]


class MatlabProgram(Program):
    """Run by Octave; states and values go through files of doubles."""

    def __post_init__(self) -> None:
        found = [name for name in ("octave-cli", "octave") if shutil.which(name)]
        if not found:
            raise NotRun("Octave was not found")
        self.octave = found[0]

    def values(self, quantity: str, states: States) -> list[Array]:
        takes, results, lines = quantity_of(quantity).takes, [f"r{k}" for k in range(parts(quantity))], ["1;"]
        for x, values in zip(takes, states):
            np.ascontiguousarray(values).tofile(self.folder / f"{x}.bin")
            read = f"fread(f, [{values.shape[1]}, Inf], 'double')"
            lines.append(f"f = fopen('{x}.bin'); {x} = {read}; fclose(f);")
        given = [*takes, *(f"[{'; '.join(map(repr, x.tolist()))}]" for x in self.parameters.values())]
        lines.append(f"[{', '.join(results)}] = {self.name}('{identifier(quantity)}', {', '.join(given)});")
        lines += [f"f = fopen('{r}.bin', 'w'); fwrite(f, {r}, 'double'); fclose(f);" for r in results]
        (self.folder / "_states.m").write_text("\n".join(lines) + "\n", encoding="utf-8")
        self.run(self.octave, "--norc", "--quiet", "_states.m")
        shape = *shape_of(quantity, self.tree)[parts(quantity) > 1 :], len(states[0])
        arrays = [np.fromfile(self.folder / f"{r}.bin").reshape(shape, order="F") for r in results]
        return [np.moveaxis(array, -1, 0) for array in arrays]


PROGRAMS: dict[str, type[Program]] = {
    "c": CProgram,
    "python": PythonProgram,
    "matlab": MatlabProgram,
    "casadi": CasadiProgram,
    "jax": JaxProgram,
    "latex": SymbolicProgram,
}
