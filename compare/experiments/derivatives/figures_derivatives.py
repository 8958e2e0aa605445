"""Figures of derivatives: the error of differences against their eps, and of all ways against their time."""

from typing import Any

from matplotlib.figure import Figure

from ...core.finding import Finding
from ...report.style import BLUE, DASHES, GREEN, GREY, ORANGE, PINK, RED, SKY, WIDTH
from .ways import EXACT, CostRow, DerivativesResult, best_of, worst_of_each_eps

LEAST = 1e-17  # that is drawn of an error
COLOURS = BLUE, RED, GREEN, ORANGE, PINK, SKY
MARKERS = "osD^vP"
LOGARITHMIC: dict[str, Any] = {"xscale": "log", "yscale": "log"}


def draw_errors(result: DerivativesResult) -> tuple[str, Figure, Finding]:
    """The error of each way along all scenes against eps, of the integrator for which an eps is advised."""
    rows = result.drawn
    fig = Figure(figsize=(WIDTH, 4.2), layout="constrained")
    ax = fig.subplots()
    ways = dict.fromkeys(row.way for row in rows if row.eps)
    for way, colour, dash, marker in zip(ways, COLOURS, DASHES, MARKERS):
        worst = worst_of_each_eps(row for row in rows if row.way == way)
        look = {"color": colour, "linestyle": dash, "marker": marker, "markersize": 4}
        ax.plot(list(worst), [row.size for row in worst.values()], label=way, **look)
    drawn = {(row.subject, row.quantity) for row in rows}
    exact = [row for row in result.rows if row.way in EXACT and (row.subject, row.quantity) in drawn]
    ax.axhline(
        max(best_of(exact).size, LEAST),
        color=GREY,
        linestyle=":",
        linewidth=1.5,
        label="tmt's exact derivatives",
    )
    units = "rad, m, rad/s, m/s, N m or N"
    ax.set(**LOGARITHMIC, xlabel=f"eps of the difference, {units}", ylabel="relative error")
    fig.legend(loc="outside upper center", ncols=3, fontsize=8)
    states = {row.subject: row.states for row in rows}
    caption = result.finding("errors_caption", states=states, integrator=result.integrator)
    return "derivatives_errors", fig, caption


def draw_times(result: DerivativesResult) -> tuple[str, Figure, Finding]:
    """The error of each way with its best eps against the time of one evaluation."""
    costs: list[CostRow] = result.tables["derivative_costs"]
    fig = Figure(figsize=(WIDTH, 4.0), layout="constrained")
    ax = fig.subplots()
    for k, way in enumerate(dict.fromkeys(row.way for row in costs)):
        points = [(max(row.error, LEAST), row.time) for row in costs
                  if row.way == way and row.time and row.error is not None]  # fmt: skip
        fill, marker = "none" if k >= len(COLOURS) else None, "s" if way in EXACT else "o"
        look: dict[str, Any] = {"color": COLOURS[k % len(COLOURS)], "marker": marker, "markerfacecolor": fill}
        ax.plot(*zip(*points), linestyle="none", label=way, **look)
    ax.set(**LOGARITHMIC, xlabel="relative error (decreasing)", ylabel="time of one evaluation, us")
    ax.invert_xaxis()
    fig.legend(loc="outside right upper", fontsize=7)
    return "derivatives_times", fig, result.finding("times_caption", subject=result.main)
