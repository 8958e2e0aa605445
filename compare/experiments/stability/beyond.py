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
COUNTS = tuple(range(1, 65))  # steps in 5 s
FAST = 1e6  # rad/s: a run that is faster has diverged
FREE_STEP, FREE_TIME = 0.2, 2000.0  # s, of a run without torque, which RK4's own damping brings to rest
PUSHED = 1.0  # rad/s2: a hanging arm that a torque accelerates by as much does not stay hanging
REST = 1e-9  # rad: so near hanging the arm hangs


def bent(mujoco, run=RUN, counts=COUNTS) -> dict:
    """RK4 at bent, below and beyond its limit, and what could end at hanging.

    rows: dt, torque (one ulp off; to four decimals), growth per step, when it leaves, the fastest rate at the end or the
    time of divergence. leaves_within_5_s: for each engine and torque the numbers of steps in 5 s with which it leaves.
    acceleration_at_hanging, free_from_hanging: of each engine, under bent's torque, and of a free run at its end.
    """
    at = held("bent", posture("bent"))
    torques = dict(zip(TORQUES, (lambda own: np.nextafter(own, np.inf), lambda own: own.round(4))))
    rows, leaves, paths = [], {}, {}
    for party in PAIR:
        own = own_torque(party, mujoco, at)
        for name, off in torques.items():
            for dt in BEYOND:
                with np.errstate(over="ignore", invalid="ignore"):
                    q, qd = party.run(mujoco, at.model, at.q, np.zeros(3), off(own), dt, run)
                fast = ~(np.abs(qd).max(axis=1) < FAST)  # no number from there on is motion
                left = departure(dt * np.arange(run + 1), q)
                rows.append({
                    "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": dt, "torque": name,
                    "growth": float(at.growth(party.scheme, dt)), "observed_s": left,
                    "steps": None if left is None else round(left / dt),
                    "diverged_at_s": float(dt * np.argmax(fast)) if fast.any() else None,
                    "largest_rad": None if fast.any() else finite(farthest(q, at.q)), "run_s": dt * run,
                })  # fmt: skip
                paths[(party.engine, name, dt)] = np.abs(np.where(fast[:, None], np.nan, q) - at.q).max(axis=1)[:200]
            leave = []
            for count in counts:
                with np.errstate(over="ignore", invalid="ignore"):
                    q, _ = party.run(mujoco, at.model, at.q, np.zeros(3), off(own), 5.0 / count, count)
                leave += [count] if not farthest(q, at.q) < LEFT else []
            leaves[(party.engine, name)] = leave
    hanging, rest = posture("hanging"), np.zeros(3)
    free = {}
    for party in PAIR:
        q, _ = party.run(mujoco, at.model, at.q, rest, rest, FREE_STEP, round(FREE_TIME / FREE_STEP))
        free[party.engine] = finite(np.abs(np.remainder(q[-1] - hanging + np.pi, 2 * np.pi) - np.pi).max())
    pushed = {"TMT": tmt.acceleration(hanging, rest, at.tau)}
    pushed["MuJoCo"] = mujoco.acceleration(hanging[None], rest[None], at.tau[None])[0]
    return {
        "rows": rows, "paths": paths, "leaves_within_5_s": leaves, "counts": list(counts), "limit": at.limit("rk4")[1] or 0.0,
        "fastest": float(np.abs(at.modes[0]).max()), "acceleration_at_hanging": pushed, "free_from_hanging": free,
    }  # fmt: skip


