"""Which joints a case needs, and its motion with the smallest model compared with the whole one."""

import numpy as np

import tmt

from ...core.check import About, Result
from ...engines import LABELS, Motion
from ...judge.rounding import NARROW, band
from ...judge.run import check_movement, deviation, required_time, step_in_words
from ...robots.case import Case
from ...robots.coordinates import Coordinates
from ...robots.states import seconds
from ...truth.smallest import Needed, needed, reduced
from ..followed import Deviation, check_closest, differences
from ..setup import Setup
from .records import Model, Need, NeedRow, ReductionResult
from .times import finer, rk4_of

SECONDS_OF_STATE = 2.0  # that an evaluation with 50 digits may take
MOST_IN_A_BAND = 12  # nv up to which runs are compared within the band of rounding


def compare_case(result: ReductionResult, case: Case, setup: Setup) -> list[Model]:
    """Findings and checks of what the case needs; the models to be timed."""
    slow = not case.is_held and seconds(case.robot) > SECONDS_OF_STATE
    need = Needed((), {}) if slow else needed(case)
    smaller, rests = reduced(case, need), len(need.stays) == len(case.joints)
    models: list[Model] = [(case.name, case.changed(locked=()))]
    if smaller or case.locked or rests:
        models.append((case.name, None if rests else smaller or case))
    names = tuple(name for name in case.joints if name in need.moves)
    rows = [NeedRow(case.name, name, need.moves[name]) for name in names]
    result.tables.setdefault("reduction_needs", []).extend(rows)
    result.needs[case.name] = Need(names, case.scene.locked, need.stays, case.joints if slow else ())
    if (smaller or rests) and not (case.robot.is_read and case.coordinates.nv > MOST_IN_A_BAND):
        compare_smaller(result, case, smaller, setup)
    return models


def joint_word(coordinates: Coordinates) -> str:
    return "hinge" if set(coordinates.all_kinds) == {"hinge"} else "joint"


def compare_smaller(result: ReductionResult, case: Case, smaller: Case | None, setup: Setup) -> None:
    """RK4 runs of the case and of the smaller one (None: rest), within the band of rounding."""
    scheme, every, coordinates = rk4_of(setup.engines, "tmt").scheme, finer(case), case.coordinates
    steps, dt = every * case.steps, case.duration / (every * case.steps)
    runs, references = runs_of(case, setup), runs_of(smaller, setup) if smaller else {}
    width = band(tmt.METHODS[scheme], case.tree, runs["tmt"].q, runs["tmt"].v, case.tau, dt, every)
    t, required = dt * every * np.arange(len(width)), required_time(case, scheme, dt)
    for engine, run in runs.items():
        where = f"{case.name}, {LABELS[engine]}, RK4, {step_in_words(case, steps)}"
        q, v = (np.tile(start, (steps + 1, 1)) for start in case.start)
        if smaller:
            positions, speeds = columns_of(smaller, case)
            reference = references[engine]
            q[:, positions], v[:, speeds] = reference.q, reference.v
            if "own" not in case.scene.tags:  # a user's own scene may hardly move
                check_movement(result, where, deviation(run.q, run.q[0], coordinates))
        apart = differences(coordinates, (run.q, run.v), (q, v))[::every]
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


def runs_of(case: Case, setup: Setup) -> dict[str, Motion]:
    """The runs of a case by RK4, by engine."""
    steps, runs = finer(case) * case.steps, {}
    for engine, dynamics in setup.compared(case).items():
        method = rk4_of(setup.engines, engine).name
        runs[engine] = dynamics.run(*case.start, case.tau, case.duration / steps, steps, method)
    return runs
