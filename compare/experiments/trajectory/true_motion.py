"""Errors of both engines against the true motion; and why a held robot leaves its posture."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from tmt.methods import METHODS

from ...engines import LABELS, Engine, compared
from ...judge.rounding import slope_rounding
from ...judge.run import LEFT, deviation, moved_from, movement_unit, number_or_none
from ...robots import Robot
from ...truth.reference import Reference
from .runs import Run, TrajectoryResult

SCHEMES_OF_RK4 = ("rk4", "rk4_mean_speed")
NO_TIME = 1e-6  # s: a step in which nothing moves


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
    scenes = []
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
        scenes.append(about | {"unit": movement_unit(run.case.coordinates)})
    if result.errors:
        result.answer = result.finding("answer", errors=result.errors, steps=coarsest_steps(result))
    if any(name in references for name in result.errors):  # held scenes have their own findings
        labels = [LABELS[engine] for engine in robot.compared]
        result.find("errors", labels=labels, scenes=scenes)


def coarsest_steps(result: TrajectoryResult) -> int | None:
    """The number of the coarsest steps of the scenes with errors, if they all have as many."""
    counts = {min(run.steps for run in result.runs if run.case.name == scene) for scene in result.errors}
    return counts.pop() if len(counts) == 1 else None


def difference_while_judged(run: Run) -> float:
    """The largest difference of the engines while they are judged, rad or m."""
    last = int(np.searchsorted(run.t, run.judged_until * (1 + 1e-9), side="right"))
    first, mujoco = (path.q[: last : run.every] for path in run.paths.values())
    return float(moved_from(first, mujoco, run.case.coordinates).max())


def find_departures(result: TrajectoryResult, robot: Robot, engines: Mapping[str, Engine]) -> None:
    """When each engine leaves the posture of each held scene, and whether its torque holds it."""
    claims = robot.claims.of_scenes if robot.claims else {}
    for run in coarsest_runs(result, robot):
        case = run.case
        if case.is_held:
            about: dict[str, Any] = {"claim": claims.get(case.name), "limit": LEFT, "duration": case.duration}
            about |= {"unit": movement_unit(case.coordinates), "stated": robot.compared[0] == "tmt"}
            result.find("held", scene=robot.scene_begins(case.name), **about, **departures(run, engines))


def departures(run: Run, engines: Mapping[str, Engine]) -> dict[str, Any]:
    """The initial acceleration under the torque that should hold, and what rounding can cause, rad/s2.

    Both of the joint whose acceleration is the largest share of what rounding can cause in it.
    """
    case = run.case
    dt, ((name, first), (mujoco, last)) = case.duration / case.steps, compared(engines, case).items()
    allowed = slope_rounding(METHODS["rk4"], case.tree, case.q[None], case.v[None], case.tau, dt)[2][0]
    of_step = first.run(*case.start, case.tau, NO_TIME, 1, "rk4").v[1] / NO_TIME
    initial = {name: of_step, mujoco: last.acceleration(*case.start, case.tau)}
    joint = int(np.argmax(np.max(np.abs([*initial.values()]), axis=0) / allowed))
    farthest, told = deviations(run), []
    for engine, acceleration in initial.items():
        push = number_or_none(np.abs(acceleration[joint]))
        about = {"label": LABELS[engine], "left": run.paths[engine].left, "farthest": farthest[engine]}
        told.append(about | {"push": push, "holds": push is not None and push <= allowed[joint]})
    return {"allowed": float(allowed[joint]), "engines": told}
