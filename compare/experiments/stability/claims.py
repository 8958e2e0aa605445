"""The runs that are claimed of a robot held at a posture that it leaves: torques in the last bit, finer steps, printed torque."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...engines import Engine, Method, same_scheme
from ...judge.run import departure, deviation, number_or_none
from ...robots import Claims, Robot
from ...truth.linear import Held, held
from .departure import predicted
from .torques import own_torque, residual, variants

CLEAR_ULPS = 16  # of each component: a push that rounding of the bias on the way cannot turn round
VARIANT, NEAREST = "variant", "nearest to own bias"  # names of torques
CLEAR_TORQUES = (f"{CLEAR_ULPS} ulps up", f"{CLEAR_ULPS} ulps down")
STEP_COUNTS = (32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384)  # in a run of the claims
PRINTED_COUNTS = (64, 256, 1024, 4096)


def of_claims(engines: Mapping[str, Engine]) -> tuple[Method, Method]:
    """What the claims are about: RK4 of tmt and of MuJoCo."""
    rk4 = same_scheme(engines, engines["mujoco"].methods["RK4"], "tmt")
    return rk4, same_scheme(engines, rk4, "mujoco")


def watched(claims: Claims) -> float:
    """For how long a posture is looked at, s: twice a run of the claims."""
    return 2.0 * claims.duration


def ulps_of(robot: Robot) -> list[str]:
    """The columns of ulps, one for each joint."""
    return [f"ulps_{joint}" for joint in robot.joints]


def holding_torques(engines: Mapping[str, Engine], robot: Robot) -> list[dict]:
    """All torques within one ulp of TMT's holding torque of the posture that is left, by RK4; then own biases; then 16 ulps.

    push_rad_per_s2: what the residual, the torque beyond the one that holds, does to the fastest unstable mode.
    residual_ulps: the residual in units of the last place of the largest torque.
    """
    claims, at = robot.claims, held(robot, robot.claims.left)
    steps = round(watched(claims) / claims.dt)
    within = variants(at.tau)
    names = [*(f"{VARIANT} {k}" for k in range(1, len(within) + 1)), NEAREST, *CLEAR_TORQUES]
    rows = []
    for method in of_claims(engines):
        own = own_torque(method, engines, at)
        aside = CLEAR_ULPS * np.spacing(np.abs(own)) * np.sign(pushes(at))
        tau = np.vstack([within, own, own + aside, own - aside])
        rest = np.zeros_like(tau)
        off = residual(method, engines, at, tau)
        motion = engines[method.engine].of(at.case).run(at.q + rest, rest, tau, claims.dt, steps, method.name)
        expected = predicted(at, method.scheme, claims.dt, rest, off)
        for k, path in enumerate(motion.q):
            left = departure(motion.t, path)
            bits = dict(zip(ulps_of(robot), ulps(tau[k] - at.tau, at.tau)))
            rows.append({
                "scene": at.name, "engine": method.engine, "method": method.name, "dt_s": claims.dt,
                "torque": names[k], **bits, "push_rad_per_s2": float(pushes(at) @ off[k]), "predicted_s": expected[k],
                "observed_s": left, "direction": side(path, left, claims.dt),
                "largest_residual_n_m": number_or_none(np.abs(off[k]).max()), "moved_rad": number_or_none(deviation(path, at.q)),
                "residual_ulps": number_or_none(np.abs(off[k]).max() / np.spacing(np.abs(at.tau).max())),
            })  # fmt: skip
    return rows


def side(path: np.ndarray, left: float | None, dt: float) -> int | None:
    """To which side of its start the first joint is when the posture is left: 1 larger, -1 smaller; None: never, or NaN."""
    away = np.nan if left is None else path[round(left / dt), 0] - path[0, 0]
    return int(np.sign(away)) if np.isfinite(away) else None


def pushes(at: Held) -> np.ndarray:
    """What a torque does to the fastest unstable mode, 1/(kg m2), (n,): its product with a torque is in rad/s2.

    The left eigenvector, its rates scaled to length 1; positive where the first joint moves to a larger angle.
    """
    n, vectors = len(at.q), at.modes[1]
    measure = np.linalg.inv(vectors)[0] * np.sign(vectors[0, 0].real)
    return (measure[n:] / np.linalg.norm(measure[n:])).real @ np.linalg.inv(at.mass_matrix)


def ulps(difference: np.ndarray, tau: np.ndarray) -> list[int | None]:
    """A difference of torques counted in units of the last place of the torque; None if it is no number."""
    counts = [float(d / np.spacing(abs(t))) for d, t in zip(difference, tau)]
    return [round(count) if np.isfinite(count) else None for count in counts]


def finer_steps(engines: Mapping[str, Engine], robot: Robot, counts: Sequence[int] = STEP_COUNTS) -> list[dict]:
    """Departure under RK4 against the step, the torque one ulp off to either side at the first joint.

    moved_rad: how far the robot has moved after a run of the claims; step_rad: the largest dt |qd| by then; half_ulp_rad: half
    a unit in the last place of the angle that it would have to change. predicted_s: by the linear map, which does not round here.
    """
    claims, at = robot.claims, held(robot, robot.claims.left)
    rest, first, rows = np.zeros_like(at.q), ulps_of(robot)[0], []
    for method in of_claims(engines):
        own, dynamics = own_torque(method, engines, at), engines[method.engine].of(at.case)
        for sign in (1.0, -1.0):
            tau = own.copy()
            tau[0] = np.nextafter(own[0], sign * np.inf)
            off = residual(method, engines, at, tau)
            for count in counts:
                dt = claims.duration / count
                steps = round(watched(claims) / dt)
                motion = dynamics.run(at.q, rest, tau, dt, steps, method.name)
                left = departure(motion.t, motion.q)
                i = int(np.argmax(np.abs(motion.v[count]) / np.spacing(np.abs(at.q))))
                expected = predicted(at, method.scheme, dt, rest[None], off[None], watched(claims), rounded=False)
                rows.append({
                    "scene": at.name, "engine": method.engine, "method": method.name, "dt_s": dt, first: int(sign),
                    "push_rad_per_s2": float(pushes(at) @ off), "predicted_s": expected[0], "observed_s": left,
                    "direction": side(motion.q, left, dt), "moved_rad": number_or_none(deviation(motion.q[: count + 1], at.q)),
                    "step_rad": number_or_none(dt * abs(motion.v[count, i])),
                    "half_ulp_rad": 0.5 * float(np.spacing(abs(at.q[i]))),
                })  # fmt: skip
    return rows


def printed_torque(engines: Mapping[str, Engine], robot: Robot, counts: Sequence[int] = PRINTED_COUNTS) -> list[dict]:
    """Departure under the torque as it is printed against the step."""
    claims, at = robot.claims, held(robot, robot.claims.left)
    tau = np.array(next(printed.values for printed in robot.printed if printed.item == claims.printed_torque))
    rest, rows = np.zeros_like(at.q), []
    for method in of_claims(engines):
        off = residual(method, engines, at, tau)
        for count in counts:
            dt = claims.duration / count
            motion = engines[method.engine].of(at.case).run(at.q, rest, tau, dt, count, method.name)
            rows.append({
                "scene": f"{at.name}, printed torque", "engine": method.engine, "method": method.name, "dt_s": dt,
                "perturbation_rad": float(np.abs(tau - at.tau).max()),
                "predicted_s": predicted(at, method.scheme, dt, rest[None], off[None])[0],
                "observed_s": departure(motion.t, motion.q),
            })  # fmt: skip
    return rows
