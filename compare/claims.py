"""The assignment's claims about the arm held at ball catch, repeated in both engines and held against predictions."""

from itertools import pairwise

import numpy as np

import tmt

from .departure import near, own_torque, predicted, residual, span, variants
from .linear import held
from .motion import departure
from .parties import Party, farthest, finite, value
from .published import ITEMS
from .scenes import posture

PAIR = (Party("TMT", "rk4"), Party("MuJoCo", "RK4"))
DT = 5 / 64  # s, the assignment's step
LONG = 10.0  # s, twice the assignment's run
CLEAR = 16  # ulps of each component: a push that rounding of the bias on the way cannot turn round
NAMES = (*(f"variant {k}" for k in range(1, 28)), "nearest to own bias", f"{CLEAR} ulps up", f"{CLEAR} ulps down")
STEP_COUNTS = (32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384)  # over 5 s


def holding_torques(mujoco) -> list:
    """All 27 torques within one ulp of TMT's holding torque of ball catch, RK4 at 5/64 s; then own biases; then 16 ulps.

    push_rad_per_s2: what the residual, the torque beyond the one that holds, does to the fastest unstable mode.
    """
    at = held("ball catch", posture("ball catch"))
    steps = round(LONG / DT)
    rows = []
    for party in PAIR:
        own = own_torque(party, mujoco, at)
        aside = CLEAR * np.spacing(np.abs(own)) * np.sign(pushes(at))
        tau = np.vstack([variants(at.tau), own, own + aside, own - aside])
        rest = np.zeros_like(tau)
        off = residual(party, mujoco, at, tau)
        q, _ = party.run(mujoco, at.model, at.q + rest, rest, tau, DT, steps)
        for k, path in enumerate(q):
            left = departure(DT * np.arange(steps + 1), path)
            away = None if left is None else path[round(left / DT)] - at.q
            bits = dict(zip(("ulps_alpha", "ulps_beta", "ulps_gamma"), ulps(tau[k] - at.tau, at.tau)))
            rows.append({
                "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": DT,
                "torque": NAMES[k], **bits, "push_rad_per_s2": float(pushes(at) @ off[k]),
                "predicted_s": predicted(at, party.scheme, DT, np.zeros(3), off[k]) if off[k].any() else None,
                "observed_s": left, "direction": None if away is None else int(np.sign(away[0])),
                "largest_residual_n_m": float(np.abs(off[k]).max()), "moved_rad": finite(farthest(path, at.q)),
            })  # fmt: skip
    return rows


def pushes(at) -> np.ndarray:
    """What a torque does to the fastest unstable mode, 1/(kg m2), (n,): its product with a torque is in rad/s2.

    The left eigenvector, its rates scaled to length 1; positive where the shoulder moves to larger alpha.
    """
    vectors = at.modes[1]
    measure = np.linalg.inv(vectors)[0] * np.sign(vectors[0, 0].real)
    return (measure[3:] / np.linalg.norm(measure[3:])).real @ np.linalg.inv(tmt.mass_matrix(at.q))


def ulps(difference, tau) -> list[int]:
    """A difference of torques counted in units of the last place of the torque."""
    return [round(float(d / np.spacing(abs(t)))) for d, t in zip(difference, tau)]


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
            off = residual(party, mujoco, at, tau)
            for count in STEP_COUNTS:
                dt = 5.0 / count
                q, qd = party.run(mujoco, at.model, at.q, np.zeros(3), tau, dt, 2 * count)
                left = departure(dt * np.arange(2 * count + 1), q)
                steps_rad = dt * np.abs(qd[count]) / (0.5 * np.spacing(np.abs(at.q)))
                i = int(np.argmax(steps_rad))
                rows.append({
                    "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": dt, "ulps_alpha": int(sign),
                    "push_rad_per_s2": float(pushes(at) @ off),
                    "predicted_s": predicted(at, party.scheme, dt, np.zeros(3), off, LONG), "observed_s": left,
                    "direction": None if left is None else int(np.sign(q[round(left / dt), 0] - at.q[0])),
                    "moved_rad": finite(farthest(q[count], at.q)), "step_rad": finite(dt * abs(qd[count, i])),
                    "half_ulp_rad": 0.5 * float(np.spacing(abs(at.q[i]))),
                    "stuck_s": finite(stuck(at, dt, np.zeros(3), off)),
                })  # fmt: skip
    return rows


def four_decimals(mujoco) -> list:
    """Departure from ball catch under the torque as it is printed, to four decimals, against the step."""
    at = held("ball catch", posture("ball catch"))
    tau = np.array(next(item.values for item in ITEMS if item.item == "h"))
    rows = []
    for party in PAIR:
        off = residual(party, mujoco, at, tau)
        for count in (64, 256, 1024, 4096):
            dt = 5.0 / count
            q, _ = party.run(mujoco, at.model, at.q, np.zeros(3), tau, dt, count)
            rows.append({
                "scene": "ball catch, printed torque", "engine": party.engine, "method": party.method, "dt_s": dt,
                "perturbation_rad": float(np.abs(tau - at.tau).max()),
                "predicted_s": predicted(at, party.scheme, dt, np.zeros(3), off),
                "observed_s": departure(dt * np.arange(count + 1), q),
            })  # fmt: skip
    return rows


