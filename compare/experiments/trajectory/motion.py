"""The motion as it is drawn: stick figures of both engines, at most 128 for each of two scenes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...judge.run import movement_unit, step_in_words
from ...robots import Robot
from ...robots.stick import as_seen, stick_figure
from .errors import SCHEMES_OF_RK4
from .runs import Run

FRAMES = 128  # of a scene at most, without its start
SCENES = 2


class Pictures(NamedTuple):
    """The stick figures of both engines in one scene, at equal times."""

    scene: str
    run: str  # method and step
    t: np.ndarray  # (pictures,) s
    points: dict[str, np.ndarray]  # by engine (pictures, points, 2): right, up, m; NaN once it diverged
    links: list[tuple[int, int]]  # pairs of points that a stick joins
    apart: np.ndarray  # (pictures,): the largest difference of a joint; NaN if an engine has diverged
    unit: str  # of that
    left: dict[str, float | None]  # by engine: when a held robot left its posture, s
    fixed: bool  # whether the first point does not move, as the first joint only turns


def drawn_runs(robot: Robot, runs: Sequence[Run]) -> list[Run]:
    """Those of a held scene, better one that is left, and of a free one, better from the same posture.

    By RK4, a held scene with its own step, as the departure depends on it, others with the finest one.
    """
    chosen: dict[str, Run] = {}
    for case in robot.cases:
        by_steps = {
            run.steps: run for run in runs if run.case.name == case.name and run.scheme in SCHEMES_OF_RK4
        }
        if by_steps:
            chosen[case.name] = by_steps[(min if case.is_held else max)(by_steps)]
    held = [run for run in chosen.values() if run.case.is_held]
    held = sorted(held, key=lambda run: all(path.left is None for path in run.paths.values()))[:1]
    postures = [run.case.scene.posture for run in held]
    free = [run for run in chosen.values() if run.case.is_free]
    free = sorted(free, key=lambda run: run.case.scene.posture not in postures)[:1]
    first = {run.case.name: run for run in (*held, *free, *chosen.values())}
    return list(first.values())[:SCENES]


def pictures_of(run: Run) -> Pictures:
    case, unit = run.case, movement_unit(run.case.coordinates)
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
    label, fixed = f"{run.integrator}, {step_in_words(case, run.steps)}", case.robot.tree.kind[0] != "slide"
    return Pictures(case.name, label, run.t[every], points, links, apart, unit, left, fixed)
