"""Figures of speed: error against time, error against evaluations."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...engines import COLOURS, LABELS
from ...judge.check import Result
from ...judge.units import value
from ...report.style import GREY, WIDTH, file_name, name_ends, plain

LINES = {"mujoco": ("-", 1.6), "tmt": ("-", 1.0), "scipy": ("--", 1.0), "heyoka": ("-.", 1.0)}  # dash, width
SAME_BITS = ("implicitfast", "discrete")  # of MuJoCo: as its Euler
MARKS = "osD^v<>PXph*"
MARKED = (  # the methods of each group in the order of the marks
    ("rk4", "dopri8", "dopri8_adaptive", "explicit_euler", "semi_implicit_euler", "implicit", "implicit_midpoint",
     "gauss_legendre_4"),
    ("RK4", "DOP853", "RK45", "implicitfast", "Euler", "discrete", "Radau", "LSODA", "Taylor"),
)  # fmt: skip
COARSE_END, FINE_END = 3.0, 3e-16  # rad: ends of the axis of errors
NO_RESULT = 1.0  # rad: a larger error is not on the Pareto front
DIVERGED_AT, COLUMN = 30.0, 2.0  # rad: where diverged runs are drawn, and the ratio to the next method's place
FEWEST_AT = 1e-9  # rad: the error for which the caption names the number of evaluations


def runs_of(result: Result, scene: str) -> list[dict]:
    return [row for row in result.rows if row["scene"] == scene and row["why_not"] is None]


def curves(result: Result, scene: str) -> dict:
    """The rows of a scene by (engine, method), in the order of their settings."""
    by_method = {}
    for row in runs_of(result, scene):
        by_method.setdefault((row["engine"], row["method"]), []).append(row)
    return by_method


def engine_name(engine: str) -> str:
    return "tmt" if engine == "tmt" else LABELS.get(engine, engine)


def colour_of(engine: str) -> str:
    return COLOURS.get(engine, GREY)


def line_of(engine: str) -> dict:
    dash, width = LINES.get(engine, ("-", 1.0))
    return {"color": colour_of(engine), "linestyle": dash, "linewidth": width}


def legend_lines(engines) -> list[Line2D]:
    return [Line2D([], [], **line_of(engine) | {"linewidth": 2.5}, label=engine_name(engine)) for engine in engines]


def marker(method: str) -> str:
    """The mark of a method in every figure."""
    for group in MARKED:
        if method in group:
            return MARKS[group.index(method)]
    return "o"


def label_of(engine: str, method: str) -> str | None:
    """A method's name with those that give the same bits; None for one of those, which are not labelled themselves."""
    if engine == "mujoco" and method in SAME_BITS:
        return None
    return ", ".join([method, *SAME_BITS]) if (engine, method) == ("mujoco", "Euler") else method


def in_range(rows: list[dict]) -> list[dict]:
    """The rows whose error is on the axis."""
    return [row for row in rows if not row["diverged"] and value(row, "worst_error") <= COARSE_END]


def beyond_range(rows: list[dict]) -> int:
    return sum(not row["diverged"] for row in rows) - len(in_range(rows))


def errors_drawn(rows: list[dict]) -> np.ndarray:
    return np.clip([value(row, "worst_error") for row in rows], FINE_END, COARSE_END)


def durations(rows: list[dict]) -> str:
    """The simulated time of the runs."""
    times = {round(row["dt_s"] * row["steps"], 9) for row in rows if row["dt_s"]}
    return " or ".join(f"{t:g} s" for t in sorted(times)) or "the scene"


def pareto(rows: list[dict]) -> list[dict]:
    """The rows than which no other is both faster and more exact, from the fastest to the most exact."""
    front, least = [], NO_RESULT
    good = (row for row in rows if not row["diverged"])
    for row in sorted(good, key=lambda row: (row["seconds"], value(row, "worst_error"))):
        if value(row, "worst_error") < least:
            front.append(row)
            least = value(row, "worst_error")
    return front


