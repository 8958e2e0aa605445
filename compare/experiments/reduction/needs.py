"""Which joints a case needs, its motion with the smallest model compared with the whole one, and the time of an RK4 step."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

import tmt
from tmt.compiled import Evaluator

from ...core.check import About, Result
from ...core.timing import fastest
from ...engines import LABELS, Engine, Method, Motion, Setting, same_scheme
from ...judge.rounding import NARROW, band
from ...judge.run import check_movement, deviation, movement_unit, required_time, step_in_words
from ...robots import Robot
from ...robots.case import Case
from ...truth.smallest import needed, reduced
from ..followed import Deviation, check_closest, differences
from ..setup import Setup
from .records import Model, Need, NeedRow, ReductionResult, ReductionRow

FINER = 16  # steps of a run for each of the case's own, which are coarse
# of a run: shorter than the time between interruptions of a busy machine
TIMED_STEPS = {"tmt": 1024, "mujoco": 128}


def compare_case(result: ReductionResult, case: Case, setup: Setup) -> list[Model]:
    """Findings and checks of what the case needs; the models to be timed."""
    need = needed(case)
    smaller, rests = reduced(case, need), len(need.stays) == len(case.joints)
    models: list[Model] = [(case.name, case.changed(locked=()))]
    if smaller or case.locked or rests:
        models.append((case.name, None if rests else smaller or case))
    names = tuple(name for name in case.joints if name in need.moves)
    rows = [NeedRow(case.name, name, need.moves[name]) for name in names]
    result.tables.setdefault("reduction_needs", []).extend(rows)
    result.needs[case.name] = Need(names, case.scene.locked, need.stays)
    if smaller or rests:
        compare_smaller(result, case, smaller, setup)
    return models


def compare_smaller(result: ReductionResult, case: Case, smaller: Case | None, setup: Setup) -> None:
    """RK4 runs of the case and of the smaller one (None: rest), within the band of rounding."""
    scheme, coordinates, steps = rk4_of(setup.engines, "tmt").scheme, case.coordinates, FINER * case.steps
    dt, runs = case.duration / steps, runs_of(case, setup)
    references = runs_of(smaller, setup) if smaller else {}
    width = band(tmt.METHODS[scheme], case.tree, runs["tmt"].q, runs["tmt"].v, case.tau, dt, FINER)
    t, required = dt * FINER * np.arange(len(width)), required_time(case, scheme, dt)
    for engine, run in runs.items():
        where = f"{case.name}, {LABELS[engine]}, RK4, {step_in_words(case, steps)}"
        q, v = (np.tile(start, (steps + 1, 1)) for start in case.start)
        if smaller:
            positions, speeds = columns_of(smaller, case)
            reference = references[engine]
            q[:, positions], v[:, speeds] = reference.q, reference.v
            if "own" not in case.scene.tags:  # a user's own scene may hardly move
                check_movement(result, where, deviation(run.q, run.q[0], coordinates))
        apart = differences(coordinates, (run.q, run.v), (q, v))[::FINER]
        until = check_smaller(result, where, Deviation(coordinates, t, apart, width), required)
        result.apart[case.name, engine] = float(apart[t <= until, : coordinates.nv].max())


def columns_of(smaller: Case, case: Case) -> tuple[np.ndarray, np.ndarray]:
    """The columns of the smaller case's positions and speeds among those of a case."""
    joints = [case.coordinates.by_name[name] for name in smaller.joints]
    return np.r_[tuple(joint.q for joint in joints)], np.r_[tuple(joint.qd for joint in joints)]


def check_smaller(result: Result, where: str, deviation: Deviation, required: float) -> float:
    """Until when the runs are judged, s: they stay within the band of rounding while it is narrow."""
    coordinates, t, apart, width = deviation
    judged = np.cumsum(~(width[:, : coordinates.nv].max(axis=1) < NARROW)) == 0
    narrow = Deviation(coordinates, t[judged], apart[judged], width[judged])
    check_closest(result, where, "smallest model to whole", narrow)
    until = float(narrow.times[-1])
    result.check(where, "time judged", until, required, "s", rule="at least", about=About.PREDICTION)
    return until


def rk4_of(engines: Mapping[str, Engine], engine: str) -> Method:
    """The method of an engine that is the same scheme as MuJoCo's RK4."""
    return same_scheme(engines, engines["mujoco"].methods["RK4"], engine)


def runs_of(case: Case, setup: Setup) -> dict[str, Motion]:
    """The runs of a case by RK4, by engine."""
    steps, runs = FINER * case.steps, {}
    for engine, dynamics in setup.compared(case).items():
        method = rk4_of(setup.engines, engine).name
        runs[engine] = dynamics.run(*case.start, case.tau, case.duration / steps, steps, method)
    return runs


def time_models(result: ReductionResult, setup: Setup, rounds: int) -> None:
    """The rows: all models of all cases, timed in turn, relative to the whole model of the same case."""
    calls: dict[Any, Callable[..., Any]] = {}
    for scene, case in result.models or ():
        if case:
            for engine, dynamics in setup.compared(case).items():
                steps = TIMED_STEPS[engine]
                setting = Setting(case.duration / case.steps / FINER * steps, steps)
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


@cache
def operations(tree: tmt.Tree) -> int:
    """Operations of one evaluation of the accelerations in compiled code."""
    return Evaluator(tree, "acceleration").operations


def largest_gain(rows: Sequence[ReductionRow], nv: int) -> ReductionRow | None:
    """The row of the largest speedup among models with fewer speeds than nv; None if there is none."""
    smaller = [row for row in rows if row.speedup and row.nv < nv]
    return max(smaller, key=lambda row: row.speedup or 0.0, default=None)
