"""What speed shows on the first screen: the settings of each engine that are best in both error and time."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

from ...judge import units
from ...judge.check import Result

TARGET = 1e-6  # rad or m: the error for which the cheapest setting is named
NOT_SOLVED = 1.0  # rad or m: a run with a larger error is none


class Cheapest(NamedTuple):
    """The setting that takes the least time within TARGET."""

    engine: str
    method: str
    milliseconds: float
    steps: float | None = None
    dt: float | None = None  # s
    tolerance: float | None = None


class Curve(NamedTuple):
    """The settings of one engine that no other of the same engine beats in both error and time."""

    engine: str
    errors: list[float]  # rad or m, from coarse to fine
    milliseconds: list[float]
    cheapest: Cheapest | None  # the first within TARGET


def target(result: Result) -> dict:
    about = {"unit": "rad", "servos_off": False} | result.curves
    return {"target": TARGET, "scene": about.get("regular"), "unit": about["unit"], "servos_off": about["servos_off"]}


def front(rows: Sequence[dict]) -> list[dict]:
    """The rows than which no other is both faster and more exact, from the fastest to the most exact."""
    best, least = [], NOT_SOLVED
    error = partial(units.value, name="worst_error")
    for row in sorted(rows, key=lambda row: (row["seconds"], error(row))):
        if error(row) < least:
            best.append(row)
            least = error(row)
    return best


def best_curves(result: Result) -> list[Curve]:
    """A curve for each engine that computed the scene in which errors are regular."""
    scene, error = result.curves.get("regular"), partial(units.value, name="worst_error")
    rows = [row for row in result.rows if row["scene"] == scene and row["seconds"] and not row["diverged"]]
    curves = []
    for engine in dict.fromkeys(row["engine"] for row in rows):
        best = front([row for row in rows if row["engine"] == engine])
        within = [
            Cheapest(engine, row["method"], 1e3 * row["seconds"], row.get("steps"), row.get("dt_s"), row.get("tolerance"))
            for row in best
            if error(row) <= TARGET
        ]  # fmt: skip
        if best:
            errors, times = [float(error(row)) for row in best], [1e3 * row["seconds"] for row in best]
            curves.append(Curve(engine, errors, times, within[0] if within else None))
    return curves


def cheapest(curves: Sequence[Curve]) -> list[Cheapest]:
    """The cheapest setting of all engines, and the cheapest of MuJoCo (of tmt, if the first is MuJoCo's)."""
    reached = {curve.engine: curve.cheapest for curve in curves if curve.cheapest}
    if not reached:
        return []
    first = min(reached, key=lambda engine: reached[engine].milliseconds)
    other = "mujoco" if first != "mujoco" else "tmt"
    return [reached[engine] for engine in (first, other) if engine in reached]
