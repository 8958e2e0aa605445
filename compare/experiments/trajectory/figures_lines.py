"""The lines of a run in a panel: of all joints, or of those in which the engines differ most."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from ...engines import LABELS
from ...judge.run import moved_from
from ...report.style import LINES, plain
from ...robots.case import Case

MOST_LINES = len(LINES)  # of joints in a panel
LEVEL = 1e-6  # of a position: a smaller change is not seen in a panel


def over_time(
    ax: Axes,
    t: np.ndarray,
    ours: np.ndarray,
    theirs: np.ndarray,
    case: Case,
    shown: Sequence[int] | None = None,
    marks_at_most: int = 64,
) -> None:
    """Positions or speeds, (times, nv), against time: lines, and marks for MuJoCo; shown: which, None: all."""
    every = slice(None, None, max(1, len(t) // marks_at_most))
    marks = {"marker": "o", "linestyle": "none", "mfc": "white", "markersize": 2.8, "markeredgewidth": 0.9}
    names, all_names = case.coordinates.speeds, case.robot.coordinates.speeds
    ours_called = LABELS[case.robot.compared[0]]
    few = len(all_names) <= MOST_LINES  # then a joint looks the same in every figure
    for k, i in enumerate(range(len(names)) if shown is None else shown):
        colour, dash = LINES[all_names.index(names[i]) if few else k]
        ax.plot(t, ours[:, i], linestyle=dash, color=colour, label=f"{plain(symbol(case, i))}, {ours_called}")
        ax.plot(t[every], theirs[every, i], color=colour, clip_on=False, **marks)
    ax.plot([], [], color="black", label="MuJoCo", **marks)


def named_with_its_factor(ax: Axes, name: str, unit: str) -> None:
    """Name a vertical axis; what its numbers are to be multiplied by, if any, stands beside the unit and nowhere else."""
    low, high = ax.get_ylim()
    largest = max(abs(low), abs(high))
    if high - low < LEVEL * largest:  # a position that does not change: its numbers would all be alike
        ax.set_ylim((low + high) / 2 - 0.05 * largest, (low + high) / 2 + 0.05 * largest)
    power = int(np.floor(np.log10(largest)))
    factor = 1.0 if -2 <= power <= 3 else 10.0**power
    ax.yaxis.set_major_formatter(lambda value, _: f"{value / factor:g}".replace("-", "\N{MINUS SIGN}"))
    ax.set_ylabel(f"{name}, {unit}" if factor == 1.0 else f"{name}, {factor:.0e} {unit}")


def while_it_lasts(c: dict, name: str, values: np.ndarray) -> np.ndarray:
    """Values of a run of an engine, (times, n), without what comes after it has diverged."""
    ended = c["ended"][name]
    return values if ended is None else np.where((c["t"] < ended)[:, None], values, np.nan)


def symbol(case: Case, i: int) -> str:
    """How the joint of a movement is written."""
    name = case.coordinates.speeds[i]
    return case.robot.symbol(name)


def drawn(case: Case, q: np.ndarray) -> np.ndarray:
    """Positions as they are drawn, (times, nv): of a ball the movement from the start, broken where it passes half a turn."""
    coordinates = case.coordinates
    if not coordinates.has_balls:
        return q
    values = coordinates.difference(q, q[0])
    for kind, at, by in coordinates.places.joints:
        if kind != "ball":
            values[:, by] = q[:, at]
            continue
        jumps = np.linalg.norm(np.diff(values[:, by], axis=0), axis=1) > np.pi
        values[1:, by][jumps] = np.nan
    return values


def differing_most(case: Case, columns: Sequence[dict]) -> list[int]:
    """The movements that are drawn, in their order: all, or of many those in which the engines differ most while judged."""
    count = case.coordinates.nv
    if count <= MOST_LINES:
        return list(range(count))
    largest = np.zeros(count)
    for c in columns:
        judged = c["t"] <= c["judged_until_s"]
        off = moved_from(*(c[name][0][judged] for name in case.robot.compared), case.coordinates)
        largest = np.fmax(largest, off.max(axis=0))
    return sorted(np.argsort(-largest, kind="stable")[:MOST_LINES].tolist())
