"""The pictures of the first screen: what they have in common, and the one of M, h and accelerations."""

import math
from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from ..core.check import Result, largest_known
from ..core.finding import Finding
from ..judge.scale import FACTOR
from ..report.style import BLUE, ORANGE, RED

SIZE = (4.2, 2.75)  # inches: about 400 px wide on the first screen
LEAST_EPS, MOST_EPS = 1e-3, 1e6  # eps: where zero, and what is larger, is drawn
MOST_ROWS = 9  # scenes or methods in one picture
QUANTITIES = {"Mbar": "mass matrix M", "bias": "bias h", "qdd": "accelerations"}


def chart(columns: int = 1, **options) -> tuple[Figure, Axes]:
    """An empty figure of the size of the first screen, and its axes."""
    fig = Figure(figsize=SIZE, layout="constrained")
    fig.get_layout_engine().set(w_pad=0.03, h_pad=0.03)
    return fig, fig.subplots(1, columns, **options)


def named_rows(ax: Axes, names: Sequence[str], passed: Sequence[bool]) -> None:
    """The names of the rows from top to bottom; those that fail in red, with a cross."""
    ax.set_yticks(range(len(names)), [name if good else f"✗ {name}" for name, good in zip(names, passed)])
    for label, good in zip(ax.get_yticklabels(), passed):
        label.set(color="black" if good else RED, fontweight="normal" if good else "bold")
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.tick_params(axis="y", length=0)


def beyond_tolerance(ax: Axes, tolerance: float, text: str) -> None:
    """A line at the tolerance, and hatching beyond it."""
    ax.axvline(tolerance, color=RED, linewidth=2)
    ax.axvspan(
        tolerance, 1e30, facecolor="none", edgecolor=(0.84, 0.37, 0.0, 0.35), hatch="////", linewidth=0
    )
    ax.annotate(f"tolerance {text}", (tolerance, 0.02), (-4, 0), xycoords=("data", "axes fraction"), fontsize=7.5,
                textcoords="offset points", color=RED, rotation=90, ha="right", va="bottom",
                path_effects=[withStroke(linewidth=3, foreground="white")])  # fmt: skip


def agreements(results: Mapping[str, Result]) -> list[dict]:
    """The largest differences of Mbar, h and accelerations over all states, eps, as far as they were compared."""
    quantities = []
    for quantity, name in QUANTITIES.items():
        rows = [row for result in results.values() for row in result.rows if row.get("quantity") == quantity]
        label = next(iter(results.values())).label.lower()
        columns = {
            "apart": "difference_eps",
            "ours": f"{label}_from_exact_eps",
            "theirs": "mujoco_from_exact_eps",
        }
        if rows:
            largest = {
                key: largest_known([row.get(column) for row in rows]) for key, column in columns.items()
            }
            quantities.append({"name": name, **largest, "passed": all(row["passed"] for row in rows)})
    return quantities


def draw_agreement(results: Mapping[str, Result]) -> tuple[str, Figure, Finding]:
    """M, h and accelerations: the largest difference of the engines, and the distance of each from exact, in eps."""
    quantities, label = agreements(results), next(iter(results.values())).label
    fig, ax = chart()
    looks = (
        ("apart", f"{label} to MuJoCo", "D", "black", -0.22),
        ("ours", f"{label} to exact", "o", BLUE, 0.0),
        ("theirs", "MuJoCo to exact", "s", ORANGE, 0.22),
    )
    for key, text, mark, colour, shift in looks:
        known = [(place + shift, row[key]) for place, row in enumerate(quantities) if row[key] is not None]
        if known:
            rows, at = zip(*((place, min(max(value, LEAST_EPS), MOST_EPS)) for place, value in known))
            ax.hlines(rows, LEAST_EPS, at, color=colour, linewidth=1.2)
            ax.plot(at, rows, mark, color=colour, markersize=5, label=text)
    for place, row in enumerate(quantities):
        if (apart := row["apart"]) is not None:
            text, far = f"{apart:.2g}" if math.isfinite(apart) else "no number", apart > 1e4
            ax.annotate(text, (min(max(apart, LEAST_EPS), MOST_EPS), place - 0.22), (-6 if far else 6, 5 if far else 0),
                        textcoords="offset points", fontsize=8, va="bottom" if far else "center",
                        ha="right" if far else "left", color="black" if row["passed"] else RED)  # fmt: skip
    beyond_tolerance(ax, FACTOR, f"{FACTOR:g} eps")
    passed = [row["passed"] for row in quantities]
    farthest = 2e3 if all(passed) else MOST_EPS
    ax.set(xscale="log", xlim=(LEAST_EPS, farthest), xlabel="difference, eps × scale of the quantity")
    named_rows(ax, [row["name"].replace(" ", "\n", len(row["name"]) > 12) for row in quantities], passed)
    fig.legend(loc="outside upper center", ncols=3, fontsize=7.5, handletextpad=0.1, columnspacing=0.8)
    caption = Finding("shared", "agreement_overview", {"quantities": quantities, "label": label})
    return "overview_agreement", fig, caption
