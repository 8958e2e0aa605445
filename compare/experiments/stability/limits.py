"""Step limits: up to which dt a method keeps a small deviation small, predicted from one step and observed in runs."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ...core.check import About, Result
from ...engines import Engine, Method
from ...stability.equilibrium import Equilibrium
from ...stability.search import largest
from .tables import LimitRow

LINEAR_DEVIATION = 1e-6  # rad, at the start
GROWTH_STEPS = 2000  # of a run
GROWTH_ALLOWED = 100.0  # fold, of the deviation
FAR = 1e4  # growth beyond which a motion is not linear any more
GROWTH_MARGIN = 1e-3  # relative: from the second to the last quarter of a run; less is no growth
DECAYED = 1e-3  # of its share at the start: a mode below that has decayed, and rounding and its square are what is left
# times the predicted limit; if there is none, the time in which the fastest mode moves: the observed one is
# sought among them
TRIED_ABOUT, TRIED_OF_FASTEST = np.array([0.5, 0.9997, 1.0003, 2.0]), np.array([0.1, 0.1, 1.0, 10.0])
BISECTED = 1e-4  # relative, to which it is then bisected
LIMIT_TOLERANCE = 1e-3  # relative, of an observed limit to the predicted one
KINDS = {"never_fails": "never fails", "always_fails": "fails at every step", "finite": "has a limit"}


class Observed(NamedTuple):
    """A limit, the kind of it that runs show, and how far the observed one may be from the predicted one."""

    row: LimitRow
    kind: str
    tolerance: float


def limit_rows(
    at: Equilibrium, engines: Mapping[str, Engine], methods: tuple[Method, ...], steps: int = GROWTH_STEPS
) -> list[Observed]:
    """The limits of one posture, of each scheme predicted once, and of each method observed."""

    @cache
    def predicted(scheme: str) -> tuple[str, float | None, float, float]:
        """Kind, limit, rate of the mode that limits, and tolerance; just above the limit its mode grows fastest."""
        kind, limit = at.limit(scheme)
        above = 1.001 * limit if limit else 0.1 / at.fastest
        rate = at.fastest if kind == "never_fails" else at.growing_rate(scheme, above)
        return kind, limit, rate, limit_tolerance(at, scheme, limit, steps) if limit else LIMIT_TOLERANCE

    found = list[Observed]()
    for method in methods:
        kind, limit, rate, tolerance = predicted(method.scheme)
        tried = limit * TRIED_ABOUT if limit else TRIED_OF_FASTEST / at.fastest
        seen, observed = observed_limit(method, engines, at, steps, tried)
        row = LimitRow(
            scene=at.name, engine=method.engine, method=method.name, damping=at.damping, mode=rate,
            predicted_dt=limit, observed_dt=observed, limit=kind,
        )  # fmt: skip
        found.append(Observed(row, seen, tolerance))
    return found


def observed_limit(
    method: Method, engines: Mapping[str, Engine], at: Equilibrium, steps: int, tried: np.ndarray
) -> tuple[str, float | None]:
    """The largest dt at which no mode of the equations of motion grows in a run.

    Between the second and the third of `tried`, by bisection, else down to the first or up to the last;
    ("never_fails", None) if none fails, ("always_fails", None) if the smallest does.
    """

    @cache
    def holds(dt: float) -> bool:
        return not grows(*shares(method, engines, at, dt, steps))

    low, high = largest(holds, tried[1], tried[0], tried[2], 1.0 + BISECTED)
    if high is None:
        low, high = largest(holds, tried[2], tried[2], tried[3], 1.0 + BISECTED)
    return ("never_fails" if high is None else "always_fails" if low is None else "finite"), high and low


def shares(
    method: Method, engines: Mapping[str, Engine], at: Equilibrium, dt: float, steps: int
) -> list[np.ndarray]:
    """Shares of the modes in the deviation, over those at the start, in the second and the last quarter of a run, (2n,).

    All modes start alike, each with an angle of up to 1e-6 rad. The modes are those of the equations of
    motion, not of a method; a quarter holds a swing of the slowest. Its mean is weighted (Hann), so that
    swings in it cancel. Of modes that decay those that move within a quarter are seen: squares of the fast
    ones move what the slow ones swing about.
    """
    n, quarter = at.nv, quarter_of(at, dt, steps)
    start = LINEAR_DEVIATION * at.shapes.sum(axis=1).real / (2 * n)
    weight = np.hanning(quarter + 2)[1:-1]
    weight /= weight.sum()
    seen = (at.rates.real > at.small) | (np.abs(at.rates) * quarter * dt >= 2.0 * np.pi)
    seen |= not seen.any()
    motion = at.run(method, engines, at.tau, float(dt), 4 * quarter, start[:n], start[n:])
    with np.errstate(over="ignore", invalid="ignore"):
        deviation = np.concatenate([motion.q - at.q, motion.v], axis=1)
        sizes = np.abs(deviation @ np.linalg.inv(at.shapes).T) ** 2
        parts = sizes[quarter + 1 : 2 * quarter + 1], sizes[3 * quarter + 1 :]
        return [np.sqrt(weight @ part / sizes[0])[seen] for part in parts]


def quarter_of(at: Equilibrium, dt: float, steps: int) -> int:
    """Steps of a quarter of a run: a quarter of `steps`, and at least a swing of the slowest mode."""
    swings = at.rates.imag[at.rates.imag > 1e-3]
    slowest = int(np.ceil(2.0 * np.pi / (swings.min() * dt))) if len(swings) else 0
    return max(steps // 4, slowest)


def limit_tolerance(at: Equilibrium, scheme: str, limit: float, steps: int) -> float:
    """How far an observed limit may be from the predicted one, relative: 0.1 %, or from where a run shows the growth.

    With little damping a mode hardly grows just above its limit.
    """
    for excess in np.geomspace(LIMIT_TOLERANCE, 1e3, 100):
        dt = limit * (1.0 + excess)
        if at.growth(scheme, dt) ** (2 * quarter_of(at, dt, steps)) > 1.0 + GROWTH_MARGIN:
            break
    return float(excess)


def grows(early: np.ndarray, late: np.ndarray) -> bool:
    """Whether a deviation grows, by the shares of its modes in the second and the last quarter of a run.

    What has grown far early may come back: it is out of the reach of a linear motion.
    """
    if not np.isfinite(late).all():
        return True
    still = (late > (1.0 + GROWTH_MARGIN) * early) & (late > DECAYED)
    return bool(((early > FAR) | (late > GROWTH_ALLOWED) | still).any())


# checks


def check_limits(result: Result, limits: Sequence[Observed]) -> None:
    """The table of limits, and a check of each."""
    for row, kind, tolerance in limits:
        where = f"{row.scene}, {row.who}, damping {row.damping:g}"
        result.rows.append(row)
        if row.limit == "finite":
            note, about = "" if kind == "finite" else f"observed: {KINDS[kind]}", About.PREDICTION
            what = "limit, observed / predicted - 1"
            row.passed = result.check(where, what, row.apart, tolerance, "", note, about=about).passed
        else:
            quantity, same = f"runs in which it {KINDS[row.limit]}, as predicted", int(kind == row.limit)
            check = result.check(where, quantity, same, 1, "runs", rule="equal", about=About.PREDICTION)
            row.passed = check.passed
    result.shown = [name for name in result.rows[0].record() if name not in ("criterion", "passed")]


def summary(rows: Sequence[LimitRow]) -> dict[str, Any]:
    """How many limits are observed and as predicted, and the largest relative difference."""
    off = [row.apart for row in rows if row.apart is not None]
    wrong = sum(row.passed is False for row in rows)
    return {"limits": len(rows), "known": len(off), "wrong": wrong, "off": max(off, default=0.0)}
