"""A file's model run as it is: contacts, limits, friction, ranges of forces and resets, all as the file has them."""

from typing import NamedTuple

import mujoco
import numpy as np

from ...robots.actuators import Drive
from .actuators import control_of
from .flags import INTEGRATORS


class WholeRun(NamedTuple):
    """What was seen in a run."""

    rms_speed: (
        float  # root of the mean square of all speeds in the last part, rad/s and m/s; nan: there were no numbers
    )
    warnings: int  # of MuJoCo's own
    resets: int  # to the reference position, by MuJoCo itself


def whole_run(
    model: mujoco.MjModel,
    drive: Drive,
    q: np.ndarray,
    u: np.ndarray,
    dt: float,
    integrator: str,
    lasts: float,
    last: float,
    speed: np.ndarray | float = 0.0,
) -> WholeRun:
    """A run of so many seconds from q, by default at rest, under u of each actuator, which stays; judged in its last seconds.

    u stands in controls, and in activations. Where MuJoCo resets, the controls and the speed are given anew.
    """
    m = model
    own = m.opt.timestep, m.opt.integrator
    m.opt.timestep, m.opt.integrator = dt, INTEGRATORS[integrator]
    data, controls = mujoco.MjData(m), np.zeros(m.nu)
    data.qpos[:], data.qvel[:] = q, speed
    for i, (one, value) in enumerate(zip(drive.actuators, u)):
        place, inputs = control_of(m, i)
        if inputs == 1:
            controls[place] = 0.0 if one.dynamics == "integrator" else value
        if one.dynamics != "none":
            data.act[m.actuator_actadr[i]] = value
    steps, squares, warnings, resets, seen = max(1, round(lasts / dt)), [], 0, 0, 0
    judged = steps - max(1, round(last / dt))
    for step in range(steps):
        before = data.time
        data.ctrl[:] = controls
        mujoco.mj_step(m, data)
        number = int(data.warning.number.sum())
        if data.time <= before:  # it begins to count anew
            resets, seen = resets + 1, 0
            data.qvel[:] = speed
        warnings, seen = warnings + number - seen, number
        if step >= judged:
            squares.append(data.qvel @ data.qvel / m.nv)
    m.opt.timestep, m.opt.integrator = own
    return WholeRun(float(np.sqrt(np.mean(squares))), warnings, resets)
