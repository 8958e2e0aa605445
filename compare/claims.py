"""The assignment's three claims about its held arm, each repeated in both engines and held against a prediction."""

import numpy as np

import tmt

from .departure import own_torque, predicted, stuck, variants
from .linear import held
from .motion import LEFT, departure
from .parties import Party, farthest
from .published import ITEMS
from .scenes import posture

PAIR = (Party("TMT", "rk4"), Party("MuJoCo", "RK4"))
DT = 5 / 64  # s, the assignment's step
LONG = 10.0  # s, twice the assignment's run
STEP_COUNTS = (32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384)  # over 5 s
BEYOND = (0.3, 0.3125, 1 / 3, 0.4, 0.5, 0.625, 1.0)  # s, from just below RK4's limit at bent
FREE_STEP, FREE_TIME = 0.2, 2000.0  # s, of a run without torque, which RK4's own damping brings to rest


def holding_torques(mujoco) -> list:
    """All 27 torques within one ulp of TMT's holding torque of ball catch, RK4 at 5/64 s, in both engines.

    push_rad_per_s2: the share of the residual, the torque less the one that holds, in the fastest unstable mode.
    """
    at = held("ball catch", posture("ball catch"))
    measure = np.linalg.inv(at.modes[1])[0]
    measure = (measure * np.exp(-1j * np.angle(at.modes[1][0, 0]))).real  # > 0: the shoulder moves to larger alpha
    measure /= np.linalg.norm(measure[3:])
    tau = variants(at.tau)
    rest = np.zeros_like(tau)
    steps = round(LONG / DT)
    rows = []
    for party in PAIR:
        own = own_torque(party, mujoco, at)
        q, _ = party.run(mujoco, at.model, at.q + rest, rest, tau, DT, steps)
        for torque, path in zip(tau, q):
            left = departure(DT * np.arange(steps + 1), path)
            residual = torque - own
            push = float(measure[3:] @ np.linalg.solve(tmt.mass_matrix(at.q), residual))
            away = None if left is None else path[round(left / DT)] - at.q
            rows.append({
                "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": DT,
                "ulps_alpha": ulps(residual, at.tau)[0], "ulps_beta": ulps(residual, at.tau)[1],
                "ulps_gamma": ulps(residual, at.tau)[2], "push_rad_per_s2": push,
                "predicted_s": predicted(at, party.scheme, DT, np.zeros(3), residual) if residual.any() else None,
                "observed_s": left, "direction": None if away is None else int(np.sign(away[0])),
            })  # fmt: skip
    return rows


def ulps(residual, tau) -> list[int]:
    """A difference of torques counted in units of the last place of the torque."""
    return [round(float(r / np.spacing(abs(t)))) for r, t in zip(residual, tau)]


def finer_steps(mujoco) -> list:
    """Departure from ball catch under RK4 against the step, the torque one ulp off to either side in alpha.

    moved_rad: how far the arm has moved after 5 s; step_rad: the largest dt |qd| by then; half_ulp_rad: half a unit in
    the last place of the angle that it would have to change.
    """
    at = held("ball catch", posture("ball catch"))
    rows = []
    for party in PAIR:
        own = own_torque(party, mujoco, at)
        for sign in (1.0, -1.0):
            tau = own.copy()
            tau[0] = np.nextafter(own[0], sign * np.inf)
            for count in STEP_COUNTS:
                dt = 5.0 / count
                q, qd = party.run(mujoco, at.model, at.q, np.zeros(3), tau, dt, 2 * count)
                left = departure(dt * np.arange(2 * count + 1), q)
                steps_rad = dt * np.abs(qd[count]) / (0.5 * np.spacing(np.abs(at.q)))
                i = int(np.argmax(steps_rad))
                rows.append({
                    "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": dt, "ulps_alpha": int(sign),
                    "predicted_s": predicted(at, party.scheme, dt, np.zeros(3), tau - own, LONG), "observed_s": left,
                    "direction": None if left is None else int(np.sign(q[round(left / dt), 0] - at.q[0])),
                    "moved_rad": farthest(q[count], at.q), "step_rad": dt * abs(float(qd[count, i])),
                    "half_ulp_rad": 0.5 * float(np.spacing(abs(at.q[i]))),
                    "stuck_s": stuck(at, dt, np.zeros(3), tau - own),
                })  # fmt: skip
    return rows


