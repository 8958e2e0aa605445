"""Step limits: up to which dt a method keeps a small deviation small, predicted from one step and observed in runs."""

import numpy as np

from .linear import held
from .parties import farthest, finite
from .scenes import posture

SIZE = 1e-6  # rad, of the deviation at the start
STEPS = 2000
ALLOWED = 100.0  # fold growth of the deviation
MARGIN = 1e-3  # relative: a mode that grows by less from the second to the last quarter of a run does not grow
FLOOR = 1e-3  # of its share at the start: a mode below that has decayed, and rounding and its square are what is left
CRITERION = "no mode grows from the second to the last quarter of a run"
COARSE = np.geomspace(3e-4, 1e2, 24)  # s: steps among which the observed limit is sought
CLOSE = 1e-4  # to which it is then bisected
GROWTH_STEPS = (1e-3, 1e-2, 5 / 64)  # s: where growth per step is compared, in scenes in which a method always fails
AIM = 1e-3  # relative, of an observed limit to the predicted one
GROWN = (
    1e-3  # relative, of the growth in all steps: the deviation reaches 1e-5 rad, and its square is not in a linear map
)
TINY, TOTAL, MOST = 1e-8, 1e3, 200  # rad, of the deviation there; how much it may grow; in at most how many steps
KINDS = {"never_fails": "never fails", "always_fails": "fails at every step", "finite": "has a limit"}


def examine(scene, mujoco, parties, steps=STEPS) -> dict:
    """Rows for tables/stability.csv and tables/stability_growth.csv of one (posture, damping)."""
    name, damping = scene
    at = held(name, posture(name), damping)
    rows, growths = [], []
    for party in parties:
        kind, predicted = at.limit(party.scheme)
        dt = GROWTH_STEPS[1] if predicted is None else 1.001 * predicted  # just above the limit its mode grows fastest
        _, shape, _ = at.fastest_growing(party.scheme, dt)
        seen, observed = observed_limit(party, mujoco, at, steps)
        if kind == "always_fails":
            growths += [growth_per_step(party, mujoco, at, dt) for dt in GROWTH_STEPS]
        rows.append({
            "scene": name, "engine": party.engine, "method": party.method, "damping": damping,
            "mode_per_s": np.abs(at.modes[0]).max() if kind == "never_fails" else at.rate(shape),
            "predicted_dt_s": predicted, "observed_dt_s": observed, "limit": kind, "criterion": CRITERION, "seen": seen,
        })  # fmt: skip
    return {"rows": rows, "growths": growths}


def growth(party, mujoco, at, direction, dt, size=SIZE, steps=STEPS) -> float:
    """The largest deviation of a run over that at its start, which is size x direction, rad; inf if it diverged."""
    start = at.q + size * direction
    with np.errstate(over="ignore", invalid="ignore"):
        q, _ = party.run(mujoco, at.model, start, np.zeros_like(start), at.tau, float(dt), steps)
        return farthest(q, at.q) / size


def observed_limit(party, mujoco, at, steps=STEPS) -> tuple[str, float | None]:
    """The largest dt at which no mode of the equations of motion grows in a run, found without the prediction.

    Upwards through COARSE to the first step that fails, then by bisection; ("never_fails", None) if none does,
    ("always_fails", None) if the smallest does.
    """
    low = None
    for high in COARSE:
        if grows(*shares(party, mujoco, at, high, steps)):
            break
        low = high
    else:
        return "never_fails", None
    if low is None:
        return "always_fails", None
    while high / low > 1.0 + CLOSE:
        middle = np.sqrt(low * high)
        low, high = (low, middle) if grows(*shares(party, mujoco, at, middle, steps)) else (middle, high)
    return "finite", float(low)


