"""Which joints a case needs, and its motion with the smallest model compared with the whole one."""

from collections.abc import Mapping

import numpy as np

import tmt

from ...core.check import About, Result
from ...engines import LABELS, Engine, Method, Motion, same_scheme
from ...judge.rounding import NARROW, band
from ...judge.run import check_movement, deviation, required_time, step_in_words
from ...robots.case import Case
from ...truth.smallest import needed, reduced
from ..followed import Deviation, check_closest, differences
from ..setup import Setup
from .records import Need, NeedRow, ReductionResult

FINER = 16  # steps of a run for each of the case's own, which are coarse


def compare_case(result: ReductionResult, case: Case, setup: Setup) -> None:
    """What the case needs, and its motion with the smallest model."""
    need = needed(case)
    smaller, rests = reduced(case, need), len(need.stays) == len(case.joints)
    names = tuple(name for name in case.joints if name in need.moves)
    rows = [NeedRow(case.name, name, need.moves[name]) for name in names]
    result.tables.setdefault("reduction_needs", []).extend(rows)
    result.needs[case.name] = Need(names, case.scene.locked, need.stays)
    if smaller or rests:
        compare_smaller(result, case, smaller, setup)


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
