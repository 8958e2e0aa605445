"""Figures of runs: positions and speeds against time, the engines' difference and its band."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from ...core.check import Result, largest_known
from ...core.finding import Finding
from ...engines import LABELS
from ...judge.run import LEFT, moved_from, movement_unit, step_in_words
from ...report.style import GREY, LINES, ORANGE, WIDTH, file_name, zero_at_the_end
from ...robots.case import Case
from .true_motion import difference_while_judged

DRAWN_ZERO = 1e-18  # rad: where differences of exactly zero are drawn
LEGEND_COLUMNS = 4  # of a legend; with names longer than LONG three
LONG = 14  # letters of a joint's name
NOT_JUDGED = {"color": (GREY, 0.2), "linewidth": 0}
MOST_LINES = len(LINES)  # of joints in a panel
LEVEL = 1e-6  # of a position: a smaller change is not seen in a panel


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
            paths = [
                (name, c[name][row] if row else drawable(case, c[name][0])) for name in case.robot.compared
            ]
            paths = [until_diverged(c, name, path) for name, path in paths]
            over_time(ax, c["t"], *paths, case, shown, 64 // len(columns))
        step = step_in_words(case, steps)
        column[0].set_title(
            f"{c['integrator']}, {step}" if len(columns) < 4 else f"{c['integrator']}\n{step}"
        )
        draw_difference(column[2], c, case, result.label)
    values = np.concatenate([line.get_ydata() for ax in axes[2] for line in ax.lines])
    values = values[np.isfinite(values)]
    if (values <= DRAWN_ZERO).any():
        zero_at_the_end(axes[2, 0].yaxis, DRAWN_ZERO, values.max(), most=6)
    place, speed = (
        ("angle", "rate") if unit == "rad" and not case.coordinates.has_balls else ("position", "speed")
    )
    label_axis(axes[0, 0], place, unit)
    label_axis(axes[1, 0], speed, " or ".join(f"{part}/s" for part in unit.split(" or ")))
    axes[2, 0].set_ylabel(f"{place}: difference, {unit}" if unit == "rad" else f"difference, {unit}")
    fig.align_ylabels(axes[:, 0])
    add_legend(fig, axes, any(len(case.coordinates.speeds[i]) > LONG for i in shown))
    return file_name("trajectory", case.name), fig, run_caption(result, case, columns, len(shown))


def draw_difference(ax: Axes, c: dict, case: Case, label: str) -> None:
    """The engines' difference in a run, and its band."""
    ours, theirs = (until_diverged(c, name, c[name][0]) for name in case.robot.compared)
    difference = moved_from(ours, theirs, case.coordinates).max(axis=1)
    band = np.where(c["band"] < 1e3, c["band"], np.nan)
    shown = np.maximum(difference[1:], DRAWN_ZERO)
    ax.semilogy(c["t"][1:], shown, color="black", linewidth=1, label=f"{label} to MuJoCo")
    ax.semilogy(c["t"][:: c["every"]][1:], band[1:], "--", color=ORANGE, label="band of rounding")
    if c["judged_until_s"] < case.duration:
        ax.axvspan(c["judged_until_s"], case.duration, **NOT_JUDGED)
    ax.set(xlabel="time, s", xlim=(0, case.duration))
    ax.xaxis.set_major_locator(
        MaxNLocator(3, prune="upper")
    )  # its last number would overlap the next column's first


def add_legend(fig: Figure, axes: np.ndarray, long: bool) -> None:
    """The legend of a run above its panels. long: it has long names."""
    handles, labels = (
        a + b for a, b in zip(*(ax.get_legend_handles_labels() for ax in (axes[0, 0], axes[2, 0])))
    )
    if any(ax.patches for ax in axes[2]):
        handles, labels = [*handles, Patch(**NOT_JUDGED)], [*labels, "not judged"]
    columns, high = LEGEND_COLUMNS - long, axes[0, 0].get_title().count("\n")
    lines = -(-len(handles) // columns)
    fig.legend(handles, labels, loc="upper center", ncols=columns)
    top = (94.5 - 3 * lines - 2.4 * high) / 100
    fig.subplots_adjust(left=0.105, right=0.985, bottom=0.075, top=top, hspace=0.12, wspace=0.08)


def run_caption(result: Result, case: Case, columns: Sequence[dict], shown: int) -> Finding:
    """The engines' difference in a scene, until when it is judged, and their errors. shown: the number of positions."""
    rows = [row for row in result.rows if row["scene"] == case.name and row["level"] == "open loop"]
    errors = result.curves["errors"].get(case.name)
    return result.finding(
        "figure_run",
        scene=case.robot.scene_begins(case.name),
        judged=[(c["integrator"], c["judged_until_s"]) for c in columns],
        share=largest_known([row["difference_over_band"] for row in rows]),
        errors=errors and dict(zip((result.label, "MuJoCo"), errors)),
        unit=movement_unit(case.coordinates),
        positions=case.coordinates.nv,
        shown=shown,
        balls=case.coordinates.has_balls,
    )


def over_time(
    ax: Axes, t, ours, theirs, case: Case, shown: Sequence[int] | None = None, marks_at_most: int = 64
) -> None:
    """Positions or speeds, (times, nv), against time: lines, and marks for MuJoCo. shown: the numbers of those, None: all."""
    every = slice(None, None, max(1, len(t) // marks_at_most))
    marks = {"marker": "o", "linestyle": "none", "mfc": "white", "markersize": 2.8, "markeredgewidth": 0.9}
    names, all_names = case.coordinates.speeds, case.robot.coordinates.speeds
    label = LABELS[case.robot.compared[0]]
    few = len(all_names) <= MOST_LINES  # then a joint looks the same in every figure
    for k, i in enumerate(range(len(names)) if shown is None else shown):
        colour, dash = LINES[all_names.index(names[i]) if few else k]
        ax.plot(t, ours[:, i], linestyle=dash, color=colour, label=f"{case.robot.symbol(names[i])}, {label}")
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
    for joint in coordinates.places.joints:
        if joint.kind != "ball":
            values[:, joint.qd] = q[:, joint.q]
            continue
        jumps = np.linalg.norm(np.diff(values[:, joint.qd], axis=0), axis=1) > np.pi
        values[1:, joint.qd][jumps] = np.nan
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
