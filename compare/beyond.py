"""The assignment's claim about the arm held at bent: RK4 below and beyond its limit, and where a run can end."""

import numpy as np

import tmt

from .claims import PAIR
from .departure import own_torque
from .linear import held
from .motion import LEFT, departure
from .parties import farthest, finite
from .scenes import posture

TORQUES = ("one ulp off", "four decimals")
BEYOND = (0.3, 0.3125, 1 / 3, 0.4, 0.5, 0.625, 1.0)  # s, from just below RK4's limit at bent
RUN = 4000  # steps
FAST = 1e6  # rad/s: a run that is faster has diverged
FREE_STEP, FREE_TIME = 0.2, 2000.0  # s, of a run without torque, which RK4's own damping brings to rest


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
                with np.errstate(over="ignore", invalid="ignore"):
                    q, qd = party.run(mujoco, at.model, at.q, np.zeros(3), off(own), dt, RUN)
                fast = ~(np.abs(qd).max(axis=1) < FAST)  # no number from there on is motion
                left = departure(dt * np.arange(RUN + 1), q)
                rows.append({
                    "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": dt, "torque": name,
                    "growth": float(at.growth(party.scheme, dt)), "observed_s": left,
                    "steps": None if left is None else round(left / dt),
                    "diverged_at_s": float(dt * np.argmax(fast)) if fast.any() else None,
                    "largest_rad": None if fast.any() else finite(farthest(q, at.q)),
                })  # fmt: skip
                paths[(party.engine, name, dt)] = np.abs(np.where(fast[:, None], np.nan, q) - at.q).max(axis=1)[:200]
            leave = []
            for count in range(1, 65):
                with np.errstate(over="ignore", invalid="ignore"):
                    q, _ = party.run(mujoco, at.model, at.q, np.zeros(3), off(own), 5.0 / count, count)
                leave += [count] if not farthest(q, at.q) < LEFT else []
            stays[(party.engine, name)] = max(leave, default=0)
    hanging = posture("hanging")
    _, free, _ = tmt.simulate(at.q, np.zeros(3), np.zeros(3), FREE_STEP, round(FREE_TIME / FREE_STEP))
    return {
        "rows": rows, "paths": paths, "leaves_within_5_s": stays,
        "acceleration_at_hanging": tmt.acceleration(hanging, np.zeros(3), at.tau),
        "free_from_hanging": float(np.abs(np.remainder(free[-1] - hanging + np.pi, 2 * np.pi) - np.pi).max()),
    }  # fmt: skip


def judge(result, beyond) -> None:
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
    soonest = min(ulp, key=lambda row: row["observed_s"], default={"observed_s": np.inf, "dt_s": np.inf})
    small = next((row for row in rows if row["largest_rad"] is not None and row["dt_s"] > limit), rows[0])
    lost = all(row["largest_rad"] is None for row in rows if row["dt_s"] >= BEYOND[2])
    word = "bounded" if all(check.passed for check in result.checks) else "not borne out, checks fail"
    never = "no number of steps from 1 to 64 lets" if max(ends[TORQUES[0]]) == 0 else "some numbers of steps let"
    result.notes.append(
        f"Claim 3, {word}: bent is a centre, and RK4 holds it up to 2 sqrt 2 / {fastest:.3f} = {limit:.4f} s. Just "
        f"beyond, at {small['dt_s']:g} s, it swings by {small['largest_rad']:.3f} rad; at {BEYOND[2]:.3f} s and more "
        f"{'it diverges' if lost else 'it does not always diverge'}. With a torque one ulp off the soonest departure "
        f"is at {soonest['observed_s']:.2f} s (dt = {soonest['dt_s']:g} s), and {never} it leave within 5 s; with a "
        f"torque of four decimals it leaves in 5 s if these are {max(ends[TORQUES[1]])} steps or fewer. So the "
        "original ran for longer than 5 s, or with a rounded torque."
    )
    result.notes.append(
        f"Its end state cannot be hanging while the torque acts: that accelerates a hanging arm by ({pushed[0]:.1f}, "
        f"{pushed[1]:.1f}, {pushed[2]:.1f}) rad/s2. Without the torque it can: RK4 takes energy out of every swing, "
        f"and the free arm at dt = {FREE_STEP:g} s hangs at rest after {FREE_TIME:g} s, "
        f"{beyond['free_from_hanging']:.1e} rad off. So in the run that the original describes the holding torque did "
        "not act to the end."
    )
    result.curves["bent"] = beyond