def shares(party, mujoco, at, dt, steps) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the modes in the deviation, over those at the start, in the second and the last quarter of a run, (2n,).

    All modes start alike, each with an angle of up to 1e-6 rad. The modes are those of the equations of motion, not of
    a method; a quarter holds a swing of the slowest. Its mean is weighted (Hann), so that swings in it cancel.
    """
    n = len(at.q)
    values, vectors = at.modes
    vectors = vectors / vectors[np.argmax(np.abs(vectors[:n]), axis=0), np.arange(2 * n)]
    swings = values.imag[values.imag > 1e-3]
    quarter = max(steps // 4, int(np.ceil(2.0 * np.pi / (swings.min() * dt))) if len(swings) else 0)
    start = SIZE * vectors.sum(axis=1).real / (2 * n)
    weight = np.hanning(quarter + 2)[1:-1]
    weight /= weight.sum()
    with np.errstate(over="ignore", invalid="ignore"):
        q, qd = party.run(mujoco, at.model, at.q + start[:n], start[n:], at.tau, float(dt), 4 * quarter)
        parts = (slice(0, 1), slice(quarter + 1, 2 * quarter + 1), slice(3 * quarter + 1, None))
        deviations = (np.concatenate([q[part] - at.q, qd[part]], axis=1) for part in parts)
        first, *found = (np.abs(deviation @ np.linalg.inv(vectors).T) ** 2 for deviation in deviations)
        early, late = (np.sqrt(weight @ part / first[0]) for part in found)
        return early, late


def grows(early, late) -> bool:
    """Whether a deviation grows, by the shares of its modes in the second and the last quarter of a run."""
    if not np.isfinite(late).all():
        return True
    return bool(((late > ALLOWED) | ((late > (1.0 + MARGIN) * early) & (late > FLOOR))).any())


def growth_per_step(party, mujoco, at, dt) -> dict:
    """How much the fastest-growing mode grows in one step: in a run, by its share in the deviation, and predicted."""
    predicted, shape, measure = at.fastest_growing(party.scheme, dt)
    steps = int(np.clip(np.log(TOTAL) / np.log(predicted), 2, MOST))
    start = TINY * shape.real
    with np.errstate(over="ignore", invalid="ignore"):
        q, qd = party.run(mujoco, at.model, at.q + start[:3], start[3:], at.tau, dt, steps)
        share = np.abs(np.concatenate([q - at.q, qd], axis=1) @ measure)
        total = share[-1] / share[0]
    return {
        "scene": at.name, "engine": party.engine, "method": party.method, "dt_s": dt, "mode_per_s": at.rate(shape),
        "predicted_growth": predicted, "observed_growth": finite(total ** (1.0 / steps)),
        "steps": steps, "total_off": float(np.abs(total / predicted**steps - 1.0)),
    }  # fmt: skip


def map_of_growth(party, mujoco, dts, steps=STEPS) -> np.ndarray:
    """Growth of the deviation in so many steps at bent, undamped, along its stiffest mode, for each dt."""
    at = held("bent", posture("bent"))
    direction = stiffest(at)[1]
    return np.array([growth(party, mujoco, at, direction, dt, steps=steps) for dt in dts])


def stiffest(at) -> tuple[float, np.ndarray]:
    """Rate, rad/s, and angles (largest 1 rad) of the fastest swinging mode."""
    values, vectors = at.modes
    k = int(np.argmax(values.imag))
    angles = (vectors[:3, k] / vectors[np.argmax(np.abs(vectors[:3, k])), k]).real
    return float(values[k].imag), angles / np.abs(angles).max()


def judge(result, parts) -> None:
    """The table of limits and that of growth per step, and a check for each row."""
    for row in (row for part in parts for row in part["rows"]):
        seen = row.pop("seen")
        result.rows.append(row)
        where = f"{row['scene']}, {row['engine']} {row['method']}, damping {row['damping']:g}"
        if row["limit"] == "finite":
            note = "" if seen == "finite" else f"it {KINDS[seen]}"
            result.check(where, "limit, observed / predicted - 1", apart(row), AIM, "", note)
        else:
            quantity = f"runs in which it {KINDS[row['limit']]}, as predicted"
            result.check(where, quantity, int(seen == row["limit"]), 1, "runs", rule="equal")
    growths = [row for part in parts for row in part["growths"]]
    totals = []
    for row in growths:
        where = f"{row['scene']}, {row['engine']} {row['method']}, dt = {row['dt_s']:.4g} s"
        totals.append(row.pop("total_off"))
        result.check(where, f"growth in {row['steps']} steps, observed / predicted - 1", totals[-1], GROWN, "")
    result.tables["stability_growth"] = growths
    result.notes[:0] = tell_limits(result.rows)
    result.notes += tell_growth(growths)


def apart(row) -> float | None:
    """How far an observed limit is from the predicted one, relative; None if one of them is missing."""
    known = row["observed_dt_s"] and row["predicted_dt_s"]
    return abs(row["observed_dt_s"] / row["predicted_dt_s"] - 1.0) if known else None


def tell_limits(rows) -> list[str]:
    """How far observed limits are from the predicted ones, damping by damping."""
    expected = [row for row in rows if row["limit"] == "finite"]
    known = [row for row in expected if apart(row) is not None]
    if not expected:
        return ["No method has a finite limit in these scenes."]
    told = ", ".join(
        f"{100 * max(apart(row) for row in known if row['damping'] == damping):.3f} % "
        + (f"with damping {damping:g} N m s/rad" if damping else "undamped")
        for damping in sorted({row["damping"] for row in known})
    )
    missing = len(expected) - len(known)
    return [
        f"{len(expected)} finite limits are predicted without a run. "
        + (f"{len(known)} are observed without the prediction; largest difference: {told}. " if known else "")
        + (f"In {missing} cases the runs show no finite limit." if missing else "The runs show each of them.")
    ]


def tell_growth(rows) -> list[str]:
    """How far the growth of one step is from the predicted one, where a method always fails."""
    if not rows:
        return ["No method fails at every step in these scenes."]
    off = [abs(row["observed_growth"] / row["predicted_growth"] - 1.0) for row in rows if row["observed_growth"]]
    where = ", ".join(dict.fromkeys(row["scene"] for row in rows))
    return [
        f"Where a method fails at every step ({where}), the growth of one step is predicted and measured, {len(rows)} "
        f"times: {f'largest difference {max(off):.1e}, relative' if off else 'no run gives a number'}"
        + (f"; runs without a number: {len(rows) - len(off)}." if off and len(off) < len(rows) else ".")
    ]
