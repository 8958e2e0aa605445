"""The three claims of the assignment about the arm that is held by a constant torque and integrated by RK4: runs and checks.

1: it leaves a posture because of rounding. 2: with a finer step it leaves to the other side. 3: it stays at another posture.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ...core.check import About, Result
from ...engines import LABELS, Engine, Method
from ...judge.run import LEFT, departure, deviation, number_or_none
from ...robots import Claims, Robot
from ...stability.held import Held, held
from .departure import check_row, own_torque, predicted, residual, variants
from .subjects import fraction, rk4_of_both
from .tables import ClaimRow

CLEAR_ULPS = 16  # of each component: a push that rounding of the bias on the way cannot turn round
VARIANT, NEAREST = "variant", "nearest to own bias"  # names of torques
CLEAR_TORQUES = (f"{CLEAR_ULPS} ulps up", f"{CLEAR_ULPS} ulps down")
ONE_ULP = "one ulp off"
ABOUT_SO_LATE = 1.0  # s: how near a time is, for "about"
WATCHED = 2.0  # runs of the claims: how long departure is awaited
STEP_COUNTS = (32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384)  # in a run of the claims
STEPS_BEYOND = (0.3, 0.3125, 1 / 3, 0.4, 0.5, 0.625, 1.0)  # s, about the limit of RK4
RUN_BEYOND = 4000  # steps
DIVERGED_RATE = 1e6  # rad/s: a run that is faster has diverged
MOVED = 1e-3  # rad: beyond its limit of the step a held robot moves by more
PUSHED = 1.0  # rad/s2: a robot that a torque accelerates by as much does not stay where it rests


def claims_of(robot: Robot) -> Claims:
    assert robot.claims is not None
    return robot.claims


def claim_row(claim: int, at: Held, method: Method, dt: float, path: np.ndarray, **more: Any) -> ClaimRow:
    """When a run of a claim leaves, and to which side. path: positions, (steps + 1, n)."""
    left = departure(dt * np.arange(len(path)), path)
    return ClaimRow(
        claim=claim, scene=at.name, engine=method.engine, method=method.name, dt=dt, observed=left,
        direction=side(path, left, dt), **more,
    )  # fmt: skip


def side(path: np.ndarray, left: float | None, dt: float) -> int | None:
    """The side of its start on which the first joint is at departure: 1 larger, -1 smaller; None: never, or NaN."""
    away = np.nan if left is None else path[round(left / dt), 0] - path[0, 0]
    return int(np.sign(away)) if np.isfinite(away) else None


# claim 1


def holding_torques(robot: Robot, engines: Mapping[str, Engine]) -> list[ClaimRow]:
    """All torques within one ulp of TMT's holding torque by RK4; then own biases; then 16 ulps."""
    claims, at = claims_of(robot), held(robot, claims_of(robot).left)
    steps = round(WATCHED * claims.duration / claims.dt)
    within = variants(at.tau)
    names = [*(f"{VARIANT} {k}" for k in range(1, len(within) + 1)), NEAREST, *CLEAR_TORQUES]
    rows = []
    for method in rk4_of_both(engines):
        own = own_torque(method, engines, at)
        aside = CLEAR_ULPS * np.spacing(np.abs(own)) * np.sign(pushes(at))
        tau = np.vstack([within, own, own + aside, own - aside])
        rest = np.zeros_like(tau)
        off = residual(method, engines, at, tau)
        motion = engines[method.engine].of(at.case).run(at.q + rest, rest, tau, claims.dt, steps, method.name)
        expected = predicted(at, method.scheme, claims.dt, rest, off)
        for k, path in enumerate(motion.q):
            rows.append(claim_row(
                1, at, method, claims.dt, path, torque=names[k], push=float(pushes(at) @ off[k]),
                predicted=expected[k], moved=number_or_none(deviation(path, at.q)),
            ))  # fmt: skip
    return rows


def pushes(at: Held) -> np.ndarray:
    """What a torque does to the fastest unstable mode, 1/(kg m2), (n,): its product with a torque is in rad/s2.

    The left eigenvector, its rates scaled to length 1; positive where the first joint moves to a larger angle.
    """
    n, vectors = len(at.q), at.modes[1]
    measure = np.linalg.inv(vectors)[0] * np.sign(vectors[0, 0].real)
    return (measure[n:] / np.linalg.norm(measure[n:])).real @ np.linalg.inv(at.mass_matrix)


def check_torques(result: Result, torques: list[ClaimRow], robot: Robot) -> None:
    """Claim 1: the posture is left after about the claimed time, because of rounding."""
    result.tables.setdefault("stability_claims", []).extend(torques)
    claims, reproduced, values = claims_of(robot), True, []
    for engine, method in dict.fromkeys((row.engine, row.method) for row in torques):
        of_engine = [row for row in torques if row.engine == engine]
        rows = [row for row in of_engine if row.torque.startswith(VARIANT)]
        (own,) = (row for row in of_engine if row.torque == NEAREST)
        where, first = f"{claims.left}, {LABELS[engine]} {method}", len(result.checks)
        for row in (row for row in of_engine if row.torque in CLEAR_TORQUES):
            along = None if row.direction is None else row.direction * np.sign(row.push or 0.0)
            at, text = (
                f"{where}, torque {row.torque}",
                "departure along the push of the residual (1; against it: -1)",
            )
            result.check(at, text, along, 1, "", rule="equal", about=About.PREDICTION)
            check_row(result, at, row)
        if (
            engine == "mujoco"
        ):  # of TMT no double need be the bias: compiled code rounds its last sum only once
            quantity = "movement under the engine's own bias"
            result.check(where, quantity, own.moved, 0.0, "rad", about=About.PREDICTION)
        gone = [row.observed for row in rows if row.observed is not None]
        close = sum(abs(time - claims.left_after) <= ABOUT_SO_LATE for time in gone)
        reproduced &= 2 * close > len(rows) and all(check.passed for check in result.checks[first:])
        values.append({
            "label": LABELS[engine], "count": len(rows), "leave": len(gone), "close": close, "own_moved": own.moved,
            "times": (min(gone), max(gone)) if gone else None,
        })  # fmt: skip
    result.find(
        "claim_1", reproduced=reproduced, posture=claims.left, dt=fraction(claims.duration, claims.dt),
        after=claims.left_after, within=ABOUT_SO_LATE, engines=values,
    )  # fmt: skip


