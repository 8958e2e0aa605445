"""MuJoCo's own steps: their derivatives, runs with its automatic reset, and runs of a file's model as it is."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from ...robots.actuators import Drive
from .differences import of_steps
from .dynamics import Array, MujocoDynamics
from .names import INTEGRATORS, bit, control_of, element_name, output_of
from .step import activation_ranges

NUDGE = 1e-6  # of central differences, rad and rad/s
LITTLE = 1e-6  # of an activation at the start of a run that is pushed
STATE = mujoco.mjtState.mjSTATE_INTEGRATION  # all that a step depends on
BAD = [int(getattr(mujoco.mjtWarning, f"mjWARN_BADQ{what}")) for what in ("POS", "VEL", "ACC")]


def transition(
    dynamics: MujocoDynamics, q: np.ndarray, tau: np.ndarray, dt: float, integrator: str
) -> np.ndarray:
    """d(q, qd)+/d(q, qd) of one step of MuJoCo at rest, positions as movements, (2nv, 2nv), by central differences.

    q: (nq,) rad, m; tau: (nv,) N m.
    """
    n = len(dynamics.dofs)
    return of_steps(dynamics, q, np.zeros(n), tau, dt, integrator, NUDGE, centred=True)()[:, : 2 * n]


def left_to_itself(
    dynamics: MujocoDynamics, q: Array, qd: Array, tau: Array, dt: float, steps: int, integrator: str
) -> dict[str, Any]:
    """A run with MuJoCo's automatic reset: time (steps + 1,) s, of its own clock, q, qd; warnings: their number at the end."""
    model, data = dynamics.own_copy(dt, integrator, q, qd, tau)
    model.opt.disableflags &= ~bit("AUTORESET")
    path = [(0.0, q, qd)]
    for _ in range(steps):
        mujoco.mj_step(model, data)
        path.append((data.time, data.qpos[dynamics.qpos], data.qvel[dynamics.dofs]))
    time, positions, speeds = map(np.array, zip(*path))
    return {"time": time, "q": positions, "qd": speeds, "warnings": int(data.warning.number.sum())}


class WholeRun(NamedTuple):
    """A run of a file's model as it is."""

    speeds: np.ndarray  # root mean square of all speeds in each part, rad/s and m/s; NaN from where it fails
    failed_at: float | None  # s: MuJoCo warns of a bad number, resets it where it may; None: it runs on


def start_of(
    model: mujoco.MjModel,
    drive: Drive,
    key: str,
    push: np.ndarray,
    q: np.ndarray | None = None,
    controls: Sequence[float | None] = (),
) -> np.ndarray:
    """The state of a keyframe, or of qpos0 if the name is empty, with `push` (nv,) rad/s and m/s added to its speeds.

    q: other positions, (nq,), at rest. controls: u of each actuator, None: as it is.

    Where no controls are stated the targets of servos are the posture.
    """
    data = mujoco.MjData(model)
    if key:
        names = [element_name(model, "key", k) for k in range(model.nkey)]
        mujoco.mj_resetDataKeyframe(model, data, names.index(key))
    if q is not None:
        data.qpos[:], data.qvel[:] = q, 0.0
    data.qvel[:] += push
    mujoco.mj_fwdPosition(model, data)
    lengths = [data.actuator_length[output_of(model, i)] for i in range(len(drive.actuators))]
    values = drive.control(key, lengths)
    for i, (actuator, own) in enumerate(zip(drive.actuators, values.tolist())):
        value = own if not controls or controls[i] is None else controls[i]
        place, inputs = control_of(model, i)
        if inputs == 1:
            data.ctrl[place] = 0.0 if actuator.dynamics == "integrator" else value
        if actuator.dynamics != "none":
            data.act[model.actuator_actadr[i]] = value
    if push.any():  # activations, too: what is pushed nowhere stays where it is
        data.act[:] = np.clip(data.act + LITTLE, *activation_ranges(model))
    state = np.zeros(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def whole_run(
    model: mujoco.MjModel, start: np.ndarray, dt: float, integrator: str, lasts: float, parts: int
) -> WholeRun:
    """A run from start_of a model, with contacts, limits, friction, fluid and force ranges, for `lasts` s or until it fails."""
    m = mujoco.MjModel.__copy__(model)
    m.opt.timestep, m.opt.integrator = dt, INTEGRATORS[integrator]
    data, squares, count = mujoco.MjData(m), np.zeros(parts), max(1, round(lasts / parts / dt))
    mujoco.mj_setState(m, data, start, STATE)
    for step in range(parts * count):
        mujoco.mj_step(m, data)
        squares[step // count] += data.qvel @ data.qvel / m.nv / count
        if not np.isfinite(squares[step // count]) or data.warning.number[BAD].any():
            squares[step // count :] = np.nan
            return WholeRun(np.sqrt(squares), (step + 1) * dt)
    return WholeRun(np.sqrt(squares), None)
