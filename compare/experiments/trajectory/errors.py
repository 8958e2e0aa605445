"""Errors of both engines against the true motion; and when a held robot leaves its posture."""

from collections.abc import Mapping

import numpy as np

from ...engines import LABELS
from ...judge.run import LEFT, deviation, moved_from, movement_unit, number_or_none
from ...robots import Robot
from ...truth.reference import Reference
from .runs import Run, TrajectoryResult

SCHEMES_OF_RK4 = ("rk4", "rk4_mean_speed")


def find_errors(result: TrajectoryResult, robot: Robot, references: Mapping[str, Reference]) -> None:
    """The largest errors of RK4 with the coarsest step: of a held scene from rest, else from its reference.

    Of a held scene also when each engine leaves the posture. A run that has diverged has no number.
    """
    scenes, unit = [], movement_unit(robot.coordinates)
    claims = robot.claims.of_scenes if robot.claims else {}
    for case in sorted(robot.cases, key=lambda case: not case.is_held):
        run, reference = result.run_of(case, *SCHEMES_OF_RK4), references.get(case.name)
        if not run or not (case.is_held or reference):
            continue
        largest: dict[str, float | None] = {}
        for engine, path in run.paths.items():
            error = deviation(path.q, path.q[0], case.coordinates)
            if reference and not case.is_held:
                error = reference.error(path.q).max()
            largest[engine] = number_or_none(error)
        first, second = largest.values()
        result.errors[case.name] = first, second
        apart = difference_while_judged(run)
        scenes.append(
            {"scene": case.name, "first": first, "second": second, "difference": apart, "unit": unit}
        )
        if case.is_held:
            engines = [{"label": LABELS[engine], "left": path.left, "farthest": largest[engine]}
                       for engine, path in run.paths.items()]  # fmt: skip
            result.find("held", scene=robot.scene_begins(case.name), engines=engines, claim=claims.get(case.name),
                        limit=LEFT, duration=case.duration, unit=unit, stated=robot.compared[0] == "tmt")  # fmt: skip
    if result.errors:
        counts = {min(run.steps for run in result.runs if run.case.name == name) for name in result.errors}
        steps = counts.pop() if len(counts) == 1 else None
        result.answer = result.finding("answer", errors=result.errors, steps=steps, unit=unit)
    if any(name in references for name in result.errors):  # held scenes have their own findings
        result.find("errors", labels=[LABELS[engine] for engine in robot.compared], scenes=scenes)


def difference_while_judged(run: Run) -> float:
    """The largest difference of the engines while they are judged, rad or m."""
    last = int(np.searchsorted(run.t, run.judged_until * (1 + 1e-9), side="right"))
    first, mujoco = (path.q[: last : run.every] for path in run.paths.values())
    return float(moved_from(first, mujoco, run.case.coordinates).max())
