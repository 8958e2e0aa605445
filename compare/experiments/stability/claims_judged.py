"""What the runs make of the claims about a posture that is left: checks and sentences."""

from itertools import pairwise

import numpy as np

from ...engines import LABELS
from ...judge.check import About, Result
from ...judge.run import LEFT, number_or_nan
from ...robots import Robot
from .choice import fraction, who
from .claims import CLEAR_TORQUES, CLEAR_ULPS, NEAREST, VARIANT, ulps_of, watched
from .departure import check_row, span

ABOUT_SO_LATE = 1.0  # s: how near a time is, for "about"


def sides(joint: str) -> dict:
    """The sides to which the first joint leaves, in words."""
    return {1: f"larger {joint}", -1: f"smaller {joint}", 0: "neither side", None: "no side"}


def check_claims(
    result: Result, robot: Robot, torques: list[dict], finer: list[dict] | None, printed: list[dict]
) -> None:
    """Checks, tables and sentences about the posture that is left: in the last bit, with finer steps, as it is printed."""
    check_torques(result, robot, torques)
    if finer:
        check_finer_steps(result, robot, finer)
    check_printed_torque(result, robot, printed)


def check_torques(result: Result, robot: Robot, torques: list[dict]) -> None:
    """Claim 1: the posture is left after about so long, because of rounding."""
    result.tables["stability_torques"] = torques
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
            result.check(
                where, "movement under the engine's own bias", own["moved_rad"], 0.0, "rad", about=About.PREDICTION
            )
        gone = [row for row in rows if row["observed_s"] is not None]
        near_claim = sum(abs(row["observed_s"] - claims.left_after) <= ABOUT_SO_LATE for row in gone)
        off = max((number_or_nan(row["residual_ulps"]) for row in rows), default=np.nan)
        findings += [2 * near_claim > len(rows), bool(off < CLEAR_ULPS)]
        texts.append(torques_in_words(robot, engine, rows, own, near_claim, off))
    passed = all(check.passed for check in result.checks[first:])
    word = "reproduced" if passed and all(findings) else "not reproduced"
    result.notes.append(
        f"Claim 1, {word}: held at {claims.left} by RK4 at {fraction(claims.duration, claims.dt)} s under each of the "
        f"{len(rows)} torques within one unit in the last place of TMT's. {'. '.join(texts)}. (Reproduced: in both engines "
        f"more than half leave within {ABOUT_SO_LATE:g} s of {claims.left_after:g} s, the residual of the torque is below "
        f"{CLEAR_ULPS} ulps, which is rounding, and the checks of the claim pass: under {CLEAR_ULPS} ulps the residual decides "
        "side and time, under MuJoCo's own bias nothing moves.)"
    )


def torques_in_words(robot: Robot, engine: str, rows: list[dict], own: dict, near_claim: int, off: float) -> str:
    """What the torques in the last bit do in one engine."""
    to = sides(robot.joints[0])
    gone = [row for row in rows if row["observed_s"] is not None]
    by_side = [f"{sum(row['direction'] == k for row in gone)} to {to[k]}" for k in (1, -1)]
    against = [abs(row["push_rad_per_s2"]) for row in gone if row["direction"] != np.sign(row["push_rad_per_s2"])]
    text = f"{LABELS[engine]}: {len(gone)} leave"
    if gone:
        text += (
            f", after {span(row['observed_s'] for row in gone)} ({near_claim} within {ABOUT_SO_LATE:g} s of "
            f"{robot.claims.left_after:g} s), {' and '.join(by_side)}; {len(gone) - len(against)} of them to the side to which "
            f"the residual of the torque, at most {off:.3g} ulps, pushes the unstable mode"
        )
        text += f" (the others are pushed by at most {max(against):.1e} rad/s2)" if against else ""
    moved = f"the {robot.noun} leaves after {span([own['observed_s']])}"
    if own["moved_rad"] == 0.0:
        moved = "nothing moves"
    elif own["observed_s"] is None:
        moved = f"the {robot.noun} stays within {LEFT:g} rad"
    return (
        text
        + f"; under the torque nearest to its own bias ({number_or_nan(own['residual_ulps']):.2g} ulps off) {moved}"
    )


