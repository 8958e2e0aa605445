"""MuJoCo's own functions for timing: called from a compiled loop, with no Python between two calls.

The C library that the Python package brings is called by its functions' addresses from a few lines of LLVM's text.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from pathlib import Path

import mujoco
import numpy as np

from tmt.compiled.machine import Library

from .dynamics import MujocoDynamics
from .names import bit

Run = Callable[[int], None]  # how many times


def library() -> str | None:
    """The path of MuJoCo's shared library, if it is where the package usually has it."""
    folder, patterns = Path(mujoco.__file__).parent, ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll")
    return next((str(path) for pattern in patterns for path in sorted(folder.glob(pattern))), None)


class MinimalCalls:
    """MuJoCo's functions called by their addresses again and again at one state, with contact and constraint stages off."""

    def __init__(self, dynamics: MujocoDynamics):
        self.qpos, self.dofs = dynamics.qpos, dynamics.dofs
        self.model, self.data = dynamics.own_copy(1.0, "RK4")
        self.model.opt.disableflags |= bit("CONTACT", "CONSTRAINT")
        self.force, self.solution = np.zeros((2, self.model.nv))

    @staticmethod
    def unavailable() -> str | None:
        return None if library() else "MuJoCo's library was not found in its package"

    def loops(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> dict[str, Run]:
        """For each way run(count), which repeats it count times at one state.

        q, v, tau: (n,) rad, rad/s, N m. mj_forward does all that MuJoCo does for an acceleration; the equal work is only what
        forward dynamics needs; it solves M a = h, without any torque.
        """
        self.place(q, v, tau)
        mujoco.mj_forward(self.model, self.data)
        path = library() or ""

        def run(*names: str) -> Run:
            loop = repeated(path, names)

            # of self: what the addresses point to must live as long as the call
            def repeat(count: int) -> None:
                structures = self.model._address, self.data._address
                loop(*structures, self.force.ctypes.data, self.solution.ctypes.data, count)

            return repeat

        mass_matrix = "mj_makeM" if hasattr(ctypes.CDLL(path), "mj_makeM") else "mj_crb"
        before, after = ("mj_kinematics", "mj_comPos", mass_matrix), ("mj_comVel", "mj_rne")
        return {
            "MuJoCo, mj_forward": run("mj_forward"),
            "MuJoCo, equal work": run(*before, "mj_factorM", *after, "mj_solveM"),
        }

    def place(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> None:
        d = self.data
        d.qpos[self.qpos], d.qvel[self.dofs], d.qfrc_applied[self.dofs] = q, v, tau


@cache
def repeated(path: str, names: tuple[str, ...]) -> Callable[..., None]:
    """run(model, data, bias, acceleration, count): functions of the library one after the other, count times."""
    more = {"mj_rne": ", i32 0, ptr %bias", "mj_solveM": ", ptr %acceleration, ptr %bias, i32 1"}
    lines = ""
    for k, name in enumerate(names):
        address = ctypes.cast(getattr(ctypes.CDLL(path), name), ctypes.c_void_p).value
        lines += f"  %f{k} = inttoptr i64 {address} to ptr\n"
        lines += f"  call void %f{k}(ptr %model, ptr %data{more.get(name, '')})\n"
    text = f"""define void @run(ptr %model, ptr %data, ptr %bias, ptr %acceleration, i64 %count) {{
entry:
  br label %head
head:
  %i = phi i64 [0, %entry], [%next, %body]
  %more = icmp slt i64 %i, %count
  br i1 %more, label %body, label %done
body:
{lines}  %next = add i64 %i, 1
  br label %head
done:
  ret void
}}
"""
    return Library(text).function("run", None, *[ctypes.c_void_p] * 4, ctypes.c_int64)
