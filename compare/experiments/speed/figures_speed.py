"""Figures of speed: time over error, of each scene and on the first screen."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ...core.finding import Finding
from ...engines import COLOURS, LABELS, MARKS
from ...report.style import GREY, WIDTH, file_name
from ..figures import SIZE
from .conclusions import TARGET, cheapest, front
from .runs import RunRow, SpeedResult

COARSE_END, FINE_END = 3.0, 3e-16  # rad: ends of the axis of errors


def draw(rows: Sequence[RunRow], floor: float, unit: str, size: tuple[float, float] = (WIDTH, 4.6)) -> Figure:
    """Time over worst error of the runs of a scene: a colour for each engine, its cheapest settings joined.

    floor: the error that rounding leaves, rad or m.
    """
    fig = Figure(figsize=size, layout="constrained")
    ax = fig.subplots()
    for engine in LABELS:
        timed = [row for row in rows if row.engine == engine and row.seconds]
        of_engine = [row for row in timed if row.largest_error <= COARSE_END]
        if not (best := front(of_engine)):
            continue
        look: dict[str, Any] = {"color": COLOURS[engine], "marker": MARKS[engine]}
        ax.plot(*drawn(of_engine), linestyle="none", markersize=3, alpha=0.3, **look)
        ax.plot(*drawn(best), label=LABELS[engine], markersize=4.5, linewidth=1.2, **look)
        if use := cheapest(of_engine, TARGET):
            ax.plot(*drawn([use]), "o", markersize=9, markerfacecolor="none", markeredgecolor="black")
    ax.axvline(floor, color=GREY, linestyle=":", label="rounding")
    ax.axvline(TARGET, color="black", linestyle=":", linewidth=0.8)
    ax.set(xscale="log", yscale="log", xlabel=f"maximum error, {unit} (decreasing)", ylabel="time, ms")
    ax.invert_xaxis()
    ax.minorticks_off()
    fig.legend(loc="outside upper center", ncols=5, fontsize=8, handletextpad=0.4, columnspacing=1.0)
    return fig


def drawn(rows: Sequence[RunRow]) -> tuple[np.ndarray, list[float]]:
    """Errors, at least FINE_END, and times in ms."""
    return np.maximum([row.largest_error for row in rows], FINE_END), [1e3 * row.time for row in rows]


def draw_times(result: SpeedResult, scene: str, beginning: str = "") -> tuple[str, Figure, Finding]:
    """The runs of one scene."""
    ran = [row for row in result.rows if row.scene == scene and row.why_not is None]
    missing = [row for row in ran if not row.largest_error <= COARSE_END]
    caption = result.finding(
        "times", begins=beginning or scene, unit=result.unit, end=COARSE_END, target=TARGET,
        ended=sum(row.ended is not None for row in missing), missing=len(missing),
    )  # fmt: skip
    return file_name("speed", scene), draw(ran, result.floors[scene], result.unit), caption


def draw_overview(result: SpeedResult, uses: dict[str, Any]) -> tuple[str, Figure, Finding]:
    """The runs of the scene in which errors are regular, for the first screen."""
    rows = [row for row in result.rows if row.scene == result.regular]
    figure = draw(rows, result.floors[result.regular], result.unit, SIZE)
    return "overview_times", figure, result.finding("overview_caption", uses=uses)
