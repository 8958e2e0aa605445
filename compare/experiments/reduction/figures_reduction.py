"""The figure of reduction: the time of a step over the error, of the models on the way to the smallest."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from ...core.check import Result
from ...core.finding import Finding
from ...report.style import BLUE, WIDTH
from .records import ModelRow


def draw_models(result: Result, rows: Sequence[ModelRow]) -> tuple[str, Figure, Finding]:
    fig = Figure(figsize=(WIDTH, 4.0), layout="constrained")
    ax = fig.subplots()
    ax.plot(
        [row.error for row in rows], [row.step or 0.0 for row in rows], color=BLUE, marker="o", linewidth=0.7
    )
    for number, row in enumerate(rows):
        place = (row.error, row.step or 0.0), (8, 0) if number % 2 else (-8, 0)
        side = "left" if number % 2 else "right"
        ax.annotate(row.model, *place, textcoords="offset points", fontsize=7, ha=side, va="center")
    errors = [row.error for row in rows if row.error > 0.0]
    if errors:
        ax.set_xscale("symlog", linthresh=min(errors) / 10.0)  # models without an error are shown too
    else:
        ax.set_xticks([0.0])
    ax.margins(0.2)
    ax.set(
        ylim=(0.0, 1.2 * max(row.step or 0.0 for row in rows) or None),
        xlabel="error, rad or m",
        ylabel="time of a step, us",
    )
    return "reduction_models", fig, result.finding("models")
