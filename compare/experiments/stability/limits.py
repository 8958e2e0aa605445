"""Step limits: up to which dt a method keeps a small deviation small, predicted from one step and observed in runs."""

from collections.abc import Mapping, Sequence

import numpy as np

from tmt.methods import METHODS

from ...engines import Engine, Method
from ...judge.check import About, Result
from ...judge.rounding import slope_rounding
from ...judge.scale import FACTOR
from ...truth.linear import Held
from .subjects import who

LINEAR_DEVIATION = 1e-6  # rad, at the start
GROWTH_STEPS = 2000  # of a run
GROWTH_ALLOWED = 100.0  # fold, of the deviation
FAR = 1e4  # growth beyond which a motion is not linear any more
GROWTH_MARGIN = 1e-3  # relative: a mode that grows by less from the second to the last quarter of a run does not grow
DECAYED = 1e-3  # of its share at the start: a mode below that has decayed, and rounding and its square are what is left
CRITERION = "no mode grows from the second to the last quarter of a run"
TRIED_STEPS = np.geomspace(3e-4, 1e2, 24)  # s: among which the observed limit is sought
TRIED_ABOUT = (0.9, 0.998, 1.002, 1.1, 3.0)  # times the predicted limit
TRIED_OF_FASTEST = (0.1, 1.0, 10.0)  # times the time in which the fastest mode moves
BISECTED = 1e-4  # relative, to which it is then bisected
LIMIT_TOLERANCE = 1e-3  # relative, of an observed limit to the predicted one
MOST_TOLERANCE = 0.1  # relative: limits of a file's robot that runs show less exactly are not observed
KINDS = {"never_fails": "never fails", "always_fails": "fails at every step", "finite": "has a limit"}


def limit_rows(
    at: Held, engines: Mapping[str, Engine], methods: tuple[Method, ...], steps: int = GROWTH_STEPS
) -> list[dict]:
    """Rows for tables/stability.csv of one posture, with `seen`, `allowed` and `undecided` for the check."""
    rows = []
    for method in methods:
        kind, predicted = at.limit(method.scheme)
        tolerance = limit_tolerance(at, method.scheme, predicted, steps) if predicted else LIMIT_TOLERANCE
        dt = 1e-2 if predicted is None else 1.001 * predicted  # just above the limit its mode grows fastest
        _, shape, _ = at.fastest_growing(method.scheme, dt)
        duration = predicted * quarter_of(at, predicted, steps) if predicted else np.inf
        reason = why_undecided(at, tolerance if predicted else 0.0, duration, at.rate(shape) if predicted else np.nan)
        tried = tried_at(at, predicted)
        seen, observed = (None, None) if reason else observed_limit(method, engines, at, steps, tried)
        if kind == "finite" and seen == "always_fails" and predicted < tried[0]:
            kind, predicted = seen, None  # it fails at every step that is tried
        rows.append({
            "scene": at.name, "engine": method.engine, "method": method.name, "damping": at.case.scene.damping,
            "mode_per_s": np.abs(at.modes[0]).max() if kind == "never_fails" else at.rate(shape),
            "predicted_dt_s": predicted, "observed_dt_s": observed, "limit": kind, "criterion": CRITERION,
            "seen": seen, "allowed": tolerance, "undecided": reason,
        })  # fmt: skip
    return rows


def observed_limit(
    method: Method,
    engines: Mapping[str, Engine],
    at: Held,
    steps: int = GROWTH_STEPS,
    tried: Sequence[float] = TRIED_STEPS,
) -> tuple[str, float | None]:
    """The largest dt at which no mode of the equations of motion grows in a run, found without the prediction.

    Upwards through `tried` to the first step that fails, then by bisection; ("never_fails", None) if none does,
    ("always_fails", None) if the smallest does.
    """

    def fails(dt: float) -> bool:
        return grows(*shares(method, engines, at, dt, steps))

    failed = next((k for k, dt in enumerate(tried) if fails(dt)), None)
    if not failed:
        return ("never_fails" if failed is None else "always_fails"), None
    low, high = tried[failed - 1], tried[failed]
    while high / low > 1.0 + BISECTED:
        middle = np.sqrt(low * high)
        low, high = (low, middle) if fails(middle) else (middle, high)
    return "finite", float(low)


