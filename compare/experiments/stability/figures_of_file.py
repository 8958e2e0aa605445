"""Figures of a file: which pushes each step survives, and how far it is from runs of fine steps."""

from itertools import groupby
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ...core.check import Result
from ...core.finding import Finding
from ...report.style import BLUE, GREEN, GREY, ORANGE, PINK, RED, WIDTH
from ...stability.answer import StepLimitRow, TriedRow
from ..figures import chart, named_rows
from .of_file import OF

LOOKS = {  # colour, dash, mark, width: lines that coincide are drawn over each other, the wider one below
    "implicitfast": (ORANGE, "-", "s", 3.2),
    "Euler": (BLUE, "-", "o", 1.3),
    "implicit": (RED, (0, (4, 2)), "D", 1.2),
    "discrete": (GREEN, "-.", "v", 1.3),
    "RK4": (PINK, (0, (5, 1)), "^", 1.3),
}


def draw_steps(result: Result) -> tuple[str, Figure, Finding]:
    """Two panels: the largest push over the step; the distance from fine runs over the step. All at the first posture."""
    rows, tried = first_posture(result)
    own = rows[0]
    fig = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    left, right = fig.subplots(1, 2)
    pushes = sorted({row.push_rad_per_s for row in tried})
    for name, (colour, dash, mark, width) in LOOKS.items():
        looks: dict[str, Any] = {"color": colour, "linestyle": dash, "linewidth": width, "marker": mark}
        mine = [row for row in tried if row.integrator == name]
        held = [(step, push) for push in pushes if (step := longest(mine, push))]
        usual = [row for row in mine if row.push_rad_per_s == own.push_rad_per_s and row.apart]
        near = sorted((row.dt_s, row.apart) for row in usual)
        for ax, points in ((left, held), (right, near)):
            if points:
                ax.plot(*zip(*points), label=name, markersize=4, **looks)
    left.axhline(own.push_rad_per_s, color="black", linewidth=0.8, linestyle=":")
    left.set(xscale="log", yscale="log", xlabel="dt, s", ylabel=f"largest push that is survived, {own.unit}")
    right.set(xscale="log", yscale="log", xlabel="dt, s", ylabel="distance from fine steps, rad or m")
    for ax in (left, right):
        ax.axvline(own.file_dt_s, color="black", linewidth=0.8, linestyle=":")
    left.set_yticks(pushes, [f"{push:g}" for push in pushes])
    left.minorticks_off()
    handles = {line.get_label(): line for ax in (right, left) for line in ax.get_legend_handles_labels()[0]}
    # one without a push that is survived is on the right alone
    names = [name for name in LOOKS if name in handles]
    fig.legend([handles[name] for name in names], names, loc="outside upper center", ncols=5)
    return "stability_steps", fig, caption(result, own, len(pushes))


def draw_bars(result: Result) -> tuple[str, Figure, Finding]:
    """The longest step of each integrator at the first posture."""
    rows, _ = first_posture(result)
    (fig, ax), own = chart(), rows[0]
    least = min([own.fine_dt_s, *(row.stable_up_to_s or np.inf for row in rows)]) / 2.0
    for place, row in enumerate(rows):
        colour = LOOKS[row.integrator][0]
        step = row.stable_up_to_s or least
        ax.barh(place, step - least, left=least, height=0.6, color=colour)
        text = "none" if row.stable_up_to_s is None else " →" if row.fails_at_s is None else ""
        ax.text(step, place, f" {text}", va="center", fontsize=8, color=GREY)
    passed = [row is not own or row.stable_at_file_dt is not False for row in rows]
    named_rows(ax, [row.integrator for row in rows], passed)
    ax.axvline(own.file_dt_s, color="black", linewidth=0.8, linestyle=":")
    ax.set(xscale="log", xlim=(least, 0.3), xlabel="longest stable dt, s")
    return "stability_steps", fig, caption(result, own, 1)


def first_posture(result: Result) -> tuple[list[StepLimitRow], list[TriedRow]]:
    """The rows of the first posture, and the steps that were tried there."""
    _, rows = next(groupby(result.tables["step_limits"], key=lambda row: row.posture))
    kept = list(rows)
    return kept, [row for row in result.tables.get("stability_runs", ()) if row.posture == kept[0].posture]


def longest(rows: list[TriedRow], push: float) -> float | None:
    """The longest step below the shortest that fails after a push, s."""
    pushed = [row for row in rows if row.push_rad_per_s == push]
    failing = min((row.dt_s for row in pushed if row.outcome != "holds"), default=np.inf)
    return max((row.dt_s for row in pushed if row.dt_s < failing), default=None)


def caption(result: Result, own: StepLimitRow, pushes: int) -> Finding:
    return result.finding(
        "figure_steps", OF, posture=own.posture, dt=own.file_dt_s, integrator=own.file_integrator,
        push=own.push_rad_per_s, pushes=pushes, unit=own.unit,
    )  # fmt: skip
