"""The checks of the three claims, and whether the runs reproduce them."""

from itertools import pairwise

import numpy as np

from ...engines import LABELS
from ...judge.check import About, Result
from ...judge.run import LEFT, number_or_nan
from ...robots import Robot
from .claims import CLEAR_TORQUES, CLEAR_ULPS, FREE_STEP, FREE_TIME, NEAREST, ONE_ULP, VARIANT, ulps_of
from .departure import check_row, span
from .subjects import fraction, who

ABOUT_SO_LATE = 1.0  # s: how near a time is, for "about"
MOVED = 1e-3  # rad: beyond its limit of the step a held robot moves by more
PUSHED = 1.0  # rad/s2: a robot that a torque accelerates by as much does not stay where it rests
AT_REST = 1e-9  # rad: so near the posture it rests there


def add_rows(result: Result, rows: list[dict]) -> None:
    """Add rows to the table of the claims."""
    result.tables.setdefault("stability_claims", []).extend(rows)


def check_torques(result: Result, robot: Robot, torques: list[dict]) -> None:
    """Claim 1: the posture is left after about the claimed time, because of rounding."""
    add_rows(result, torques)
    claims, first, texts, findings = robot.claims, len(result.checks), [], []
    for engine, method in dict.fromkeys((row["engine"], row["method"]) for row in torques):
        of_engine = [row for row in torques if row["engine"] == engine]
        rows = [row for row in of_engine if row["torque"].startswith(VARIANT)]
        (own,) = (row for row in of_engine if row["torque"] == NEAREST)
        where = f"{claims.left}, {LABELS[engine]} {method}"
        for row in (row for row in of_engine if row["torque"] in CLEAR_TORQUES):
            along = None if row["direction"] is None else row["direction"] * np.sign(row["push_rad_per_s2"])
            text = "departure along the push of the residual (1; against it: -1)"
            result.check(f"{where}, torque {row['torque']}", text, along, 1, "", rule="equal", about=About.PREDICTION)
            check_row(result, f"{where}, torque {row['torque']}", row)
        if engine == "mujoco":  # of TMT no double need be the bias: compiled code rounds its last sum only once
            quantity = "movement under the engine's own bias"
            result.check(where, quantity, own["moved_rad"], 0.0, "rad", about=About.PREDICTION)
        gone = [row for row in rows if row["observed_s"] is not None]
        near_claim = sum(abs(row["observed_s"] - claims.left_after) <= ABOUT_SO_LATE for row in gone)
        off = max((number_or_nan(row["residual_ulps"]) for row in rows), default=np.nan)
        findings += [2 * near_claim > len(rows), bool(off < CLEAR_ULPS)]
        texts.append({
            "label": LABELS[engine], "count": len(rows), "leave": len(gone), "times": span(row["observed_s"] for row in gone),
            "close": near_claim, "larger": sum(row["direction"] == 1 for row in gone),
            "smaller": sum(row["direction"] == -1 for row in gone), "ulps": off, "own_moved": own["moved_rad"],
            "own_left": own["observed_s"], "along": sum(row["direction"] == np.sign(row["push_rad_per_s2"]) for row in gone),
        })  # fmt: skip
    passed = all(check.passed for check in result.checks[first:])
    values = {"posture": claims.left, "dt": fraction(claims.duration, claims.dt), "after": claims.left_after}
    reproduced = passed and all(findings)
    result.find("claim_1", reproduced=reproduced, within=ABOUT_SO_LATE, joint=robot.joints[0], engines=texts, **values)


