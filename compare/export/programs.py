"""The exported equations as programs: compiled or run in their language, they give values at states."""

import ctypes
import os
import runpy
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from math import prod
from pathlib import Path

import numpy as np

import tmt
from tmt.compiled import evaluator
from tmt.derivation.quantities import QUANTITIES, shape_of

from ..engines.own.functions import functions_of
from ..robots import Robot

STATE = ("q", "qd", "tau")
MOST_SECONDS = 900.0  # of a compiler, or of a run in another language


class NotRun(RuntimeError):
    """The text was not run; the message says why."""


class WrongProgram(RuntimeError):
    """The text does not compile or does not run; the message is the first line that says why."""


class Program:
    """The files of a folder, for a Tree; `values` runs a function of them."""

    of = ""  # the file that is run, where there are others with the same expressions

    def __init__(self, folder: Path, name: str, tree: tmt.Tree, quantities: Sequence[str], single: bool):
        self.folder, self.name, self.tree, self.quantities, self.single = (
            folder,
            name,
            tree,
            quantities,
            single,
        )
        self.start()

    def start(self) -> None:
        """Compile or load the text."""

    def values(self, quantity: str, q, qd, tau) -> list[np.ndarray]:
        """The results of a function at states, (states, ...) each: one, or one for each part of the quantity."""
        raise NotImplementedError

    def takes(self, quantity: str, *states: np.ndarray) -> list[np.ndarray]:
        return list(states[: len(QUANTITIES[quantity].takes)])

    def operations(self, quantity: str) -> int:
        """+ - * / of an evaluation; a sine, a cosine, a root count as one each."""
        return evaluator(self.tree, quantity).operations

    def parts(self, quantity: str) -> int:
        return max(1, len(QUANTITIES[quantity].parts))

    def run(self, *command: str) -> str:
        """The output of a command in the folder."""
        try:
            done = subprocess.run(
                command, cwd=self.folder, capture_output=True, text=True, errors="replace", timeout=MOST_SECONDS,
                stdin=subprocess.DEVNULL, check=False,
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


class CProgram(Program):
    """Compiled with -O2, called for many states by a loop in C."""

    def start(self):
        compiler = (
            shlex.split(os.environ.get("CC", "")) or list(filter(shutil.which, ("gcc", "cc", "clang")))[:1]
        )
        if not compiler or not shutil.which(compiler[0]):
            raise NotRun(f"no C compiler was found ({' '.join(compiler) or 'gcc, cc, clang'})")
        driver = [f'#include "{self.name}.h"', *map(self.loop, self.quantities)]
        Path(self.folder, "_states.c").write_text("\n".join(driver) + "\n", encoding="utf-8")
        Path(self.folder, "_none.c").write_text("#include <math.h>\nint none;\n", encoding="utf-8")
        flags = ["-std=c99", "-O2", "-Wall", "-fPIC", "-shared"]
        try:
            self.run(*compiler, *flags, "_none.c", "-o", "_none.so", "-lm")
            ctypes.CDLL(str(self.folder / "_none.so"))
        except (WrongProgram, OSError) as error:  # of the compiler or the folder, not of the equations
            raise NotRun(f"a C library cannot be made or loaded: {error}") from None
        # the header before the source: the declarations must be those of the functions
        files = ["-include", f"{self.name}.h", f"{self.name}.c", "_states.c"]
        self.run(*compiler, *flags, *files, "-o", "_states.so", "-lm")
        self.library = ctypes.CDLL(str(self.folder / "_states.so"))

    def loop(self, quantity: str) -> str:
        """A function for many states."""
        kind, of = "float" if self.single else "double", QUANTITIES[quantity]
        sizes = dict(zip(STATE, self.sizes))
        size = prod(shape_of(quantity, self.tree))
        own = size // self.parts(quantity)
        taken = [f"{x} + {sizes[x]} * i" for x in of.takes]
        taken += [f"out + {size} * i + {own * k}" for k in range(self.parts(quantity))]
        arguments = ", ".join(f"const {kind} *{x}" for x in STATE)
        call = f"{self.name}_{quantity}({', '.join(taken)});"
        return f"void states_{quantity}({arguments}, {kind} *out, long n) {{ for (long i = 0; i < n; i++) {call} }}"

    @property
    def sizes(self) -> tuple[int, int, int]:
        return self.tree.coordinates.nq, self.tree.coordinates.nv, self.tree.coordinates.nv

    def call(self, quantity: str, q, qd, tau):
        """A call without arguments that evaluates all states, and its output (states, size)."""
        kind = np.float32 if self.single else float
        arrays = [np.ascontiguousarray(x, dtype=kind) for x in (q, qd, tau)]
        out = np.empty((len(q), prod(shape_of(quantity, self.tree))), dtype=kind)
        function = self.library[f"states_{quantity}"]
        places = [ctypes.c_void_p(x.ctypes.data) for x in (*arrays, out)]
        count = ctypes.c_long(len(q))

        def call(_=(*arrays, out)):  # they live as long as the call
            function(*places, count)

        return call, out

    def values(self, quantity, q, qd, tau):
        call, out = self.call(quantity, q, qd, tau)
        call()
        found = out.astype(float).reshape(len(q), *shape_of(quantity, self.tree))
        return [found[:, k] for k in range(self.parts(quantity))] if self.parts(quantity) > 1 else [found]


class PythonProgram(Program):
    """A module, called with all states at once."""

    def start(self):
        self.functions = runpy.run_path(str(self.folder / f"{self.name}.py"))

    def values(self, quantity, q, qd, tau):
        found = self.functions[quantity](*self.takes(quantity, q, qd, tau))
        return list(found) if self.parts(quantity) > 1 else [found]


class SymbolicProgram(Program):
    """The matrices of SymPy, as functions of states."""

    def start(self):
        self.of = f"{self.name}.py"
        self.found = runpy.run_path(str(self.folder / self.of))
        robot = Robot("", Path(), self.tree, {}, ())
        self.functions = functions_of(self.found, robot.coordinates, ())

    def operations(self, quantity):
        import sympy

        matrix, _ = self.found[quantity.removesuffix("_balance")]
        return int(sum(sympy.count_ops(entry) for entry in matrix))

    def values(self, quantity, q, qd, tau):
        function = self.functions[quantity.removesuffix("_balance")]
        return [np.array([function(*state) for state in zip(*self.takes(quantity, q, qd, tau))], dtype=float)]


class MatlabProgram(Program):
    """Run by Octave; states and values go through files of doubles."""

    def start(self):
        self.octave = next(filter(shutil.which, ("octave-cli", "octave")), None)
        if self.octave is None:
            raise NotRun("Octave was not found")

    def values(self, quantity, q, qd, tau):
        takes, parts = QUANTITIES[quantity].takes, self.parts(quantity)
        lines = []
        for x, values in zip(takes, (q, qd, tau)):
            np.ascontiguousarray(values).tofile(self.folder / f"{x}.bin")
            lines.append(
                f"f = fopen('{x}.bin'); {x} = fread(f, [{values.shape[1]}, Inf], 'double'); fclose(f);"
            )
        results = [f"r{k}" for k in range(parts)]
        lines.append(f"[{', '.join(results)}] = {self.name}('{quantity}', {', '.join(takes)});")
        lines += [f"f = fopen('{r}.bin', 'w'); fwrite(f, {r}, 'double'); fclose(f);" for r in results]
        (self.folder / "_states.m").write_text("\n".join(["1;", *lines]) + "\n", encoding="utf-8")
        self.run(self.octave, "--norc", "--quiet", "_states.m")
        shape = shape_of(quantity, self.tree)[parts > 1 :]
        arrays = [np.fromfile(self.folder / f"{r}.bin").reshape((*shape, len(q)), order="F") for r in results]
        return [np.moveaxis(array, -1, 0) for array in arrays]


PROGRAMS = {"c": CProgram, "python": PythonProgram, "matlab": MatlabProgram, "latex": SymbolicProgram}
