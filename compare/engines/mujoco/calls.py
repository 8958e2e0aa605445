"""MuJoCo's own functions called from a compiled loop, for timing: no Python between two calls.

The C library that the Python package brings is called through its function pointers from a loop that numba compiles.
"""

import ctypes
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
from numba import njit

from .engine import FLAGS, INTEGRATORS, Engine


def library() -> ctypes.CDLL | None:
    """MuJoCo's shared library, if it lies where the package usually has it."""
    for pattern in ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll"):
        for path in sorted(Path(mujoco.__file__).parent.glob(pattern)):
            return ctypes.CDLL(str(path))
    return None


@njit
def repeated(function, model, data, count):
    for _ in range(count):
        function(model, data)


def loops(engine: Engine, q, qd, tau) -> dict[str, tuple[str, Callable]]:
    """For each way: (quantity, run(count)), where run does the same at one state count times. {} without the library.

    q, qd, tau: (n,) rad, rad/s, N m. mj_forward does all that MuJoCo does for an acceleration, with contact and constraint
    stages off; the equal work is only what forward dynamics of this arm needs.
    """
    lib = library()
    if lib is None:
        return {}
    model, data = mujoco.MjModel.__copy__(engine.model), mujoco.MjData(engine.model)
    model.opt.integrator, model.opt.timestep = INTEGRATORS["RK4"], 1e-9
    model.opt.disableflags |= int(FLAGS["contact"]) | int(FLAGS["constraint"])
    data.qpos[engine.qpos], data.qvel[engine.dofs], data.qfrc_applied[engine.dofs] = q, qd, tau
    mujoco.mj_forward(model, data)
    m, d = model._address, data._address

    def named(name, *more):
        function = getattr(lib, name)
        function.argtypes, function.restype = [ctypes.c_void_p, ctypes.c_void_p, *more], None
        return function

    forward, step = named("mj_forward"), named("mj_step")
    kinematics, com, velocities = named("mj_kinematics"), named("mj_comPos"), named("mj_comVel")
    inertia = named("mj_makeM" if hasattr(lib, "mj_makeM") else "mj_crb")
    factor, rne = named("mj_factorM"), named("mj_rne", ctypes.c_int, ctypes.c_void_p)
    solve = named("mj_solveM", ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
    bias, acceleration = np.zeros((2, model.nv))
    to_bias, to_acceleration = bias.ctypes.data, acceleration.ctypes.data

    @njit
    def terms(m, d, bias, count):
        for _ in range(count):
            kinematics(m, d)
            com(m, d)
            inertia(m, d)
            velocities(m, d)
            rne(m, d, 0, bias)

    @njit
    def dynamics(m, d, bias, acceleration, count):
        for _ in range(count):
            kinematics(m, d)
            com(m, d)
            inertia(m, d)
            factor(m, d)
            velocities(m, d)
            rne(m, d, 0, bias)
            solve(m, d, acceleration, bias, 1)

    owners = model, data, bias, acceleration  # what the addresses point to must live as long as the calls

    def call(loop, *arguments):
        return lambda count, _=owners: loop(*arguments, count)

    return {
        "MuJoCo, mj_forward": ("forward_dynamics", call(repeated, forward, m, d)),
        "MuJoCo, equal work": ("forward_dynamics", call(dynamics, m, d, to_bias, to_acceleration)),
        "MuJoCo, equal work, no solve": ("mass_matrix_and_bias", call(terms, m, d, to_bias)),
        "MuJoCo, mj_step": ("rk4_step", call(repeated, step, m, d)),
    }
