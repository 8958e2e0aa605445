"""Step limits: up to which dt a method keeps a small deviation small, predicted from one step and observed in runs."""

import numpy as np

from .linear import held
from .parties import farthest, finite
from .scenes import posture

SIZE = 1e-6  # rad, of the deviation at the start
STEPS = 2000
ALLOWED = 100.0  # fold growth of the deviation
CRITERION = f"growth below {ALLOWED:.0f}-fold in {STEPS} steps"
STEP_GROWTH = "growth of a step is above 1 at every dt"
COARSE = np.geomspace(1e-4, 1e2, 25)  # s: steps among which the observed limit is sought
LAST = 150  # steps at the end of a run
CLOSE = 1e-4  # to which it is then bisected
GROWTH_STEPS = (1e-3, 1e-2, 5 / 64)  # s: where growth per step is compared, in scenes in which a method always fails
AIM, AIM_DAMPED = 0.002, 0.005  # relative, of an observed limit to the predicted one
GROWN = (
    1e-3  # relative, of the growth in all steps: the deviation reaches 1e-5 rad, and its square is not in a linear map
)
TINY, TOTAL, MOST = 1e-8, 1e3, 200  # rad, of the deviation there; how much it may grow; in at most how many steps


def examine(scene, mujoco, parties) -> dict:
    """Rows for tables/stability.csv and tables/stability_growth.csv of one (posture, damping)."""
    name, damping = scene
    at = held(name, posture(name), damping)
    rows, growths = [], []
    for party in parties:
        kind, predicted = at.limit(party.scheme)
        dt = GROWTH_STEPS[1] if predicted is None else 1.001 * predicted  # just above the limit its mode grows fastest
        _, shape, _ = at.fastest_growing(party.scheme, dt)
        expected = observed = None
        if kind == "always_fails":
            found = [growth_per_step(party, mujoco, at, dt) for dt in GROWTH_STEPS]
            growths += found
            seen = kind if all((row["observed_growth"] or 0.0) > 1.0 for row in found) else "finite"
        else:
            direction = shape[:3].real / np.abs(shape[:3].real).max()
            seen, observed = observed_limit(party, mujoco, at, direction)
            if kind == "finite":
                expected = linear_limit(at, party.scheme, direction, predicted)
        rows.append({
            "scene": name, "engine": party.engine, "method": party.method, "damping": damping,
            "mode_per_s": np.abs(at.modes[0]).max() if kind == "never_fails" else at.rate(shape),
            "predicted_dt_s": predicted, "observed_dt_s": observed, "limit": kind,
            "criterion": STEP_GROWTH if kind == "always_fails" else CRITERION, "seen": seen, "expected": expected,
        })  # fmt: skip
    return {"rows": rows, "growths": growths}


def growth(party, mujoco, at, direction, dt, size=SIZE, steps=STEPS) -> float:
    """The largest deviation of a run over that at its start, which is size x direction, rad; inf if it diverged."""
    start = at.q + size * direction
    with np.errstate(over="ignore", invalid="ignore"):
        q, _ = party.run(mujoco, at.model, start, np.zeros_like(start), at.tau, float(dt), steps)
        return farthest(q, at.q) / size


def observed_limit(party, mujoco, at, direction) -> tuple[str, float | None]:
    """The largest dt for which the deviation grows less than 100-fold in 2,000 steps, found without the prediction.

    Upwards through COARSE to the first step that fails, then by bisection; ("never_fails", None) if none does.
    """
    low = None
    for high in COARSE:
        if not growth(party, mujoco, at, direction, high) < ALLOWED:
            break
        low = high
    else:
        return "never_fails", None
    if low is None:
        return "always_fails", None
    while high / low > 1.0 + CLOSE:
        middle = np.sqrt(low * high)
        low, high = (middle, high) if growth(party, mujoco, at, direction, middle) < ALLOWED else (low, middle)
    return "finite", float(low)


def linear_limit(at, scheme, direction, near) -> float:
    """The same criterion applied to the method's own linear map: the first dt above about `near` that fails it."""
    low, high = 0.9 * near, 1.5 * near
    state = np.concatenate([direction, np.zeros_like(direction)])
    count = np.arange(STEPS - LAST, STEPS + 1)  # near the edge the deviation is largest within the last swing
    for _ in range(3):
        steps = np.linspace(low, high, 61)
        with np.errstate(over="ignore", invalid="ignore"):
            values, vectors = np.linalg.eig(at.step(scheme, steps))
            share = np.linalg.solve(vectors, np.broadcast_to(state, (len(steps), 6))[..., None])[..., 0]
            powers = values[:, :, None] ** count * share[:, :, None]
            largest = np.abs(np.einsum("sij,sjn->sin", vectors[:, :3], powers)).max(axis=(1, 2))
        first = int(np.argmax(~(largest < ALLOWED)))
        low, high = steps[max(first - 1, 0)], steps[first]
    return float(low)


