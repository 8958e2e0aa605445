"""The motion itself: a table of positions and speeds at 65 equal times, and the stick figures of both engines at about 128."""

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...engines import GRID, LABELS, Dynamics, Engine, compared
from ...judge.check import Result
from ...judge.finding import Finding
from ...judge.run import LEFT, departure, diverged_at, movement_unit, step_in_words
from ...robots import Robot
from ...robots.case import Case, Coordinates
from ...robots.stick import as_seen, stick_figure
from .true_motion import SCHEMES_OF_RK4, initial_accelerations, predicted_departure

FRAMES = 128  # of a scene, about, without its start
SEEN_AFTER = 0.1  # of a scene's duration: the time that is shown after the departure
SUFFIXES = {  # of a joint's columns: of its positions, of its speeds
    "hinge": (["_rad"], ["_rad_per_s"]),
    "slide": (["_m"], ["_m_per_s"]),
    "ball": ([f"_{part}" for part in "wxyz"], [f"_{part}_rad_per_s" for part in "xyz"]),
}


def at_equal_times(case: Case, t: np.ndarray, q: np.ndarray, v: np.ndarray, ended: float | None) -> tuple | None:
    """t (65,) s, and all joints' positions and speeds, (65, nq + nv), of a run; NaN from its divergence, `ended` s, on.

    None if the number of its steps is not a multiple of 64.
    """
    every, left = divmod(len(t) - 1, GRID)
    if left:
        return None
    t = t[::every]
    values = np.concatenate([case.whole_positions(q[::every]), case.whole_speeds(v[::every])], axis=1)
    alive = (t < (np.inf if ended is None else ended))[:, None] & np.isfinite(values).all(axis=1, keepdims=True)
    return t, np.where(alive, values, np.nan)


def tabulate_motion(result: Result, robot: Robot) -> None:
    """The table "motion", in its file alone: each scene by its coarsest step that is recorded at 65 equal times.

    Missing values are None. A finding names the scenes that have no such step.
    """
    columns, coarsest, rows = motion_columns(robot.coordinates), {}, []
    for (scene, _, steps), curve in result.curves["runs"].items():
        counts = coarsest.setdefault(scene, [])
        counts += [steps] if None not in curve["records"].values() else []
    for (scene, _, steps), curve in result.curves["runs"].items():
        if steps != min(coarsest[scene], default=None):
            continue
        for (engine, integrator), (t, values) in curve["records"].items():
            about = {"scene": scene, "engine": engine, "integrator": integrator, "dt_s": float(curve["t"][1])}
            whole = np.where(np.isfinite(values), values, None).tolist()
            rows += [about | {"t_s": time} | dict(zip(columns, state)) for time, state in zip(t.tolist(), whole)]
    result.tables["motion"] = rows
    result.filed += ("motion",)
    without = [scene for scene, counts in coarsest.items() if not counts]
    if without:
        result.find("no_motion_table", grid=GRID, scenes=without)


def motion_columns(coordinates: Coordinates) -> list[str]:
    """The names of the columns of positions and speeds, (nq + nv,): q_<joint>_rad ..., then qd_<joint>_rad_per_s ...

    Of a free joint `root`: q_root_x_m, _y_m, _z_m, and q_root_w, _x, _y, _z.
    """
    names, columns = list(coordinates.names), []
    for i in range(3, len(names)):
        base = names[i].removesuffix(" turn")
        if names[i - 3 : i + 1] == [f"{base} {part}" for part in ("x", "y", "z", "turn")]:
            names[i] = base
    joints = [(re.sub(r"\W+", "_", name), kind) for name, kind in zip(names, coordinates.all_kinds)]
    for which, letter in enumerate(("q", "qd")):
        for name, kind in joints:
            for end in SUFFIXES[kind][which]:
                column = f"{letter}_{name}{end}"
                while column in columns:  # names that differ in signs alone
                    column += "_"
                columns.append(column)
    return columns


