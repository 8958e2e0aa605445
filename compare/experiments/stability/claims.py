"""The assignment's claims about the arm held at ball catch, repeated in both engines and held against predictions."""

from itertools import pairwise

import numpy as np

import tmt

from .departure import check_row, own_torque, predicted, residual, span, variants
from .linear import held
from .motion import departure
from .parties import Party, farthest, finite, value
from .published import ITEMS
from .scenes import posture

PAIR = (Party("TMT", "rk4"), Party("MuJoCo", "RK4"))
DT = 5 / 64  # s, the assignment's step
LONG = 10.0  # s, twice the assignment's run
PUBLISHED, WITHIN = 4.5, 1.0  # s: when the assignment's arm leaves, and how near that is near, for "about"
CLEAR = 16  # ulps of each component: a push that rounding of the bias on the way cannot turn round
NAMES = (*(f"variant {k}" for k in range(1, 28)), "nearest to own bias", f"{CLEAR} ulps up", f"{CLEAR} ulps down")
STEP_COUNTS = (32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384)  # over 5 s
PRINTED_COUNTS = (64, 256, 1024, 4096)
SIDES = {1: "larger alpha", -1: "smaller alpha", 0: "neither side", None: "no side"}


def holding_torques(mujoco) -> list:
    """All 27 torques within one ulp of TMT's holding torque of ball catch, RK4 at 5/64 s; then own biases; then 16 ulps.

    push_rad_per_s2: what the residual, the torque beyond the one that holds, does to the fastest unstable mode.
    residual_ulps: the residual in units of the last place of the largest torque.
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
        expected = predicted(at, party.scheme, DT, rest, off)
        for k, path in enumerate(q):
            left = departure(DT * np.arange(steps + 1), path)
            bits = dict(zip(("ulps_alpha", "ulps_beta", "ulps_gamma"), ulps(tau[k] - at.tau, at.tau)))
            rows.append({
                "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": DT,
                "torque": NAMES[k], **bits, "push_rad_per_s2": float(pushes(at) @ off[k]), "predicted_s": expected[k],
                "observed_s": left, "direction": side(path, left, DT),
                "largest_residual_n_m": finite(np.abs(off[k]).max()), "moved_rad": finite(farthest(path, at.q)),
                "residual_ulps": finite(np.abs(off[k]).max() / np.spacing(np.abs(at.tau).max())),
            })  # fmt: skip
    return rows


def side(path, left, dt) -> int | None:
    """To which side of its start alpha is when the arm leaves: 1 larger, -1 smaller; None: it never leaves, or is NaN."""
    away = np.nan if left is None else path[round(left / dt), 0] - path[0, 0]
    return int(np.sign(away)) if np.isfinite(away) else None


def pushes(at) -> np.ndarray:
    """What a torque does to the fastest unstable mode, 1/(kg m2), (n,): its product with a torque is in rad/s2.

    The left eigenvector, its rates scaled to length 1; positive where the shoulder moves to larger alpha.
    """
    vectors = at.modes[1]
    measure = np.linalg.inv(vectors)[0] * np.sign(vectors[0, 0].real)
    return (measure[3:] / np.linalg.norm(measure[3:])).real @ np.linalg.inv(tmt.mass_matrix(at.q))


def ulps(difference, tau) -> list[int | None]:
    """A difference of torques counted in units of the last place of the torque; None if it is no number."""
    counts = [float(d / np.spacing(abs(t))) for d, t in zip(difference, tau)]
    return [round(count) if np.isfinite(count) else None for count in counts]


def finer_steps(mujoco, counts=STEP_COUNTS) -> list:
    """Departure from ball catch under RK4 against the step, the torque one ulp off to either side in alpha.

    moved_rad: how far the arm has moved after 5 s; step_rad: the largest dt |qd| by then; half_ulp_rad: half a unit in
    the last place of the angle that it would have to change. predicted_s: by the linear map, which does not round here.
    """
    at = held("ball catch", posture("ball catch"))
    rows = []
    for party in PAIR:
        own = own_torque(party, mujoco, at)
        for sign in (1.0, -1.0):
            tau = own.copy()
            tau[0] = np.nextafter(own[0], sign * np.inf)
            off = residual(party, mujoco, at, tau)
            for count in counts:
                dt = 5.0 / count
                q, qd = party.run(mujoco, at.model, at.q, np.zeros(3), tau, dt, 2 * count)
                left = departure(dt * np.arange(2 * count + 1), q)
                i = int(np.argmax(np.abs(qd[count]) / np.spacing(np.abs(at.q))))
                rows.append({
                    "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": dt, "ulps_alpha": int(sign),
                    "push_rad_per_s2": float(pushes(at) @ off),
                    "predicted_s": predicted(at, party.scheme, dt, np.zeros((1, 3)), off[None], LONG, rounded=False)[0],
                    "observed_s": left, "direction": side(q, left, dt), "moved_rad": finite(farthest(q[: count + 1], at.q)),
                    "step_rad": finite(dt * abs(qd[count, i])), "half_ulp_rad": 0.5 * float(np.spacing(abs(at.q[i]))),
                })  # fmt: skip
    return rows


def four_decimals(mujoco, counts=PRINTED_COUNTS) -> list:
    """Departure from ball catch under the torque as it is printed, to four decimals, against the step."""
    at = held("ball catch", posture("ball catch"))
    tau = np.array(next(item.values for item in ITEMS if item.item == "h"))
    rows = []
    for party in PAIR:
        off = residual(party, mujoco, at, tau)
        for count in counts:
            dt = 5.0 / count
            q, _ = party.run(mujoco, at.model, at.q, np.zeros(3), tau, dt, count)
            rows.append({
                "scene": "ball catch, printed torque", "engine": party.engine, "method": party.method, "dt_s": dt,
                "perturbation_rad": float(np.abs(tau - at.tau).max()),
                "predicted_s": predicted(at, party.scheme, dt, np.zeros((1, 3)), off[None])[0],
                "observed_s": departure(dt * np.arange(count + 1), q),
            })  # fmt: skip
    return rows


def judge(result, torques, finer, printed) -> None:
    """Checks, tables and sentences about the first two published claims, and the torque as it is printed."""
    judge_torques(result, torques)
    if finer:
        judge_finer(result, finer)
    result.tables.setdefault("departure", []).extend(printed)
    for row in printed:
        check_row(result, f"{row['scene']}, {row['engine']} {row['method']}, dt = {row['dt_s']:.4g} s", row)
    stay = sum(row["observed_s"] is None for row in printed)
    result.notes.append(
        f"The torque as printed, four decimals, in {len(printed)} runs of both engines at ball catch with steps from "
        f"{max(row['dt_s'] for row in printed):.4g} s down: the arm leaves after {span(row['observed_s'] for row in printed)}"
        + (
            f"; runs in which it stays: {stay}."
            if stay
            else f". The assignment's arm leaves after about {PUBLISHED:g} s."
        )
    )


def judge_torques(result, torques) -> None:
    """Claim 1: ball catch is left after about 4.5 s, because of rounding."""
    result.tables["stability_torques"] = torques
    first, told, findings = len(result.checks), [], []
    for party in PAIR:
        rows = [row for row in torques if row["engine"] == party.engine]
        rows, own, clear = rows[:27], rows[27], rows[28:]
        where = f"ball catch, {party.label}"
        for row in clear:
            along = None if row["direction"] is None else row["direction"] * np.sign(row["push_rad_per_s2"])
            text = "departure along the push of the residual (1; against it: -1)"
            result.check(f"{where}, torque {row['torque']}", text, along, 1, "", rule="equal")
            check_row(result, f"{where}, torque {row['torque']}", row)
        if party.engine == "MuJoCo":  # of TMT no double need be the bias: compiled code rounds its last sum only once
            result.check(where, "movement under the engine's own bias", own["moved_rad"], 0.0, "rad")
        gone = [row for row in rows if row["observed_s"] is not None]
        near_published = sum(abs(row["observed_s"] - PUBLISHED) <= WITHIN for row in gone)
        off = max((value(row["residual_ulps"]) for row in rows), default=np.nan)
        findings += [2 * near_published > len(rows), bool(off < CLEAR)]
        told.append(tell_engine(party.engine, rows, own, near_published, off))
    passed = all(check.passed for check in result.checks[first:])
    word = "reproduced" if passed and all(findings) else "not reproduced"
    result.notes.append(
        f"Claim 1, {word}: held at ball catch by RK4 at 5/64 s under each of the 27 torques within one unit in the last "
        f"place of TMT's. {'. '.join(told)}. (Reproduced: in both engines more than half leave within {WITHIN:g} s of "
        f"{PUBLISHED:g} s, the residual of the torque is below {CLEAR} ulps, which is rounding, and the checks of the claim "
        f"pass: under {CLEAR} ulps the residual decides side and time, under MuJoCo's own bias nothing moves.)"
    )


def tell_engine(engine, rows, own, near_published, off) -> str:
    """What the 27 torques do in one engine."""
    gone = [row for row in rows if row["observed_s"] is not None]
    sides = [f"{sum(row['direction'] == k for row in gone)} to {SIDES[k]}" for k in (1, -1)]
    against = [abs(row["push_rad_per_s2"]) for row in gone if row["direction"] != np.sign(row["push_rad_per_s2"])]
    text = f"{engine}: {len(gone)} leave"
    if gone:
        text += (
            f", after {span(row['observed_s'] for row in gone)} ({near_published} within {WITHIN:g} s of {PUBLISHED:g} s), "
            f"{' and '.join(sides)}; {len(gone) - len(against)} of them to the side to which the residual of the torque, at "
            f"most {off:.3g} ulps, pushes the unstable mode"
        )
        text += f" (the others are pushed by at most {max(against):.1e} rad/s2)" if against else ""
    moved = "nothing moves" if own["moved_rad"] == 0.0 else f"the arm leaves after {span([own['observed_s']])}"
    if own["observed_s"] is None and own["moved_rad"] != 0.0:
        moved = "the arm stays within 0.1 rad"
    return text + f"; under the torque nearest to its own bias ({value(own['residual_ulps']):.2g} ulps off) {moved}"


def judge_finer(result, finer) -> None:
    """Claim 2: a smaller step reverses the side, and a very small one leaves the arm in place."""
    result.tables["stability_finer_steps"] = finer
    finest = min(row["dt_s"] for row in finer)
    count = round(5 / finest)
    still = True
    for row in (row for row in finer if row["dt_s"] == finest):
        where = f"ball catch, {row['engine']} {row['method']}, torque {row['ulps_alpha']:+d} ulp"
        still &= result.check(where, f"movement in 5 s at {count} steps", row["moved_rad"], 0.0, "rad").passed
    series, turned, leave = [], 0, True
    for engine, sign in dict.fromkeys((row["engine"], row["ulps_alpha"]) for row in finer):
        rows = [row for row in finer if (row["engine"], row["ulps_alpha"]) == (engine, sign) and row["direction"]]
        turns = [row for before, row in pairwise(rows) if before["direction"] != row["direction"]]
        turned += bool(turns)
        leave &= bool(rows)
        series.append(
            f"{engine} {sign:+d} ulp to {SIDES[rows[0]['direction'] if rows else None]}"
            + "".join(f", from {round(5 / row['dt_s'])} steps on to {SIDES[row['direction']]}" for row in turns)
        )
    met = bool(turned) + bool(still) + leave
    word = {3: "reproduced", 2: "reproduced in part"}.get(met, "not reproduced")
    rows = [row for row in finer if row["engine"] == "TMT" and row["ulps_alpha"] == 1]
    times = ", ".join(
        f"{round(5 / row['dt_s'])}: " + ("never" if row["observed_s"] is None else f"{row['observed_s']:.2f} s")
        for row in rows
    )
    last = rows[-1]
    lost = last["step_rad"] is not None and last["step_rad"] < last["half_ulp_rad"]
    result.notes.append(
        f"Claim 2, {word}: the torque one ulp off in alpha, {len(rows)} steps from {rows[0]['dt_s']:.4g} s down. "
        f"{'; '.join(series)}. A smaller step reverses the side in {turned} of these {len(series)} series; with {count} steps "
        f"in 5 s {'nothing moves in any' if still else 'not every arm stays where it is'}. Steps in 5 s and time to leave "
        f"(TMT +1 ulp, within {LONG:g} s): {times}. What a step adds to an angle, dt qd, is "
        f"{value(last['step_rad']):.1e} rad after 5 s at {round(5 / last['dt_s'])} steps: "
        f"{'less' if lost else 'not less'} than half a unit in the last place of the angle that it would change "
        f"first, {last['half_ulp_rad']:.1e} rad"
        f"{', so it is lost in the sum' if lost else ''}. (Reproduced: every series leaves at some step, at least one "
        "reverses its side, and with the most steps nothing moves in 5 s; in part: two of these.)"
    )
