"""What is claimed of the robot held at the posture that it keeps: RK4 below and beyond its limit, and where a run can end."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...engines import LABELS, Engine
from ...judge.check import About, Result
from ...judge.run import LEFT, departure, deviation, number_or_none
from ...robots import Robot
from ...truth.linear import held
from .choice import who
from .claims import of_claims
from .torques import own_torque

ONE_ULP, FOUR_DECIMALS = "one ulp off", "four decimals"
NEAR_TORQUES = {ONE_ULP: lambda own: np.nextafter(own, np.inf), FOUR_DECIMALS: lambda own: own.round(4)}
STEPS_BEYOND = (0.3, 0.3125, 1 / 3, 0.4, 0.5, 0.625, 1.0)  # s, about the limit of RK4
RUN_BEYOND = 4000  # steps
COUNTS_WITHIN = tuple(range(1, 65))  # steps in a run of the claims
DIVERGED_RATE = 1e6  # rad/s: a run that is faster has diverged
FREE_STEP, FREE_TIME = 0.2, 2000.0  # s, of a run without torque, which RK4's own damping brings to rest
PUSHED = 1.0  # rad/s2: a robot that a torque accelerates by as much does not stay where it rests
AT_REST = 1e-9  # rad: so near the posture it rests there
CURVE_STEPS = 200  # of a curve in the figure


def kept(
    engines: Mapping[str, Engine], robot: Robot, steps: int = RUN_BEYOND, counts: Sequence[int] = COUNTS_WITHIN
) -> dict:
    """RK4 at the posture that is kept, below and beyond its limit, and what could end at the posture that is claimed.

    rows: dt, torque (one ulp off; to four decimals), growth per step, when it leaves, the fastest rate at the end or the
    time of divergence. leaves: for each engine and torque the numbers of steps in a run of the claims with which it leaves.
    acceleration_at_end, free_from_end: of each engine, under the torque that holds, and of a free run at its end.
    """
    claims, at = robot.claims, held(robot, robot.claims.kept)
    end, rest = robot.posture(claims.end), np.zeros_like(at.q)
    rows, leaves, paths, pushed, free = [], {}, {}, {}, {}
    for method in of_claims(engines):
        own, dynamics = own_torque(method, engines, at), engines[method.engine].of(at.case)
        for name, off in NEAR_TORQUES.items():
            for dt in STEPS_BEYOND:
                with np.errstate(over="ignore", invalid="ignore"):
                    motion = dynamics.run(at.q, rest, off(own), dt, steps, method.name)
                fast = ~(np.abs(motion.v).max(axis=1) < DIVERGED_RATE)  # no number from there on is motion
                left = departure(motion.t, motion.q)
                rows.append({
                    "scene": at.name, "engine": method.engine, "method": method.name, "dt_s": dt, "torque": name,
                    "growth": float(at.growth(method.scheme, dt)), "observed_s": left,
                    "steps": None if left is None else round(left / dt),
                    "diverged_at_s": float(dt * np.argmax(fast)) if fast.any() else None,
                    "largest_rad": None if fast.any() else number_or_none(deviation(motion.q, at.q)), "run_s": dt * steps,
                })  # fmt: skip
                path = np.abs(np.where(fast[:, None], np.nan, motion.q) - at.q).max(axis=1)
                paths[(method.engine, name, dt)] = path[:CURVE_STEPS]
            leaves[(method.engine, name)] = []
            for count in counts:
                with np.errstate(over="ignore", invalid="ignore"):
                    motion = dynamics.run(at.q, rest, off(own), claims.duration / count, count, method.name)
                if not deviation(motion.q, at.q) < LEFT:
                    leaves[(method.engine, name)].append(count)
        pushed[method.engine] = dynamics.acceleration(end, rest, at.tau)
        motion = dynamics.run(at.q, rest, rest, FREE_STEP, round(FREE_TIME / FREE_STEP), method.name)
        off = np.remainder(motion.q[-1] - end + np.pi, 2 * np.pi) - np.pi
        free[method.engine] = number_or_none(np.abs(off).max())
    return {
        "rows": rows, "paths": paths, "leaves": leaves, "counts": list(counts), "limit": at.limit("rk4")[1] or 0.0,
        "fastest": float(np.abs(at.modes[0]).max()), "acceleration_at_end": pushed, "free_from_end": free,
    }  # fmt: skip


def check_kept(result: Result, robot: Robot, found: dict) -> None:
    """Claim 3: held beyond the limit of RK4."""
    claims, rows, limit, leaves = robot.claims, found["rows"], found["limit"], found["leaves"]
    result.tables["stability_bent"] = rows
    result.curves["kept"] = found
    first = len(result.checks)
    for row in (row for row in rows if row["dt_s"] < limit):
        where = f"{claims.kept}, {who(row)}, dt = {row['dt_s']:.4g} s, torque {row['torque']}"
        stays = row["run_s"] if row["observed_s"] is None else row["observed_s"]
        what = f"time within {LEFT:g} rad, below the limit"
        result.check(where, what, stays, row["run_s"], "s", rule="at least", about=About.PREDICTION)
    for (engine, torque), counts in leaves.items():
        if torque == ONE_ULP:
            where = f"{claims.kept}, {LABELS[engine]}, torque {torque}"
            quantity = f"numbers of steps in {claims.duration:g} s with which it leaves"
            result.check(where, quantity, len(counts), 0, "", rule="equal", about=About.PREDICTION)
    stays = all(check.passed for check in result.checks[first:])
    ends = []
    for engine, pushed in found["acceleration_at_end"].items():
        where, size = f"{claims.end}, {LABELS[engine]}", float(np.abs(pushed).max())
        quantity = f"acceleration that {claims.kept}'s torque gives a {claims.end} {robot.name}"
        away = result.check(where, quantity, size, PUSHED, "rad/s2", rule="at least", about=About.PREDICTION).passed
        where = f"{claims.kept}, {LABELS[engine]}, RK4 at {FREE_STEP:g} s"
        quantity = f"angle from {claims.end} after {FREE_TIME:g} s, free"
        off = found["free_from_end"][engine]
        result.check(where, quantity, off, AT_REST, "rad", about=About.PREDICTION)
        ends.append(away)
    above = [row for row in rows if row["dt_s"] > limit]
    moves = bool(above) and all(row["observed_s"] is not None or (row["largest_rad"] or 0.0) > 1e-3 for row in above)
    word = ("bounded" if any(ends) else "reproduced") if stays and moves else "not reproduced"
    result.notes.append(
        f"Claim 3, {word}: the predicted limit of RK4 at {claims.kept} is {limit:.4f} s, {limit * found['fastest']:.4f} over "
        f"the rate of its fastest mode, {found['fastest']:.3f} rad/s. {above_in_words(above)} "
        f"{within_in_words(robot, rows, leaves, len(found['counts']))} "
        f"(Reproduced: it stays below the limit, moves by more than 1e-3 rad at each step above it, and can end at "
        f"{claims.end}; bounded: all but the last.)"
    )
    result.notes.append(end_in_words(robot, found))


def above_in_words(rows: list[dict]) -> str:
    """What becomes of the robot at each step above the limit."""
    texts = []
    for dt in sorted({row["dt_s"] for row in rows}):
        mine = [row for row in rows if row["dt_s"] == dt]
        away = [row["largest_rad"] for row in mine if row["largest_rad"] is not None]
        lost = sum(row["diverged_at_s"] is not None for row in mine)
        texts.append(
            f"at {dt:.4g} s "
            + f"{lost} of {len(mine)} runs diverge" * bool(lost)
            + " and " * bool(lost and away)
            + (f"{len(away)} of {len(mine)} runs stay within {max(away):.3f} rad" if away else "")
        )
    return f"Above it, {'; '.join(texts)}." if texts else "No step above it was taken."


def within_in_words(robot: Robot, rows: list[dict], leaves: Mapping[tuple, list[int]], tried: int) -> str:
    """When the posture is left with each torque, and with how many steps in a run of the claims."""
    texts = []
    for torque in NEAR_TORQUES:
        times = [(row["observed_s"], row["dt_s"]) for row in rows if row["torque"] == torque and row["observed_s"]]
        counts = [count for (_, name), found in leaves.items() if name == torque for count in found]
        soonest = (
            f"it leaves after {min(times)[0]:.2f} s at the soonest (dt = {min(times)[1]:.4g} s)"
            if times
            else "it stays"
        )
        within = f"the largest with which it leaves is {max(counts)}" if counts else "none lets it leave"
        name, run = torque.replace("four", "of four"), f"{robot.claims.duration:g} s"
        texts.append(f"With a torque {name} {soonest}; of {tried} numbers of steps tried for {run}, {within}.")
    return " ".join(texts)


def end_in_words(robot: Robot, found: dict) -> str:
    """Whether a run can end at the posture that is claimed, with the torque that holds and without."""
    claims, texts = robot.claims, []
    for engine, pushed in found["acceleration_at_end"].items():
        off = found["free_from_end"][engine]
        can = np.abs(pushed).max() < PUSHED
        text = (
            f"{LABELS[engine]}: the torque of {claims.kept} accelerates a {claims.end} {robot.name} by "
            f"({', '.join(f'{a:.1f}' for a in pushed)}) rad/s2, "
        )
        text += "so little that it may end there" if can else "so it does not end there while that torque acts"
        if off is None:
            text += "; the free run has diverged"
        else:
            rests = "hangs at rest" if off <= AT_REST else f"is not at rest at {claims.end}"
            text += f"; free, by RK4 at {FREE_STEP:g} s, it {rests} after {FREE_TIME:g} s, {off:.1e} rad off"
        texts.append(text)
    return f"Where a run from {claims.kept} can end. {'. '.join(texts)}."
