"""How long a step takes, with the whole model and with the smallest one that has the motion of a case."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

import tmt
from tmt.compiled import evaluator

from ...engines import Engine, Setting, same_scheme
from ...judge.check import Result
from ...judge.run import movement_unit
from ...judge.timing import fastest
from ...judge.units import renamed
from ...robots.case import Case
from ..setup import Setup

TWO_INTEGRATORS = ("Euler", "RK4")  # of MuJoCo, and the same schemes of tmt
TIMED_STEPS = {
    "tmt": 1024,
    "mujoco": 128,
}  # of a timed run, which is shorter than the interruptions of a busy machine are apart
FINER_RUNS = 16  # steps of a run for each of the case's own, which are coarse except for a robot from a file
MOST_TRACED = 12  # nv up to which operations are counted


def finer(case: Case) -> int:
    """Steps of a run for each of the case's own."""
    return 1 if case.robot.is_read else FINER_RUNS


def method_of(engines: Mapping[str, Engine], integrator: str, engine: str) -> str:
    """The method of an engine that is the same scheme as an integrator of MuJoCo."""
    return same_scheme(engines, engines["mujoco"].methods[integrator], engine).name


def time_models(result: Result, models: Sequence[tuple], setup: Setup, rounds: int) -> None:
    """The rows: all models of all cases, timed in turn, relative to the whole model of the same case."""
    calls = {}
    for name, case in models:
        for integrator in TWO_INTEGRATORS if case else ():
            for engine, dynamics in setup.compared(case).items():
                steps = TIMED_STEPS[engine]
                setting = Setting(case.duration / case.steps / finer(case) * steps, steps)
                method = method_of(setup.engines, integrator, engine)
                call, _ = dynamics.prepare(*case.start, case.tau, setting, method)
                calls[name, case.joints, engine, integrator] = call
    rows = time_rows(models, setup, fastest(calls, rounds), result.curves["apart"])
    result.rows += renamed(rows, movement_unit(setup.robot.coordinates))


def time_rows(
    models: Sequence[tuple], setup: Setup, seconds: Mapping[tuple, float], apart: Mapping[tuple, float]
) -> list[dict]:
    """The rows of models, (a case's name, Case or None); seconds of a timed run: by (name, joints, engine, integrator)."""
    rows, every = [], setup.robot.joints
    for name, case in models:
        joints = case.joints if case else ()
        for engine, steps in TIMED_STEPS.items():
            for integrator in TWO_INTEGRATORS:
                time = seconds.get((name, joints, engine, integrator))
                count = operations(case.tree) if case else 0
                rows.append(
                    {
                        "scene": name,
                        "hinges": " ".join(joints) or "none",
                        "engine": engine,
                        "nv": case.coordinates.nv if case else 0,
                        "operations": count if engine == "tmt" else None,
                        "ns_per_step": 1e9 * time / steps if time else None,
                        "speedup": seconds[name, every, engine, integrator] / time if time else None,
                        "max_difference_rad": None if joints == every else apart.get((name, engine, integrator)),
                        "integrator": integrator,
                    }
                )
    return rows


@lru_cache
def operations(tree: tmt.Tree) -> int | None:
    """Operations of one evaluation of the accelerations in compiled code; None for many joints."""
    return evaluator(tree, "acceleration").operations if len(tree.axis) <= MOST_TRACED else None
