"""The assignment's three claims about its held arm, each repeated in both engines and held against a prediction."""

import numpy as np

import tmt

from .departure import near, own_torque, predicted, stuck, variants
from .linear import held
from .motion import LEFT, departure
from .parties import Party, farthest
from .published import ITEMS
from .scenes import posture

PAIR = (Party("TMT", "rk4"), Party("MuJoCo", "RK4"))
DT = 5 / 64  # s, the assignment's step
LONG = 10.0  # s, twice the assignment's run
STEP_COUNTS = (32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384)  # over 5 s
TORQUES = ("one ulp off", "four decimals")
BEYOND = (0.3, 0.3125, 1 / 3, 0.4, 0.5, 0.625, 1.0)  # s, from just below RK4's limit at bent
FREE_STEP, FREE_TIME = 0.2, 2000.0  # s, of a run without torque, which RK4's own damping brings to rest


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
            rows.append({
                "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": DT,
                "torque": "own bias" if k == 27 else f"variant {k + 1}", "ulps_alpha": ulps(residual, at.tau)[0], "ulps_beta": ulps(residual, at.tau)[1],
                "ulps_gamma": ulps(residual, at.tau)[2], "push_rad_per_s2": push,
                "predicted_s": predicted(at, party.scheme, DT, np.zeros(3), residual) if residual.any() else None,
                "observed_s": left, "direction": None if away is None else int(np.sign(away[0])),
                "first_step_rad_per_s": float(np.abs(qd[k, 1]).max()), "moved_rad": farthest(path, at.q),
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
    torques = dict(zip(TORQUES, (lambda own: np.nextafter(own, np.inf), lambda own: own.round(4))))
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


def judge(result, torques, finer, printed, beyond) -> None:
    """Checks, tables and sentences about the three published claims."""
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
            result.check(where, "movement under the engine's own bias", own["moved_rad"], 0.0, "rad")
        times = [row["observed_s"] for row in rows if row["observed_s"] is not None]
        up = sum(row["direction"] == 1 for row in rows)
        told.append(
            f"{party.engine}: {len(times)} leave, between {min(times):.2f} and {max(times):.2f} s, {up} to larger alpha, "
            f"{len(times) - up} to smaller, {27 - len(times)} never (under its own bias it "
            f"{'never leaves' if own['observed_s'] is None else 'leaves'}); the direction is the sign of the residual "
            f"on the unstable "
            f"mode in all {len(clear)} cases where that residual is more than the bias is rounded by, {noise:.1e} rad/s2"
        )
    result.notes.append(
        "Claim 1, reproduced: held at ball catch by RK4 at 5/64 s under each of the 27 torques within one unit in the last "
        f"place of TMT's. {'. '.join(told)}. The cause is rounding, as the assignment says: of the torque."
    )
    if finer:
        tell_finer(result, finer)
    for row in printed:
        where = f"{row['scene']}, {row['engine']} {row['method']}, dt = {row['dt_s']:.4g} s"
        off = abs((row["observed_s"] or np.inf) - (row["predicted_s"] or np.inf))
        result.check(where, "departure, observed - predicted", off, near(row["dt_s"]), "s")
    times = [row["observed_s"] for row in printed]
    result.notes.append(
        f"The torque as printed, four decimals, lasts {min(times):.2f} to {max(times):.2f} s at ball catch, whatever "
        f"the step and "
        "the engine: the original cannot have used it for its Figure 2."
    )
    if beyond:
        tell_bent(result, beyond)


def tell_finer(result, finer) -> None:
    """Claim 2: smaller steps."""
    result.tables["stability_finer_steps"] = finer
    finest = min(row["dt_s"] for row in finer)
    for party in PAIR:
        rows = [row for row in finer if row["engine"] == party.engine]
        moved = max(row["moved_rad"] for row in rows if row["dt_s"] == finest)
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
        "step in both "
        "engines, so a smaller step reverses nothing; a reversal is another rounding of the torque, and luck. Steps "
        "in 5 s and "
        f"time to leave (TMT, within {LONG:g} s): {times}. Fine steps delay: what a step adds to an angle, dt qd, is "
        f"lost while "
        f"it is below half a unit in its last place. At {round(5 / last['dt_s'])} steps it is {last['step_rad']:.1e} "
        f"rad after 5 s, "
        f"against {last['half_ulp_rad']:.1e} rad, and no angle has changed."
    )
    result.curves["finer"] = finer


def tell_bent(result, beyond) -> None:
    """Claim 3: bent beyond the limit of RK4."""
    rows = beyond["rows"]
    result.tables["stability_bent"] = rows
    at = held("bent", posture("bent"))
    fastest = float(np.abs(at.modes[0]).max())
    limit = 2.0 * np.sqrt(2.0) / fastest
    result.check(
        "bent, rk4", "limit of the method's own step from 2 sqrt 2 / omega", abs(at.limit("rk4")[1] - limit), 1e-6, "s"
    )
    for row in rows:
        if row["dt_s"] < limit:
            where = f"bent, {row['engine']} {row['method']}, dt = {row['dt_s']:.4g} s, torque {row['torque']}"
            result.check(where, "leaves below the limit", row["observed_s"] is not None, 0.0, "runs")
    pushed = beyond["acceleration_at_hanging"]
    missing = max(0.0, 1.0 - float(np.abs(pushed).max()))
    result.check("hanging, bent's torque", "acceleration is less than 1 rad/s2", missing, 0.0, "rad/s2 missing")
    result.check("bent, free, rk4, 0.2 s", "from hanging after 2000 s", beyond["free_from_hanging"], 1e-9, "rad")
    ends = {torque: [n for (_, name), n in beyond["leaves_within_5_s"].items() if name == torque] for torque in TORQUES}
    result.check(
        "bent, rk4, torque one ulp off", "most steps in 5 s with which it leaves", max(ends[TORQUES[0]]), 0.0, "steps"
    )
    ulp = [row for row in rows if row["torque"] == TORQUES[0] and row["observed_s"] is not None]
    soonest = min(ulp, key=lambda row: row["observed_s"])
    small = next(row for row in rows if row["largest_rad"] is not None and row["dt_s"] > limit)
    result.notes.append(
        f"Claim 3, bounded: bent is a centre, and RK4 holds it up to 2 sqrt 2 / {fastest:.3f} = {limit:.4f} s. Just "
        f"beyond, at "
        f"{small['dt_s']:g} s, it swings by {small['largest_rad']:.3f} rad for ever; at {BEYOND[2]:.3f} s and more it "
        f"diverges. "
        f"With a torque one ulp off the soonest departure is at {soonest['observed_s']:.2f} s (dt = "
        f"{soonest['dt_s']:g} s), and no "
        f"number of steps from 1 to 64 lets it leave within 5 s; with a torque of four decimals it leaves in 5 s if "
        f"these are "
        f"{max(ends[TORQUES[1]])} steps or fewer. So the original ran for longer than 5 s, or with a rounded torque."
    )
    result.notes.append(
        f"Its end state cannot be hanging while the torque acts: that accelerates a hanging arm by ({pushed[0]:.1f}, "
        f"{pushed[1]:.1f}, "
        f"{pushed[2]:.1f}) rad/s2. Without the torque it can: RK4 takes energy out of every swing, and the free arm at dt = "
        f"{FREE_STEP:g} s hangs at rest after {FREE_TIME:g} s, {beyond['free_from_hanging']:.0e} rad off. So in the "
        f"run that "
        "the original describes the holding torque did not act to the end."
    )
    result.curves["bent"] = beyond
