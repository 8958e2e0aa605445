"""Time of a step and world where many worlds are followed at once, all by Runge and Kutta's method with the same step."""

from collections.abc import Callable
from functools import partial

import numpy as np

import tmt
from tmt.compiled.cores import cores

from ...core import timing
from ...engines import LABELS, RECORDS, Array, Engine
from ...engines.outside import OutsideDynamics
from ...engines.outside.file import EngineError, TooLong
from ...robots.case import Case
from ..setup import Setup
from .motion import free_scene
from .tables import BatchRow, EnginesResult

WORLDS = (1, 4, 16, 64, 256, 1024, 4096)
FEW = (1, 64, 4096)  # of engines that compile for each number
STEPS = 16
FINER = 16  # steps of the reference in one of these
METHODS = {"mujoco": "RK4", "tmt": "rk4", "mjx": "RK4", "mjx_float32": "RK4", "warp": "RK4"}
LONGEST = 5.0  # s: after a call that takes longer, no more worlds


def time_batches(result: EnginesResult, setup: Setup, engine: Engine) -> None:
    """Rows of an engine that follows many worlds at once, none in a quick run."""
    case = free_scene(setup)
    if engine.name not in METHODS or case is None or setup.is_quick:
        return
    for worlds in FEW if RECORDS[engine.name].compiles else WORLDS:
        setup.progress(f"engines: {worlds} worlds, {LABELS[engine.name]}")
        try:
            seconds = add_row(result, case, engine, worlds)
        except TooLong:
            raise
        except EngineError as error:
            what = f"{worlds} worlds, {LABELS[engine.name]}"
            result.find("left_out", what=what, reason=str(error).rstrip("."))
            return
        if seconds > LONGEST:
            return


def add_row(result: EnginesResult, case: Case, engine: Engine, worlds: int) -> float:
    """Add a row; the seconds of its run."""
    dt, dynamics, prepared = case.duration / (-(-case.steps // 64) * 64), engine.of(case), None
    q, v, tau = (np.tile(values, (worlds, 1)) for values in (*case.start, case.tau))
    method, device = METHODS[engine.name], f"CPU, {cores()} threads"
    if isinstance(dynamics, OutsideDynamics):
        prepared, seconds, device, end = dynamics.batch((q, v, tau), dt, STEPS, method)
    else:
        run: Callable[[], object] = partial(dynamics.run, q, v, tau, dt, STEPS, method)
        seconds = timing.fastest({"": run}, 5)[""]
        end = dynamics.run(q[:1], v[:1], tau[:1], dt, STEPS, method).q[0, -1]
    error = float(np.abs(case.coordinates.difference(end, exact(case, dt))).max())
    cost = 1e6 * seconds / (worlds * STEPS)
    result.tables["engines_batches"].append(BatchRow(
        engine=LABELS[engine.name], method=method, device=device, worlds=worlds, steps=STEPS, dt=dt, worst_error=error,
        per_step_and_world=cost, seconds_prepared=prepared,
    ))  # fmt: skip
    return seconds


def exact(case: Case, dt: float) -> Array:
    """Positions after STEPS steps, by a method of order 8 with finer ones."""
    motion = tmt.simulate(*case.start, case.tau, dt / FINER, STEPS * FINER, "dopri8", case.tree)
    return np.asarray(motion.q[-1])
