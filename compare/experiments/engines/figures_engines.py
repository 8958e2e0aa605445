"""Figures of other engines: errors, times, responses of servos, batches."""

from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ...core.check import Result
from ...core.finding import Finding
from ...engines import COLOURS, LABELS, MARKS
from ...report import style
from ...report.style import WIDTH
from .tables import EnginesResult

DASHES = (*style.DASHES, (0, (1, 3)), (0, (8, 2)), (0, (6, 1, 1, 1, 1, 1)))
OF_METHODS = "os^DvPX<>*hp"  # markers of the methods of one engine
LOOKS: dict[str, Any] = {LABELS[name]: {"marker": MARKS[name], "color": COLOURS[name]} for name in LABELS}


def draw_errors(result: Result) -> tuple[str, Figure, Finding]:
    """The error of each integrator against its step, and the time that the engine takes against the error."""
    rows = [row for row in result.tables["engines_methods"] if row.worst_error]
    fig = Figure(figsize=(WIDTH, 5.6), layout="constrained")
    by_step, by_time = fig.subplots(1, 2)
    for engine in dict.fromkeys(row.engine for row in rows):
        methods = dict.fromkeys(row.method for row in rows if row.engine == engine)
        for method, marker, dashes in zip(methods, cycle(OF_METHODS), cycle(DASHES)):
            look = {"marker": marker, "markersize": 5, "linewidth": 1, "color": LOOKS[engine]["color"]}
            runs = [row for row in rows if (row.engine, row.method) == (engine, method)]
            steps, errors, times = zip(*((row.dt, row.worst_error, 1e3 * row.own_seconds) for row in runs))
            if runs[0].dt:
                by_step.plot(1e3 * np.array(steps), errors, linestyle=dashes, **look)
            by_time.plot(errors, times, linestyle=dashes, label=f"{engine} {method}", **look)
            unsteady = [k for k, row in enumerate(runs) if not row.steady]
            hollow = [np.take(values, unsteady) for values in (errors, times)]
            by_time.plot(*hollow, linestyle="none", markerfacecolor="white", **look)
    error = "largest error over the scene, rad"
    by_step.set(xscale="log", yscale="log", xlabel="dt, ms", ylabel=error)
    time = "time of the engine's steps, ms"
    by_time.set(xscale="log", yscale="log", xlabel=f"{error} (decreasing)", ylabel=time)
    for axis in (by_step.xaxis, by_step.yaxis, by_time.xaxis, by_time.yaxis):
        few_ticks(axis)
    by_time.invert_xaxis()
    fig.legend(loc="outside upper center", ncols=4, fontsize=7)
    best = min(rows, key=lambda row: row.worst_error)
    return "engines_errors", fig, result.finding("errors", scene=best.scene, best=best)


def few_ticks(axis: Axis) -> None:
    """Labels at powers of ten that do not touch; within one power at 1, 2 and 5 of it."""
    low, high = axis.get_view_interval()
    is_short = high < 30.0 * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if is_short else (1.0,), numticks=6))
    axis.set_minor_formatter(NullFormatter())
    if is_short:
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def draw_servos(result: EnginesResult) -> tuple[str, Figure, Finding]:
    """The largest deviation of each method from the exact response, against time."""
    fig = Figure(figsize=(WIDTH, 4.0), layout="constrained")
    ax, rows = fig.subplots(), result.tables["engines_servos"]
    engines = {row.label: row.engine for row in rows}
    for (label, (t, deviation)), dashes in zip(result.responses.items(), cycle(DASHES)):
        largest, colour = np.abs(deviation[1:]).max(axis=1), LOOKS[engines[label]]["color"]
        ax.plot(t[1:], largest, label=label, color=colour, linestyle=dashes)
    ax.set(yscale="log", xlabel="t, s", ylabel="distance from the exact response, rad")
    few_ticks(ax.yaxis)
    fig.legend(loc="outside upper center", ncols=4, fontsize=7)
    return "engines_servos", fig, result.finding("servos", scene=rows[0].scene, dt=rows[0].dt)


def draw_batches(result: EnginesResult) -> tuple[str, Figure, Finding]:
    """The time of a step and world against the number of worlds."""
    fig = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    ax, rows = fig.subplots(), result.tables["engines_batches"]
    for engine in dict.fromkeys(row.engine for row in rows):
        of_engine = [row for row in rows if row.engine == engine]
        costs = [row.per_step_and_world for row in of_engine]
        worlds, label = [row.worlds for row in of_engine], f"{engine}, {of_engine[0].device}"
        ax.plot(worlds, costs, label=label, **LOOKS[engine])
    ax.set(xscale="log", yscale="log", xlabel="worlds", ylabel="time of a step and world, us")
    few_ticks(ax.yaxis)
    fig.legend(loc="outside upper center", ncols=3, fontsize=7)
    return "engines_batches", fig, result.finding("batches", dt=rows[0].dt)
