"""Figures of runs: positions and speeds against time, the engines' difference and its band; all scenes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from ...core.check import About, largest_known
from ...core.finding import Finding
from ...core.words import scene_of
from ...engines import LABELS
from ...judge.run import LEFT, moved_from, movement_unit, step_in_words
from ...report.style import BLUE, GREY, LINES, ORANGE, RED, WIDTH, file_name, zero_at_the_end
from ...robots import Robot
from ...robots.case import Case
from ..figures import MOST_ROWS, beyond_tolerance, chart, lines_to, named_rows
from .pairs import Pair, TrajectoryResult

DRAWN_ZERO = 1e-18  # rad: where differences of exactly zero are drawn
LEVEL = 1e-6  # of a position: a smaller change is not seen in a panel
LEGEND_COLUMNS = 4  # of a legend; with names longer than LONG three
LONG = 14  # letters of a joint's name
MARKS: dict[str, Any] = {"marker": "o", "linestyle": "none", "mfc": "white", "markersize": 2.8, "mew": 0.9}
NOT_JUDGED: dict[str, Any] = {"color": (GREY, 0.2), "linewidth": 0}
MOST_LINES = len(LINES)  # of joints in a panel
LEAST_SHARE, MOST_SHARE = 1e-4, 1e3  # of a band


def draw_held(result: TrajectoryResult, pair: Pair, number: int) -> tuple[str, Figure, Finding]:
    """The assignment's figure of a held posture: angles against time, and when each engine leaves it."""
    name, end = pair.case.name, pair.case.duration
    fig = Figure(figsize=(WIDTH, 3.3), layout="constrained")
    ax = fig.subplots()
    over_time(ax, pair, [np.degrees(q) for q in pair.until_diverged("q")])
    engines = []
    for (engine, run), error, dash in zip(pair.runs.items(), result.errors[name], ("--", ":")):
        engines.append({"label": LABELS[engine], "left": run.left, "error": error})
        if run.left is not None:
            label = f"{LABELS[engine]} leaves at {run.left:.2f} s"
            ax.axvline(run.left, color="black", linestyle=dash, label=label)
    ax.set(xlabel="time, s", ylabel="hinge angle, deg", xlim=(0, end))
    fig.legend(loc="outside upper center", ncols=LEGEND_COLUMNS + 1)
    caption = result.finding(
        "figure_held", number=number, scene=name, end=end, steps=pair.steps, limit=LEFT, engines=engines,
        judged=pair.judged_until, apart=pair.apart.max(), unit=movement_unit(pair.case.coordinates),
    )  # fmt: skip
    return f"assignment_figure_{number}", fig, caption