class Drawn(NamedTuple):
    """The motion of one scene as it is drawn."""

    scene: str
    run: str  # method and step
    t: np.ndarray  # (frames,) s
    points: dict  # of each engine (frames, points, 2): to the right and up, m; NaN from where it has diverged on
    links: list  # pairs of points that a stick joins
    apart: np.ndarray  # (frames,): the largest difference of the engines in any joint; NaN if one has diverged
    unit: str  # of that
    ended: dict  # of each engine: time of divergence, s, or None
    left: dict  # of each engine: time when a held robot left its posture, s, or None
    seen: Finding  # departures, the largest difference, divergence
    fixed: bool  # whether the first point does not move, as the first joint only turns


def drawn_motion(case: Case, engines: Mapping[str, Engine], runs: Mapping[tuple, dict]) -> Drawn | None:
    """The motion of a case by RK4; None if there is no such run.

    A held scene is drawn with its own step, as the departure depends on the step; others with the finest one. If only one
    engine has left its posture at the end, both runs go on until both have, for at most the same time again.
    """
    keys = [key for key in runs if key[0] == case.name and key[1] in SCHEMES_OF_RK4]
    if not keys:
        return None
    key = (min if case.is_held else max)(keys, key=lambda key: key[2])
    _, scheme, steps = key
    curve, dynamics = runs[key], compared(engines, case)
    dt, methods = case.duration / steps, dict(zip(dynamics, (scheme, curve["integrator"])))
    t, paths, ended, left = followed_on(case, dynamics, methods, curve, steps)
    every, parts = -(-steps // FRAMES), 1 if case.robot.own else max(1, FRAMES // steps)
    times = t[::every] if parts == 1 else np.arange(parts * (len(t) - 1) + 1) * (dt / parts)
    seen, points, links = {}, {}, []
    for name, path in paths.items():
        few = [part[::every] for part in path]
        q = with_parts_of_steps(dynamics[name], few, case.tau, dt, parts, methods[name])
        alive = np.isfinite(q).all(axis=1) & (times < (np.inf if ended[name] is None else ended[name]))
        whole = case.whole_positions(np.where(alive[:, None], q, case.q))
        of_robot, links = stick_figure(case.robot, whole, crosses=True)
        points[name] = np.where(alive[:, None, None], as_seen(of_robot), np.nan)
        seen[name] = np.where(alive[:, None], q, np.nan)
    apart = np.abs(case.coordinates.difference(*seen.values())).max(axis=1)
    run = f"{curve['integrator']}, {step_in_words(case, steps)}"
    words = what_is_seen(case, engines, t, paths, ended, left, apart, parts)
    fixed = case.robot.tree.kind[0] != "slide"
    return Drawn(
        case.name, run, times, points, links, apart, movement_unit(case.coordinates), ended, left, words, fixed
    )


def followed_on(
    case: Case, dynamics: Mapping[str, Dynamics], methods: Mapping[str, str], curve: dict, steps: int
) -> tuple[np.ndarray, dict, dict, dict]:
    """Times of a run (times,) s; of both engines the states, the times of divergence and of departure from the posture.

    The run is longer than the scene's if only one engine has left its posture by then.
    """
    t, paths, ended = curve["t"], {name: curve[name] for name in dynamics}, curve["ended"]
    left = curve["left"] if case.is_held else dict.fromkeys(dynamics)  # of a posture
    if len({time is None for time in left.values()}) == 1 or any(ended.values()) or case.robot.own:
        return t, paths, ended, left
    dt = case.duration / steps
    motions = {
        name: engine.run(*case.start, case.tau, dt, 2 * steps, methods[name]) for name, engine in dynamics.items()
    }
    leaving = {name: departure(motion.t, motion.q, case.coordinates) for name, motion in motions.items()}
    if None in leaving.values():
        return t, paths, ended, left
    last = max(leaving.values()) + SEEN_AFTER * case.duration
    longer = next(iter(motions.values())).t
    t = longer[longer <= last]
    paths = {name: [motion.q[: len(t)], motion.v[: len(t)]] for name, motion in motions.items()}
    return t, paths, {name: diverged_at(case, t, *path) for name, path in paths.items()}, leaving


def in_order(drawn: Sequence[Drawn], robot: Robot) -> list[Drawn]:
    """Scenes in the order of the page: a held one, if possible with a departure; a free one, if possible from there; the rest."""
    cases = {case.name: case for case in robot.cases}
    held = [each for each in drawn if cases[each.scene].is_held]
    first = sorted(held, key=lambda each: not any(each.left.values()))[:1]
    postures = [cases[each.scene].scene.posture for each in first]
    free = [each for each in drawn if cases[each.scene].is_free]
    then = sorted(free, key=lambda each: cases[each.scene].scene.posture not in postures)[:1]
    chosen = [each.scene for each in first + then]
    return first + then + [each for each in drawn if each.scene not in chosen]


def with_parts_of_steps(
    dynamics: Dynamics, path: Sequence[np.ndarray], tau: np.ndarray, dt: float, parts: int, method: str
) -> np.ndarray:
    """Positions of a run, (times, nq), with intermediate ones by shorter steps of its method from each state.

    dt: of its steps, s; parts: the number of parts of a step.
    """
    q, v = path
    alive = int(np.argmin(np.append(np.isfinite(np.concatenate(path, axis=1)).all(axis=1), False)))
    positions = np.full((parts * (len(q) - 1) + 1, q.shape[1]), np.nan)
    positions[::parts] = q
    if alive > 1:
        for k in range(1, parts):
            moved = dynamics.run(q[: alive - 1], v[: alive - 1], tau, dt * k / parts, 1, method).q[:, 1]
            positions[k::parts][: alive - 1] = moved
    return positions


def what_is_seen(
    case: Case,
    engines: Mapping[str, Engine],
    t: np.ndarray,
    paths: dict,
    ended: dict,
    left: dict,
    apart: np.ndarray,
    parts: int,
) -> Finding:
    """When and to which side each engine leaves its posture, the engines' largest difference, which has diverged."""
    leaves, sides, unit = [], None, movement_unit(case.coordinates)
    if case.is_held and any(left.values()):
        longer = case.changed(duration=2.0 * case.duration)
        pushes = initial_accelerations(case, engines)
        for name, time in sorted(left.items(), key=lambda item: item[1] or np.inf):
            predicted = predicted_departure(longer, pushes[name]) if np.isfinite(pushes[name]).all() else None
            leaves.append({"label": LABELS[name], "left": time, "predicted": predicted})
        sides = sides_left_to(case, t, paths, left) if all(left.values()) else None
    values = {
        "noun": case.robot.noun,
        "unit": unit,
        "limit": LEFT,
        "held": case.is_held,
        "leaves": leaves,
        "sides": sides,
        "apart": float(np.nanmax(apart)) if np.isfinite(apart).any() else None,
        "duration": case.duration,
        "end": float(t[-1]),
        "diverged": [{"label": LABELS[name], "time": time} for name, time in ended.items() if time is not None],
        "parts": parts,
    }
    return Finding("trajectory", "seen", values)


def sides_left_to(case: Case, t: np.ndarray, paths: dict, left: dict) -> dict | None:
    """The joint with the largest movement at the departure, its movement in each engine, and whether the sides are the same."""
    moved, coordinates = {}, case.coordinates
    for name, time in left.items():
        k = int(np.searchsorted(t, time))
        moved[name] = coordinates.difference(paths[name][0][k], case.q)
    ours, theirs = moved.values()
    if not np.isfinite([ours, theirs]).all():
        return None
    i = int(np.argmax(np.abs(ours)))
    by = [{"label": LABELS[name], "by": float(values[i])} for name, values in moved.items()]
    joint = case.robot.symbol(coordinates.speeds[i])
    return {"joint": joint, "unit": coordinates.units[i], "same": bool(ours @ theirs > 0.0), "moved": by}
