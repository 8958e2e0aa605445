"""Why a held arm leaves its posture: the acceleration that the torque leaves, grown by RK4's own linear map."""

import numpy as np

import tmt
from tmt.methods import METHODS

from .band import slope_rounding
from .exact_motion import stiffness
from .motion import LEFT

SHORT = 1e-6  # s: a step in which the arm does not move
STEADY = 1e-3  # per second: a slower growth is none in these runs
NEAR = 2  # steps: so near the time that is predicted from rounding, rounding is the cause


def pushes(scene, engine) -> dict[str, np.ndarray]:
    """The acceleration that each engine finds at the start under the torque that is to hold, rad/s2, (n,)."""
    q, qd = scene.start
    return {
        "TMT": tmt.simulate(q, qd, scene.tau, SHORT, 1, "rk4", scene.model)[2][1] / SHORT,
        "MuJoCo": engine.acceleration(q, qd, scene.tau),
    }


def allowed(scene) -> float:
    """How large that acceleration may be by rounding alone, rad/s2."""
    (q, qd), dt = scene.start, scene.duration / scene.steps
    return float(slope_rounding(METHODS["rk4"], scene.model, q[None], qd[None], scene.tau, dt)[2][0])


def linear_map(scene) -> tuple[np.ndarray, np.ndarray]:
    """J and G of x+ = J x + G a: one step of RK4 of the linear motion about the start, pushed by a constant a, rad/s2.

    x: deviations of angles and rates; J (2n, 2n), G (2n, n). xdd = -Mbar^-1 (K x + D xd) + a.
    """
    q, n, dt = scene.start[0], len(scene.hinges), scene.duration / scene.steps
    inverse = np.linalg.inv(tmt.mass_matrix(q, scene.model))
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:] = -inverse @ np.hstack([stiffness(scene.model, q), np.diag(scene.model.damping)])
    Z = dt * A
    pushed = dt * (np.eye(2 * n) + Z / 2 + Z @ Z / 6 + Z @ Z @ Z / 24)
    return np.eye(2 * n) + A @ pushed, pushed[:, n:]


def predicted(scene, push) -> float | None:
    """When the linear map has the arm 0.1 rad away under a constant push, rad/s2: s; None: not in this scene."""
    J, G = linear_map(scene)
    state = np.zeros(len(J))
    for k in range(1, scene.steps + 1):
        state = J @ state + G @ push
        if np.abs(state[: len(push)]).max() > LEFT:
            return k * scene.duration / scene.steps
    return None


def told(scene, engine, left) -> list[str]:
    """A sentence for each engine: what the torque leaves, what becomes of it, when the arm left, and what the cause is."""
    J, _ = linear_map(scene)
    rate = np.log(np.abs(np.linalg.eigvals(J)).max()) / (scene.duration / scene.steps)
    may = allowed(scene)
    grows = f"small deviations grow by up to e^{rate:.1f} per second" if rate > STEADY else "no small deviation grow"
    sentences = [f"The linear map of RK4 lets {grows}."]
    for name, push in pushes(scene, engine).items():
        if not np.isfinite(push).all():
            sentences.append(f"{name} gives no acceleration there.")
            continue
        size, at = float(np.abs(push).max()), predicted(scene, push)
        away = (
            f"be {LEFT} rad away at {at:.2f} s"
            if at is not None
            else f"stay within {LEFT} rad for {scene.duration:g} s"
        )
        sentences.append(
            f"{name}: the torque leaves an acceleration of {size:.1e} rad/s2 (rounding allows {may:.1e}); by that map alone the "
            f"arm would {away}; it {words(left[name])}{cause(scene, size, may, at, left[name])}."
        )
    return sentences


def words(left) -> str:
    """Whether and when a held arm left, in words."""
    return f"stays within {LEFT} rad" if left is None else f"is {LEFT} rad away at {left:.2f} s"


def cause(scene, size, may, at, left) -> str:
    """The cause of leaving, in words; nothing where the arm stays."""
    if left is None:
        return ""
    if size > may:
        return ": that is no rounding"
    steps = np.inf if at is None else abs(left - at) * scene.steps / scene.duration
    return (
        ": the cause is rounding of the torque"
        if steps < NEAR + 0.5
        else ": rounding of the torque alone does not explain it"
    )