def judge(result, torques, finer, printed) -> None:
    """Checks, tables and sentences about the first two published claims, and the torque as it is printed."""
    result.tables["stability_torques"] = torques
    result.tables.setdefault("departure", []).extend(printed)
    told = []
    for party in PAIR:
        rows = [row for row in torques if row["engine"] == party.engine]
        rows, own, clear = rows[:27], rows[27], rows[28:]
        where = f"ball catch, {party.label}"
        for row in clear:
            wrong = row["direction"] != np.sign(row["push_rad_per_s2"])
            result.check(
                f"{where}, torque {row['torque']}", "departure against the push of the residual", wrong, 0.0, "runs"
            )
            known = None not in (row["observed_s"], row["predicted_s"])
            off = abs(row["observed_s"] - row["predicted_s"]) if known else np.nan
            result.check(f"{where}, torque {row['torque']}", "departure, observed - predicted", off, near(DT), "s")
        if party.engine == "MuJoCo":  # of TMT no double is the bias: compiled code rounds its last sum only once
            result.check(where, "residual of the engine's own bias", own["largest_residual_n_m"], 0.0, "N m")
            result.check(where, "movement under the engine's own bias", value(own["moved_rad"]), 0.0, "rad")
        gone = [row for row in rows if row["observed_s"] is not None]
        up = sum(row["direction"] == 1 for row in gone)
        against = [row["push_rad_per_s2"] for row in gone if row["direction"] != np.sign(row["push_rad_per_s2"])]
        told.append(
            f"{party.engine}: {len(gone)} leave, after {span(row['observed_s'] for row in gone)}, {up} to larger "
            f"alpha, {len(gone) - up} to smaller; {len(gone) - len(against)} of them to the side to which the residual "
            "of the torque pushes the unstable mode"
            + (f" (the others are pushed by at most {np.abs(against).max():.1e} rad/s2)" if against else "")
            + (
                "; under its own bias, bit for bit, it never leaves"
                if own["observed_s"] is None
                else f"; no double is its own bias, and under the nearest it leaves after {own['observed_s']:.2f} s"
            )
        )
    result.notes.append(
        f"Claim 1, {reproduced(result)}: held at ball catch by RK4 at 5/64 s under each of the 27 torques within one unit in the "
        f"last place of TMT's. {'. '.join(told)}. The cause is rounding, as the assignment says: of the torque first, "
        f"and of the bias on the way where the torque is near. A torque {CLEAR} ulps off decides side and time by "
        "itself."
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


def reproduced(result) -> str:
    """Whether the checks so far bear a claim out, in a word."""
    return "reproduced" if all(check.passed for check in result.checks) else "not reproduced: checks fail"


def tell_finer(result, finer) -> None:
    """Claim 2: smaller steps."""
    result.tables["stability_finer_steps"] = finer
    finest = min(row["dt_s"] for row in finer)
    for party in PAIR:
        rows = [row for row in finer if row["engine"] == party.engine]
        moved = max(value(row["moved_rad"]) for row in rows if row["dt_s"] == finest)
        where = f"ball catch, {party.label}, torque one ulp off"
        result.check(where, "movement in 5 s at 16384 steps", moved, 0.0, "rad")
    sides = {1: "larger alpha", -1: "smaller"}
    series, reversed_ = [], 0
    for engine, sign in dict.fromkeys((row["engine"], row["ulps_alpha"]) for row in finer):
        mine = [row for row in finer if (row["engine"], row["ulps_alpha"]) == (engine, sign) and row["direction"]]
        turns = [row for before, row in pairwise(mine) if before["direction"] != row["direction"]]
        reversed_ += bool(turns)
        series.append(
            f"{engine} {sign:+d} ulp to {sides[mine[0]['direction']] if mine else 'no side'}"
            + "".join(f", from {round(5 / row['dt_s'])} steps on to {sides[row['direction']]}" for row in turns)
        )
    rows = [row for row in finer if row["engine"] == "TMT" and row["ulps_alpha"] == 1]
    times = ", ".join(
        f"{round(5 / row['dt_s'])}: " + ("never" if row["observed_s"] is None else f"{row['observed_s']:.2f} s")
        for row in rows
    )
    last = rows[-1]
    result.notes.append(
        f"Claim 2, {reproduced(result)}: the torque one ulp off in alpha, {len(STEP_COUNTS)} steps from 5/32 s "
        f"down. {'; '.join(series)}. A smaller step reverses the side in {reversed_} of these {len(series)} series: it "
        "is luck, rounding of the bias at the angles met on the way. Steps in 5 s and time to leave (TMT +1 ulp, "
        f"within {LONG:g} s): {times}. The finest steps delay: what a step adds to an angle, dt qd, is lost while it is "
        f"below half a unit in its last place. At {round(5 / last['dt_s'])} steps it is {value(last['step_rad']):.1e} "
        f"rad after 5 s, against {last['half_ulp_rad']:.1e} rad, and no angle has changed."
    )
