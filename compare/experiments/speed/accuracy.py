"""Checks of the errors of the runs: MuJoCo against the same scheme in tmt, and against rounding."""

from collections.abc import Mapping

import numpy as np

from ...judge.check import Result
from ...judge.scale import FACTOR

Floors = Mapping[str, float]  # {scene: error that rounding leaves, rad}

NEAR_ROUNDING = 30  # a smaller multiple of the error of rounding counts as rounding
SMALL_ERROR = 0.1  # rad: rounding changes a smaller error by no more than the growth of a small difference predicts


def check_same_schemes(
    result: Result, floors: Floors, schemes: Mapping[str, Mapping[str, str]], unit: str = "rad"
) -> None:
    """MuJoCo's integrators and the same schemes in tmt make the same error, except for rounding.

    Checked where at least one of the errors is below 0.1 rad; a diverged run has the error inf.
    schemes: for each scene {integrator of MuJoCo: method of tmt}.
    """
    by_place = {(row["scene"], row["engine"], row["method"], row["dt_s"]): row for row in result.rows}
    for (scene, engine, method, dt), row in by_place.items():
        scheme = schemes[scene].get(method) if engine == "mujoco" and scene in floors else None
        ours = by_place.get((scene, "tmt", scheme, dt)) if scheme else None
        if ours and min(error(row), error(ours)) < SMALL_ERROR:
            difference = abs(error(row) - error(ours))
            where = f"{scene}, {method}, dt = {dt:.3g} s"
            quantity = f"the same error as tmt's {ours['method']}"
            result.check(where, quantity, difference, FACTOR * floors[scene], unit, rounding=True)


def check_smallest_errors(result: Result, floors: Floors, unit: str = "rad") -> None:
    """The smallest error of MuJoCo's RK4 is that of tmt's; where errors stop falling, they are of the size of rounding.

    If MuJoCo's errors still fall at its finest step, tmt's runs with finer steps are left out. If both diverge at all steps,
    as with a stiff robot, or tmt has no run with such a step, nothing is compared.
    """
    for scene, left in floors.items():
        least, finest = {}, finest_while_falling(result.rows, scene) or 0.0
        for engine, method in (("mujoco", "RK4"), ("tmt", "rk4"), ("tmt", "dopri8")):
            errors = errors_of(result.rows, scene, engine, method)
            least[method] = min(errors, default=np.inf)
            if stopped(errors):
                quantity = f"smallest error of {engine}'s {method}, where smaller steps gain nothing"
                result.check(scene, quantity, least[method], FACTOR * left, unit, rounding=True)
        comparable = errors_of(result.rows, scene, "tmt", "rk4", finest)
        least["rk4"] = min(comparable, default=np.inf)
        if not comparable or not np.isfinite([least["RK4"], least["rk4"]]).any():
            continue
        tolerance = FACTOR * left + (2.0 * least["rk4"] if np.isfinite(least["rk4"]) else 0.0)
        result.check(scene, "smallest error of MuJoCo's RK4, compared with tmt's rk4", least["RK4"], tolerance, unit)


def gained_nothing(error: float, work: int, best: float, last: int, left: float) -> bool:
    """Whether a run that cost more than the last one is not more exact, when the best error is already near rounding."""
    return best < NEAR_ROUNDING * left and work > 1.2 * last and not error < 0.7 * best


def error(row: dict) -> float:
    """The worst error of a run, rad; inf if it diverged."""
    return np.inf if row["diverged"] else row["worst_error_rad"]


def errors_of(rows: list[dict], scene: str, engine: str, method: str, finest: float = 0.0) -> list[float]:
    """The errors of a method in a scene, rad, in the order of its settings, except of steps shorter than `finest`, s."""
    return [error(row) for row in rows_of_method(rows, scene, engine, method) if not (row["dt_s"] or np.inf) < finest]


def rows_of_method(rows: list[dict], scene: str, engine: str, method: str) -> list[dict]:
    """The rows of a method in a scene, from coarse to fine."""
    return [row for row in rows if (row["scene"], row["engine"], row["method"]) == (scene, engine, method)]


def finest_while_falling(rows: list[dict], scene: str) -> float | None:
    """The finest step of MuJoCo's RK4, s, if its errors fall until there; None if finer steps gain nothing."""
    runs = rows_of_method(rows, scene, "mujoco", "RK4")
    falls = runs and not stopped([error(row) for row in runs])
    return min(row["dt_s"] for row in runs) if falls else None


def stopped(errors: list[float]) -> bool:
    """Whether the least of these errors is not the last: smaller steps gained nothing."""
    return bool(errors) and np.isfinite(min(errors)) and errors.index(min(errors)) < len(errors) - 1
