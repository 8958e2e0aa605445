"""Figures of the experiments at single states: differences and corrections."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ..core.finding import Finding
from ..judge.agree import AgreementResult
from ..judge.scale import EPS, FACTOR
from ..report.style import GREEN, GREY, RED, WIDTH, zero_at_the_end
from .figures_overview import LOOKS

ZERO_AT = 1e-3  # eps: where differences of exactly zero are drawn
MOST_DRAWN = 600  # points of a curve: more are not seen


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
