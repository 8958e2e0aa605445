"""The three claims of the assignment about the arm that is held by a constant torque and integrated by RK4: runs.

1: it leaves a posture because of rounding. 2: with a finer step it leaves to the other side. 3: it stays at another posture.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ...engines import Engine
from ...judge.run import LEFT, departure, deviation, number_or_none
from ...robots import Claims, Robot
from ...truth.linear import Held, held
from .departure import own_torque, predicted, residual, variants
from .subjects import rk4_of_both

CLEAR_ULPS = 16  # of each component: a push that rounding of the bias on the way cannot turn round
VARIANT, NEAREST = "variant", "nearest to own bias"  # names of torques
CLEAR_TORQUES = (f"{CLEAR_ULPS} ulps up", f"{CLEAR_ULPS} ulps down")
STEP_COUNTS = (32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384)  # in a run of the claims
PRINTED_COUNTS = (64, 256, 1024, 4096)
ONE_ULP, FOUR_DECIMALS = "one ulp off", "four decimals"
NEAR_TORQUES = {ONE_ULP: lambda own: np.nextafter(own, np.inf), FOUR_DECIMALS: lambda own: own.round(4)}
STEPS_BEYOND = (0.3, 0.3125, 1 / 3, 0.4, 0.5, 0.625, 1.0)  # s, about the limit of RK4
RUN_BEYOND = 4000  # steps
COUNTS_WITHIN = tuple(range(1, 65))  # steps in a run of the claims
DIVERGED_RATE = 1e6  # rad/s: a run that is faster has diverged
FREE_STEP, FREE_TIME = 0.2, 2000.0  # s, of a run without torque, which RK4's own damping brings to rest


def watched(claims: Claims) -> float:
    """The duration of a run that is examined for departure, s: twice a run of the claims."""
    return 2.0 * claims.duration


def ulps_of(robot: Robot) -> list[str]:
    """The columns of ulps, one for each joint."""
    return [f"ulps_{joint}" for joint in robot.joints]


def holding_torques(engines: Mapping[str, Engine], robot: Robot) -> list[dict]:
    """Claim 1: all torques within one ulp of TMT's holding torque by RK4; then own biases; then 16 ulps.

    push_rad_per_s2: what the residual, the torque beyond the one that holds, does to the fastest unstable mode.
    residual_ulps: the residual in units of the last place of the largest torque.
    """
    claims, at = robot.claims, held(robot, robot.claims.left)
    steps = round(watched(claims) / claims.dt)
    within = variants(at.tau)
    names = [*(f"{VARIANT} {k}" for k in range(1, len(within) + 1)), NEAREST, *CLEAR_TORQUES]
    rows = []
    for method in rk4_of_both(engines):
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
                "claim": 1, "scene": at.name, "engine": method.engine, "method": method.name, "dt_s": claims.dt,
                "torque": names[k], **bits, "push_rad_per_s2": float(pushes(at) @ off[k]), "predicted_s": expected[k],
                "observed_s": left, "direction": side(path, left, claims.dt), "moved_rad": number_or_none(deviation(path, at.q)),
                "residual_ulps": number_or_none(np.abs(off[k]).max() / np.spacing(np.abs(at.tau).max())),
            })  # fmt: skip
    return rows


def side(path: np.ndarray, left: float | None, dt: float) -> int | None:
    """The side of its start on which the first joint is at departure: 1 larger, -1 smaller; None: never, or NaN."""
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
    """A difference of torques counted in units of the last place of the torque; None if it is not a number."""
    counts = [float(d / np.spacing(abs(t))) for d, t in zip(difference, tau)]
    return [round(count) if np.isfinite(count) else None for count in counts]


def finer_steps(engines: Mapping[str, Engine], robot: Robot, counts: Sequence[int] = STEP_COUNTS) -> list[dict]:
    """Claim 2: departure under RK4 against the step, the torque one ulp off to either side at the first joint.

    moved_rad: the largest movement in a run of the claims; step_rad: the largest dt |qd| by then; half_ulp_rad: half
    a unit in the last place of the angle that it would have to change. predicted_s: by the linear map, which does not round here.
    """
    claims, at = robot.claims, held(robot, robot.claims.left)
    rest, first, rows = np.zeros_like(at.q), ulps_of(robot)[0], []
    for method in rk4_of_both(engines):
        own, dynamics = own_torque(method, engines, at), engines[method.engine].of(at.case)
        for sign in (1.0, -1.0):
            tau = own.copy()
            tau[0] = np.nextafter(own[0], sign * np.inf)
            off = residual(method, engines, at, tau)
            for count in counts:
                dt = claims.duration / count
                motion = dynamics.run(at.q, rest, tau, dt, round(watched(claims) / dt), method.name)
                left = departure(motion.t, motion.q)
                i = int(np.argmax(np.abs(motion.v[count]) / np.spacing(np.abs(at.q))))
                expected = predicted(at, method.scheme, dt, rest[None], off[None], watched(claims), rounded=False)
                rows.append({
                    "claim": 2, "scene": at.name, "engine": method.engine, "method": method.name, "dt_s": dt, first: int(sign),
                    "push_rad_per_s2": float(pushes(at) @ off), "predicted_s": expected[0], "observed_s": left,
                    "direction": side(motion.q, left, dt), "moved_rad": number_or_none(deviation(motion.q[: count + 1], at.q)),
                    "step_rad": number_or_none(dt * abs(motion.v[count, i])),
                    "half_ulp_rad": 0.5 * float(np.spacing(abs(at.q[i]))),
                })  # fmt: skip
    return rows


def printed_torque(engines: Mapping[str, Engine], robot: Robot, counts: Sequence[int] = PRINTED_COUNTS) -> list[dict]:
    """Departure under the printed torque against the step."""
    claims, at = robot.claims, held(robot, robot.claims.left)
    tau = np.array(next(printed.values for printed in robot.printed if printed.item == claims.printed_torque))
    rest, rows = np.zeros_like(at.q), []
    for method in rk4_of_both(engines):
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


def kept(
    engines: Mapping[str, Engine], robot: Robot, steps: int = RUN_BEYOND, counts: Sequence[int] = COUNTS_WITHIN
) -> dict:
    """Claim 3: RK4 at the posture that is kept, below and beyond its limit, and whether it can end at the claimed posture.

    rows: dt, torque (one ulp off; to four decimals), growth per step, departure, the time of divergence.
    leaves: of each engine the numbers of steps in a run of the claims with which it leaves, the torque one ulp off.
    acceleration_at_end, free_from_end: of each engine, under the torque that holds, and of a free run at its end.
    """
    claims, at = robot.claims, held(robot, robot.claims.kept)
    end, rest = robot.posture(claims.end), np.zeros_like(at.q)
    rows, leaves, pushed, free = [], {}, {}, {}
    for method in rk4_of_both(engines):
        own, dynamics = own_torque(method, engines, at), engines[method.engine].of(at.case)
        for name, off in NEAR_TORQUES.items():
            for dt in STEPS_BEYOND:
                with np.errstate(over="ignore", invalid="ignore"):
                    motion = dynamics.run(at.q, rest, off(own), dt, steps, method.name)
                fast = ~(np.abs(motion.v).max(axis=1) < DIVERGED_RATE)  # no number from there on is motion
                rows.append({
                    "claim": 3, "scene": at.name, "engine": method.engine, "method": method.name, "dt_s": dt, "torque": name,
                    "growth": float(at.growth(method.scheme, dt)), "observed_s": departure(motion.t, motion.q),
                    "diverged_at_s": float(dt * np.argmax(fast)) if fast.any() else None,
                    "moved_rad": None if fast.any() else number_or_none(deviation(motion.q, at.q)), "run_s": dt * steps,
                })  # fmt: skip
        leaves[method.engine] = []
        for count in counts:
            with np.errstate(over="ignore", invalid="ignore"):
                tau = NEAR_TORQUES[ONE_ULP](own)
                motion = dynamics.run(at.q, rest, tau, claims.duration / count, count, method.name)
            if not deviation(motion.q, at.q) < LEFT:
                leaves[method.engine].append(count)
        pushed[method.engine] = dynamics.acceleration(end, rest, at.tau)
        motion = dynamics.run(at.q, rest, rest, FREE_STEP, round(FREE_TIME / FREE_STEP), method.name)
        off = np.remainder(motion.q[-1] - end + np.pi, 2 * np.pi) - np.pi
        free[method.engine] = number_or_none(np.abs(off).max())
    return {
        "rows": rows, "leaves": leaves, "limit": at.limit("rk4")[1] or 0.0,
        "fastest": float(np.abs(at.modes[0]).max()), "acceleration_at_end": pushed, "free_from_end": free,
    }  # fmt: skip
