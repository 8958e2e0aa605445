"""The motion as it is drawn: stick figures of both engines, at most 128 for each scene."""

from collections.abc import Sequence

import numpy as np

from ...core.finding import Finding
from ...core.pictures import Pictures
from ...engines import LABELS
from ...judge.run import LEFT, movement_unit, step_in_words
from ...robots import Robot
from ...robots.case import Case
from ...robots.stick import as_seen, stick_figure
from .errors import SCHEMES_OF_RK4
from .runs import Run

FRAMES = 128  # of a scene at most, without its start


def pictures_of(case: Case, runs: Sequence[Run]) -> Pictures | None:
    """The motion of a case by RK4, states of its runs; None if there is no such run.

    A held scene is drawn with its own step, as the departure depends on the step; others with the finest one.
    """
    by_steps = {run.steps: run for run in runs if run.case.name == case.name and run.scheme in SCHEMES_OF_RK4}
    if not by_steps:
        return None
    run, unit = by_steps[(min if case.is_held else max)(by_steps)], movement_unit(case.coordinates)
    every = slice(None, None, -(-run.steps // FRAMES))
    positions, points = [], {}
    for engine, path in run.paths.items():
        q = run.until_diverged(engine, path.q)[every]
        alive = np.isfinite(q).all(axis=1)
        whole = case.positions_of_all(np.where(alive[:, None], q, case.q))
        of_robot, links = stick_figure(case.robot, whole, crosses=True)
        points[engine] = np.where(alive[:, None, None], as_seen(of_robot), np.nan)
        positions.append(np.where(alive[:, None], q, np.nan))
    apart = np.abs(case.coordinates.difference(*positions)).max(axis=1)
    left = {engine: path.left if case.is_held else None for engine, path in run.paths.items()}
    leaves = [{"label": LABELS[name], "left": time} for name, time in left.items()]
    ended = {LABELS[engine]: path.ended for engine, path in run.paths.items() if path.ended is not None}
    seen = Finding("trajectory", "seen", {
        "noun": case.robot.noun, "unit": unit, "limit": LEFT, "held": case.is_held, "end": case.duration,
        "leaves": leaves if any(left.values()) else [],
        "apart": float(np.nanmax(apart)) if np.isfinite(apart).any() else None,
        "diverged": [{"label": label, "time": end} for label, end in ended.items()],
    })  # fmt: skip
    label, fixed = f"{run.integrator}, {step_in_words(case, run.steps)}", case.robot.tree.kind[0] != "slide"
    return Pictures(case.name, label, run.t[every], points, links, apart, unit, left, seen, fixed)


def in_order(drawn: Sequence[Pictures], robot: Robot) -> list[Pictures]:
    """A held scene, better one with a departure, a free one, better of the same posture, and the rest."""
    cases = {case.name: case for case in robot.cases}
    held = [scene for scene in drawn if cases[scene.scene].is_held]
    free = [scene for scene in drawn if cases[scene.scene].is_free]
    first = sorted(held, key=lambda scene: not any(scene.left.values()))[:1]
    postures = [cases[scene.scene].scene.posture for scene in first]
    first += sorted(free, key=lambda scene: cases[scene.scene].scene.posture not in postures)[:1]
    return first + [scene for scene in drawn if all(scene is not other for other in first)]
