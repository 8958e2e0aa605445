"""Figures of the experiments at single states, and what pictures of the first screen share."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patheffects import withStroke

from ..core.check import Result, largest_known
from ..core.finding import Finding
from ..judge.scale import FACTOR
from ..report.style import BLUE, GREEN, ORANGE, RED, WIDTH

SIZE = (4.2, 2.75)  # inches: about 400 px wide on the first screen
LEAST_EPS, MOST_EPS = 1e-3, 1e6  # eps: where zero, and what is larger, is drawn
MOST_ROWS = 9  # scenes or methods in one picture
OUTLINE = [withStroke(linewidth=3, foreground="white")]  # of a text on lines
# how each of the DISTANCES of judge.agree is drawn: label, colour, mark, shift of its row
LOOKS = {
    "difference": ("{} to MuJoCo", "black", "D", -0.22),
    "from_exact": ("{} to exact", BLUE, "o", 0.0),
    "mujoco_from_exact": ("MuJoCo to exact", ORANGE, "s", 0.22),
}
QUANTITIES = {"Mbar": "mass matrix M", "bias": "bias h", "qdd": "accelerations"}


def chart(columns: int = 1, **options: Any) -> tuple[Figure, Any]:
    """An empty figure of the size of the first screen, and its axes: one, or an array of them."""
    fig = Figure(figsize=SIZE, layout=ConstrainedLayoutEngine(w_pad=0.03, h_pad=0.03))
    return fig, fig.subplots(1, columns, **options)


def named_rows(ax: Axes, names: Sequence[str], passed: Sequence[bool]) -> None:
    """The names of the rows from top to bottom; those that fail in red, with a cross."""
    ax.set_yticks(range(len(names)), [name if good else f"✗ {name}" for name, good in zip(names, passed)])
    for label, good in zip(ax.get_yticklabels(), passed):
        label.set(color="black" if good else RED, fontweight="normal" if good else "bold")
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.tick_params(axis="y", length=0)


def lines_to(
    ax: Axes, values: Sequence[float], rows: Sequence[float], mark: str, colour: str, **look: Any
) -> None:
    """A mark at each value in its row, and a line to it from the left end of the axis. look: of the marks."""
    shown = np.clip(values, *ax.get_xlim())
    ax.hlines(rows, ax.get_xlim()[0], shown, color=colour, linewidth=1.2)
    ax.plot(shown, rows, mark, color=colour, **{"markersize": 5} | look)


def beyond_tolerance(ax: Axes, tolerance: float, text: str) -> None:
    """A line at the tolerance, and hatching beyond it."""
    ax.axvline(tolerance, color=RED, linewidth=2)
    edge = (0.84, 0.37, 0.0, 0.35)
    ax.axvspan(tolerance, 1e30, facecolor="none", edgecolor=edge, hatch="////", linewidth=0)
    ax.annotate(f"tolerance {text}", (tolerance, 0.02), (4, 0), xycoords=("data", "axes fraction"),
                textcoords="offset points", color=RED, rotation=90, ha="left", va="bottom", fontsize=7.5,
                path_effects=OUTLINE)  # fmt: skip


def agreements(results: Mapping[str, Result]) -> list[dict[str, Any]]:
    """The largest DISTANCES of Mbar, h and accelerations over all states, eps, and whether all pass."""
    quantities = []
    for quantity, name in QUANTITIES.items():
        rows = [row for result in results.values() for row in result.rows if row.quantity == quantity]
        largest = {distance: largest_known([getattr(row, distance) for row in rows]) for distance in LOOKS}
        if rows:
            quantities.append({"name": name, "passed": all(row.passed for row in rows), **largest})
    return quantities


def draw_agreement(results: Mapping[str, Result]) -> tuple[str, Figure, Finding]:
    """M, h and accelerations: the largest difference of the engines, and of each from exact, in eps."""
    quantities, label = agreements(results), next(iter(results.values())).label
    passed = [quantity["passed"] for quantity in quantities]
    fig, ax = chart()
    farthest = 2e3 if all(passed) else MOST_EPS
    ax.set(xscale="log", xlim=(LEAST_EPS, farthest), xlabel="difference, eps × scale of the quantity")
    for distance, (text, colour, mark, shift) in LOOKS.items():
        values = {place + shift: quantity[distance] for place, quantity in enumerate(quantities)}
        known = {place: value for place, value in values.items() if value is not None}
        if known:
            lines_to(ax, [*known.values()], [*known], mark, colour, label=text.format(label))
    for place, quantity in enumerate(quantities):
        if quantity["difference"] is not None:
            label_value(ax, quantity["difference"], place - 0.22, "black" if quantity["passed"] else RED)
    beyond_tolerance(ax, FACTOR, f"{FACTOR:g} eps")
    names = [quantity["name"] for quantity in quantities]
    named_rows(ax, [name.replace(" ", "\n", len(name) > 12) for name in names], passed)
    fig.legend(loc="outside upper center", ncols=3, fontsize=7.5, handletextpad=0.1, columnspacing=0.8)
    caption = Finding("shared", "agreement_overview", {"quantities": quantities, "label": label})
    return "overview_agreement", fig, caption


def label_value(ax: Axes, value: float, row: float, colour: str) -> None:
    """A number beside its mark: at the right, or at the left of a large one."""
    text = f"{value:.2g}" if math.isfinite(value) else "no number"
    offset, ha, va = ((-6, 5), "right", "bottom") if value > 1e4 else ((6, 0), "left", "center")
    at = np.clip(value, *ax.get_xlim()), row
    ax.annotate(text, at, offset, textcoords="offset points", fontsize=8, color=colour, ha=ha, va=va)


def draw_curve(
    entry: str, coordinate: str, unit: str, moved: np.ndarray, yours: np.ndarray, right: np.ndarray
) -> tuple[str, Figure, Finding]:
    """An entry of a user's equations and the right one along a coordinate."""
    fig = Figure(figsize=(WIDTH, 2.6), layout="constrained")
    ax = fig.subplots()
    ax.plot(moved, right, color=GREEN, label="right")
    ax.plot(moved, yours, color=RED, linestyle="--", label="yours")
    ax.set(xlabel=f"{coordinate}, from its value at the state, {unit}", ylabel=entry)
    fig.legend(loc="outside upper center", ncols=2)
    largest = float(np.nan_to_num(np.abs(yours - right)).max())
    caption = Finding("diagnosis", "curve", {"entry": entry, "coordinate": coordinate, "largest": largest})
    return "diagnosis_curve", fig, caption
