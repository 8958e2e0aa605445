"""Figures of runs: positions and speeds against time, the engines' difference and its band; drift against the step."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from ...engines import LABELS
from ...judge.check import Result
from ...judge.finding import Finding
from ...judge.run import LEFT, moved_from, movement_unit, step_in_words
from ...judge.scale import EPS
from ...judge.words import scene_begins
from ...report.style import BLUE, GREY, LINES, ORANGE, WIDTH, file_name, plain, zero_at_the_end
from ...robots.case import Case
from .drift import DRIFT_DURATION, drift_order
from .true_motion import difference_while_judged

DRAWN_ZERO = 1e-18  # rad: where differences of exactly zero are drawn
LEGEND_COLUMNS = 4  # of a legend; with names longer than LONG three
LONG = 14  # letters of a joint's name
NOT_JUDGED = {"color": (GREY, 0.2), "linewidth": 0}
MOST_LINES = len(LINES)  # of joints in a panel
LEVEL = 1e-6  # of a position: a smaller change is not seen in a panel
SCHEME_LINES = dict(zip(("semi_implicit_euler", "implicit", "rk4"), LINES))  # colour and dash


def draw_held(result: Result, case: Case, number: int) -> tuple[str, Figure, Finding]:
    """The assignment's figure of a held posture: joint angles against time, and when each engine leaves it."""
    curve = result.curves["runs"][(case.name, "rk4", case.steps)]
    fig = Figure(figsize=(WIDTH, 3.3), layout="constrained")
    ax = fig.subplots()
    paths = (np.degrees(until_diverged(curve, name, curve[name][0])) for name in ("tmt", "mujoco"))
    over_time(ax, curve["t"], *paths, case)
    for (name, left), dash in zip(curve["left"].items(), ("--", ":")):
        if left is not None:
            ax.axvline(left, color="black", linestyle=dash, label=f"{LABELS[name]} leaves at {left:.2f} s")
    ax.set(xlabel="time, s", ylabel="hinge angle, deg", xlim=(0, curve["t"][-1]))
    fig.legend(loc="outside upper center", ncols=LEGEND_COLUMNS + 1)
    ours, theirs = result.curves["errors"][case.name]
    engines = [
        {"label": "TMT", "left": curve["left"]["tmt"], "error": ours},
        {"label": "MuJoCo", "left": curve["left"]["mujoco"], "error": theirs},
    ]
    end, judged = float(curve["t"][-1]), curve["judged_until_s"]
    values = {"number": number, "scene": case.name, "end": end, "steps": len(curve["t"]) - 1, "limit": LEFT}
    apart = difference_while_judged(curve, case)
    caption = result.finding("figure_held", **values, engines=engines, judged=judged, apart=apart)
    return f"assignment_figure_{number}", fig, caption


