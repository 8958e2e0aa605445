"""Motions of a case, and loops of calls of MuJoCo's own functions at one state, for timing.

In a loop there is no Python: the functions of the C library are called by their addresses, from LLVM's text.
"""

import ctypes
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import mujoco
import numpy as np

from tmt.compiled.machine import Library

from ...robots.case import Case
from .. import Motion, Prepared, Setting, Tolerance, as_far_as_it_goes, rows_of_states
from .actuators import engage
from .names import EVALUATIONS, bit, joint_places
from .stepper import Stepper

Array = np.ndarray | float
Run = Callable[[int], np.ndarray]  # how many times


class Runs:
    """MuJoCo with one model in motion, at states q (..., nq), v, tau (..., nv), joints in the case's order.

    Of a torque that is given only the part beyond the constant part of its actuators is applied.
    """

    def __init__(self, model: mujoco.MjModel, case: Case) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        if case.controller:
            self.data.ctrl[:], self.data.act[:] = engage(model, case.controller)
        self.constant: Array = case.controller.torque if case.controller else 0.0
        by_name, self.coordinates = joint_places(model), case.coordinates
        places = [by_name[name] for name in case.joints]
        self.joints = np.array([place.joint for place in places])
        self.qpos = np.array([i for place in places for i in place.qpos])
        self.dofs = np.array([i for place in places for i in place.dofs])

    def run(
        self, q: Array, v: Array, tau: Array, dt: float, steps: int, method: str, tolerance: Tolerance = None
    ) -> Motion:
        """Motion under constant torque: q, v (..., steps + 1, n), NaN from where it diverges."""
        stepper = self.stepper(dt, method, tolerance)
        batch, states = self.states(stepper, q, v, tau)
        rolled, qpos, qvel = stepper.roll(states, steps), stepper.places["qpos"], stepper.places["qvel"]
        q_path = np.concatenate([states[:, None, qpos], rolled.q], axis=1)
        v_path = np.concatenate([states[:, None, qvel], rolled.v], axis=1)
        return self.motion(q_path, v_path, dt, batch, EVALUATIONS[method])

    def prepare(self, q: Array, v: Array, tau: Array, setting: Setting, method: str) -> Prepared:
        steps, every = int(setting.steps or 0), setting.every
        dt = setting.duration / steps
        stepper = self.stepper(dt, method, setting.tolerance)
        state = self.states(stepper, q, v, tau)[1][0]

        def read(physics: np.ndarray) -> Motion:
            path = np.vstack([state[: physics.shape[1]], physics])  # time, qpos, qvel are first in both
            path[1 + stepper.taken(physics) :] = np.nan
            qpos, qvel = (path[None, :, stepper.places[name]] for name in ("qpos", "qvel"))
            motion = self.motion(qpos, qvel, dt, (), EVALUATIONS[method])
            return motion._replace(t=setting.times, q=motion.q[::every], v=motion.v[::every])

        return stepper.loop(state, steps), read

    def motion(
        self, qpos: np.ndarray, qvel: np.ndarray, dt: float, batch: tuple[int, ...], evaluations: int
    ) -> Motion:
        """The Motion of runs, (runs, steps + 1, n), and why some end early. evaluations: of a step."""
        q, v, steps = qpos[..., self.qpos], qvel[..., self.dofs], qpos.shape[1] - 1
        t, ended = dt * np.arange(steps + 1), np.full(len(q), None, dtype=object)
        for k, run in enumerate(np.concatenate([q, v], axis=-1)):
            run, ended[k] = as_far_as_it_goes(t, run, run[0], "a number is not finite")
            q[k], v[k] = run[:, : q.shape[-1]], run[:, q.shape[-1] :]
        q, v = (path.reshape(*batch, steps + 1, path.shape[-1]) for path in (q, v))
        return Motion(t, q, v, len(ended) * steps * evaluations, ended.reshape(batch)[()], steps)

    def stepper(self, dt: float, method: str, tolerance: Tolerance = None) -> Stepper:
        """Steps of dt, s, by an integrator. ValueError for a tolerance."""
        if tolerance is not None:
            raise ValueError(f"MuJoCo's {method} has a fixed step and takes no tolerance")
        return Stepper(self.model, dt, method)

    def states(
        self, stepper: Stepper, q: Array, v: Array = 0.0, tau: Array = 0.0
    ) -> tuple[tuple[int, ...], np.ndarray]:
        """The batch shape and the states, (runs, n), of a stepper under constant torque."""
        batch, rows = rows_of_states(q, v, tau - self.constant)
        states = np.tile(stepper.reset, (len(rows[0]), 1))
        values = zip(("qpos", "qvel", "qfrc_applied"), (self.qpos, self.dofs, self.dofs), rows)
        for name, columns, row in values:
            states[:, stepper.places[name].start + columns] = row
        states[:, stepper.places["ctrl"]], states[:, stepper.places["act"]] = self.data.ctrl, self.data.act
        return batch, states


def library() -> str | None:
    """The path of MuJoCo's shared library, if it is where the package usually has it."""
    folder, patterns = Path(mujoco.__file__).parent, ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll")
    return next((str(path) for pattern in patterns for path in sorted(folder.glob(pattern))), None)


def loops(dynamics: Runs, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> dict[str, Run]:
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
