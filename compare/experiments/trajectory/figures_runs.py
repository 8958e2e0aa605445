"""Figures of runs: angles and rates against time, and the engines' difference in its band."""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from ...engines import LABELS
from ...judge.check import Result
from ...judge.run import moved_from, movement_unit, step_in_words
from ...judge.scale import EPS
from ...judge.words import capital, scene_begins
from ...report.style import BLUE, GREY, ORANGE, WIDTH, file_name, zero_at_the_end
from ...robots.case import Case
from .figures_lines import differing_most, drawn, named_with_its_factor, over_time, while_it_lasts
from .leaving import left_in_words, why_in_words
from .sentences import agreement, rad

DRAWN_ZERO = 1e-18  # rad: where differences of exactly zero are drawn
LEGEND_COLUMNS = 4  # of a legend; with names longer than LONG three
LETTERS = 85  # of a line above a panel as wide as the page
LONG = 14  # letters of a joint's name
NOT_JUDGED = {"color": (GREY, 0.2), "linewidth": 0}


def draw_held(result: Result, case: Case, number: int) -> tuple[str, Figure, str]:
    """The assignment's figure of a held posture: joint angles against time, and why the engines leave it or stay."""
    curve = result.curves["runs"][(case.name, "rk4", case.steps)]
    fig = Figure(figsize=(WIDTH, 3.3), layout="constrained")
    ax = fig.subplots()
    paths = (np.degrees(while_it_lasts(curve, name, curve[name][0])) for name in ("tmt", "mujoco"))
    over_time(ax, curve["t"], *paths, case)
    for (name, left), dash in zip(curve["left"].items(), ("--", ":")):
        if left is not None:
            ax.axvline(left, color="black", linestyle=dash, label=f"{LABELS[name]} {left_in_words(left)}")
    ax.set(xlabel="time, s", ylabel="hinge angle, deg", xlim=(0, curve["t"][-1]))
    found = result.curves.get("leaving", {}).get(case.name)
    why = f"{capital(why_in_words(found))}." if found else ""
    ax.set_title(fill(why, LETTERS), loc="left")
    fig.legend(loc="outside upper center", ncols=LEGEND_COLUMNS + 1)
    ours, theirs = result.curves["errors"][case.name]
    end = f"{curve['t'][-1]:g}"
    caption = (
        f"The assignment's Figure {number} redrawn: {case.name} with TMT's torque in both engines, RK4, "
        f"dt = {end}/{len(curve['t']) - 1} s. In {end} s the {case.robot.noun} of TMT {left_in_words(curve['left']['tmt'])}, "
        f"that of MuJoCo {left_in_words(curve['left']['mujoco'])}. {why}{' ' * bool(why)}"
        f"The true motion is rest: of that TMT is at most {rad(ours)} off, MuJoCo {rad(theirs)}; while judged, to "
        f"{curve['judged_until_s']:.2f} s, they are {agreement(curve, case):.1e} rad apart."
    )
    return f"assignment_figure_{number}", fig, caption