def tried_at(at: Held, predicted: float | None) -> Sequence[float]:
    """The steps through which the observed limit is sought, s; of a file's robot few, about the predicted one.

    Where none is predicted these are about the time of the fastest mode.
    """
    if not at.case.robot.is_read:
        return TRIED_STEPS
    if predicted:
        return predicted * np.array(TRIED_ABOUT)
    return np.array(TRIED_OF_FASTEST) / np.abs(at.modes[0]).max()


def shares(method: Method, engines: Mapping[str, Engine], at: Held, dt: float, steps: int) -> list[np.ndarray]:
    """Shares of the modes in the deviation, over those at the start, in the second and the last quarter of a run, (2n,).

    All modes start alike, each with an angle of up to 1e-6 rad. The modes are those of the equations of motion, not of
    a method; a quarter holds a swing of the slowest. Its mean is weighted (Hann), so that swings in it cancel. Modes that
    `is_seen` excludes are left out: squares of the fast ones move what they swing about.
    """
    n, vectors = at.nv, at.shapes
    quarter = quarter_of(at, dt, steps)
    start = LINEAR_DEVIATION * vectors.sum(axis=1).real / (2 * n)
    weight = np.hanning(quarter + 2)[1:-1]
    weight /= weight.sum()
    dynamics = engines[method.engine].of(at.case)
    with np.errstate(over="ignore", invalid="ignore"):
        motion = dynamics.run(at.moved(start[:n]), start[n:], at.tau, float(dt), 4 * quarter, method.name)
        parts = (slice(0, 1), slice(quarter + 1, 2 * quarter + 1), slice(3 * quarter + 1, None))
        deviations = (np.concatenate([at.away(motion.q[part]), motion.v[part]], axis=1) for part in parts)
        first, *later = (np.abs(off @ at.measures.T) ** 2 for off in deviations)
        seen = is_seen(at.modes[0][~at.without_stiffness], at.small, quarter * dt)
        return [np.sqrt(weight @ part / first[0])[seen] for part in later]


def is_seen(rates: np.ndarray, small: float, duration: float) -> np.ndarray:
    """Which modes a run shows, by their rates, 1/s: those that grow, and those that move within `duration`, s."""
    seen = (rates.real > small) | (np.abs(rates) * duration >= 2.0 * np.pi)
    return seen if seen.any() else np.ones_like(seen)


