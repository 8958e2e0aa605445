"""The figure of a file's steps: the growth of deviations from rest over dt."""

from matplotlib.figure import Figure

from ...core.finding import Finding
from ...report.style import BLUE, GREEN, ORANGE, PINK, RED, WIDTH
from .of_file import OF
from .tables import StabilityResult

LOOKS = {  # colour, dash, marker, width: those that coincide are drawn over each other, the wider one below
    "Euler": (BLUE, "-", "o", 1.3),
    "implicitfast": (ORANGE, "-", "s", 3.2),
    "implicit": (RED, (0, (4, 2)), "D", 1.2),
    "discrete": (GREEN, "-.", "v", 1.3),
    "RK4": (PINK, (0, (5, 1)), "^", 1.3),
}
TITLES = {"contact": "in contact", "free": "touching nothing", "air": "in the air"}
MOST_GROWTH = 3.0  # of a step: the upper end of the axis


def draw_growth(result: StabilityResult) -> tuple[str, Figure, Finding]:
    """Growth over step: a line for each integrator, marks of runs, the file's own step; a panel for each surroundings."""
    rows = result.tables["step_limits"]
    dt, integrator, posture = rows[0].file_dt, rows[0].file_integrator, rows[0].posture
    fig = Figure(figsize=(WIDTH, 3.8), layout="constrained")
    panels = fig.subplots(1, len(result.growth), sharey=True, squeeze=False)[0]
    for ax, (surroundings, curves) in zip(panels, result.growth.items()):
        for name, curve in curves.items():
            colour, dash, marker, width = LOOKS[name]
            steps, factors = zip(*curve.predicted) if curve.predicted else ((), ())
            ax.plot(steps, factors, color=colour, linestyle=dash, linewidth=width, label=name)
            if curve.observed:
                ax.plot(
                    *zip(*curve.observed),
                    marker,
                    color=colour,
                    markersize=6,
                    markeredgecolor="black",
                    zorder=4,
                )
        ax.axhline(1.0, color="black", linewidth=0.6)
        ax.axvline(dt, color="black", linewidth=0.8, linestyle=":")
        ax.set(xscale="log", xlabel="dt, s", ylim=(0.9, MOST_GROWTH), title=TITLES[surroundings])
    panels[0].set_ylabel("growth of a deviation in a step")
    panels[0].plot([], [], "o", color="white", markeredgecolor="black", label="in runs")
    fig.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=6)
    first = next(iter(result.growth))
    limits = {
        row.integrator: row.predicted_dt
        for row in rows
        if (row.posture, row.surroundings) == (posture, first)
    }
    values = {"posture": posture, "dt": dt, "integrator": integrator, "radii": limits}
    return "stability_growth", fig, result.finding("figure_growth", OF, **values)