def judge(result, beyond) -> None:
    """Claim 3: bent beyond the limit of RK4."""
    rows, limit, leaves = beyond["rows"], beyond["limit"], beyond["leaves_within_5_s"]
    result.tables["stability_bent"] = rows
    result.curves["bent"] = beyond
    first = len(result.checks)
    for row in (row for row in rows if row["dt_s"] < limit):
        where = f"bent, {row['engine']} {row['method']}, dt = {row['dt_s']:.4g} s, torque {row['torque']}"
        stays = row["run_s"] if row["observed_s"] is None else row["observed_s"]
        result.check(where, f"time within {LEFT:g} rad, below the limit", stays, row["run_s"], "s", rule="at least")
    for (engine, torque), counts in leaves.items():
        if torque == TORQUES[0]:
            quantity = "numbers of steps in 5 s with which it leaves"
            result.check(f"bent, {engine}, torque {torque}", quantity, len(counts), 0, "", rule="equal")
    stays = all(check.passed for check in result.checks[first:])
    ends = []
    for engine, pushed in beyond["acceleration_at_hanging"].items():
        size = float(np.abs(pushed).max())
        quantity = "acceleration that bent's torque gives a hanging arm"
        held_off = result.check(f"hanging, {engine}", quantity, size, PUSHED, "rad/s2", rule="at least").passed
        quantity = f"angle from hanging after {FREE_TIME:g} s, free"
        off = beyond["free_from_hanging"][engine]
        result.check(f"bent, {engine}, RK4 at {FREE_STEP:g} s", quantity, off, REST, "rad")
        ends.append(held_off)
    above = [row for row in rows if row["dt_s"] > limit]
    moves = bool(above) and all(row["observed_s"] is not None or (row["largest_rad"] or 0.0) > 1e-3 for row in above)
    word = ("bounded" if any(ends) else "reproduced") if stays and moves else "not reproduced"
    result.notes.append(
        f"Claim 3, {word}: the predicted limit of RK4 at bent is {limit:.4f} s, {limit * beyond['fastest']:.4f} over the rate "
        f"of its fastest mode, {beyond['fastest']:.3f} rad/s. {tell_above(above)} "
        f"{tell_within(rows, leaves, len(beyond['counts']))} "
        "(Reproduced: it stays below the limit, moves by more than 1e-3 rad at each step above it, and can end at hanging; "
        "bounded: all but the last.)"
    )
    result.notes.append(tell_end(beyond))


def tell_above(rows) -> str:
    """What becomes of the arm at each step above the limit."""
    told = []
    for dt in sorted({row["dt_s"] for row in rows}):
        mine = [row for row in rows if row["dt_s"] == dt]
        away = [row["largest_rad"] for row in mine if row["largest_rad"] is not None]
        lost = sum(row["diverged_at_s"] is not None for row in mine)
        told.append(
            f"at {dt:.4g} s "
            + f"{lost} of {len(mine)} runs diverge" * bool(lost)
            + " and " * bool(lost and away)
            + (f"{len(away)} of {len(mine)} runs stay within {max(away):.3f} rad" if away else "")
        )
    return f"Above it, {'; '.join(told)}." if told else "No step above it was taken."


def tell_within(rows, leaves, tried) -> str:
    """When the arm leaves with each torque, and with how many steps in 5 s."""
    told = []
    for torque in TORQUES:
        times = [(row["observed_s"], row["dt_s"]) for row in rows if row["torque"] == torque and row["observed_s"]]
        counts = [count for (_, name), found in leaves.items() if name == torque for count in found]
        soonest = (
            f"it leaves after {min(times)[0]:.2f} s at the soonest (dt = {min(times)[1]:.4g} s)"
            if times
            else "it stays"
        )
        within = f"the largest with which it leaves is {max(counts)}" if counts else "none lets it leave"
        name = torque.replace("four", "of four")
        told.append(f"With a torque {name} {soonest}; of {tried} numbers of steps tried for 5 s, {within}.")
    return " ".join(told)


def tell_end(beyond) -> str:
    """Whether bent can end at hanging with its torque, and without."""
    told = []
    for engine, pushed in beyond["acceleration_at_hanging"].items():
        off = beyond["free_from_hanging"][engine]
        can = np.abs(pushed).max() < PUSHED
        text = f"{engine}: the torque of bent accelerates a hanging arm by ({', '.join(f'{a:.1f}' for a in pushed)}) rad/s2, "
        text += "so little that it may end there" if can else "so it does not end there while that torque acts"
        if off is None:
            text += "; the free run has diverged"
        else:
            rests = "hangs at rest" if off <= REST else "is not at rest at hanging"
            text += f"; free, by RK4 at {FREE_STEP:g} s, it {rests} after {FREE_TIME:g} s, {off:.1e} rad off"
        told.append(text)
    return f"Where a run from bent can end. {'. '.join(told)}."
