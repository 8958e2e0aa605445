"""Step limits: up to which dt a method keeps a small deviation small, predicted from one step and observed in runs."""

from collections.abc import Mapping, Sequence

import numpy as np

from tmt.methods import METHODS

from ...engines import Engine, Method
from ...judge.rounding import slope_rounding
from ...judge.scale import FACTOR
from ...truth.linear import Held
from ...truth.steps import beyond_limit
from .growth import GROWTH_STEPS, LINEAR_DEVIATION, MOST_OF_A_STEP, growth_per_step

GROWTH_ALLOWED = 100.0  # fold, of the deviation
FAR = 1e4  # fold, of what has left the reach of a linear motion
GROWTH_MARGIN = 1e-3  # relative: a mode that grows by less from the second to the last quarter of a run does not grow
DECAYED = 1e-3  # of its share at the start: a mode below that has decayed, and rounding and its square are what is left
CRITERION = "no mode grows from the second to the last quarter of a run"
TRIED_STEPS = np.geomspace(3e-4, 1e2, 24)  # s: among which the observed limit is sought
TRIED_ABOUT = (0.9, 0.998, 1.002, 1.1, 3.0)  # times the predicted limit
TRIED_OF_FASTEST = (0.1, 1.0, 10.0)  # times the time in which the fastest mode moves
BISECTED = 1e-4  # relative, to which it is then bisected
LIMIT_TOLERANCE = 1e-3  # relative, of an observed limit to the predicted one
# relative, of the growth in all steps: the deviation reaches 1e-5 rad, and its square is not in a linear map
GROWTH_TOLERANCE = 1e-3
MOST_TOLERANCE = 0.1  # relative: a limit of a file's robot that runs show no nearer is not asked of them
LIMIT_KINDS = {"never_fails": "never fails", "always_fails": "fails at every step", "finite": "has a limit"}


def limits_and_growths(
    at: Held,
    engines: Mapping[str, Engine],
    methods: tuple[Method, ...],
    steps: int = GROWTH_STEPS,
    growth_dts: Sequence[float] = (1e-3, 1e-2),
) -> dict:
    """Rows for tables/stability.csv and tables/stability_growth.csv of one posture.

    growth_dts: s, where growth per step is compared if a method always fails; too long: those that are left out, each with how
    many times it is beyond the limit.
    """
    rows, growths, too_long = [], [], {}
    for method in methods:
        kind, predicted = at.limit(method.scheme)
        tolerance = limit_tolerance(at, method.scheme, predicted, steps) if predicted else LIMIT_TOLERANCE
        dt = 1e-2 if predicted is None else 1.001 * predicted  # just above the limit its mode grows fastest
        _, shape, _ = at.fastest_growing(method.scheme, dt)
        open_end = (
            why_undecided(at, tolerance, predicted * quarter_of(at, predicted, steps), at.rate(shape))
            if predicted
            else why_undecided(at)
        )
        seen, observed = (
            (None, None) if open_end else observed_limit(method, engines, at, steps, tried_at(at, predicted))
        )
        if kind == "finite" and seen == "always_fails" and predicted < tried_at(at, predicted)[0]:
            kind, predicted = seen, None  # it fails at every step that is tried
        if kind == "always_fails":
            for each in growth_dts:
                if at.growth(method.scheme, each) > MOST_OF_A_STEP:
                    too_long[f"{at.name}, {method.label}, dt = {each:.4g} s"] = beyond_limit(at, method.scheme, each)
                else:
                    growths.append(growth_per_step(method, engines, at, each))
        rows.append({
            "scene": at.name, "engine": method.engine, "method": method.name, "damping": at.case.scene.damping,
            "mode_per_s": np.abs(at.modes[0]).max() if kind == "never_fails" else at.rate(shape),
            "predicted_dt_s": predicted, "observed_dt_s": observed, "limit": kind, "criterion": CRITERION,
            "seen": seen, "allowed": tolerance, "undecided": open_end,
        })  # fmt: skip
    return {"rows": rows, "growths": growths, "too long": too_long}


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
    low = None
    for high in tried:
        if grows(*shares(method, engines, at, high, steps)):
            break
        low = high
    else:
        return "never_fails", None
    if low is None:
        return "always_fails", None
    while high / low > 1.0 + BISECTED:
        middle = np.sqrt(low * high)
        low, high = (low, middle) if grows(*shares(method, engines, at, middle, steps)) else (middle, high)
    return "finite", float(low)


