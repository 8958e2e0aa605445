"""Loops of calls of MuJoCo's own functions at one state, for timing.

In a loop there is no Python: the functions of the C library are called by their addresses, from LLVM's text.
"""

import ctypes
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import mujoco
import numpy as np

from tmt.compiled.machine import Library

from .dynamics import MujocoDynamics
from .names import bit

Run = Callable[[int], np.ndarray]  # how many times


def library() -> str | None:
    """The path of MuJoCo's shared library, if it is where the package usually has it."""
    folder, patterns = Path(mujoco.__file__).parent, ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll")
    return next((str(path) for pattern in patterns for path in sorted(folder.glob(pattern))), None)


def loops(dynamics: MujocoDynamics, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> dict[str, Run]:
    """Each way's run(count), which repeats it at one state, without contacts and constraints; {}: no library.

    q, v, tau: (n,) rad, rad/s, N m. mj_forward does all that MuJoCo does for an acceleration; the equal work
    is only what forward dynamics needs; it solves M a = h, without any torque.
    """
    if (path := library()) is None:
        return {}
    stepper = dynamics.stepper(1.0, "RK4")
    model, data = stepper.model, stepper.put(dynamics.states(stepper, q, v, tau)[1][0])
    model.opt.disableflags |= bit("CONTACT", "CONSTRAINT")
    mujoco.mj_forward(model, data)
    mass_matrix = "mj_makeM" if hasattr(ctypes.CDLL(path), "mj_makeM") else "mj_crb"
    before, after = ("mj_kinematics", "mj_comPos", mass_matrix), ("mj_comVel", "mj_rne")
    ways = {"mj_forward": ["mj_forward"], "equal work": [*before, "mj_factorM", *after, "mj_solveM"]}
    # what the addresses point to lives as long as the call
    return {f"MuJoCo, {way}": partial(repeat, path, tuple(names), model, data) for way, names in ways.items()}


def repeat(
    path: str, names: tuple[str, ...], model: mujoco.MjModel, data: mujoco.MjData, count: int
) -> np.ndarray:
    """Call functions of the library in turn, count times: the bias and the acceleration, (2, nv)."""
    results = np.zeros((2, model.nv))
    addresses = model._address, data._address, *(row.ctypes.data for row in results)
    repeated(path, names)(*addresses, count)
    return results


@cache
def repeated(path: str, names: tuple[str, ...]) -> Callable[..., None]:
    """run(model, data, bias, acceleration, count): functions of the library in turn, count times."""
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
