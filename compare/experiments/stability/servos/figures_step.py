"""The figure of the error of a step response over dt, with the robot's own servos."""

from matplotlib.figure import Figure

from ....core.finding import Finding
from ....core.words import milliseconds
from ....report.style import BLUE, GREEN, ORANGE, PINK, RED, WIDTH
from ....robots import Robot
from ..tables import StabilityResult
from .response import LASTS

STEP_LOOKS = {  # colour, dash, marker, width: those that coincide are drawn over each other, the wider one below
    "Euler": (BLUE, "-", "o", 1.3),
    "implicitfast": (ORANGE, "-", "s", 3.2),
    "implicit": (RED, (0, (4, 2)), "D", 1.2),
    "discrete": (GREEN, "-.", "v", 1.3),
    "RK4": (PINK, (0, (5, 1)), "^", 1.3),
}


def draw_step_response(result: StabilityResult, robot: Robot) -> tuple[str, Figure, Finding]:
    """Error over step, a line for each integrator, with its largest stable step and the file's own point."""
    drawn = result.step_response
    rows = {row.integrator: row for row in drawn.rows}
    dt, integrator = drawn.rows[0].file_dt, drawn.rows[0].file_integrator
    fig = Figure(figsize=(WIDTH, 4.2), layout="constrained")
    ax = fig.subplots()
    for name, line in drawn.lines.items():
        colour, dash, marker, width = STEP_LOOKS[name]
        limit = rows[name].predicted_dt
        ends = f"stable up to {milliseconds(limit)}" if limit else "no limit up to 5000 ms"
        ax.loglog(*zip(*line), color=colour, linestyle=dash, linewidth=width, label=f"{name}, {ends}")
        if limit and line and limit <= 1.001 * line[-1][0]:
            ax.plot(*line[-1], marker=marker, color=colour, markersize=7, markeredgecolor="black", zorder=4)
    if error := rows[integrator].step_response_error:
        label = f"the file's step: {milliseconds(dt)}, {integrator}"
        ax.plot(dt, error, "*", color="black", markersize=13, zorder=5, label=label)
    ax.set(xlabel="dt, s", ylabel="relative error of the step response")
    ax.axvline(dt, color="black", linewidth=0.6, linestyle=":")
    fig.legend(loc="outside upper center", ncols=2, title=f"at {drawn.posture}")
    caption = result.finding("figure_step_response", "servos", posture=drawn.posture, seconds=LASTS, dt=dt)
    return "stability_step_response", fig, caption
