"""Figures of the experiments at single states: differences and corrections; each is (file name, figure, caption)."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..core.check import Result, largest_known
from ..core.finding import Finding
from ..judge.scale import EPS, FACTOR
from ..report.style import BLUE, GREEN, GREY, ORANGE, RED, WIDTH, zero_at_the_end

ZERO_AT = 1e-3  # eps: where differences of exactly zero are drawn
MOST_DRAWN = 600  # points of a curve: more are not seen


def draw_distances(result: Result, quantities: list[str]) -> tuple[str, Figure, Finding]:
    """Cumulative distributions of the differences between the engines over random states, and of each from the exact value."""
    curves, label = result.curves["random states"], result.label
    styles = [
        (f"{label} to MuJoCo", "black", "-"),
        (f"{label} to exact", BLUE, "--"),
        ("MuJoCo to exact", ORANGE, "-."),
    ]
    exact = styles[1][0] in curves[quantities[0]]  # not where exact values take too long
    columns = 2 if len(quantities) == 4 else min(3, len(quantities))
    lines = -(-len(quantities) // columns)
    fig = Figure(figsize=(WIDTH, 0.7 + 2.1 * lines), layout="constrained")
    axes = fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for ax, quantity in zip(axes.flat, quantities):
        for name, colour, dash in styles if exact else styles[:1]:
            values = np.maximum(curves[quantity][name], ZERO_AT)
            share = np.arange(1, len(values) + 1) / len(values)
            shown = np.unique(
                np.linspace(0, len(values) - 1, min(len(values), MOST_DRAWN)).round().astype(int)
            )
            ax.step(values[shown], share[shown], where="post", color=colour, linestyle=dash, label=name)
        ax.axvline(FACTOR, color=RED, linewidth=2, label=f"tolerance, {FACTOR} eps")
        ax.set(title=quantity, xscale="log", ylim=(0, 1.02))
    for ax in axes.flat[len(quantities) :]:
        ax.set_visible(False)
    drawn = [line.get_xdata() for ax in axes.flat for line in ax.lines]
    zeros = min(values[0] for values in drawn) <= ZERO_AT
    if zeros:
        largest = max((values[-1] for values in drawn if np.isfinite(values[-1])), default=FACTOR)
        zero_at_the_end(axes[0, 0].xaxis, ZERO_AT, largest, most=4 + 2 * (columns < 3))
    for ax in axes[:, 0]:
        ax.set_ylabel("share of states")
    fig.supxlabel("difference, eps × scale of the quantity", fontsize=9)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    maxima = [(largest_known(curves[quantity][styles[0][0]][-1:]), quantity) for quantity in quantities]
    worst, of_worst = max(maxima)
    values = {"label": label, "worst": worst, "of_worst": of_worst, "zero_at": ZERO_AT if zeros else None}
    caption = result.finding("distances", of="shared", exact=exact, **values)
    return f"{result.experiment}_distances", fig, caption


def draw_nearest(result: Result) -> tuple[str, Figure, Finding]:
    """The share of the difference that remains after each of the best single corrections."""
    names, left, explains = zip(*result.curves["nearest"])
    left = np.maximum(left, EPS)
    fig = Figure(figsize=(WIDTH, 0.9 + 0.25 * len(names)), layout="constrained")
    ax = fig.subplots()
    ax.barh(range(len(names)), left, color=[GREEN if one else GREY for one in explains])
    ax.set(
        xscale="log",
        xlim=(EPS / 3.0, 1.5),
        xlabel="remaining share of the difference",
        yticks=range(len(names)),
    )
    ax.set_yticklabels(names)
    ax.invert_yaxis()
    looks = ((True, GREEN, "explains the difference down to rounding"), (False, GREY, "does not explain it"))
    handles = [Patch(color=colour, label=name) for one, colour, name in looks if one in explains]
    fig.legend(handles=handles, loc="outside upper center", ncols=2)
    return "diagnosis_nearest", fig, result.finding("nearest", names=names[:2], left=left[:2].tolist())