def draw_run(result: Result, case: Case) -> tuple[str, Figure, Finding]:
    """One scene under each scheme: angles, rates, and the difference under its band; grey: not judged."""
    of_case = [key for key in result.curves["runs"] if key[0] == case.name]
    steps = max(n for *_, n in of_case if n <= 16 * case.steps)
    columns = [result.curves["runs"][key] for key in of_case if key[-1] == steps]
    shown, unit = differing_most(case, columns), movement_unit(case.coordinates)
    fig = Figure(figsize=(WIDTH, 6.2))  # laid out by hand: nine axes take a second otherwise
    axes = fig.subplots(3, len(columns), sharex=True, sharey="row", squeeze=False)
    for column, c in zip(axes.T, columns):
        for row, ax in enumerate(column[:2]):
            paths = [(name, c[name][row] if row else drawable(case, c[name][0])) for name in case.robot.compared]
            paths = [until_diverged(c, name, path) for name, path in paths]
            over_time(ax, c["t"], *paths, case, shown, 64 // len(columns))
        step = step_in_words(case, steps)
        column[0].set_title(f"{c['integrator']}, {step}" if len(columns) < 4 else f"{c['integrator']}\n{step}")
        draw_difference(column[2], c, case, result.label)
    values = np.concatenate([line.get_ydata() for ax in axes[2] for line in ax.lines])
    values = values[np.isfinite(values)]
    if zeros := bool((values <= DRAWN_ZERO).any()):
        zero_at_the_end(axes[2, 0].yaxis, DRAWN_ZERO, values.max(), most=6)
    place, speed = ("angle", "rate") if unit == "rad" and not case.coordinates.has_balls else ("position", "speed")
    label_axis(axes[0, 0], place, unit)
    label_axis(axes[1, 0], speed, " or ".join(f"{part}/s" for part in unit.split(" or ")))
    axes[2, 0].set_ylabel(f"{place}: difference, {unit}" if unit == "rad" else f"difference, {unit}")
    fig.align_ylabels(axes[:, 0])
    add_legend(fig, axes, any(len(case.coordinates.speeds[i]) > LONG for i in shown))
    return file_name("trajectory", case.name), fig, run_caption(result, case, columns, len(shown), zeros)


def draw_difference(ax: Axes, c: dict, case: Case, label: str) -> None:
    """The engines' difference in a run, its band, and the difference that a start off by eps makes."""
    ours, theirs = (until_diverged(c, name, c[name][0]) for name in case.robot.compared)
    difference = moved_from(ours, theirs, case.coordinates).max(axis=1)
    from_perturbed = moved_from(ours, c["perturbed"], case.coordinates).max(axis=1)
    band = np.where(c["band"] < 1e3, c["band"], np.nan)
    for values, look, name in (
        (from_perturbed, {"color": BLUE, "linewidth": 0.9}, f"{label} to itself, start off by {EPS:.0e}"),
        (difference, {"color": "black", "linewidth": 1}, f"{label} to MuJoCo"),
    ):
        ax.semilogy(c["t"][1:], np.maximum(values[1:], DRAWN_ZERO), **look, label=name)
    ax.semilogy(c["t"][:: c["every"]][1:], band[1:], "--", color=ORANGE, label="band of rounding")
    if c["judged_until_s"] < case.duration:
        ax.axvspan(c["judged_until_s"], case.duration, **NOT_JUDGED)
    ax.set(xlabel="time, s", xlim=(0, case.duration))
    if len(f"{case.duration:g}") > 2 or case.duration < 2.0:  # its last number would overlap the next column's first
        few = 3 if ax.get_subplotspec().get_gridspec().ncols > 3 and case.duration < 1.0 else 5
        ax.xaxis.set_major_locator(MaxNLocator(few, prune="upper"))


def add_legend(fig: Figure, axes: np.ndarray, long: bool) -> None:
    """The legend of a run above its panels. long: it has long names."""
    handles, labels = (a + b for a, b in zip(*(ax.get_legend_handles_labels() for ax in (axes[0, 0], axes[2, 0]))))
    if any(ax.patches for ax in axes[2]):
        handles, labels = [*handles, Patch(**NOT_JUDGED)], [*labels, "not judged"]
    columns, high = LEGEND_COLUMNS - long, axes[0, 0].get_title().count("\n")
    lines = -(-len(handles) // columns)
    fig.legend(handles, labels, loc="upper center", ncols=columns)
    top = (94.5 - 3 * lines - 2.4 * high) / 100
    fig.subplots_adjust(left=0.105, right=0.985, bottom=0.075, top=top, hspace=0.12, wspace=0.08)


def run_caption(result: Result, case: Case, columns: Sequence[dict], shown: int, zeros: bool) -> Finding:
    """The engines' difference in a scene, their errors, which runs diverge.

    columns: the curves that are drawn; shown: the number of positions; zeros: whether a difference of 0 is drawn.
    """
    rows = [row for row in result.rows if row["scene"] == case.name and row["level"] == "open loop"]
    diverged = {
        f"{row['engine_integrator']} at dt = {row['dt_s']:.3g} s" for row in rows if row["diverged_at_s"] is not None
    }
    used = [row["difference_over_band"] for row in rows if row["difference_over_band"] is not None]
    errors = result.curves["errors"].get(case.name)
    return result.finding(
        "figure_run",
        scene=scene_begins(case.name, case.robot),
        judged=[(c["integrator"], c["judged_until_s"]) for c in columns],
        to_the_end=all(c["judged_until_s"] >= case.duration for c in columns),
        share=max(used) if used else None,
        errors=errors and dict(zip((result.label, "MuJoCo"), errors)),
        steps=case.steps,
        unit=movement_unit(case.coordinates),
        diverged=sorted(diverged),
        positions=case.coordinates.nv,
        shown=shown,
        balls=case.coordinates.has_balls,
        zero_at=DRAWN_ZERO if zeros else None,
        ended=any(at is not None for c in columns for at in c["ended"].values()),
    )


def over_time(
    ax: Axes,
    t: np.ndarray,
    ours: np.ndarray,
    theirs: np.ndarray,
    case: Case,
    shown: Sequence[int] | None = None,
    marks_at_most: int = 64,
) -> None:
    """Positions or speeds, (times, nv), against time: lines, and marks for MuJoCo. shown: the numbers of those, None: all."""
    every = slice(None, None, max(1, len(t) // marks_at_most))
    marks = {"marker": "o", "linestyle": "none", "mfc": "white", "markersize": 2.8, "markeredgewidth": 0.9}
    names, all_names = case.coordinates.speeds, case.robot.coordinates.speeds
    label = LABELS[case.robot.compared[0]]
    few = len(all_names) <= MOST_LINES  # then a joint looks the same in every figure
    for k, i in enumerate(range(len(names)) if shown is None else shown):
        colour, dash = LINES[all_names.index(names[i]) if few else k]
        ax.plot(t, ours[:, i], linestyle=dash, color=colour, label=f"{plain(case.robot.symbol(names[i]))}, {label}")
        ax.plot(t[every], theirs[every, i], color=colour, clip_on=False, **marks)
    ax.plot([], [], color="black", label="MuJoCo", **marks)


def label_axis(ax: Axes, name: str, unit: str) -> None:
    """Name a vertical axis, with the power of ten by which its numbers are multiplied."""
    low, high = ax.get_ylim()
    largest = max(abs(low), abs(high))
    if high - low < LEVEL * largest:  # a position that does not change: its numbers would all be alike
        ax.set_ylim((low + high) / 2 - 0.05 * largest, (low + high) / 2 + 0.05 * largest)
    power = int(np.floor(np.log10(largest)))
    factor = 1.0 if -2 <= power <= 3 else 10.0**power
    ax.yaxis.set_major_formatter(lambda value, _: f"{value / factor:g}".replace("-", "\N{MINUS SIGN}"))
    ax.set_ylabel(f"{name}, {unit}" if factor == 1.0 else f"{name}, {factor:.0e} {unit}")


def until_diverged(c: dict, name: str, values: np.ndarray) -> np.ndarray:
    """Values of a run of an engine, (times, n), NaN from where it has diverged."""
    ended = c["ended"][name]
    return values if ended is None else np.where((c["t"] < ended)[:, None], values, np.nan)


def drawable(case: Case, q: np.ndarray) -> np.ndarray:
    """Positions as they are drawn, (times, nv): of a ball the movement from the start, NaN where it passes half a turn."""
    coordinates = case.coordinates
    if not coordinates.has_balls:
        return q
    values = coordinates.difference(q, q[0])
    for kind, at, by in coordinates.places.joints:
        if kind != "ball":
            values[:, by] = q[:, at]
            continue
        jumps = np.linalg.norm(np.diff(values[:, by], axis=0), axis=1) > np.pi
        values[1:, by][jumps] = np.nan
    return values


def differing_most(case: Case, columns: Sequence[dict]) -> list[int]:
    """The numbers of the movements that are drawn: all, or those in which the engines differ most while judged."""
    count = case.coordinates.nv
    if count <= MOST_LINES:
        return list(range(count))
    largest = np.zeros(count)
    for c in columns:
        judged = c["t"] <= c["judged_until_s"]
        off = moved_from(*(c[name][0][judged] for name in case.robot.compared), case.coordinates)
        largest = np.fmax(largest, off.max(axis=0))
    return sorted(np.argsort(-largest, kind="stable")[:MOST_LINES].tolist())


def draw_drift(result: Result) -> tuple[str, Figure, Finding]:
    """Drift of energy and momentum against the step size, both engines."""
    drifts, steps = (result.curves["drift"][key] for key in ("drifts", "steps"))
    lines = -(-len(drifts) // 3)
    fig = Figure(figsize=(WIDTH, 0.8 + 2.0 * lines), layout="constrained")
    axes = fig.subplots(lines, 3, sharex=True, sharey=True, squeeze=False)
    for ax in axes.flat[len(drifts) :]:
        ax.set_visible(False)
    for ax, ((scene, quantity, unit), by_method) in zip(axes.flat, drifts.items()):
        for mark, (method, engines) in zip(cycle("osD"), by_method.items()):
            colour, dash = SCHEME_LINES[method.scheme]
            dt = DRIFT_DURATION / np.array(steps[method])
            ax.loglog(dt, engines["tmt"], linestyle=dash, color=colour, label=f"{method.name}, TMT")
            ax.loglog(dt, engines["mujoco"], mark, mfc="none", color=colour)
        ax.plot([], [], "o", mfc="none", color="black", label="marks: MuJoCo")
        ax.set_title(f"{plain(scene)}\n{quantity}, {unit}")
        ax.set_xticks([2e-4, 1e-3, 4e-3], ["2e-4", "1e-3", "4e-3"])
        ax.minorticks_off()
    fig.supylabel(f"largest drift in {DRIFT_DURATION:g} s", fontsize=9)
    fig.supxlabel("dt, s", fontsize=9)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return "trajectory_drift", fig, drift_caption(result, drifts, steps)


def drift_caption(result: Result, drifts: dict, steps: dict) -> Finding:
    """The orders at which the drift falls, the largest drift of the energy, and MuJoCo's drift over TMT's."""
    methods = []
    for method in dict.fromkeys(method for by_method in drifts.values() for method in by_method):
        engines = []
        for name in ("tmt", "mujoco"):
            values = {key: by_method[method][name] for key, by_method in drifts.items()}
            energy = max(drift[-1] for (_, quantity, _), drift in values.items() if quantity == "energy")
            orders = finite_range([drift_order(drift) for drift in values.values()])
            engines.append({"label": LABELS[name], "orders": orders, "energy": float(energy)})
        methods.append({"name": method.name, "dt": DRIFT_DURATION / steps[method][-1], "engines": engines})
    by_engine = [engines for by_method in drifts.values() for engines in by_method.values()]
    pairs = [pair for engines in by_engine for pair in zip(engines["tmt"], engines["mujoco"])]
    ratios = finite_range([theirs / ours if ours else np.nan for ours, theirs in pairs])
    return result.finding("figure_drift", methods=methods, ratios=ratios)


def finite_range(values: Sequence[float]) -> tuple[float, float] | None:
    """The least and the largest of the finite numbers; None: there is none."""
    values = [value for value in values if np.isfinite(value)]
    return (min(values), max(values)) if values else None
