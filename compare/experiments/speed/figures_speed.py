"""Figures of speed: error against time, of each scene and on the first screen."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.figure import Figure

from ...core.finding import Finding
from ...engines import COLOURS, LABELS, MARKS
from ...report.style import GREY, WIDTH, file_name
from ..figures import chart
from .conclusions import TARGET, best_rows, cheapest, cheapest_settings, front, reaching
from .runs import SpeedResult, SpeedRow

METHOD_MARKERS = "osD^v<>PX*hp"  # of the methods of an engine, whose colour they have
COARSE_END, FINE_END = 3.0, 3e-16  # rad: ends of the axis of errors


def draw_times(result: SpeedResult, scene: str, beginning: str = "") -> tuple[str, Figure, Finding]:
    """Worst error against time of one scene, a curve for each method, the Pareto front marked."""
    fig = Figure(figsize=(WIDTH, 5.6), layout="constrained")
    ax, unit = fig.subplots(), result.unit
    ran = [row for row in result.rows if row.scene == scene and row.why_not is None]
    good = [row for row in ran if row.largest_error <= COARSE_END]
    curves: dict[tuple[str, str], list[SpeedRow]] = {}
    for row in good:
        curves.setdefault((row.engine, row.method), []).append(row)
    markers: dict[str, cycle[str]] = {}
    for (engine, method), rows in curves.items():
        marker = next(markers.setdefault(engine, cycle(METHOD_MARKERS)))
        label, colour = f"{LABELS.get(engine, engine)} {method}", COLOURS.get(engine, GREY)
        ax.plot(*drawn(rows), label=label, color=colour, marker=marker, markersize=4.5, linewidth=1.0)
    ax.plot(*drawn(front(good)), "ko", markersize=9, markerfacecolor="none", label="Pareto front")
    label = "rounding, or accuracy of the reference"
    ax.axvline(result.floors[scene], color=GREY, linestyle=":", label=label)
    ax.set(xscale="log", yscale="log", xlim=(2.0 * COARSE_END, FINE_END / 30), ylabel="time of the run, ms")
    ax.set(xlabel=f"maximum error, {unit} (decreasing)", xticks=[10.0**k for k in range(0, -17, -2)])
    ax.minorticks_off()
    fig.legend(loc="outside right upper", fontsize=7, handlelength=1.6)
    caption = result.finding(
        "times", begins=beginning or scene, unit=unit, end=COARSE_END,
        diverged=sum(bool(row.diverged) for row in ran), missing=len(ran) - len(good),
    )  # fmt: skip
    return file_name("speed", scene), fig, caption


def drawn(rows: Sequence[SpeedRow]) -> tuple[np.ndarray, list[float]]:
    """Errors, at least FINE_END, and times in ms."""
    return np.maximum([row.largest_error for row in rows], FINE_END), [1e3 * row.time for row in rows]


def draw_overview(result: SpeedResult) -> tuple[str, Figure, Finding]:
    """Time against error: the best settings of each engine; the cheapest within the target has a circle."""
    fig, ax = chart()
    for engine, rows in best_rows(result).items():
        colour, (errors, times) = COLOURS.get(engine, GREY), drawn(rows)
        label, mark = LABELS.get(engine, engine), MARKS.get(engine, "v")
        ax.plot(errors, times, label=label, color=colour, marker=mark, markersize=3.5, linewidth=1.2)
        if best := cheapest(reaching(rows, TARGET)):
            ax.plot(*drawn([best]), "o", markersize=9, markerfacecolor="none", markeredgecolor="black")
    ax.axvline(TARGET, color=GREY, linestyle=":", linewidth=1.2)
    ax.set(xscale="log", yscale="log", xlabel=f"maximum error, {result.unit} (decreasing)", ylabel="time, ms")
    ax.invert_xaxis()
    ax.margins(0.06, 0.12)
    fig.legend(loc="outside upper center", ncols=4, fontsize=8, handletextpad=0.4, columnspacing=1.0)
    return "overview_times", fig, result.finding("overview_caption", **cheapest_settings(result))
