"""The picture of speed on the first screen."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from ...engines import COLOURS, LABELS, MARKS
from ...judge.check import Result
from ...judge.finding import Finding
from ...report.style import GREY
from ..figures_overview import chart
from .first_screen import TARGET, best_curves, cheapest, target


def draw_times(result: Result) -> tuple[str, Figure, Finding]:
    """Time against error: the best settings of each engine in one scene, the cheapest within the target in a circle."""
    fig, ax = chart()
    curves = best_curves(result)
    for curve in curves:
        colour, errors = COLOURS.get(curve.engine, GREY), np.maximum(curve.errors, 1e-16)
        ax.plot(errors, curve.milliseconds, marker=MARKS.get(curve.engine, "v"), markersize=3.5, linewidth=1.2,
                color=colour, label=LABELS.get(curve.engine, curve.engine))  # fmt: skip
        if curve.cheapest:
            time = curve.cheapest.milliseconds
            error = errors[curve.milliseconds.index(time)]
            ax.plot(error, time, "o", markersize=9, markerfacecolor="none", markeredgecolor="black")
            if curve.engine in ("mujoco", "tmt"):
                above, fine = curve.engine == "mujoco", error < np.sqrt(errors[0] * errors[-1])
                text = f"{curve.cheapest.method} {float(f'{time:.2g}'):g} ms"
                ax.annotate(text, (error, time), (0, 8 if above else -11), fontsize=8, color=colour,
                            textcoords="offset points", ha="right" if above else "center" if fine else "left",
                            va="bottom" if above else "top",
                            path_effects=[withStroke(linewidth=3, foreground="white")])  # fmt: skip
    numbers = target(result)
    ax.axvline(TARGET, color=GREY, linestyle=":", linewidth=1.2)
    ax.set(xscale="log", yscale="log", xlabel=f"maximum error, {numbers['unit']} (decreasing)", ylabel="time, ms")
    ax.invert_xaxis()
    ax.margins(0.06, 0.12)
    fig.legend(loc="outside upper center", ncols=4, fontsize=8, handletextpad=0.4, columnspacing=1.0)
    return "overview_times", fig, result.finding("overview_caption", settings=cheapest(curves), **numbers)