def draw_run(result: Result, case: Case) -> tuple[str, Figure, str]:
    """One scene under each scheme: angles, rates, and the difference under its band; grey: not judged."""
    of_case = [key for key in result.curves["runs"] if key[0] == case.name]
    steps = max(n for *_, n in of_case if n <= 16 * case.steps)
    columns = [result.curves["runs"][key] for key in of_case if key[-1] == steps]
    shown, unit = differing_most(case, columns), movement_unit(case.coordinates)
    fig = Figure(figsize=(WIDTH, 6.2))  # laid out by hand: nine axes take a second otherwise
    axes = fig.subplots(3, len(columns), sharex=True, sharey="row", squeeze=False)
    for column, c in zip(axes.T, columns):
        for row, ax in enumerate(column[:2]):
            paths = [(name, c[name][row] if row else drawn(case, c[name][0])) for name in case.robot.compared]
            paths = [while_it_lasts(c, name, path) for name, path in paths]
            over_time(ax, c["t"], *paths, case, shown, 64 // len(columns))
        step = step_in_words(case, steps)
        column[0].set_title(f"{c['integrator']}, {step}" if len(columns) < 4 else f"{c['integrator']}\n{step}")
        draw_difference(column[2], c, case, result.label)
    of_all = np.concatenate([line.get_ydata() for ax in axes[2] for line in ax.lines])
    of_all = of_all[np.isfinite(of_all)]
    if zeros := bool((of_all <= DRAWN_ZERO).any()):
        zero_at_the_end(axes[2, 0].yaxis, DRAWN_ZERO, of_all.max(), most=6)
    place, speed = ("angle", "rate") if unit == "rad" and not case.coordinates.has_balls else ("position", "speed")
    named_with_its_factor(axes[0, 0], place, unit)
    named_with_its_factor(axes[1, 0], speed, " or ".join(f"{one}/s" for one in unit.split(" or ")))
    axes[2, 0].set_ylabel(f"{place}: difference, {unit}" if unit == "rad" else f"difference, {unit}")
    fig.align_ylabels(axes[:, 0])
    add_legend(fig, axes, any(len(case.coordinates.speeds[i]) > LONG for i in shown))
    return file_name("trajectory", case.name), fig, run_caption(result, case, columns, len(shown), zeros)


def draw_difference(ax: Axes, c: dict, case: Case, label: str) -> None:
    """How far the engines are apart in a run, under its band; beside it what rounding of the start makes of itself."""
    ours, theirs = (while_it_lasts(c, name, c[name][0]) for name in case.robot.compared)
    difference = moved_from(ours, theirs, case.coordinates).max(axis=1)
    of_itself = moved_from(ours, c["nudged"], case.coordinates).max(axis=1)
    band = np.where(c["band"] < 1e3, c["band"], np.nan)
    for values, look, name in (
        (of_itself, {"color": BLUE, "linewidth": 0.9}, f"{label}, start {EPS:.0e} away"),
        (difference, {"color": "black", "linewidth": 1}, f"{label} to MuJoCo"),
    ):
        ax.semilogy(c["t"][1:], np.maximum(values[1:], DRAWN_ZERO), **look, label=name)
    ax.semilogy(c["t"][:: c["every"]][1:], band[1:], "--", color=ORANGE, label="band of rounding")
    if c["judged_until_s"] < case.duration:
        ax.axvspan(c["judged_until_s"], case.duration, **NOT_JUDGED)
    ax.set(xlabel="time, s", xlim=(0, case.duration))
    if (
        len(f"{case.duration:g}") > 2 or case.duration < 2.0
    ):  # the last number of a column would meet the next one's first
        few = 3 if ax.get_subplotspec().get_gridspec().ncols > 3 and case.duration < 1.0 else 5
        ax.xaxis.set_major_locator(MaxNLocator(few, prune="upper"))


def add_legend(fig: Figure, axes: np.ndarray, long: bool) -> None:
    """The legend of a run above its panels, which take what it leaves. long: it has long names."""
    handles, labels = (a + b for a, b in zip(*(ax.get_legend_handles_labels() for ax in (axes[0, 0], axes[2, 0]))))
    if any(ax.patches for ax in axes[2]):
        handles, labels = [*handles, Patch(**NOT_JUDGED)], [*labels, "not judged"]
    columns, high = LEGEND_COLUMNS - long, axes[0, 0].get_title().count("\n")
    lines = -(-len(handles) // columns)
    fig.legend(handles, labels, loc="upper center", ncols=columns)
    top = (94.5 - 3 * lines - 2.4 * high) / 100
    fig.subplots_adjust(left=0.105, right=0.985, bottom=0.075, top=top, hspace=0.12, wspace=0.08)


def run_caption(result: Result, case: Case, columns: Sequence[dict], shown: int, zeros: bool) -> str:
    """How far the engines are apart in a scene, how far from the true motion, and what diverges.

    columns: the curves that are drawn; shown: of how many positions; zeros: whether some differences are drawn as none.
    """
    until = ", ".join(f"{c['integrator']} to {c['judged_until_s']:.2f} s" for c in columns)
    until += "; grey: not judged" * any(c["judged_until_s"] < case.duration for c in columns)
    rows = [row for row in result.rows if row["scene"] == case.name and row["level"] == "open loop"]
    diverged = [row for row in rows if row["diverged_at_s"] is not None]
    ended = sorted({f"{row['engine_integrator']} at dt = {row['dt_s']:.3g} s" for row in diverged})
    used = [row["difference_over_band"] for row in rows if row["difference_over_band"] is not None]
    most = f"at most {max(used):.1e}" if used else "no measured part"
    errors, unit = result.curves["errors"].get(case.name), movement_unit(case.coordinates)
    count, label = case.coordinates.nv, result.label
    return (
        f"{scene_begins(case.name, case.robot)}. While judged ({until}) the engines' difference "
        f"is {most} of the band, over all steps and integrators. "
        + (
            f"With {case.steps} steps of RK4 {label} is {rad(errors[0], unit)} and MuJoCo {rad(errors[1], unit)} from the true "
            "motion. "
            if errors
            else ""
        )
        + (f"MuJoCo's run diverged: {', '.join(ended)}. " if ended else "")
        + (
            f"Of {count} positions and speeds the {shown} are shown in which the engines' positions differ most while judged. "
            if shown < count
            else ""
        )
        + (
            "Of a ball the turn from its start is drawn, in its own axes, beyond half a turn from the other side. "
            if case.coordinates.has_balls
            else ""
        )
        + f"Blue: {label} beside itself, its start moved by {EPS:.1e}."
        + f" Differences below {DRAWN_ZERO:g} are drawn at 0." * zeros
        + " Lines and marks end where a run has diverged."
        * any(at is not None for c in columns for at in c["ended"].values())
    )