def check_finer_steps(result: Result, robot: Robot, finer: list[dict]) -> None:
    """Claim 2: a smaller step reverses the side, and a very small one leaves the robot in place."""
    result.tables["stability_finer_steps"] = finer
    claims, joint, column = robot.claims, robot.joints[0], ulps_of(robot)[0]

    def steps_of(row) -> int:
        return round(claims.duration / row["dt_s"])

    count, still = max(steps_of(row) for row in finer), True
    for row in (row for row in finer if steps_of(row) == count):
        where = f"{claims.left}, {who(row)}, torque {row[column]:+d} ulp"
        quantity = f"movement in {claims.duration:g} s at {count} steps"
        still &= result.check(where, quantity, row["moved_rad"], 0.0, "rad", about=About.PREDICTION).passed
    series, turned, leave = [], 0, True
    for engine, sign in dict.fromkeys((row["engine"], row[column]) for row in finer):
        rows = [row for row in finer if (row["engine"], row[column]) == (engine, sign) and row["direction"]]
        turns = [row for before, row in pairwise(rows) if before["direction"] != row["direction"]]
        turned += bool(turns)
        leave &= bool(rows)
        series.append(
            f"{LABELS[engine]} {sign:+d} ulp to {sides(joint)[rows[0]['direction'] if rows else None]}"
            + "".join(f", from {steps_of(row)} steps on to {sides(joint)[row['direction']]}" for row in turns)
        )
    met = bool(turned) + bool(still) + leave
    word = {3: "reproduced", 2: "reproduced in part"}.get(met, "not reproduced")
    rows = [row for row in finer if row["engine"] == "tmt" and row[column] == 1]
    times = ", ".join(
        f"{steps_of(row)}: " + ("never" if row["observed_s"] is None else f"{row['observed_s']:.2f} s") for row in rows
    )
    last = rows[-1]
    lost = last["step_rad"] is not None and last["step_rad"] < last["half_ulp_rad"]
    run = f"{claims.duration:g} s"
    result.notes.append(
        f"Claim 2, {word}: the torque one ulp off in {joint}, {len(rows)} steps from {rows[0]['dt_s']:.4g} s down. "
        f"{'; '.join(series)}. A smaller step reverses the side in {turned} of these {len(series)} series; with {count} steps "
        f"in {run} {'nothing moves in any' if still else f'not every {robot.name} stays where it is'}. Steps in {run} and time "
        f"to leave (TMT +1 ulp, within {watched(claims):g} s): {times}. What a step adds to an angle, dt qd, is "
        f"{number_or_nan(last['step_rad']):.1e} rad after {run} at {steps_of(last)} steps: "
        f"{'less' if lost else 'not less'} than half a unit in the last place of the angle that it would change "
        f"first, {last['half_ulp_rad']:.1e} rad"
        f"{', so it is lost in the sum' if lost else ''}. (Reproduced: every series leaves at some step, at least one "
        f"reverses its side, and with the most steps nothing moves in {run}; in part: two of these.)"
    )


def check_printed_torque(result: Result, robot: Robot, printed: list[dict]) -> None:
    """The torque as it is printed: every departure is as predicted."""
    claims = robot.claims
    result.tables.setdefault("departure", []).extend(printed)
    for row in printed:
        check_row(result, f"{row['scene']}, {who(row)}, dt = {row['dt_s']:.4g} s", row)
    stay = sum(row["observed_s"] is None for row in printed)
    result.notes.append(
        f"The torque as printed, four decimals, in {len(printed)} runs of both engines at {claims.left} with steps from "
        f"{max(row['dt_s'] for row in printed):.4g} s down: the {robot.noun} leaves after "
        f"{span(row['observed_s'] for row in printed)}"
        + (
            f"; runs in which it stays: {stay}."
            if stay
            else f". The assignment's {robot.name} leaves after about {claims.left_after:g} s."
        )
    )
