"""The figure of what a step costs under a robot's own servos: its size against the error of a step response."""

from matplotlib.figure import Figure

from ....judge.check import Result
from ....report.style import BLUE, GREEN, ORANGE, PINK, RED, WIDTH
from ....robots import Robot
from .response import LASTS
from .sentences import in_digits, in_seconds

STEP_LOOKS = {  # colour, dash, marker, width: those that coincide are drawn over each other, the wider one below
    "Euler": (BLUE, "-", "o", 1.3),
    "implicitfast": (ORANGE, "-", "s", 3.2),
    "implicit": (RED, (0, (4, 2)), "D", 1.2),
    "discrete": (GREEN, "-.", "v", 1.3),
    "RK4": (PINK, (0, (5, 1)), "^", 1.3),
}


def draw_step_response(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Step against error, a line for each integrator, with its stable end and the file's own point."""
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
        ends = f"stable up to {in_seconds(limit)}" if limit else "no limit up to 5 s"
        ax.loglog(*zip(*line), color=colour, linestyle=dash, linewidth=width, label=f"{name}, {ends}")
        if limit and limit <= 1.001 * line[-1][0]:
            ax.plot(*line[-1], marker=marker, color=colour, markersize=7, markeredgecolor="black", zorder=4)
    ax.plot([], [], "s", color="white", markeredgecolor="black", label="filled mark: the last stable step")
    if own and own["step_response_error"]:
        ax.plot(
            own["file_dt_s"], own["step_response_error"], "*", color="black", markersize=13, zorder=5,
            label=f"the file's own: {in_seconds(own['file_dt_s'])}, {own['file_integrator']}",
        )  # fmt: skip
    ax.set(xlabel="dt, s", ylabel="error of the step response, ratio")
    ax.axvline(drawn["rows"][0]["file_dt_s"], color="black", linewidth=0.6, linestyle=":")
    fig.legend(loc="outside upper center", ncols=2, title=f"at {drawn['posture']}")
    errors = {
        name: row["step_response_error"]
        for name, row in rows.items()
        if row["step_response_error"] is not None and row["stable_at_file_dt"]
    }
    best = min(errors, key=errors.get, default=None)
    dt = in_seconds(drawn["rows"][0]["file_dt_s"])
    caption = (
        f"What a step costs beside being stable, at {drawn['posture']}: all targets of servos are moved by a step, and "
        f"MuJoCo's response over {LASTS:g} s is compared with the exact one of the linear equations; largest difference over "
        "largest response. A mark is the last stable step. "
    )
    if own and own["step_response_error"]:
        caption += (
            f"The file's own {dt} under {own['file_integrator']} is {in_digits(100 * own['step_response_error'])} % off"
        )
        caption += (
            f"; least at that step is {best} with {in_digits(100 * errors[best])} %."
            if best != own["integrator"]
            else ", the least of all integrators at that step."
        )
    elif best:
        caption += f"At the file's own {dt} the least error is that of {best}, {in_digits(100 * errors[best])} %."
    return "stability_step_response", fig, caption