def tried_at(at: Held, predicted: float | None) -> Sequence[float]:
    """The steps through which the observed limit is sought, s: TRIED_STEPS; few about the predicted one for a file's robot.

    Where none is predicted these are about the time of the fastest mode.
    """
    if not at.case.robot.is_read:
        return TRIED_STEPS
    if predicted:
        return predicted * np.array(TRIED_ABOUT)
    return np.array(TRIED_OF_FASTEST) / np.abs(at.modes[0]).max()


def shares(
    method: Method, engines: Mapping[str, Engine], at: Held, dt: float, steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the modes in the deviation, over those at the start, in the second and the last quarter of a run, (2n,).

    All modes start alike, each with an angle of up to 1e-6 rad. The modes are those of the equations of motion, not of
    a method; a quarter holds a swing of the slowest. Its mean is weighted (Hann), so that swings in it cancel. Of a robot of a
    file a mode that does not grow by itself and of which a quarter holds no swing is left out: squares of what the fast ones do
    move what it swings about.
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
        first, *found = (np.abs(off @ at.measures.T) ** 2 for off in deviations)
        seen = is_seen(at.modes[0][~at.without_stiffness], at.small, quarter * dt)
        early, late = (np.sqrt(weight @ part / first[0])[seen] for part in found)
        return early, late


def is_seen(rates: np.ndarray, small: float, duration: float) -> np.ndarray:
    """Which modes a run shows, by their rates, 1/s: those that grow, and those that move in a part of so many seconds."""
    seen = (rates.real > small) | (np.abs(rates) * duration >= 2.0 * np.pi)
    return seen if seen.any() else np.ones_like(seen)


def quarter_of(at: Held, dt: float, steps: int) -> int:
    """A quarter of a run of at least so many steps: it holds a swing of the slowest mode.

    Of a robot that is read from a file, some mode of which may be very slow, a quarter of so many steps.
    """
    swings = at.modes[0].imag[at.modes[0].imag > 1e-3]
    if at.case.robot.is_read or not len(swings):
        return steps // 4
    return max(steps // 4, int(np.ceil(2.0 * np.pi / (swings.min() * dt))))


def limit_tolerance(at: Held, scheme: str, limit: float, steps: int) -> float:
    """How far an observed limit may be from the predicted one, relative: 0.1 %, or more where that makes too little difference.

    So it is if little damping alone keeps a mode from growing: then it hardly grows just above the limit. So far above it that
    from the second to the last quarter of a run the growth can be seen.
    """
    for excess in np.geomspace(LIMIT_TOLERANCE, 1e3, 100):
        dt = limit * (1.0 + excess)
        if at.growth(scheme, np.array([dt]))[0] ** (2 * quarter_of(at, dt, steps)) > 1.0 + GROWTH_MARGIN:
            break
    return float(excess)


def why_undecided(at: Held, tolerance: float = 0.0, duration: float = np.inf, rate: float = np.nan) -> str | None:
    """Why runs of a file's robot cannot show a limit, or None.

    tolerance: how far above the limit they show the growth, relative; duration: of a quarter of a run at the limit, s; rate: of
    the mode that grows beyond it, 1/s. One eps of the forces pushes a mode of the rate r by an acceleration, and its equilibrium
    by that over r^2.
    """
    if not at.case.robot.is_read:
        return None
    if tolerance > MOST_TOLERANCE:
        return f"a run of this length shows growth only more than {100 * MOST_TOLERANCE:g} % above them"
    modes = at.modes[0][~at.without_stiffness]
    rates = np.abs(modes)
    if np.isclose(rates, rate)[~is_seen(modes, at.small, duration)].any():
        return f"a quarter of a run of this length is shorter than a swing of the mode of {rate:.2g} per second"
    pushed = slope_rounding(METHODS["rk4"], at.tree, at.q[None], np.zeros((1, at.nv)), at.tau, 1.0)[2][0] / FACTOR
    if len(rates) and pushed > GROWTH_MARGIN * LINEAR_DEVIATION * rates.min() ** 2:
        return (
            f"a rate of {rates.min():.1e} per second is so slow that rounding of the forces moves what it swings about"
        )
    return None


def grows(early: np.ndarray, late: np.ndarray) -> bool:
    """Whether a deviation grows, by the shares of its modes in the second and the last quarter of a run.

    What has grown far early may come back: it is out of the reach of a linear motion.
    """
    if not np.isfinite(late).all():
        return True
    still = (late > (1.0 + GROWTH_MARGIN) * early) & (late > DECAYED)
    return bool(((early > FAR) | (late > GROWTH_ALLOWED) | still).any())
