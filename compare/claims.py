"""The assignment's claims about the arm held at ball catch, repeated in both engines and held against predictions."""

import numpy as np

import tmt

from .departure import near, own_torque, predicted, span, stuck, variants
from .linear import held
from .motion import departure
from .parties import Party, farthest, finite, value
from .published import ITEMS
from .scenes import posture

PAIR = (Party("TMT", "rk4"), Party("MuJoCo", "RK4"))
DT = 5 / 64  # s, the assignment's step
LONG = 10.0  # s, twice the assignment's run
STEP_COUNTS = (32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384)  # over 5 s


def holding_torques(mujoco) -> list:
    """All 27 torques within one ulp of TMT's holding torque of ball catch, RK4 at 5/64 s, and each engine's own bias.

    push_rad_per_s2: the share of the residual, the torque less the one that holds, in the fastest unstable mode.
    """
    at = held("ball catch", posture("ball catch"))
    measure = np.linalg.inv(at.modes[1])[0]
    measure = (measure * np.exp(-1j * np.angle(at.modes[1][0, 0]))).real  # > 0: the shoulder moves to larger alpha
    measure /= np.linalg.norm(measure[3:])
    steps = round(LONG / DT)
    rows = []
    for party in PAIR:
        own = own_torque(party, mujoco, at)
        tau = np.vstack([variants(at.tau), own])
        rest = np.zeros_like(tau)
        q, qd = party.run(mujoco, at.model, at.q + rest, rest, tau, DT, steps)
        for k, (torque, path) in enumerate(zip(tau, q)):
            left = departure(DT * np.arange(steps + 1), path)
            residual = torque - own
            push = float(measure[3:] @ np.linalg.solve(tmt.mass_matrix(at.q), residual))
            away = None if left is None else path[round(left / DT)] - at.q
            bits = dict(zip(("ulps_alpha", "ulps_beta", "ulps_gamma"), ulps(residual, at.tau)))
            rows.append({
                "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": DT,
                "torque": "own bias" if k == 27 else f"variant {k + 1}", **bits, "push_rad_per_s2": push,
                "predicted_s": predicted(at, party.scheme, DT, np.zeros(3), residual) if residual.any() else None,
                "observed_s": left, "direction": None if away is None else int(np.sign(away[0])),
                "first_step_rad_per_s": float(np.abs(qd[k, 1]).max()), "moved_rad": finite(farthest(path, at.q)),
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
                    "moved_rad": finite(farthest(q[count], at.q)), "step_rad": finite(dt * abs(qd[count, i])),
                    "half_ulp_rad": 0.5 * float(np.spacing(abs(at.q[i]))),
                    "stuck_s": finite(stuck(at, dt, np.zeros(3), tau - own)),
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


def judge(result, torques, finer, printed) -> None:
    """Checks, tables and sentences about the first two published claims, and the torque as it is printed."""
    result.tables["stability_torques"] = torques
    result.tables.setdefault("departure", []).extend(printed)
    at = held("ball catch", posture("ball catch"))
    measure = np.linalg.inv(at.modes[1])[0]
    share = np.abs(measure[3:] @ np.linalg.inv(tmt.mass_matrix(at.q))) / np.linalg.norm(measure[3:])
    noise = float(share @ (0.5 * np.spacing(np.abs(at.tau))))  # what rounding of the bias can push, half an ulp each
    told = []
    for party in PAIR:
        rows = [row for row in torques if row["engine"] == party.engine]
        clear = [row for row in rows if abs(row["push_rad_per_s2"]) > noise]
        wrong = sum(row["direction"] != np.sign(row["push_rad_per_s2"]) for row in clear)
        own, rows = rows[-1], rows[:-1]
        where = f"ball catch, {party.label}, 27 torques"
        result.check(where, "departures against the residual's sign on the unstable mode", wrong, 0.0, "runs")
        if own["first_step_rad_per_s"] == 0.0:  # else no torque within two ulps is the bias of the compiled code
            result.check(where, "movement under the engine's own bias", value(own["moved_rad"]), 0.0, "rad")
        times = [row["observed_s"] for row in rows if row["observed_s"] is not None]
        up = sum(row["direction"] == 1 for row in rows)
        told.append(
            f"{party.engine}: {len(times)} leave, after {span(times)}, {up} to larger alpha, {len(times) - up} to "
            f"smaller, {27 - len(times)} never (under its own bias it "
            f"{'never leaves' if own['observed_s'] is None else 'leaves'}); the direction is the sign of the residual "
            f"on the unstable mode in all {len(clear)} cases where that residual is more than the bias is rounded by, "
            f"{noise:.1e} rad/s2"
        )
    result.notes.append(
        "Claim 1, reproduced: held at ball catch by RK4 at 5/64 s under each of the 27 torques within one unit in the "
        f"last place of TMT's. {'. '.join(told)}. The cause is rounding, as the assignment says: of the torque."
    )
    if finer:
        tell_finer(result, finer)
    for row in printed:
        where = f"{row['scene']}, {row['engine']} {row['method']}, dt = {row['dt_s']:.4g} s"
        known = None not in (row["observed_s"], row["predicted_s"])
        off = abs(row["observed_s"] - row["predicted_s"]) if known else np.nan
        result.check(where, "departure, observed - predicted", off, near(row["dt_s"]), "s")
    times = [row["observed_s"] for row in printed]
    result.notes.append(
        f"The torque as printed, four decimals, lasts {span(times)} at ball catch, whatever the step and the engine: "
        "the original cannot have used it for its Figure 2."
    )


def tell_finer(result, finer) -> None:
    """Claim 2: smaller steps."""
    result.tables["stability_finer_steps"] = finer
    finest = min(row["dt_s"] for row in finer)
    for party in PAIR:
        rows = [row for row in finer if row["engine"] == party.engine]
        moved = max(value(row["moved_rad"]) for row in rows if row["dt_s"] == finest)
        where = f"ball catch, {party.label}, torque one ulp off"
        result.check(where, "movement in 5 s at 16384 steps", moved, 0.0, "rad")
        turned = sum(row["direction"] not in (None, row["ulps_alpha"]) for row in rows)
        result.check(where, "departures against the sign of the torque's error", turned, 0.0, "runs")
    rows = [row for row in finer if row["engine"] == "TMT" and row["ulps_alpha"] == 1]
    times = ", ".join(
        f"{round(5 / row['dt_s'])}: " + ("never" if row["observed_s"] is None else f"{row['observed_s']:.2f} s")
        for row in rows
    )
    last = rows[-1]
    result.notes.append(
        "Claim 2, explained: with the torque one ulp off in alpha the arm leaves to the side of the error at every "
        "step in both engines, so a smaller step reverses nothing; a reversal is another rounding of the torque, and "
        f"luck. Steps in 5 s and time to leave (TMT, within {LONG:g} s): {times}. Fine steps delay: what a step adds "
        f"to an angle, dt qd, is lost while it is below half a unit in its last place. At {round(5 / last['dt_s'])} "
        f"steps it is {last['step_rad']:.1e} rad after 5 s, against {last['half_ulp_rad']:.1e} rad, and no angle has "
        "changed."
    )
    result.curves["finer"] = finer
