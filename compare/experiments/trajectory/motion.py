"""The motion as it is drawn: stick figures of both engines, about 128 for each scene."""

from collections.abc import Sequence

import numpy as np

from ...core.finding import Finding
from ...core.pictures import Pictures
from ...engines import LABELS
from ...judge.run import LEFT, movement_unit, step_in_words
from ...robots import Robot
from ...robots.case import Case
from ...robots.stick import as_seen, stick_figure
from .runs import Path, Run
from .true_motion import SCHEMES_OF_RK4

FRAMES = 128  # of a scene, about, without its start


def pictures_of(case: Case, runs: Sequence[Run]) -> Pictures | None:
    """The motion of a case by RK4; None if there is no such run.

    A held scene is drawn with its own step, as the departure depends on the step; others with the finest one.
    """
    by_steps = {run.steps: run for run in runs if run.case.name == case.name and run.scheme in SCHEMES_OF_RK4}
    if not by_steps:
        return None
    run, unit = by_steps[(min if case.is_held else max)(by_steps)], movement_unit(case.coordinates)
    positions, points = [], {}
    for engine, path in run.paths.items():
        times, q = frames(case, run.t, path)
        alive = np.isfinite(q).all(axis=1)
        whole = case.positions_of_all(np.where(alive[:, None], q, case.q))
        of_robot, links = stick_figure(case.robot, whole, crosses=True)
        points[engine] = np.where(alive[:, None, None], as_seen(of_robot), np.nan)
        positions.append(q)
    apart = np.abs(case.coordinates.difference(*positions)).max(axis=1)
    left = {engine: path.left if case.is_held else None for engine, path in run.paths.items()}
    ended = {engine: path.ended for engine, path in run.paths.items() if path.ended is not None}
    leaves = [{"label": LABELS[name], "left": time} for name, time in left.items()]
    seen = Finding("trajectory", "seen", {
        "noun": case.robot.noun, "unit": unit, "limit": LEFT, "held": case.is_held, "end": case.duration,
        "leaves": leaves if any(left.values()) else [],
        "apart": float(np.nanmax(apart)) if np.isfinite(apart).any() else None,
        "diverged": [{"label": LABELS[name], "time": end} for name, end in ended.items()],
    })  # fmt: skip
    label, fixed = f"{run.integrator}, {step_in_words(case, run.steps)}", case.robot.tree.kind[0] != "slide"
    return Pictures(case.name, label, times, points, links, apart, unit, left, seen, fixed)


def frames(case: Case, t: np.ndarray, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """The times and positions of the pictures of a run, (frames,) and (frames, nq); NaN once it has diverged.

    A run of few steps is interpolated between them, unless a joint is a ball.
    """
    alive = (t < (np.inf if path.ended is None else path.ended)) & np.isfinite(path.q).all(axis=1)
    q, v = np.where(alive[:, None], path.q, np.nan), path.v
    parts, every = max(1, FRAMES // (len(t) - 1)), -(-(len(t) - 1) // FRAMES)
    if parts == 1 or case.coordinates.has_balls:
        return t[::every], q[::every]
    times = np.linspace(t[0], t[-1], parts * (len(t) - 1) + 1)
    first = np.clip(np.searchsorted(t, times, "right") - 1, 0, max(0, alive.sum() - 2))  # step of each time
    share, step, rise = ((times - t[first]) / (t[1] - t[0]))[:, None], t[1] - t[0], q[first + 1] - q[first]
    # Hermite's cubic polynomial
    bent = (1.0 - share) * (step * v[first] - rise) - share * (step * v[first + 1] - rise)
    between = q[first] + share * rise + share * (1.0 - share) * bent if alive.sum() > 1 else q[:1]
    return times, np.where((times <= t[alive][-1])[:, None], between, np.nan)


def in_order(drawn: Sequence[Pictures], robot: Robot) -> list[Pictures]:
    """A held scene, better one with a departure, a free one, better of the same posture, and the rest."""
    cases = {case.name: case for case in robot.cases}
    held = [scene for scene in drawn if cases[scene.scene].is_held]
    free = [scene for scene in drawn if cases[scene.scene].is_free]
    first = sorted(held, key=lambda scene: not any(scene.left.values()))[:1]
    postures = [cases[scene.scene].scene.posture for scene in first]
    first += sorted(free, key=lambda scene: cases[scene.scene].scene.posture not in postures)[:1]
    names = [scene.scene for scene in first]
    return first + [scene for scene in drawn if scene.scene not in names]
