"""MuJoCo's own functions for timing: called from a compiled loop, with no Python between two calls, or by mujoco.batch.

The C library that the Python package brings is called by its functions' addresses from a few lines of LLVM's text.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import mujoco
import numpy as np

from tmt.compiled import Library

from .. import rows_of_states
from .dynamics import MujocoDynamics
from .names import bit

TINY_STEP = 1e-9  # s: a loop of steps stays where it starts


def library() -> ctypes.CDLL | None:
    """MuJoCo's shared library, if it is where the package usually has it."""
    for pattern in ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll"):
        for path in sorted(Path(mujoco.__file__).parent.glob(pattern)):
            return opened(str(path))
    return None


@cache
def opened(path: str) -> ctypes.CDLL:
    return ctypes.CDLL(path)


class MinimalCalls:
    """Dynamics by only those of MuJoCo's functions that a tree of joints with damping needs, called by their addresses.

    Contact and constraint stages are off; tendons and actuators take no part, and springs only in the acceleration.
    """

    def __init__(self, dynamics: MujocoDynamics):
        self.coordinates, self.qpos, self.dofs = dynamics.coordinates, dynamics.qpos, dynamics.dofs
        self.model, self.data = dynamics.own_copy(TINY_STEP, "RK4")
        self.model.opt.disableflags |= bit("CONTACT", "CONSTRAINT")
        self.force, self.solution = np.zeros((2, self.model.nv))
        self.functions = functions(library())

    @staticmethod
    def unavailable() -> str | None:
        """Why it cannot take part here, or None."""
        return None if library() else "MuJoCo's library was not found in its package"

    def mass_matrix(self, q) -> np.ndarray:
        """M, kg m2, (..., nv, nv): mj_makeM (or mj_crb), laid out by mj_fullM."""
        full = np.zeros((self.model.nv, self.model.nv))

        def dense():
            mujoco.mj_fullM(self.model, self.data, full)
            return full[np.ix_(self.dofs, self.dofs)]

        return self.each(dense, q, 0.0, 0.0)

    def bias(self, q, v) -> np.ndarray:
        """h, N m, (..., nv): mj_rne."""
        return self.each(lambda: self.force[self.dofs], q, v, 0.0)

    def acceleration(self, q, v, tau) -> np.ndarray:
        """rad/s2, (..., nv): mj_solveM of tau - D v - h, less what springs take."""

        def solved():
            d = self.data
            if self.model.jnt_stiffness.any():
                mujoco.mj_passive(self.model, d)
                self.force[:] = d.qfrc_applied + d.qfrc_passive - self.force
            else:
                self.force[:] = d.qfrc_applied - self.model.dof_damping * d.qvel - self.force
            self.functions["mj_factorM"](*self.addresses)
            self.functions["mj_solveM"](*self.addresses, self.solution.ctypes.data, self.force.ctypes.data, 1)
            return self.solution[self.dofs]

        return self.each(solved, q, v, tau)

    def loops(self, q, v, tau) -> dict[str, tuple[str, Callable]]:
        """For each way: (quantity, run(count)), where run repeats it count times at one state.

        q, v, tau: (n,) rad, rad/s, N m. mj_forward does all that MuJoCo does for an acceleration; the equal work is only what
        forward dynamics needs. Its solution is -M^-1 h, as no torque is added up.
        """
        self.place(q, v, tau)
        mujoco.mj_forward(self.model, self.data)
        arrays = self.force.ctypes.data, self.solution.ctypes.data

        def run(*names):
            loop = repeated(library(), names)
            # what the addresses point to must live as long as the call
            return lambda count, _=self: loop(*self.addresses, *arrays, count)

        def called(count):
            for _ in range(count):
                mujoco.mj_forward(self.model, self.data)

        terms = (*BEFORE_RNE, "mj_rne")
        return {
            "MuJoCo, mj_forward called from Python": ("forward_dynamics", called),
            "MuJoCo, mj_forward": ("forward_dynamics", run("mj_forward")),
            "MuJoCo, equal work": ("forward_dynamics", run(*terms[:3], "mj_factorM", *terms[3:], "mj_solveM")),
            "MuJoCo, equal work, no solve": ("mass_matrix_and_bias", run(*terms)),
            "MuJoCo, mj_step": ("rk4_step", run("mj_step")),
        }

    @property
    def addresses(self) -> tuple[int, int]:
        return self.model._address, self.data._address

    def place(self, q, v, tau) -> None:
        d = self.data
        d.qpos[self.qpos], d.qvel[self.dofs], d.qfrc_applied[self.dofs] = q, v, tau

    def each(self, read, q, v, tau) -> np.ndarray:
        """read() after the calls that give M and h, at each state, stacked to the batch shape of the states."""
        batch, states = rows_of_states(q, v, tau)
        values = []
        for state in zip(*states):
            self.place(*state)
            for name in BEFORE_RNE:
                self.functions[name](*self.addresses)
            self.functions["mj_rne"](*self.addresses, 0, self.force.ctypes.data)
            values.append(np.array(read()))
        return np.array(values).reshape(*batch, *values[0].shape)


