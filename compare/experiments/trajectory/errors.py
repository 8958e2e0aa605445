"""Errors of both engines against the true motion; and when a held robot leaves its posture."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...engines import LABELS
from ...judge.run import LEFT, deviation, moved_from, movement_unit, number_or_none
from ...robots import Robot
from ...truth.reference import Reference
from .runs import Run, TrajectoryResult

SCHEMES_OF_RK4 = ("rk4", "rk4_mean_speed")


def coarsest_runs(result: TrajectoryResult, robot: Robot) -> Iterator[Run]:
    """The run of each scene with the coarsest step of MuJoCo's RK4, held scenes first."""
    for case in sorted(robot.cases, key=lambda case: not case.is_held):
        if run := result.run_of(case, *SCHEMES_OF_RK4):
            yield run


def deviations(run: Run) -> dict[str, float | None]:
    """The largest movement of each engine's run from its start, rad or m; None of a run that has diverged."""
    paths = {engine: path.q for engine, path in run.paths.items()}
    return {engine: number_or_none(deviation(q, q[0], run.case.coordinates)) for engine, q in paths.items()}


def find_errors(result: TrajectoryResult, robot: Robot, references: Mapping[str, Reference]) -> None:
    """The largest errors in each scene: of a held one from rest, else from its reference, if it has one."""
    scenes, unit = [], movement_unit(robot.coordinates)
    for run in coarsest_runs(result, robot):
        name, reference = run.case.name, references.get(run.case.name)
        if run.case.is_held:
            first, second = deviations(run).values()
        elif reference:
            first, second = (number_or_none(reference.error(path.q).max()) for path in run.paths.values())
        else:
            continue
        result.errors[name] = first, second
        about = {"scene": name, "first": first, "second": second, "difference": difference_while_judged(run)}
        scenes.append(about | {"unit": unit})
    if result.errors:
        counts = {min(run.steps for run in result.runs if run.case.name == name) for name in result.errors}
        steps = counts.pop() if len(counts) == 1 else None
        result.answer = result.finding("answer", errors=result.errors, steps=steps, unit=unit)
    if any(name in references for name in result.errors):  # held scenes have their own findings
        labels = [LABELS[engine] for engine in robot.compared]
        result.find("errors", labels=labels, scenes=scenes)


def difference_while_judged(run: Run) -> float:
    """The largest difference of the engines while they are judged, rad or m."""
    last = int(np.searchsorted(run.t, run.judged_until * (1 + 1e-9), side="right"))
    first, mujoco = (path.q[: last : run.every] for path in run.paths.values())
    return float(moved_from(first, mujoco, run.case.coordinates).max())


def find_departures(result: TrajectoryResult, robot: Robot) -> None:
    """When each engine leaves the posture of each held scene, and how far it goes."""
    claims = robot.claims.of_scenes if robot.claims else {}
    for run in coarsest_runs(result, robot):
        case = run.case
        if case.is_held:
            farthest = deviations(run)
            engines = [{"label": LABELS[engine], "left": path.left, "farthest": farthest[engine]}
                       for engine, path in run.paths.items()]  # fmt: skip
            about: dict[str, Any] = {"claim": claims.get(case.name), "limit": LEFT, "duration": case.duration}
            about |= {"unit": movement_unit(case.coordinates), "stated": robot.compared[0] == "tmt"}
            result.find("held", scene=robot.scene_begins(case.name), engines=engines, **about)