def growth_per_step(party, mujoco, at, dt) -> dict:
    """How much the fastest-growing mode grows in one step: in a run, by its share in the deviation, and predicted."""
    predicted, shape, measure = at.fastest_growing(party.scheme, dt)
    steps = int(np.clip(np.log(TOTAL) / np.log(predicted), 2, MOST))
    start = TINY * shape.real
    q, qd = party.run(mujoco, at.model, at.q + start[:3], start[3:], at.tau, dt, steps)
    share = np.abs(np.concatenate([q - at.q, qd], axis=1) @ measure)
    total = share[-1] / share[0]
    return {
        "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": dt, "mode_per_s": at.rate(shape),
        "predicted_growth": predicted, "observed_growth": finite(total ** (1.0 / steps)),
        "steps": steps, "total_off": float(np.abs(total / predicted**steps - 1.0)),
    }  # fmt: skip


def map_of_growth(party, mujoco, steps) -> np.ndarray:
    """Growth of the deviation in 2,000 steps at bent, undamped, along its stiffest mode, for each dt."""
    at = held("bent", posture("bent"))
    direction = stiffest(at)[1]
    return np.array([growth(party, mujoco, at, direction, dt) for dt in steps])


def stiffest(at) -> tuple[float, np.ndarray]:
    """Rate, rad/s, and angles (largest 1 rad) of the fastest swinging mode."""
    values, vectors = at.modes
    k = int(np.argmax(values.imag))
    angles = (vectors[:3, k] / vectors[np.argmax(np.abs(vectors[:3, k])), k]).real
    return float(values[k].imag), angles / np.abs(angles).max()


def judge(result, parts) -> None:
    """The table of limits and that of growth per step, a check for each row, and what is not within the aim."""
    aimed = explained = 0
    for row in (row for part in parts for row in part["rows"]):
        seen, expected = row.pop("seen"), row.pop("expected")
        result.rows.append(row)
        where = f"{row['scene']}, {row['engine']} {row['method']}, damping {row['damping']:g}"
        result.check(where, f"limit is not {row['limit'].replace('_', ' ')}", seen != row["limit"], 0.0, "methods")
        if row["limit"] != "finite" or seen != "finite":
            continue
        aim = AIM_DAMPED if row["damping"] else AIM
        off, by_map = row["observed_dt_s"] / row["predicted_dt_s"] - 1.0, row["observed_dt_s"] / expected - 1.0
        result.check(where, "limit, observed / the linear map's own 100-fold - 1", abs(by_map), AIM, "")
        aimed += 1
        if abs(expected / row["predicted_dt_s"] - 1.0) < 0.9 * aim:  # the criterion itself is that near to the limit
            result.check(where, "limit, observed / predicted - 1", abs(off), aim, "")
        else:
            explained += 1
            result.notes.append(
                f"{where}: the observed limit is {100 * off:.1f} % above the predicted one, because growth per step "
                f"rises so slowly beyond it that {ALLOWED:.0f}-fold in {STEPS} steps is reached at {expected:.5f} s "
                f"only; observed {row['observed_dt_s']:.5f} s."
            )
    finite = [row for row in result.rows if row["limit"] == "finite" and row["observed_dt_s"]]
    worst = {
        damping: max(abs(r["observed_dt_s"] / r["predicted_dt_s"] - 1.0) for r in finite if r["damping"] == damping)
        for damping in sorted({row["damping"] for row in finite})
    }
    told = ", ".join(f"{100 * off:.2f} % with damping {damping:g} N m s/rad" for damping, off in worst.items())
    result.notes.insert(
        0,
        f"{aimed} finite limits, predicted without a run and observed without the prediction, differ by at most "
        f"{told}; {aimed - explained} of them are within the aim of {100 * AIM:g} % undamped and {100 * AIM_DAMPED:g} "
        "% damped" + (f", and of the other {explained} the cause is told below." if explained else "."),
    )
    growths = [row for part in parts for row in part["growths"]]
    for row in growths:
        where = f"{row['scene']}, {row['engine']} {row['method']}, dt = {row['dt_s']:.4g} s"
        result.check(
            where, f"growth in {row['steps']} steps, observed / predicted - 1", row.pop("total_off"), GROWN, ""
        )
    result.tables["stability_growth"] = growths
    seen = [row for row in growths if row["observed_growth"] is not None]
    off = max((abs(row["observed_growth"] / row["predicted_growth"] - 1.0) for row in seen), default=np.inf)
    result.notes.append(
        "Where a method always fails (a saddle; explicit Euler at an undamped centre) the growth of one step, "
        f"{len(growths)} times measured, is the predicted one within {off:.1e}, relative."
    )