BEFORE_RNE = ("mj_kinematics", "mj_comPos", "mass matrix", "mj_comVel")  # before mj_rne, in this order


@cache
def functions(lib: ctypes.CDLL) -> dict[str, Callable]:
    """MuJoCo's functions of model and data by their names."""
    more = {"mj_rne": (ctypes.c_int, ctypes.c_void_p), "mj_solveM": (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)}
    mass_matrix = "mj_makeM" if hasattr(lib, "mj_makeM") else "mj_crb"
    names = ("mj_forward", "mj_step", "mj_kinematics", "mj_comPos", "mj_comVel", "mj_factorM", "mj_rne", "mj_solveM")
    by_name = {name: getattr(lib, name) for name in names} | {"mass matrix": getattr(lib, mass_matrix)}
    for name, function in by_name.items():
        function.argtypes, function.restype = [ctypes.c_void_p, ctypes.c_void_p, *more.get(name, ())], None
    return by_name


@cache
def repeated(lib: ctypes.CDLL, names: tuple[str, ...]) -> Callable:
    """run(model, data, bias, acceleration, count): functions of the library one after the other, count times."""
    more = {"mj_rne": ", i32 0, ptr %bias", "mj_solveM": ", ptr %acceleration, ptr %bias, i32 1"}
    calls = []
    for k, name in enumerate(names):
        address = ctypes.cast(functions(lib)[name], ctypes.c_void_p).value
        calls.append(f"  %f{k} = inttoptr i64 {address} to ptr")
        calls.append(f"  call void %f{k}(ptr %model, ptr %data{more.get(name, '')})")
    lines = "\n".join(calls)
    text = f"""define void @run(ptr %model, ptr %data, ptr %bias, ptr %acceleration, i64 %count) {{
entry:
  br label %head
head:
  %i = phi i64 [0, %entry], [%next, %body]
  %more = icmp slt i64 %i, %count
  br i1 %more, label %body, label %done
body:
{lines}
  %next = add i64 %i, 1
  br label %head
done:
  ret void
}}
"""
    return Library(text).function("run", None, *[ctypes.c_void_p] * 4, ctypes.c_int64)


class BatchedCalls:
    """N states of a case in one batch, their contact and constraint stages off; q (N, nq), v and tau (N, nv)."""

    def __init__(self, dynamics: MujocoDynamics, q, v, tau, threads: int = 1):
        from mujoco.batch import Batch

        model = dynamics.own_copy(TINY_STEP, "RK4")[0]
        model.opt.disableflags |= bit("CONTACT", "CONSTRAINT")
        self.batch, self.dofs = Batch(model, len(q), threads), dynamics.dofs
        state = self.batch.bind("qpos"), self.batch.bind("qvel"), self.batch.bind("qfrc_applied")
        for part, values, places in zip(state, (q, v, tau), (dynamics.qpos, dynamics.dofs, dynamics.dofs)):
            part[:, places] = values
        self.qacc = self.batch.bind("qacc")

    @staticmethod
    def unavailable() -> str | None:
        """Why it cannot take part here, or None."""
        if find_spec("mujoco.batch") is None:
            return f"MuJoCo {mujoco.__version__} has no mujoco.batch; it needs 4.0"
        return None

    def forward(self) -> np.ndarray:
        """rad/s2, (N, nv): mj_forward of each state."""
        self.batch.forward()
        return self.qacc[:, self.dofs]

    def step(self) -> None:
        """mj_step of each state, with a step so short that the state stays."""
        self.batch.step()

    def forward_loop(self) -> Callable[[int], object]:
        """run(count): mj_forward of all states count times, each time a call from Python."""
        return lambda count: [self.batch.forward() for _ in range(count)]