def quarter_of(at: Held, dt: float, steps: int) -> int:
    """Steps of a quarter of a run: a quarter of `steps`, and at least a swing of the slowest mode.

    Of a file's robot, some mode of which may be very slow, a quarter of `steps`.
    """
    swings = at.modes[0].imag[at.modes[0].imag > 1e-3]
    if at.case.robot.is_read or not len(swings):
        return steps // 4
    return max(steps // 4, int(np.ceil(2.0 * np.pi / (swings.min() * dt))))


def limit_tolerance(at: Held, scheme: str, limit: float, steps: int) -> float:
    """How far an observed limit may be from the predicted one, relative: 0.1 %, or from where a run shows the growth.

    With little damping a mode hardly grows just above its limit.
    """
    for excess in np.geomspace(LIMIT_TOLERANCE, 1e3, 100):
        dt = limit * (1.0 + excess)
        if at.growth(scheme, np.array([dt]))[0] ** (2 * quarter_of(at, dt, steps)) > 1.0 + GROWTH_MARGIN:
            break
    return float(excess)


def why_undecided(
    at: Held, tolerance: float = 0.0, duration: float = np.inf, rate: float = np.nan
) -> tuple[str, float] | None:
    """Why runs of a file's robot cannot show a limit: the reason and its number; or None.

    tolerance: how far above the limit they show the growth, relative; duration: of a quarter of a run at the limit, s; rate: of
    the mode that grows beyond it, 1/s. One eps of the forces pushes a mode of the rate r by an acceleration, and its equilibrium
    by that over r^2.
    """
    if not at.case.robot.is_read:
        return None
    if tolerance > MOST_TOLERANCE:
        return "late growth", MOST_TOLERANCE
    modes = at.modes[0][~at.without_stiffness]
    rates = np.abs(modes)
    if np.isclose(rates, rate)[~is_seen(modes, at.small, duration)].any():
        return "slow mode", rate
    pushed = slope_rounding(METHODS["rk4"], at.tree, at.q[None], np.zeros((1, at.nv)), at.tau, 1.0)[2][0] / FACTOR
    if len(rates) and pushed > GROWTH_MARGIN * LINEAR_DEVIATION * rates.min() ** 2:
        return "rounding", float(rates.min())
    return None


def grows(early: np.ndarray, late: np.ndarray) -> bool:
    """Whether a deviation grows, by the shares of its modes in the second and the last quarter of a run.

    What has grown far early may come back: it is out of the reach of a linear motion.
    """
    if not np.isfinite(late).all():
        return True
    still = (late > (1.0 + GROWTH_MARGIN) * early) & (late > DECAYED)
    return bool(((early > FAR) | (late > GROWTH_ALLOWED) | still).any())


# checks


def check_limits(result: Result, rows: Sequence[dict]) -> None:
    """The table of limits, and a check for each row."""
    late, undecided = {}, {}
    kinds = [row.pop("seen") for row in rows]
    for row, seen in zip(rows, kinds):
        tolerance, reason = row.pop("allowed"), row.pop("undecided", None)
        result.rows.append(row)
        where = f"{row['scene']}, {who(row)}, damping {row['damping']:g}"
        if seen is None:
            undecided.setdefault(reason, []).append(where)
            continue
        twins = [(other, kind) for other, kind in zip(rows, kinds) if is_twin(result, other, row)]
        same = all(k == seen and alike(t["observed_dt_s"], row["observed_dt_s"], tolerance) for t, k in twins)
        about = About.PREDICTION if same else About.MODELS
        if row["limit"] == "finite":
            note = "" if seen == "finite" else f"observed: {KINDS[seen]}"
            result.check(where, "limit, observed / predicted - 1", apart(row), tolerance, "", note, about=about)
        else:
            quantity = f"runs in which it {KINDS[row['limit']]}, as predicted"
            result.check(where, quantity, int(seen == row["limit"]), 1, "runs", rule="equal", about=about)
        if tolerance > LIMIT_TOLERANCE:
            late[where] = tolerance
    result.shown = [name for name in (rows[0] if rows else ()) if name != "criterion"]
    finite = [(row, seen) for row, seen in zip(rows, kinds) if row["limit"] == "finite"]
    off = largest_differences(result.rows)
    missing = sum(apart(row) is None and seen is not None for row, seen in finite)
    observed = sum(apart(row) is not None for row, _ in finite)
    result.find("limits", predicted=len(finite), observed=observed, off=off, missing=missing)
    if late:
        result.find("late_growth", places=late)
    for (reason, number), where in undecided.items():
        result.find("undecided", reason=reason, number=number, where=where)


def largest_differences(rows: Sequence[dict]) -> dict[float, float]:
    """The largest difference of an observed limit from the predicted one, relative, for each damping."""
    known = [row for row in rows if row["limit"] == "finite" and apart(row) is not None]
    dampings = sorted({row["damping"] for row in known})
    return {damping: max(apart(row) for row in known if row["damping"] == damping) for damping in dampings}


def is_twin(result: Result, other: dict, row: dict) -> bool:
    """Whether another row is of the same scheme in the other engine, at the same places."""
    schemes = result.curves.get("schemes", {})
    mine, theirs = (schemes.get((of["engine"], of["method"]), of["method"]) for of in (row, other))
    return (
        other["engine"] != row["engine"]
        and mine == theirs
        and all(other[name] == row[name] for name in ("scene", "damping"))
    )


def alike(first: float | None, second: float | None, tolerance: float) -> bool:
    """Whether two numbers, or none, are the same, relative to a tolerance; engines that are not alike differ in their models."""
    return first is second if None in (first, second) else abs(first - second) <= tolerance * abs(second)


def apart(row: dict) -> float | None:
    """How far an observed limit is from the predicted one, relative; None if one of them is missing."""
    known = row["observed_dt_s"] and row["predicted_dt_s"]
    return abs(row["observed_dt_s"] / row["predicted_dt_s"] - 1.0) if known else None
