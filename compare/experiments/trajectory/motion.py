"""The motion itself as a table: positions and speeds of every engine and integrator at 65 equal times."""

import re

import numpy as np

from ...engines import GRID
from ...judge.check import Result
from ...robots import Robot
from ...robots.case import Case, Coordinates

IN_COLUMNS = {  # what stands behind a joint's name: of its positions, of its speeds
    "hinge": (["_rad"], ["_rad_per_s"]),
    "slide": (["_m"], ["_m_per_s"]),
    "ball": ([f"_{part}" for part in "wxyz"], [f"_{part}_rad_per_s" for part in "xyz"]),
}


def at_equal_times(case: Case, t: np.ndarray, q: np.ndarray, v: np.ndarray, ended: float | None) -> tuple | None:
    """t (65,) s, and all joints' positions and speeds, (65, nq + nv), of a run; NaN from where it has diverged, `ended` s, on.

    None where 64 equal times are no whole number of its steps each.
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

    Where that is not the scene's own step, or there is none, a note says so. What a run does not have is None.
    """
    columns, coarsest, rows = motion_columns(robot.coordinates), {}, []
    for (scene, _, steps), curve in result.curves["runs"].items():
        known = coarsest.setdefault(scene, [])
        known += [steps] if None not in curve["records"].values() else []
    for (scene, _, steps), curve in result.curves["runs"].items():
        if steps != min(coarsest[scene], default=None):
            continue
        for (engine, integrator), (t, values) in curve["records"].items():
            about = {"scene": scene, "engine": engine, "integrator": integrator, "dt_s": float(curve["t"][1])}
            whole = np.where(np.isfinite(values), values, None).tolist()
            rows += [about | {"t_s": at} | dict(zip(columns, state)) for at, state in zip(t.tolist(), whole)]
    result.tables["motion"] = rows
    result.filed += ("motion",)
    own = {case.name: case.steps for case in robot.cases}
    without = "; ".join(scene for scene, found in coarsest.items() if not found)
    finer = "; ".join(
        f"{scene}: {min(found)} steps"
        for scene, found in coarsest.items()
        if found and scene in own and min(found) != own[scene]
    )
    if finer:
        result.notes.append(
            f"tables/motion.csv has {GRID + 1} equal times, which are no states of a run with a scene's own steps here; its run "
            f"is one with finer steps: {finer}."
        )
    if without:
        result.notes.append(
            f"tables/motion.csv has no rows of scenes whose runs have no multiple of {GRID} steps: {without}."
        )


def motion_columns(coordinates: Coordinates) -> list[str]:
    """The names of the columns of positions and speeds, (nq + nv,): q_<joint>_rad ..., then qd_<joint>_rad_per_s ...

    Of a free joint `root`: q_root_x_m, _y_m, _z_m, and q_root_w, _x, _y, _z.
    """
    names, found = list(coordinates.names), []
    for i in range(3, len(names)):
        base = names[i].removesuffix(" turn")
        if names[i - 3 : i + 1] == [f"{base} {part}" for part in ("x", "y", "z", "turn")]:
            names[i] = base
    joints = [(re.sub(r"\W+", "_", name), kind) for name, kind in zip(names, coordinates.all_kinds)]
    for which, letter in enumerate(("q", "qd")):
        for name, kind in joints:
            for end in IN_COLUMNS[kind][which]:
                column = f"{letter}_{name}{end}"
                while column in found:  # names that differ in signs alone
                    column += "_"
                found.append(column)
    return found
