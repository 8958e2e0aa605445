"""The error of MuJoCo's response to a step of all servo targets."""

import numpy as np
from scipy.linalg import expm

from ....engines.mujoco import Reading
from ....truth.driven import Posture
from .predicted import acting_at

LASTS = 0.2  # s, of a response; at least one step
RESPONSE_SIZE = 1e-4  # rad or m: how far a response, and the posture at rest, may move
RESPONSE_LEAST = 1e-3  # of the largest response: joints of a unit that move less count as if they did so much
RESPONSE_MOST = 100.0  # fold, of the largest response
MOST_STEPS = 10_000  # of a run
CURVE_FROM, CURVE_STEPS = 16.0, 16  # of a curve: the file's step over its first; how many


def response_error(at: Posture, integrator: str, reading: Reading, dt: float | None = None) -> float | None:
    """The largest difference from the exact response over the largest response, in 0.2 s, a ratio. dt: by default the file's.

    Of rad and of m separately, the larger of both; None: no servo, nothing moves, it diverged, or more than 10,000 steps.
    The targets of all servos jump by the same length, so that nothing moves by more than 1e-4 rad or m; u of those with an
    activation jumps too. Exact: the matrix exponential of the linear equations. Half of the difference of two runs, there and
    back, has neither an offset nor squares.
    """
    dt = dt or reading.dt
    jump, force = jump_of(at)
    if not jump.any() or LASTS / dt > MOST_STEPS:
        return None
    steps = max(1, round(LASTS / dt))
    exact, end = exact_response(at, force, dt, steps)
    largest = max(np.abs(exact).max(), np.abs(end).max())
    if not largest > 0.0:
        return None
    acting, size = acting_at(reading, at), RESPONSE_SIZE / largest
    with np.errstate(over="ignore", invalid="ignore"):
        rest = at.q, at.u, dt, integrator, [steps]
        there, back = (next(acting.deviations(*rest, jump=by * jump)) for by in (size, -size))
        off = np.abs((there - back)[:, at.kept] / (2.0 * size) - exact)
    if not off.max() <= RESPONSE_MOST * largest:  # or no number
        return None
    units, most = np.array(at.robot.coordinates.units)[at.kept], np.abs(np.vstack([exact, end])).max(axis=0)
    of_units = [(off[:, units == unit].max(), most[units == unit].max()) for unit in set(units)]
    return float(max(apart / max(size, RESPONSE_LEAST * largest) for apart, size in of_units))


def curve(at: Posture, integrator: str, limit: float | None, reading: Reading) -> list[tuple[float, float]]:
    """(dt, error) from well below the file's step up to the limit, s; without one up to the whole response.

    Empty where each step up to the limit would be too short.
    """
    end = min(limit or LASTS, LASTS)
    first = max(min(reading.dt, end) / CURVE_FROM, LASTS / MOST_STEPS)
    dts = np.geomspace(first, end, CURVE_STEPS).tolist() if first < end else []
    errors = [(dt, response_error(at, integrator, reading, dt)) for dt in dts]
    return [(dt, off) for dt, off in errors if off is not None]


def jump_of(at: Posture) -> tuple[np.ndarray, np.ndarray]:
    """By how much u of each actuator jumps so that all targets move by the same length, 1 rad or m, (k,); the force, (n,).

    The force is that on the speeds of Posture.small: a free base gives way.
    """
    along, M, kept = at.driven.along(at.q), at.whole.M, at.kept
    jump, force = np.zeros(len(at.u)), np.zeros(len(M))
    for i, (actuator, u, length) in enumerate(zip(at.robot.drive.actuators, at.u, along.lengths)):
        gain = actuator.gain[0] + actuator.gain[1] * length
        if actuator.is_servo and gain and i not in at.cut:
            jump[i] = actuator.stiffness(u) / gain
            force += gain * jump[i] * along.moments[i]
    free = [k for k in at.base if k not in kept]
    return jump, force[kept] - M[np.ix_(kept, free)] @ np.linalg.solve(M[np.ix_(free, free)], force[free])


def exact_response(at: Posture, force: np.ndarray, dt: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Movements under a constant force on the speeds of Posture.small after each step, (steps, n), and at rest then, (n,).

    Without stiffness in some direction the rest is that in the others.
    """
    n = len(force)
    # the state is movement, speed, and a constant 1 that pushes
    A = np.zeros((2 * n + 1, 2 * n + 1))
    A[:n, n : 2 * n] = np.eye(n)
    by_place, by_speed, by_force = at.small.equations(dt)
    A[n : 2 * n] = np.hstack([by_place, by_speed, by_force @ force[:, None]])
    step, state = expm(dt * A), np.eye(2 * n + 1)[-1]
    states = []
    for _ in range(steps):
        state = step @ state
        states.append(state[:n])
    return np.array(states), np.linalg.lstsq(-by_place, by_force @ force, rcond=1e-9)[0]
