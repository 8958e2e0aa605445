"""What speed shows on the first screen: the settings of each engine that are best in both error and time."""

from collections.abc import Mapping, Sequence

from ...core import units
from ...core.check import Result

TARGET = 1e-6  # rad or m: the error for which the cheapest setting is named
NOT_SOLVED = 1.0  # rad or m: a run with a larger error is none
SETTING = ("engine", "method", "seconds", "steps", "dt_s", "tolerance")  # columns


def target(result: Result) -> dict:
    about = {"unit": "rad", "servos_off": False} | result.curves
    return {
        "target": TARGET,
        "scene": about.get("regular"),
        "unit": about["unit"],
        "servos_off": about["servos_off"],
    }


def error(row: Mapping) -> float:
    return units.value(row, "worst_error")


def front(rows: Sequence[dict]) -> list[dict]:
    """The rows than which no other is both faster and more exact, from the fastest to the most exact."""
    best, least = [], NOT_SOLVED
    for row in sorted(rows, key=lambda row: (row["seconds"], error(row))):
        if error(row) < least:
            best.append(row)
            least = error(row)
    return best


def best_rows(result: Result) -> dict[str, list[dict]]:
    """The front of each engine that computed the scene in which errors are regular."""
    scene, of_engine = result.curves.get("regular"), {}
    for row in result.rows:
        if row["scene"] == scene and row["seconds"] and not row["diverged"]:
            of_engine.setdefault(row["engine"], []).append(row)
    fronts = {engine: front(rows) for engine, rows in of_engine.items()}
    return {engine: rows for engine, rows in fronts.items() if rows}


def within_target(rows: Sequence[dict]) -> dict | None:
    """The cheapest setting of a front within TARGET."""
    row = next((row for row in rows if error(row) <= TARGET), None)
    return row and {name: row.get(name) for name in SETTING}


def cheapest(fronts: Mapping[str, Sequence[dict]]) -> list[dict]:
    """The cheapest setting of all engines, and the cheapest of MuJoCo (of tmt, if the first is MuJoCo's)."""
    reached = {engine: setting for engine, rows in fronts.items() if (setting := within_target(rows))}
    first = min(reached, key=lambda engine: reached[engine]["seconds"], default=None)
    other = "mujoco" if first != "mujoco" else "tmt"
    return [reached[engine] for engine in (first, other) if engine in reached]
