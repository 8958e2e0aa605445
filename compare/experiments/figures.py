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
from ..judge.agree import AgreementResult
from ..judge.scale import EPS, FACTOR
from ..report.style import BLUE, GREEN, GREY, ORANGE, RED, WIDTH, zero_at_the_end

SIZE = (4.2, 2.75)  # inches: about 400 px wide on the first screen
LEAST_EPS, MOST_EPS = 1e-3, 1e6  # eps: where zero, and what is larger, is drawn
MOST_ROWS = 9  # scenes or methods in one picture
OUTLINE = [withStroke(linewidth=3, foreground="white")]  # of a text on lines
# how each of the DISTANCES of judge.agree is drawn: label, colour, dash, mark, shift of its row
LOOKS = {
    "difference": ("{} to MuJoCo", "black", "-", "D", -0.22),
    "from_exact": ("{} to exact", BLUE, "--", "o", 0.0),
    "mujoco_from_exact": ("MuJoCo to exact", ORANGE, "-.", "s", 0.22),
}
QUANTITIES = {"Mbar": "mass matrix M", "bias": "bias h", "qdd": "accelerations"}
ZERO_AT = 1e-3  # eps: where differences of exactly zero are drawn
MOST_DRAWN = 600  # points of a curve: more are not seen


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
    ax.annotate(f"tolerance {text}", (tolerance, 0.02), (-4, 0), xycoords=("data", "axes fraction"),
                textcoords="offset points", color=RED, rotation=90, ha="right", va="bottom", fontsize=7.5,
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
    for distance, (text, colour, _, mark, shift) in LOOKS.items():
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


def draw_distances(result: AgreementResult, quantities: list[str]) -> tuple[str, Figure, Finding]:
    """Cumulative distributions of the DISTANCES of judge.agree over random states."""
    distances = {quantity: result.distances["random states"][quantity] for quantity in quantities}
    columns = 2 if len(quantities) == 4 else min(3, len(quantities))
    lines = -(-len(quantities) // columns)
    fig = Figure(figsize=(WIDTH, 0.7 + 2.1 * lines), layout="constrained")
    axes = fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for ax, (quantity, measured) in zip(axes.flat, distances.items()):
        for distance, ascending in measured.items():
            text, colour, dash, *_ = LOOKS[distance]
            look = {"color": colour, "linestyle": dash, "label": text.format(result.label)}
            ax.step(*drawn(ascending), where="post", **look)
        ax.axvline(FACTOR, color=RED, linewidth=2, label=f"tolerance, {FACTOR} eps")
        ax.set(title=quantity, xscale="log", ylim=(0, 1.02))
    for ax in axes.flat[len(quantities) :]:
        ax.set_visible(False)
    every = np.concatenate([values for measured in distances.values() for values in measured.values()])
    zeros = bool((every <= ZERO_AT).any())
    if zeros:
        farthest = max(np.max(every[np.isfinite(every)], initial=0.0), FACTOR)
        zero_at_the_end(axes[0, 0].xaxis, ZERO_AT, farthest, most=4 + 2 * (columns < 3))
    for ax in axes[:, 0]:
        ax.set_ylabel("share of states")
    fig.supxlabel("difference, eps × scale of the quantity", fontsize=9)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    largest = {quantity: measured["difference"][-1] for quantity, measured in distances.items()}
    largest = {quantity: np.inf if np.isnan(value) else float(value) for quantity, value in largest.items()}
    furthest = max(quantities, key=lambda quantity: largest[quantity])
    told = {"label": result.label, "worst": largest[furthest], "of_worst": furthest}
    told |= {"exact": "from_exact" in distances[quantities[0]], "zero_at": ZERO_AT if zeros else None}
    return f"{result.experiment}_distances", fig, result.finding("distances", of="shared", **told)


def drawn(ascending: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """At most MOST_DRAWN points of a cumulative distribution: values, and the share of states up to each."""
    count = len(ascending)
    points = np.unique(np.linspace(0, count - 1, min(count, MOST_DRAWN)).round().astype(int))
    return np.maximum(ascending[points], ZERO_AT), (points + 1) / count


def draw_nearest(nearest: Sequence[tuple[str, float, bool]]) -> tuple[str, Figure, Finding]:
    """The share of the difference that remains after each of the best single corrections."""
    names, shares, explains = zip(*nearest)
    left = np.maximum(shares, EPS)
    fig = Figure(figsize=(WIDTH, 0.9 + 0.25 * len(names)), layout="constrained")
    ax, rows = fig.subplots(), np.arange(len(names))
    looks = ((True, GREEN, "explains the difference down to rounding"), (False, GREY, "does not explain it"))
    for is_explained, colour, label in looks:
        shown = np.equal(explains, is_explained)
        if shown.any():
            ax.barh(rows[shown], left[shown], color=colour, label=label)
    ax.set(xscale="log", xlim=(EPS / 3.0, 1.5), xlabel="remaining share of the difference")
    ax.set_yticks(rows, names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    fig.legend(loc="outside upper center", ncols=2)
    caption = Finding("diagnosis", "nearest", {"names": names[:2], "left": left[:2].tolist()})
    return "diagnosis_nearest", fig, caption


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