def four_decimals(mujoco) -> list:
    """Departure from ball catch under the torque as it is printed, to four decimals, against the step."""
    at = held("ball catch", posture("ball catch"))
    tau = np.array(next(item.values for item in ITEMS if item.item == "h"))
    rows = []
    for party in PAIR:
        for count in (64, 256, 1024, 4096):
            dt = 5.0 / count
            q, _ = party.run(mujoco, at.model, at.q, np.zeros(3), tau, dt, count)
            rows.append({
                "scene": "ball catch, printed torque", "engine": party.engine, "method": party.method, "dt_s": dt,
                "perturbation_rad": float(np.abs(tau - at.tau).max()),
                "predicted_s": predicted(at, party.scheme, dt, np.zeros(3), tau - own_torque(party, mujoco, at)),
                "observed_s": departure(dt * np.arange(count + 1), q),
            })  # fmt: skip
    return rows


def bent(mujoco) -> dict:
    """RK4 at bent, below and beyond its limit of 2 sqrt 2 over the fastest mode, and what could end at hanging.

    rows: dt, torque (one ulp off; to four decimals), growth per step, when it leaves, the fastest rate at the end or the
    time of divergence. within_5_s: for each torque the coarsest number of steps in 5 s at which nothing leaves.
    """
    at = held("bent", posture("bent"))
    torques = {"one ulp off": lambda own: np.nextafter(own, np.inf), "four decimals": lambda own: own.round(4)}
    rows, stays, paths = [], {}, {}
    for party in PAIR:
        own = own_torque(party, mujoco, at)
        for name, off in torques.items():
            for dt in BEYOND:
                steps = 4000
                with np.errstate(over="ignore", invalid="ignore"):
                    q, qd = party.run(mujoco, at.model, at.q, np.zeros(3), off(own), dt, steps)
                fast = ~(np.abs(qd).max(axis=1) < 1e6)  # no number from there on is motion
                left = departure(dt * np.arange(steps + 1), q)
                rows.append({
                    "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": dt, "torque": name,
                    "growth": float(at.growth(party.scheme, dt)), "observed_s": left,
                    "steps": None if left is None else round(left / dt),
                    "diverged_at_s": float(dt * np.argmax(fast)) if fast.any() else None,
                    "largest_rad": None if fast.any() else farthest(q, at.q),
                })  # fmt: skip
                paths[(party.engine, name, dt)] = np.abs(np.where(fast[:, None], np.nan, q) - at.q).max(axis=1)[:200]
            leave = []
            for count in range(1, 65):
                with np.errstate(over="ignore", invalid="ignore"):
                    q, _ = party.run(mujoco, at.model, at.q, np.zeros(3), off(own), 5.0 / count, count)
                leave += [count] if not farthest(q, at.q) < LEFT else []
            stays[(party.engine, name)] = max(leave, default=0)
    hanging = posture("hanging")
    _, free, rates = tmt.simulate(at.q, np.zeros(3), np.zeros(3), FREE_STEP, round(FREE_TIME / FREE_STEP))
    return {
        "rows": rows, "paths": paths, "leaves_within_5_s": stays,
        "acceleration_at_hanging": tmt.acceleration(hanging, np.zeros(3), at.tau),
        "free_from_hanging": float(np.abs(np.remainder(free[-1] - hanging + np.pi, 2 * np.pi) - np.pi).max()),
        "free_rate": float(np.abs(rates[-1]).max()), "tau": at.tau,
    }  # fmt: skip
