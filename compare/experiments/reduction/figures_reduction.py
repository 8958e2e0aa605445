"""The figure of reduction: time over error of a file's models."""

from collections.abc import Sequence
from itertools import cycle, product

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...core.check import Result
from ...core.finding import Finding
from ...report.style import LINES, WIDTH
from .records import FrontierRow

MARKS_OF_INTEGRATORS = "osD^v"


def draw_frontier(result: Result, rows: Sequence[FrontierRow]) -> tuple[str, Figure, Finding]:
    """Time over error: a colour for each model, a mark for each integrator."""
    fig = Figure(figsize=(WIDTH, 4.5), layout="constrained")
    ax = fig.subplots()
    colours = dict(zip(dict.fromkeys(row.model for row in rows), cycle(colour for colour, _ in LINES)))
    marks = dict(zip(dict.fromkeys(row.integrator for row in rows), MARKS_OF_INTEGRATORS))
    for (model, colour), (integrator, mark) in product(colours.items(), marks.items()):
        points = [row for row in rows if (row.model, row.integrator) == (model, integrator)]
        places = [row.error for row in points], [row.time_of_second for row in points]
        ax.plot(*places, color=colour, marker=mark, markersize=4.5, linewidth=0.7)
    for row in filter(lambda row: row.best_for, rows):
        place = row.error, row.time_of_second
        ax.plot(*place, "ko", markersize=11, markerfacecolor="none")
        gain = f"{row.best_for}: ×{row.gain:.1f}"
        ax.annotate(gain, place, (0, -16), textcoords="offset points", horizontalalignment="center")
    ax.margins(0.12)
    handles = [Line2D([], [], color=colour, label=model) for model, colour in colours.items()]
    for name, mark in marks.items():
        handles.append(Line2D([], [], color="black", linestyle="none", marker=mark, label=name))
    fig.legend(handles=handles, loc="outside right upper", fontsize=7)
    smallest = min((row.error for row in rows if row.error > 0.0), default=1.0)
    ax.set_xscale("symlog", linthresh=smallest / 10.0)  # models without an error are shown too
    ax.set(yscale="log", xlabel="error, rad or m", ylabel="time for a second of motion, s")
    return "reduction_frontier", fig, result.finding("frontier", "reduction_of_file")