def draw_run(result: TrajectoryResult, case: Case) -> tuple[str, Figure, Finding]:
    """One scene under each scheme: movements, speeds, and the difference under its band; grey: not judged."""
    pairs = [pair for pair in result.pairs if pair.case.name == case.name]
    steps = max(pair.steps for pair in pairs if pair.steps <= 16 * case.steps)
    pairs = [pair for pair in pairs if pair.steps == steps]
    most_apart = np.argsort(-np.fmax.reduce([pair.apart for pair in pairs]), kind="stable")[:MOST_LINES]
    shown, unit, step = (
        sorted(most_apart.tolist()),
        movement_unit(case.coordinates),
        step_in_words(case, steps),
    )
    fig = Figure(figsize=(WIDTH, 6.2))  # laid out by hand: nine axes take a second otherwise
    axes = fig.subplots(3, len(pairs), sharex=True, sharey="row", squeeze=False)
    for (positions, speeds, below), pair in zip(axes.T, pairs):
        moved = [case.coordinates.difference(q, q[0]) for q in pair.until_diverged("q")]
        for ax, of_engines in ((positions, moved), (speeds, [*pair.until_diverged("v")])):
            over_time(ax, pair, of_engines, shown, 64 // len(pairs))
        title = f"{pair.integrator}, {step}" if len(pairs) < 4 else f"{pair.integrator}\n{step}"
        positions.set_title(title)
        draw_difference(below, pair, result.label)
    values = np.concatenate([line.get_ydata() for ax in axes[2] for line in ax.lines])
    values = values[np.isfinite(values)]
    if (values <= DRAWN_ZERO).any():
        zero_at_the_end(axes[2, 0].yaxis, DRAWN_ZERO, values.max(), most=6)
    label_axis(axes[0, 0], "movement", unit)
    label_axis(axes[1, 0], "speed", f"{unit.replace(' or', '/s or')}/s")
    axes[2, 0].set_ylabel(f"difference, {unit}")
    fig.align_ylabels(axes[:, 0])
    add_legend(fig, axes, any(len(case.coordinates.speeds[i]) > LONG for i in shown))
    rows = [row for row in result.rows if row.scene == case.name and row.level == "open loop"]
    share = largest_known([row.difference_over_band for row in rows])
    caption = result.finding(
        "figure_run", scene=case.robot.scene_begins(case.name), shown=len(shown), positions=case.coordinates.nv,
        share=share, judged=[(pair.integrator, pair.judged_until) for pair in pairs],
    )  # fmt: skip
    return file_name("trajectory", case.name), fig, caption


def draw_difference(ax: Axes, pair: Pair, label: str) -> None:
    """The engines' difference, and its band."""
    first, mujoco = pair.until_diverged("q")
    difference = moved_from(first, mujoco, pair.case.coordinates).max(axis=1)
    band, end = np.where(pair.band < 1e3, pair.band, np.nan), pair.case.duration
    shown = np.maximum(difference[1:], DRAWN_ZERO)
    ax.semilogy(pair.t[1:], shown, color="black", linewidth=1, label=f"{label} to MuJoCo")
    ax.semilogy(pair.t[:: pair.every][1:], band[1:], "--", color=ORANGE, label="band of rounding")
    if pair.judged_until < end:
        ax.axvspan(pair.judged_until, end, **NOT_JUDGED)
    ax.set(xlabel="time, s", xlim=(0, end))
    # its last number would overlap the next column's first
    ax.xaxis.set_major_locator(MaxNLocator(3, prune="upper"))


def add_legend(fig: Figure, axes: np.ndarray, long: bool) -> None:
    """The legend of a run above its panels. long: it has long names."""
    handles = [handle for ax in (axes[0, 0], axes[2, 0]) for handle in ax.get_legend_handles_labels()[0]]
    if any(ax.patches for ax in axes[2]):
        handles.append(Patch(label="not judged", **NOT_JUDGED))
    columns, high = LEGEND_COLUMNS - long, axes[0, 0].get_title().count("\n")
    fig.legend(handles=handles, loc="upper center", ncols=columns)
    top = (94.5 - 3 * -(-len(handles) // columns) - 2.4 * high) / 100
    fig.subplots_adjust(left=0.105, right=0.985, bottom=0.075, top=top, hspace=0.12, wspace=0.08)


def over_time(
    ax: Axes, pair: Pair, values: Sequence[np.ndarray], shown: Sequence[int] = (), marks_at_most: int = 64
) -> None:
    """Positions or speeds of both engines, (times, nv): lines, and marks for MuJoCo. shown: which; (): all."""
    every = slice(None, None, max(1, len(pair.t) // marks_at_most))
    robot, names, (first, mujoco) = pair.case.robot, pair.case.coordinates.speeds, values
    all_names = robot.coordinates.speeds
    few = len(all_names) <= MOST_LINES  # then a joint looks the same in every figure
    for k, i in enumerate(shown or range(len(names))):
        colour, dash = LINES[all_names.index(names[i]) if few else k]
        label = f"{robot.symbol(names[i])}, {LABELS[robot.compared[0]]}"
        ax.plot(pair.t, first[:, i], linestyle=dash, color=colour, label=label)
        ax.plot(pair.t[every], mujoco[every, i], color=colour, clip_on=False, **MARKS)
    ax.plot([], [], color="black", label="MuJoCo", **MARKS)


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


def draw_scenes(result: TrajectoryResult, robot: Robot) -> tuple[str, Figure, Finding]:
    """Each scene: at the left the difference over its band; at the right how long all its runs are judged."""
    durations = {case.name: case.duration for case in robot.cases}
    names = [name for name in durations if any(row.scene == name for row in result.rows)]
    wrong = [check for check in result.checks if check.failed and check.about == About.MODELS]
    failing = [name for name in names if name in {scene_of(check.scene, names) for check in wrong}]
    beginnings, shares, until = result.of_beginnings, {}, {}
    for name in names:
        rows = [row for row in result.rows if row.scene == name]
        shares[name] = largest_known([row.difference_over_band for row in rows])
        until[name] = [row.judged_until for row in rows if row not in beginnings]
    wrong_first = sorted(names, key=lambda name: name not in failing)[:MOST_ROWS]
    shown = [name for name in names if name in wrong_first]
    fig, (left, right) = chart(2, sharey=True, width_ratios=(1.15, 1))
    left.set(xscale="log", xlim=(LEAST_SHARE, MOST_SHARE if failing else 10.0), xlabel="difference / band")
    for place, name in enumerate(shown):
        colour, mark = (RED, "X") if name in failing else ("black", "D")
        if (share := shares[name]) is not None:
            lines_to(left, [share], [place], mark, colour, markersize=4.5)
    lengths, judged = [durations[name] for name in shown], [min(until[name], default=0.0) for name in shown]
    right.barh(range(len(shown)), lengths, height=0.5, color=(GREY, 0.2), label="not judged")
    right.barh(range(len(shown)), judged, height=0.5, color=BLUE, label="judged at all dt")
    beyond_tolerance(left, 1.0, "1")
    left.set_xticks([1e-4, 1e-2, 1.0])
    left.minorticks_off()
    right.set(xlabel="time, s", xlim=(0, 1.04 * max(lengths)))
    named_rows(left, shown, [name not in failing for name in shown])
    left.tick_params(axis="y", labelsize=8)
    right.grid(axis="y", visible=False)
    fig.legend(loc="outside upper center", ncols=2, fontsize=7)
    caption = result.finding(
        "overview_caption", label=result.label, share=largest_known([*shares.values()]), scenes=len(names),
        failing=failing, times=sorted({time for times in until.values() for time in times}),
        beginning=sorted({row.engine_integrator for row in beginnings}),
    )  # fmt: skip
    return "overview_scenes", fig, caption