def check_finer_steps(result: Result, robot: Robot, finer: list[dict]) -> None:
    """Claim 2: a smaller step reverses the side, and a very small one leaves the robot in place."""
    add_rows(result, finer)
    claims, column = robot.claims, ulps_of(robot)[0]

    def steps_of(row) -> int:
        return round(claims.duration / row["dt_s"])

    count, still = max(steps_of(row) for row in finer), True
    for row in (row for row in finer if steps_of(row) == count):
        where = f"{claims.left}, {who(row)}, torque {row[column]:+d} ulp"
        quantity = f"movement in {claims.duration:g} s at {count} steps"
        still &= result.check(where, quantity, row["moved_rad"], 0.0, "rad", about=About.PREDICTION).passed
    turned, series, leave = 0, list(dict.fromkeys((row["engine"], row[column]) for row in finer)), True
    for engine, sign in series:
        rows = [row for row in finer if (row["engine"], row[column]) == (engine, sign) and row["direction"]]
        turned += any(before["direction"] != row["direction"] for before, row in pairwise(rows))
        leave &= bool(rows)
    last = [row for row in finer if row["engine"] == "tmt" and row[column] == 1][-1]
    met = bool(turned) + bool(still) + leave
    values = {"series": len(series), "turned": turned, "still": still, "count": count, "seconds": claims.duration}
    values |= {"step": last["step_rad"], "half_ulp": last["half_ulp_rad"], "joint": robot.joints[0]}
    result.find("claim_2", reproduced={3: "yes", 2: "in part"}.get(met, "no"), **values)


def check_printed_torque(result: Result, robot: Robot, printed: list[dict]) -> None:
    """Every departure under the printed torque is as predicted."""
    claims = robot.claims
    result.tables.setdefault("departure", []).extend(printed)
    for row in printed:
        check_row(result, f"{row['scene']}, {who(row)}, dt = {row['dt_s']:.4g} s", row)
    times = span(row["observed_s"] for row in printed)
    stay = sum(row["observed_s"] is None for row in printed)
    values = {"posture": claims.left, "count": len(printed), "after": claims.left_after}
    result.find("printed_torque", **values, times=times, stay=stay, noun=robot.noun)


def check_kept(result: Result, robot: Robot, runs: dict) -> None:
    """Claim 3: held beyond the limit of RK4."""
    claims, rows, limit, leaves = robot.claims, runs["rows"], runs["limit"], runs["leaves"]
    add_rows(result, rows)
    first = len(result.checks)
    for row in (row for row in rows if row["dt_s"] < limit):
        where = f"{claims.kept}, {who(row)}, dt = {row['dt_s']:.4g} s, torque {row['torque']}"
        stays = row["run_s"] if row["observed_s"] is None else row["observed_s"]
        what = f"time within {LEFT:g} rad, below the limit"
        result.check(where, what, stays, row["run_s"], "s", rule="at least", about=About.PREDICTION)
    for engine, counts in leaves.items():
        where = f"{claims.kept}, {LABELS[engine]}, torque {ONE_ULP}"
        quantity = f"numbers of steps in {claims.duration:g} s with which it leaves"
        result.check(where, quantity, len(counts), 0, "", rule="equal", about=About.PREDICTION)
    stays = all(check.passed for check in result.checks[first:])
    ends, leaves_end = [], False
    for engine, pushed in runs["acceleration_at_end"].items():
        where, size = f"{claims.end}, {LABELS[engine]}", float(np.abs(pushed).max())
        quantity = f"acceleration that {claims.kept}'s torque gives a {claims.end} {robot.name}"
        options = {"rule": "at least", "about": About.PREDICTION}
        leaves_end |= result.check(where, quantity, size, PUSHED, "rad/s2", **options).passed
        where = f"{claims.kept}, {LABELS[engine]}, RK4 at {FREE_STEP:g} s"
        quantity = f"angle from {claims.end} after {FREE_TIME:g} s, free"
        off = runs["free_from_end"][engine]
        rests = result.check(where, quantity, off, AT_REST, "rad", about=About.PREDICTION).passed
        ends.append({"label": LABELS[engine], "acceleration": size, "rests": rests})
    above = [row for row in rows if row["dt_s"] > limit]
    moves = bool(above) and all(row["observed_s"] is not None or (row["moved_rad"] or 0.0) > MOVED for row in above)
    values = {"posture": claims.kept, "end": claims.end, "noun": robot.noun, "limit": limit, "rate": runs["fastest"]}
    values |= {"above": len(above), "diverged": sum(row["diverged_at_s"] is not None for row in above)}
    farthest = max((row["moved_rad"] for row in above if row["moved_rad"] is not None), default=None)
    reproduced = ("bounded" if leaves_end else "yes") if stays and moves else "no"
    result.find("claim_3", reproduced=reproduced, farthest=farthest, ends=ends, seconds=FREE_TIME, **values)
