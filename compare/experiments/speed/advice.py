"""The cheapest settings of MuJoCo, of tmt and of all engines for each error; and the first screen."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...core.rows import MOVEMENT, MovementRow, column
from .runs import SpeedResult, SpeedRow

TARGETS = (1e-2, 1e-3, 1e-6, 1e-9, 1e-12)  # rad or m, worst error of a run
TARGET = 1e-6  # rad or m: the error for which the first screen has the cheapest setting
NOT_SOLVED = 1.0  # rad or m: a run with a larger error is none


@dataclass(kw_only=True)
class AdviceRow(MovementRow):
    """The cheapest settings for an error in a scene.

    ratio: MuJoCo's time over tmt's. It is the product of integrator_part (MuJoCo's cheapest over its RK4),
    kernel_part (MuJoCo's RK4 over tmt's with the same step) and method_part (that over tmt's cheapest).
    """

    scene: str
    target: float = column(MOVEMENT)
    ratio: float | None
    integrator_part: float | None
    kernel_part: float | None
    method_part: float | None
    mujoco: str
    mujoco_dt: float | None = column("s", digits=5)
    mujoco_ms: float | None
    mujoco_evaluations: int | None
    tmt: str
    tmt_dt: float | None = column("s", digits=5)
    tmt_ms: float | None
    tmt_evaluations: int | None
    of_all: str
    of_all_dt: float | None = column("s")
    of_all_ms: float | None
    of_all_evaluations: int | None


def advice(result: SpeedResult) -> list[AdviceRow]:
    """For each scene and error the cheapest setting of MuJoCo, of tmt and of all."""
    table = []
    for scene in result.floors:
        rows = [row for row in result.rows if row.scene == scene and not row.diverged]
        for target in TARGETS:
            reach = [row for row in rows if row.largest_error <= target]
            mujoco, tmt = cheapest(reach, "mujoco"), cheapest(reach, "tmt")
            rk4 = cheapest(reach, "mujoco", "RK4")
            same_step = cheapest([row for row in rows if rk4 and row.dt == rk4.dt], "tmt", "rk4")
            ratios: dict[str, Any] = {"ratio": ratio(mujoco, tmt), "integrator_part": ratio(mujoco, rk4)}
            ratios |= {"kernel_part": ratio(rk4, same_step), "method_part": ratio(same_step, tmt)}
            settings = setting("mujoco", mujoco) | setting("tmt", tmt) | setting("of_all", cheapest(reach))
            table.append(AdviceRow(scene=scene, target=target, unit=result.unit, **ratios, **settings))
    return table


def setting(name: str, row: SpeedRow | None) -> dict[str, Any]:
    """The fields of an AdviceRow that describe a setting."""
    if row is None:
        return {name: "none", f"{name}_dt": None, f"{name}_ms": None, f"{name}_evaluations": None}
    steps = f"{row.steps} steps" if row.dt else f"tolerance {row.tolerance:.0e}"
    of_run = {f"{name}_dt": row.dt, f"{name}_ms": 1e3 * row.time, f"{name}_evaluations": row.evaluations}
    return {name: f"{row.engine} {row.method}, {steps}"} | of_run


def cheapest(rows: Sequence[SpeedRow], engine: str = "", method: str = "") -> SpeedRow | None:
    """The run that takes the least time, of all or of an engine or method."""
    fit = [row for row in rows if engine in ("", row.engine) and method in ("", row.method)]
    return min(fit, key=lambda row: row.time, default=None)


def ratio(slow: SpeedRow | None, fast: SpeedRow | None) -> float | None:
    return slow.time / fast.time if slow and fast else None


def target(result: SpeedResult) -> dict[str, Any]:
    """What the sentences about the cheapest setting of the first screen say of the run."""
    return {"scene": result.regular, "unit": result.unit, "servos_off": result.servos_off, "target": TARGET}


def front(rows: Sequence[SpeedRow]) -> list[SpeedRow]:
    """The rows than which no other is both faster and more exact, from the fastest to the most exact."""
    best: list[SpeedRow] = []
    least = NOT_SOLVED
    for row in sorted(rows, key=lambda row: (row.time, row.largest_error)):
        if row.largest_error < least:
            best.append(row)
            least = row.largest_error
    return best


def best_rows(result: SpeedResult) -> dict[str, list[SpeedRow]]:
    """The front of each engine that computed the scene in which errors are regular."""
    of_engine: dict[str, list[SpeedRow]] = {}
    for row in result.rows:
        if row.scene == result.regular and row.time < math.inf:
            of_engine.setdefault(row.engine, []).append(row)
    return {engine: best for engine, rows in of_engine.items() if (best := front(rows))}


def within_target(rows: Sequence[SpeedRow]) -> SpeedRow | None:
    """The cheapest setting of a front within TARGET."""
    return next((row for row in rows if row.largest_error <= TARGET), None)


def cheapest_of_fronts(fronts: Mapping[str, Sequence[SpeedRow]]) -> list[SpeedRow]:
    """The cheapest setting of all engines, and the cheapest of MuJoCo (of tmt, if the first is MuJoCo's)."""
    reached = [row for rows in fronts.values() if (row := within_target(rows))]
    first = cheapest(reached)
    other = "tmt" if first and first.engine == "mujoco" else "mujoco"
    return [row for row in (first, cheapest(reached, other)) if row]
