"""Figures of other engines: distances from the exact values; errors against the step."""

from matplotlib.figure import Figure

from ...core.check import Result
from ...core.finding import Finding
from ...engines import COLOURS, LABELS, MARKS
from ...judge.scale import FACTOR
from ...report import style
from ...report.style import RED, WIDTH

DASHES = (*style.DASHES, (0, (1, 3)), (0, (8, 2)), (0, (6, 1, 1, 1, 1, 1)))
LOOKS = {LABELS[name]: {"marker": MARKS[name], "color": COLOURS[name]} for name in LABELS}


def draw_distances(result: Result) -> tuple[str, Figure, Finding]:
    """The largest distance from the exact values, in eps of each engine's precision, for each quantity."""
    names = [*dict.fromkeys(row.engine for row in result.rows), LABELS["mujoco"]]
    quantities = list(dict.fromkeys(row.quantity for row in result.rows))
    fig = Figure(figsize=(WIDTH, 1.0 + 0.32 * len(names)), layout="constrained")
    axes = fig.subplots(1, len(quantities), sharey=True, sharex=True, squeeze=False)[0]
    for ax, quantity in zip(axes, quantities):
        rows = [row for row in result.rows if row.quantity == quantity]
        distances = {row.engine: row.difference_eps for row in rows}
        distances[LABELS["mujoco"]] = max(row.mujoco_eps for row in rows)
        for name, distance in distances.items():
            ax.plot(distance, names.index(name), **LOOKS[name])
        ax.axvline(FACTOR, color=RED, linewidth=2, label=f"tolerance, {FACTOR} eps")
        ax.set(title=quantity, xscale="log", ylim=(len(names) - 0.4, -0.6))
        ax.set_yticks(range(len(names)), names)
    label = "largest distance from the exact value, eps of the engine × scale of the quantity"
    fig.supxlabel(label, fontsize=9)
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center")
    most = max(result.rows, key=lambda row: row.difference_eps)
    return "engines_distances", fig, result.finding("distances", most=most)


def draw_errors(result: Result) -> tuple[str, Figure, Finding]:
    """The error of each integrator against its step, and the time that it takes against the error."""
    rows = [row for row in result.tables["engines_methods"] if row.worst_error]
    fig = Figure(figsize=(WIDTH, 4.6), layout="constrained")
    by_step, by_time = fig.subplots(1, 2)
    for engine in dict.fromkeys(row.engine for row in rows):
        methods = dict.fromkeys(row.method for row in rows if row.engine == engine)
        for k, method in enumerate(methods):
            runs = [row for row in rows if (row.engine, row.method) == (engine, method)]
            look = {"markersize": 4, "linestyle": DASHES[k % len(DASHES)], **LOOKS[engine]}
            errors, times = [row.worst_error for row in runs], [1e3 * row.seconds for row in runs]
            if runs[0].dt:
                by_step.plot([1e3 * row.dt for row in runs], errors, **look)
            by_time.plot(errors, times, label=f"{engine} {method}", **look)
    error = "largest error over the scene, rad"
    by_step.set(xscale="log", yscale="log", xlabel="dt, ms", ylabel=error)
    by_time.set(xscale="log", yscale="log", xlabel=f"{error} (decreasing)", ylabel="time, ms")
    by_time.invert_xaxis()
    fig.legend(loc="outside upper center", ncols=4, fontsize=7)
    best = min(rows, key=lambda row: row.worst_error)
    return "engines_errors", fig, result.finding("errors", scene=best.scene, best=best)
