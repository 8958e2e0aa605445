"""Figures of other engines: distances from the exact values; errors against the step."""

from matplotlib.figure import Figure

from ...core.check import Result
from ...core.finding import Finding
from ...engines import COLOURS, LABELS, MARKS
from ...judge.scale import FACTOR
from ...report.style import RED, WIDTH

DASHES = (
    "-",
    "--",
    "-.",
    ":",
    (0, (5, 1)),
    (0, (3, 1, 1, 1)),
    (0, (1, 3)),
    (0, (8, 2)),
    (0, (6, 1, 1, 1, 1, 1)),
)
BY_LABEL = {label: name for name, label in LABELS.items()}


def draw_distances(result: Result) -> tuple[str, Figure, Finding]:
    """The largest distance from the exact values, in eps of each engine's precision, for each quantity."""
    names = list(dict.fromkeys(row["engine"] for row in result.rows))
    quantities = list(dict.fromkeys(row["quantity"] for row in result.rows))
    fig = Figure(figsize=(WIDTH, 1.0 + 0.32 * (len(names) + 1)), layout="constrained")
    for ax, quantity in zip(
        fig.subplots(1, len(quantities), sharey=True, sharex=True, squeeze=False)[0], quantities
    ):
        rows = {row["engine"]: row for row in result.rows if row["quantity"] == quantity}
        for k, name in enumerate(names):
            if name in rows:
                key = BY_LABEL[name]
                ax.plot(rows[name]["difference_eps"], k, MARKS[key], color=COLOURS[key])
        ax.plot(
            max(row["mujoco_eps"] for row in rows.values()),
            len(names),
            MARKS["mujoco"],
            color=COLOURS["mujoco"],
        )
        ax.axvline(FACTOR, color=RED, linewidth=2, label=f"tolerance, {FACTOR} eps")
        ax.set(title=quantity, xscale="log", ylim=(len(names) + 0.6, -0.6))
        ax.set_yticks(range(len(names) + 1), [*names, LABELS["mujoco"]])
    fig.supxlabel(
        "largest distance from the exact value, eps of the engine × scale of the quantity", fontsize=9
    )
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center")
    most = max(result.rows, key=lambda row: row["difference_eps"])
    return "engines_distances", fig, result.finding("distances", most=most)


def draw_errors(result: Result) -> tuple[str, Figure, Finding]:
    """The error of each integrator against its step, and the time that it takes against the error."""
    rows = [row for row in result.tables["engines_methods"] if row["worst_error_rad"]]
    fig = Figure(figsize=(WIDTH, 4.6), layout="constrained")
    by_step, by_time = fig.subplots(1, 2)
    for engine, method in dict.fromkeys((row["engine"], row["method"]) for row in rows):
        of, key = (
            [row for row in rows if (row["engine"], row["method"]) == (engine, method)],
            BY_LABEL[engine],
        )
        methods = list(dict.fromkeys(row["method"] for row in rows if row["engine"] == engine))
        style = {
            "marker": MARKS[key],
            "color": COLOURS[key],
            "linestyle": DASHES[methods.index(method) % len(DASHES)],
        }
        errors = [row["worst_error_rad"] for row in of]
        if of[0]["dt_s"]:
            by_step.plot([1e3 * row["dt_s"] for row in of], errors, markersize=4, **style)
        by_time.plot(
            errors, [1e3 * row["seconds"] for row in of], markersize=4, label=f"{engine} {method}", **style
        )
    by_step.set(xscale="log", yscale="log", xlabel="dt, ms", ylabel="largest error over the scene, rad")
    by_time.set(
        xscale="log", yscale="log", xlabel="largest error over the scene, rad (decreasing)", ylabel="time, ms"
    )
    by_time.invert_xaxis()
    fig.legend(loc="outside upper center", ncols=4, fontsize=7)
    best = min(rows, key=lambda row: row["worst_error_rad"])
    return "engines_errors", fig, result.finding("errors", scene=best["scene"], best=best)
