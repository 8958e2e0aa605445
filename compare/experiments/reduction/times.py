"""How long an RK4 step takes, with the whole model and with the smallest one of a case."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import tmt
from tmt.compiled import Evaluator

from ...core.timing import fastest
from ...engines import Engine, Method, Setting, same_scheme
from ...judge.run import movement_unit
from ...robots import Robot
from ...robots.case import Case
from ..setup import Setup
from .records import ReductionResult, ReductionRow

# of a run: shorter than the time between interruptions of a busy machine
TIMED_STEPS = {"tmt": 1024, "mujoco": 128}
MOST_TRACED = 12  # nv up to which operations are counted


def finer(case: Case) -> int:
    """Steps of a run for each of the case's own, which are coarse except for a robot from a file."""
    return 1 if case.robot.is_read else 16


def rk4_of(engines: Mapping[str, Engine], engine: str) -> Method:
    """The method of an engine that is the same scheme as MuJoCo's RK4."""
    return same_scheme(engines, engines["mujoco"].methods["RK4"], engine)


def time_models(result: ReductionResult, setup: Setup, rounds: int) -> None:
    """The rows: all models of all cases, timed in turn, relative to the whole model of the same case."""
    calls: dict[Any, Callable[..., Any]] = {}
    for scene, case in result.models or ():
        if case:
            for engine, dynamics in setup.compared(case).items():
                steps = TIMED_STEPS[engine]
                setting = Setting(case.duration / case.steps / finer(case) * steps, steps)
                method = rk4_of(setup.engines, engine).name
                run, _ = dynamics.prepare(*case.start, case.tau, setting, method)
                calls[scene, case.joints, engine] = run
    add_rows(result, setup.robot, fastest(calls, rounds))


def add_rows(result: ReductionResult, robot: Robot, seconds: Mapping[Any, float]) -> None:
    """The rows of all models. seconds: of a run, by scene, joints and engine."""
    unit = movement_unit(robot.coordinates)
    for scene, case in result.models or ():
        joints, nv, count = (case.joints, case.coordinates.nv, operations(case.tree)) if case else ((), 0, 0)
        about: dict[str, Any] = {"scene": scene, "hinges": " ".join(joints) or "none", "nv": nv, "unit": unit}
        for engine, steps in TIMED_STEPS.items():
            row = ReductionRow(engine=engine, operations=count if engine == "tmt" else None, **about)
            if time := seconds.get((scene, joints, engine)):
                row.ns_per_step, row.speedup = 1e9 * time / steps, seconds[scene, robot.joints, engine] / time
            if joints != robot.joints:
                row.max_difference = result.apart.get((scene, engine))
            result.rows.append(row)


@lru_cache
def operations(tree: tmt.Tree) -> int | None:
    """Operations of one evaluation of the accelerations in compiled code; None for many joints."""
    return Evaluator(tree, "acceleration").operations if len(tree.axis) <= MOST_TRACED else None


def largest_gain(rows: Sequence[ReductionRow], nv: int) -> ReductionRow | None:
    """The row of the largest speedup among models with fewer speeds than nv; None if there is none."""
    smaller = [row for row in rows if row.speedup and row.nv < nv]
    return max(smaller, key=lambda row: row.speedup or 0.0, default=None)