def draw_times(result: Result, scene: str, beginning: str = "") -> tuple:
    """Worst error against time of one scene, a curve for each method, the Pareto front marked."""
    fig = Figure(figsize=(WIDTH, 5.6))  # no automatic layout, since labels are placed by position
    fig.subplots_adjust(left=0.085, right=0.985, bottom=0.085, top=0.905)
    ax = fig.subplots()
    by_method, unit = curves(result, scene), result.curves.get("unit", "rad")
    ends = []
    for (engine, method), rows in by_method.items():
        good = in_range(rows)
        errors, times = errors_drawn(good), [1e3 * row["seconds"] for row in good]
        ax.plot(errors, times, marker=marker(method), markersize=3.5, **line_of(engine))
        if good and (label := label_of(engine, method)):
            k = int(np.argmin(errors))
            ends.append((errors[k], times[k], label, colour_of(engine)))
    front = pareto(runs_of(result, scene))
    looks = {"markersize": 9, "markerfacecolor": "none", "markeredgecolor": "black", "label": "Pareto front"}
    best = ax.plot(errors_drawn(front), [1e3 * row["seconds"] for row in front], "o", **looks)
    limit = "accuracy of the reference" if scene in result.curves.get("doubles", ()) else "rounding: eps × growth"
    floor = ax.axvline(result.curves["floors"][scene], color=GREY, linestyle=":", label=limit)
    widest, shading = draw_diverged(ax, by_method)
    ax.set(xscale="log", yscale="log", xlim=(widest, FINE_END / 30))
    ax.set(
        xlabel=f"maximum error, {unit} (decreasing)",
        ylabel=f"time for {durations(runs_of(result, scene))} of motion, ms",
    )
    ax.minorticks_off()
    ax.set_xticks([10.0**k for k in range(0, -17, -2)])
    name_ends(ax, ends)
    engines = dict.fromkeys(engine for engine, _ in by_method)
    handles = [*legend_lines(engines), *best, floor, *shading]
    fig.legend(handles=handles, loc="upper center", ncols=4, fontsize=8)
    ratios = [
        {"target": value(line, "target"), "ratio": line["ratio"]}
        for line in result.tables["what_should_i_use"]
        if line["scene"] == scene and line["ratio"]
    ]
    diverged = sum(row["diverged"] for row in runs_of(result, scene))
    values = {"ratios": ratios, "diverged": diverged, "beyond": beyond_range(runs_of(result, scene))}
    caption = result.finding("times", begins=beginning or scene, unit=unit, end=COARSE_END, **values)
    return file_name("speed", scene), fig, caption


def draw_diverged(ax: Axes, by_method: dict) -> tuple[float, list]:
    """Diverged runs at the left, each method in a column; the coarse end of the axis of errors, handles for the legend."""
    place = DIVERGED_AT
    for (engine, method), rows in by_method.items():
        times = [1e3 * row["seconds"] for row in rows if row["diverged"]]
        if times and label_of(engine, method):
            look = {"mfc": "white", "markersize": 5, "color": colour_of(engine)}
            ax.plot([place] * len(times), times, marker(method), **look, label=f"_{method}, diverged")
            place *= COLUMN
    if place == DIVERGED_AT:
        return COLUMN * place, []
    shading = ax.axvspan(DIVERGED_AT / 2.0, COLUMN * place, color=(GREY, 0.15), linewidth=0, label="diverged")
    return COLUMN * place, [shading]


def draw_evaluations(result: Result) -> tuple:
    """Worst error against evaluations of the equations of motion, independent of the machine; a panel for each scene."""
    scenes, regular = list(result.curves["floors"]), result.curves.get("regular")
    unit = result.curves.get("unit", "rad")
    columns = 2 if len(scenes) > 1 else 1
    lines = max(1, -(-len(scenes) // columns))
    height = 0.9 + 3.1 * lines
    fig = Figure(figsize=(WIDTH, height))  # no automatic layout, since labels are placed by position
    fig.subplots_adjust(left=0.09, right=0.985, bottom=0.55 / height, top=1.0 - 0.55 / height, hspace=0.13, wspace=0.05)
    axes = fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for ax in axes.flat[len(scenes) :]:
        ax.set_visible(False)
    labelled, engines, beyond = regular if regular in scenes else next(iter(scenes), None), {}, 0
    for ax, scene in zip(axes.flat, scenes):
        ends = []
        for (engine, method), rows in curves(result, scene).items():
            rows, label = [row for row in rows if row["evaluations"]], label_of(engine, method)
            beyond += beyond_range(rows)
            rows = in_range(rows)
            if not rows or label is None:
                continue
            engines[engine] = None
            errors, counts = errors_drawn(rows), [row["evaluations"] for row in rows]
            wide = {"linewidth": 2.5} if engine == "mujoco" else {}  # visible below the same scheme of tmt
            size = 3 + (engine == "mujoco")
            ax.plot(errors, counts, marker=marker(method), markersize=size, **line_of(engine) | wide, label=label)
            k = int(np.argmin(errors))
            ends.append((errors[k], counts[k], label, colour_of(engine)))
        ax.set(xscale="log", yscale="log", title=plain(scene), xlim=(COARSE_END * 2, 1e-19))
        ax.set_xticks([10.0**k for k in range(0, -16, -3)])
        ax.minorticks_off()
        if scene == labelled:
            axes_of_labels = ax, ends
    if labelled:
        name_ends(*axes_of_labels, size=7.5)
    fig.supxlabel(f"maximum error, {unit} (decreasing)", fontsize=9)
    fig.supylabel("evaluations of the equations of motion", fontsize=9)
    fig.legend(handles=legend_lines(engines), loc="upper center", ncols=4)
    fewest = {method: fewest_evaluations(result, regular, method) for method in ("rk4", "dopri8")}
    values = {"scene": regular, "target": FEWEST_AT, "unit": unit, "fewest": fewest if all(fewest.values()) else None}
    panel = labelled if len(scenes) > 1 else None
    return "speed_evaluations", fig, result.finding("evaluations", **values, beyond=beyond, end=COARSE_END, panel=panel)


def fewest_evaluations(result: Result, scene: str, method: str, target: float = FEWEST_AT) -> int | None:
    """The evaluations of the coarsest run of a method of tmt within an error; None: no run is."""
    rows = curves(result, scene).get(("tmt", method), [])
    good = [row["evaluations"] for row in rows if not row["diverged"] and value(row, "worst_error") <= target]
    return min(good, default=None)
