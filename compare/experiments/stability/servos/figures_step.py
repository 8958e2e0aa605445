"""The figure of the error of a step response over dt, with the robot's own servos."""

from matplotlib.figure import Figure

from ....judge.check import Result
from ....judge.finding import Finding
from ....judge.words import seconds
from ....report.style import BLUE, GREEN, ORANGE, PINK, RED, WIDTH
from ....robots import Robot
from .response import LASTS

STEP_LOOKS = {  # colour, dash, marker, width: those that coincide are drawn over each other, the wider one below
    "Euler": (BLUE, "-", "o", 1.3),
    "implicitfast": (ORANGE, "-", "s", 3.2),
    "implicit": (RED, (0, (4, 2)), "D", 1.2),
    "discrete": (GREEN, "-.", "v", 1.3),
    "RK4": (PINK, (0, (5, 1)), "^", 1.3),
}


def draw_step_response(result: Result, robot: Robot) -> tuple[str, Figure, Finding]:
    """Error over step, a line for each integrator, with its largest stable step and the file's own point."""
    drawn = result.curves["step response"]
    rows = {row["integrator"]: row for row in drawn["rows"]}
    own = rows[drawn["rows"][0]["file_integrator"]] if drawn["rows"] else None
    fig = Figure(figsize=(WIDTH, 4.2), layout="constrained")
    ax = fig.subplots()
    for name, line in drawn["lines"].items():
        if not line:
            continue
        colour, dash, marker, width = STEP_LOOKS[name]
        limit = rows[name]["predicted_dt_s"]
        ends = f"stable up to {seconds(limit)}" if limit else "no limit up to 5 s"
        ax.loglog(*zip(*line), color=colour, linestyle=dash, linewidth=width, label=f"{name}, {ends}")
        if limit and limit <= 1.001 * line[-1][0]:
            ax.plot(*line[-1], marker=marker, color=colour, markersize=7, markeredgecolor="black", zorder=4)
    ax.plot([], [], "s", color="white", markeredgecolor="black", label="filled marker: largest stable step")
    if own and own["step_response_error"]:
        ax.plot(
            own["file_dt_s"], own["step_response_error"], "*", color="black", markersize=13, zorder=5,
            label=f"the file's step: {seconds(own['file_dt_s'])}, {own['file_integrator']}",
        )  # fmt: skip
    ax.set(xlabel="dt, s", ylabel="relative error of the step response")
    ax.axvline(drawn["rows"][0]["file_dt_s"], color="black", linewidth=0.6, linestyle=":")
    fig.legend(loc="outside upper center", ncols=2, title=f"at {drawn['posture']}")
    errors = {
        name: row["step_response_error"]
        for name, row in rows.items()
        if row["step_response_error"] is not None and row["stable_at_file_dt"]
    }
    best = min(errors, key=errors.get, default=None)
    caption = result.finding(
        "figure_step_response",
        "servos",
        posture=drawn["posture"],
        seconds=LASTS,
        dt=drawn["rows"][0]["file_dt_s"],
        integrator=drawn["rows"][0]["file_integrator"],
        error=own and own["step_response_error"],
        best=best,
        least=errors.get(best),
    )
    return "stability_step_response", fig, caption
