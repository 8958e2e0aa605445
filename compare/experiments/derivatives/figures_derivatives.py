"""Figures of derivatives: the error of differences against their eps, and of all ways against their time."""

from matplotlib.figure import Figure

from ...core.finding import Finding
from ...report.style import BLUE, DASHES, GREEN, GREY, ORANGE, PINK, RED, SKY, WIDTH
from .tables import CostRow, DerivativesResult, errors_of
from .ways import EXACT

LEAST = 1e-17  # that is drawn of an error
COLOURS = BLUE, RED, GREEN, ORANGE, PINK, SKY
MARKERS = "osD^vP"


def draw_errors(result: DerivativesResult) -> tuple[str, Figure, Finding]:
    """The error of each way at the main subject against eps, the largest of all integrators."""
    rows = [row for row in result.rows if row.subject == result.main]
    fig = Figure(figsize=(WIDTH, 4.2), layout="constrained")
    ax = fig.subplots()
    ways = dict.fromkeys(row.way for row in rows if row.eps)
    for way, colour, dash, marker in zip(ways, COLOURS, DASHES, MARKERS):
        errors = errors_of(row for row in rows if row.way == way)
        ax.plot(
            list(errors),
            list(errors.values()),
            color=colour,
            linestyle=dash,
            marker=marker,
            markersize=4,
            label=way,
        )
    exact = max(errors_of(row for row in rows if row.eps is None).values())
    ax.axhline(max(exact, LEAST), color=GREY, linestyle=":", linewidth=1.5, label="tmt's exact derivatives")
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="eps of the difference, rad, m, rad/s, m/s, N m or N",
        ylabel="relative error",
    )
    fig.legend(loc="outside upper center", ncols=3, fontsize=8)
    return (
        "derivatives_errors",
        fig,
        result.finding("errors_caption", subject=result.main, states=rows[0].states),
    )


def draw_times(result: DerivativesResult) -> tuple[str, Figure, Finding]:
    """The error of each way with its best eps against the time of one evaluation."""
    rows: list[CostRow] = [
        row for row in result.tables["derivative_costs"] if row.time and row.error is not None
    ]
    fig = Figure(figsize=(WIDTH, 4.0), layout="constrained")
    ax = fig.subplots()
    ways = list(dict.fromkeys(row.way for row in rows))
    for k, way in enumerate(ways):
        of_way = [row for row in rows if row.way == way]
        errors = [max(row.error or 0.0, LEAST) for row in of_way]
        exact = way in EXACT
        times = [row.time or 0.0 for row in of_way]
        ax.plot(errors, times, "s" if exact else "o", color=COLOURS[k % len(COLOURS)],
                markerfacecolor="none" if k >= len(COLOURS) else None, label=way)  # fmt: skip
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="relative error (decreasing)",
        ylabel="time of one evaluation, us",
    )
    ax.invert_xaxis()
    fig.legend(loc="outside right upper", fontsize=7)
    return "derivatives_times", fig, result.finding("times_caption", subject=result.main)