# claim 2


def finer_steps(
    robot: Robot, engines: Mapping[str, Engine], counts: Sequence[int] = STEP_COUNTS
) -> list[ClaimRow]:
    """Departure under RK4 against the step, the torque one ulp off to either side at the first joint."""
    claims, at = claims_of(robot), held(robot, claims_of(robot).left)
    rest, rows = np.zeros_like(at.q), []
    for method in rk4_of_both(engines):
        own, dynamics = own_torque(method, engines, at), engines[method.engine].of(at.case)
        for sign in (1.0, -1.0):
            tau = own.copy()
            tau[0] = np.nextafter(own[0], sign * np.inf)
            for count in counts:
                dt = claims.duration / count
                motion = dynamics.run(at.q, rest, tau, dt, round(WATCHED * count), method.name)
                i = int(np.argmax(np.abs(motion.v[count]) / np.spacing(np.abs(at.q))))
                rows.append(claim_row(
                    2, at, method, dt, motion.q, ulps=int(sign),
                    moved=number_or_none(deviation(motion.q[: count + 1], at.q)),
                    step=number_or_none(dt * abs(motion.v[count, i])), half_ulp=0.5 * float(np.spacing(abs(at.q[i]))),
                ))  # fmt: skip
    return rows


def check_finer_steps(result: Result, finer: list[ClaimRow], robot: Robot) -> None:
    """Claim 2: a smaller step reverses the side, and a very small one leaves the robot in place."""
    result.tables.setdefault("stability_claims", []).extend(finer)
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


# claim 3


def kept(robot: Robot, engines: Mapping[str, Engine], steps: int = RUN_BEYOND) -> list[ClaimRow]:
    """RK4 at the posture that is kept, below and beyond its limit, the torque one ulp off."""
    at = held(robot, claims_of(robot).kept)
    rest, rows = np.zeros_like(at.q), []
    for method in rk4_of_both(engines):
        tau = np.nextafter(own_torque(method, engines, at), np.inf)
        dynamics = engines[method.engine].of(at.case)
        for dt in STEPS_BEYOND:
            with np.errstate(over="ignore", invalid="ignore"):
                motion = dynamics.run(at.q, rest, tau, dt, steps, method.name)
            fast = ~(np.abs(motion.v).max(axis=1) < DIVERGED_RATE)  # no number from there on is motion
            rows.append(claim_row(
                3, at, method, dt, motion.q, torque=ONE_ULP, run=dt * steps,
                diverged_at=float(dt * np.argmax(fast)) if fast.any() else None,
                moved=None if fast.any() else number_or_none(deviation(motion.q, at.q)),
            ))  # fmt: skip
    return rows


def accelerations_at_end(robot: Robot, engines: Mapping[str, Engine]) -> dict[str, float]:
    """The largest acceleration at the claimed end under the torque that holds the other posture, rad/s2, by engine."""
    claims, at = claims_of(robot), held(robot, claims_of(robot).kept)
    q, sizes = robot.posture(claims.end), {}
    for method in rk4_of_both(engines):
        qdd = engines[method.engine].of(at.case).acceleration(q, np.zeros_like(q), at.tau)
        sizes[LABELS[method.engine]] = float(np.abs(qdd).max())
    return sizes


def check_kept(result: Result, rows: list[ClaimRow], robot: Robot, ends: Mapping[str, float]) -> None:
    """Claim 3: held beyond the limit of RK4. ends: accelerations at the claimed end, rad/s2."""
    claims, stays, leaves_end, about = claims_of(robot), True, False, About.PREDICTION
    at = held(robot, claims.kept)
    limit, rate = at.limit("rk4")[1] or 0.0, float(np.abs(at.modes[0]).max())
    result.tables.setdefault("stability_claims", []).extend(rows)
    for row in (row for row in rows if row.dt < limit):
        where = f"{claims.kept}, {row.who}, dt = {row.dt:.4g} s, torque {row.torque}"
        run = row.run or 0.0
        time = run if row.observed is None else row.observed
        what = f"time within {LEFT:g} rad, below the limit"
        stays &= result.check(where, what, time, run, "s", rule="at least", about=about).passed
    for label, size in ends.items():
        where = f"{claims.end}, {label}"
        quantity = f"acceleration that {claims.kept}'s torque gives a {claims.end} {robot.name}"
        leaves_end |= result.check(
            where, quantity, size, PUSHED, "rad/s2", rule="at least", about=about
        ).passed
    above = [row for row in rows if row.dt > limit]
    moves = bool(above) and all(row.observed is not None or (row.moved or 0.0) > MOVED for row in above)
    result.find(
        "claim_3", reproduced=("bounded" if leaves_end else "yes") if stays and moves else "no", posture=claims.kept,
        end=claims.end, noun=robot.noun, limit=limit, rate=rate, above=len(above), ends=ends,
        diverged=sum(row.diverged_at is not None for row in above),
        farthest=max((row.moved for row in above if row.moved is not None), default=None),
    )  # fmt: skip
