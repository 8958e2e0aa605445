"""The three claims of the assignment about the arm that is held by a constant torque and integrated by RK4.

1: it leaves a posture because of rounding. 2: with a finer step it leaves to the other side. 3: it stays at
another posture.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from ...core.check import About, Result
from ...engines import LABELS, Engine, Method
from ...judge.run import LEFT, departure, deviation, number_or_none
from ...robots import Claims, Robot
from ...stability.equilibrium import Equilibrium, equilibrium
from .departure import own_torque, variants
from .tables import ClaimRow, rk4_of_both

VARIANT, NEAREST, ONE_ULP = "variant", "nearest to own bias", "one ulp off"  # names of torques
ABOUT_SO_LATE = 1.0  # s: how near a time is, for "about"
WATCHED = 2.0  # runs of the claims: how long departure is awaited
STEP_COUNTS = (32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384)  # in a run of the claims
STEPS_BEYOND = (0.3, 0.3125, 1 / 3, 0.4, 0.5, 0.625, 1.0)  # s, about the limit of RK4
RUN_BEYOND = 4000  # steps
DIVERGED_RATE = 1e6  # rad/s: a run that is faster has diverged
MOVED = 1e-3  # rad: beyond its limit of the step a held robot moves by more
PUSHED = 1.0  # rad/s2: a robot that a torque accelerates by as much does not stay where it rests
Engines = Mapping[str, Engine]


def claims_of(robot: Robot) -> Claims:
    assert robot.claims is not None
    return robot.claims


def fraction(duration: float, dt: float) -> str:
    """A step that divides a run, as a fraction: 5/64."""
    return f"{duration:g}/{round(duration / dt)}"


def add(result: Result, rows: list[ClaimRow]) -> None:
    result.tables.setdefault("stability_claims", []).extend(rows)


def claim_row(
    claim: int, at: Equilibrium, method: Method, dt: float, path: np.ndarray, **more: object
) -> ClaimRow:
    """When a run of a claim leaves, and to which side. path: positions, (steps + 1, n)."""
    left = departure(dt * np.arange(len(path)), path)
    named = {"scene": at.name, "engine": method.engine, "method": method.name, "dt": dt}
    return ClaimRow(claim=claim, observed=left, direction=side(path, left, dt), **named | more)  # type: ignore[arg-type]


def side(path: np.ndarray, left: float | None, dt: float) -> int | None:
    """The side of its start on which the first joint is at departure: 1 larger, -1 smaller; None: never, or NaN."""
    away = np.nan if left is None else path[round(left / dt), 0] - path[0, 0]
    return int(np.sign(away)) if np.isfinite(away) else None


def holding_torques(robot: Robot, engines: Engines) -> list[ClaimRow]:
    """Claim 1: RK4 under all torques within an ulp of TMT's holding torque, then under an engine's own bias."""
    claims, at = claims_of(robot), equilibrium(robot, claims_of(robot).left)
    steps, within, rows = round(WATCHED * claims.duration / claims.dt), variants(at.tau), list[ClaimRow]()
    names = [*(f"{VARIANT} {k}" for k in range(1, len(within) + 1)), NEAREST]
    for method in rk4_of_both(engines):
        tau = np.vstack([within, own_torque(method, engines, at)])
        motion = at.run(method, engines, tau, claims.dt, steps)
        for name, path in zip(names, motion.q):
            moved = number_or_none(deviation(path, at.q))
            rows.append(claim_row(1, at, method, claims.dt, path, torque=name, moved=moved))
    return rows


def check_torques(result: Result, torques: list[ClaimRow], robot: Robot) -> None:
    """Claim 1: the posture is left after about the claimed time, because of rounding."""
    add(result, torques)
    claims, reproduced, values = claims_of(robot), True, []
    for engine in dict.fromkeys(row.engine for row in torques):
        *rows, own = [row for row in torques if row.engine == engine]  # the last by its own bias
        if (
            engine == "mujoco"
        ):  # of TMT no double need be the bias: compiled code rounds its last sum only once
            where, quantity = f"{claims.left}, {own.who}", "movement under the engine's own bias"
            reproduced &= result.check(where, quantity, own.moved, 0.0, "rad", about=About.PREDICTION).passed
        gone = [row.observed for row in rows if row.observed is not None]
        close = sum(abs(time - claims.left_after) <= ABOUT_SO_LATE for time in gone)
        reproduced &= 2 * close > len(rows)
        values.append({
            "label": LABELS[engine], "count": len(rows), "leave": len(gone), "close": close, "own_moved": own.moved,
            "times": (min(gone), max(gone)) if gone else None,
        })  # fmt: skip
    result.find(
        "claim_1", reproduced=reproduced, posture=claims.left, dt=fraction(claims.duration, claims.dt),
        after=claims.left_after, within=ABOUT_SO_LATE, engines=values,
    )  # fmt: skip


def finer_steps(robot: Robot, engines: Engines, counts: Sequence[int] = STEP_COUNTS) -> list[ClaimRow]:
    """Claim 2: departure under RK4 against the step, the torque one ulp off to either side at the first joint."""
    claims, at = claims_of(robot), equilibrium(robot, claims_of(robot).left)
    rows = list[ClaimRow]()
    for method in rk4_of_both(engines):
        own = own_torque(method, engines, at)
        for sign in (1.0, -1.0):
            tau = own.copy()
            tau[0] = np.nextafter(own[0], sign * np.inf)
            for count in counts:
                dt = claims.duration / count
                motion = at.run(method, engines, tau, dt, round(WATCHED * count))
                i = int(np.argmax(np.abs(motion.v[count]) / np.spacing(np.abs(at.q))))
                moved = number_or_none(deviation(motion.q[: count + 1], at.q))
                rows.append(claim_row(
                    2, at, method, dt, motion.q, ulps=int(sign), moved=moved,
                    step=number_or_none(dt * abs(motion.v[count, i])), half_ulp=0.5 * float(np.spacing(abs(at.q[i]))),
                ))  # fmt: skip
    return rows


def check_finer_steps(result: Result, finer: list[ClaimRow], robot: Robot) -> None:
    """Claim 2: a smaller step reverses the side, and a very small one leaves the robot in place."""
    add(result, finer)
    claims, still, turned, leave = claims_of(robot), True, 0, True
    series = list(dict.fromkeys((row.engine, row.ulps) for row in finer))
    for engine, sign in series:
        rows = [row for row in finer if (row.engine, row.ulps) == (engine, sign)]
        finest = min(rows, key=lambda row: row.dt)
        count = round(claims.duration / finest.dt)
        where = f"{claims.left}, {finest.who}, torque {sign:+d} ulp"
        quantity = f"movement in {claims.duration:g} s at {count} steps"
        still &= result.check(where, quantity, finest.moved, 0.0, "rad", about=About.PREDICTION).passed
        sides = [row.direction for row in rows if row.direction]
        turned += any(before != after for before, after in pairwise(sides))
        leave &= bool(sides)
    met = {3: "yes", 2: "in part"}.get(bool(turned) + still + leave, "no")
    result.find(
        "claim_2", reproduced=met, joint=robot.joints[0], series=len(series), turned=turned, still=still, count=count,
        seconds=claims.duration, step=finest.step, half_ulp=finest.half_ulp,
    )  # fmt: skip


def kept(robot: Robot, engines: Engines, steps: int = RUN_BEYOND) -> list[ClaimRow]:
    """Claim 3: RK4 at the posture that is kept, below and beyond its limit, the torque one ulp off."""
    at, rows = equilibrium(robot, claims_of(robot).kept), list[ClaimRow]()
    for method in rk4_of_both(engines):
        tau = np.nextafter(own_torque(method, engines, at), np.inf)
        for dt in STEPS_BEYOND:
            motion = at.run(method, engines, tau, dt, steps)
            fast = ~(np.abs(motion.v).max(axis=1) < DIVERGED_RATE)  # no number from there on is motion
            moved = None if fast.any() else number_or_none(deviation(motion.q, at.q))
            ended = float(dt * np.argmax(fast)) if fast.any() else None
            about = {"torque": ONE_ULP, "run": dt * steps, "diverged_at": ended, "moved": moved}
            rows.append(claim_row(3, at, method, dt, motion.q, **about))
    return rows


def accelerations_at_end(robot: Robot, engines: Engines) -> dict[str, float]:
    """The largest acceleration at the claimed end under the torque that holds the other posture, rad/s2, by engine."""
    at, q = equilibrium(robot, claims_of(robot).kept), robot.posture(claims_of(robot).end)
    dynamics, rest = {name: engines[name].of(at.case) for name in robot.compared}, np.zeros_like(q)
    return {
        LABELS[name]: float(np.abs(of.acceleration(q, rest, at.tau)).max()) for name, of in dynamics.items()
    }


def check_kept(result: Result, rows: list[ClaimRow], robot: Robot, ends: Mapping[str, float]) -> None:
    """Claim 3: held beyond the limit of RK4. ends: accelerations at the claimed end, rad/s2."""
    add(result, rows)
    claims, stays, leaves_end, about = claims_of(robot), True, False, About.PREDICTION
    at = equilibrium(robot, claims.kept)
    limit = at.limit("rk4")[1] or 0.0
    for row in (row for row in rows if row.dt < limit):
        where = f"{claims.kept}, {row.who}, dt = {row.dt:.4g} s, torque {row.torque}"
        run, what = row.run or 0.0, f"time within {LEFT:g} rad, below the limit"
        time = run if row.observed is None else row.observed
        stays &= result.check(where, what, time, run, "s", rule="at least", about=about).passed
    for label, size in ends.items():
        quantity = f"acceleration that {claims.kept}'s torque gives a {claims.end} {robot.name}"
        where = f"{claims.end}, {label}"
        check = result.check(where, quantity, size, PUSHED, "rad/s2", rule="at least", about=about)
        leaves_end |= check.passed
    above = [row for row in rows if row.dt > limit]
    moves = bool(above) and all(row.observed is not None or (row.moved or 0.0) > MOVED for row in above)
    result.find(
        "claim_3", reproduced=("bounded" if leaves_end else "yes") if stays and moves else "no", posture=claims.kept,
        end=claims.end, noun=robot.noun, limit=limit, rate=at.fastest, above=len(above), ends=ends,
        diverged=sum(row.diverged_at is not None for row in above),
        farthest=max((row.moved for row in above if row.moved is not None), default=None),
    )  # fmt: skip
