"""Figures of runs: angles and rates against time, differences in their bands, drift, growth of errors."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ...case import Case
from ...engines import LABELS
from ...judge.check import Result
from ...judge.run import moved_from, movement_unit, step_in_words
from ...judge.words import scene_begins
from ...report.style import BLUE, GREEN, GREY, LINES, ORANGE, PINK, RED, SKY, WIDTH, file_name
from .drift import DRIFT_DURATION, found_order
from .figures_lines import differing_most, drawn, over_time
from .horizon import CARRIED, early, power
from .leaving import left_in_words
from .sentences import agreement, rad

SCHEME_LINES = dict(zip(("semi_implicit_euler", "implicit", "rk4"), LINES))  # colour and dash
DRAWN_ZERO = 1e-18  # rad: where differences of exactly zero are drawn
LEGEND_COLUMNS = 4  # of a legend; with names longer than LONG three
LONG = 14  # letters of a joint's name


def draw_held(result: Result, case: Case, number: int) -> tuple[str, Figure, str]:
    """The assignment's figure of a held posture: joint angles against time."""
    curve = result.curves["runs"][(case.name, "rk4", case.steps)]
    fig = Figure(figsize=(WIDTH, 2.9), layout="constrained")
    ax = fig.subplots()
    over_time(ax, curve["t"], np.degrees(curve["tmt"][0]), np.degrees(curve["mujoco"][0]), case)
    ax.set(xlabel="time, s", ylabel="hinge angle, deg", xlim=(0, curve["t"][-1]))
    fig.legend(loc="outside upper center", ncols=LEGEND_COLUMNS)
    ours, theirs = result.curves["errors"][case.name]
    end = f"{curve['t'][-1]:g}"
    caption = (
        f"The assignment's Figure {number} redrawn: {case.name} with TMT's torque in both engines, RK4, "
        f"dt = {end}/{len(curve['t']) - 1} s. In {end} s the {case.robot.noun} of TMT {left_in_words(curve['left']['tmt'])}, "
        f"that of MuJoCo {left_in_words(curve['left']['mujoco'])}. "
        f"The true motion is rest: of that TMT is at most {rad(ours)} off, MuJoCo {rad(theirs)}; while judged, to "
        f"{curve['judged_until_s']:.2f} s, they are {agreement(curve, case):.1e} rad apart."
    )
    return f"assignment_figure_{number}", fig, caption


def draw_run(result: Result, case: Case) -> tuple[str, Figure, str]:
    """One scene under each scheme: angles, rates, and the difference under its band; grey: not judged."""
    of_case = [key for key in result.curves["runs"] if key[0] == case.name]
    steps = max(n for *_, n in of_case if n <= 16 * case.steps)
    columns = [result.curves["runs"][key] for key in of_case if key[-1] == steps]
    shown, unit, label = differing_most(case, columns), movement_unit(case.coordinates), result.label
    fig = Figure(figsize=(WIDTH, 6.2))  # laid out by hand: nine axes take a second otherwise
    long = any(len(case.coordinates.speeds[i]) > LONG for i in shown)
    columns_of_legend = LEGEND_COLUMNS - long
    lines_of_legend = -(-(len(shown) + 4) // columns_of_legend)
    fig.subplots_adjust(
        left=0.105,
        right=0.985,
        bottom=0.075,
        top=(93 - 3 * lines_of_legend - 2 * (len(columns) > 3)) / 100,
        hspace=0.12,
        wspace=0.08,
    )
    axes = fig.subplots(3, len(columns), sharex=True, sharey="row", squeeze=False)
    until = []
    for column, c in zip(axes.T, columns):
        for row, ax in enumerate(column[:2]):
            paths = [c[name][row] for name in case.robot.compared]
            over_time(ax, c["t"], *(paths if row else (drawn(case, q) for q in paths)), case, shown)
            ax.ticklabel_format(axis="y", scilimits=(-2, 3))
        step = step_in_words(case, steps)
        column[0].set_title(f"{c['integrator']}, {step}" if len(columns) < 4 else f"{c['integrator']}\n{step}")
        ours, theirs = (c[name][0] for name in case.robot.compared)
        difference = moved_from(ours, theirs, case.coordinates).max(axis=1)
        ulp = moved_from(ours, c["ulp"], case.coordinates).max(axis=1)
        band = np.where(c["band"] < 1e3, c["band"], np.nan)
        lines = column[2]
        lines.semilogy(
            c["t"][1:],
            np.maximum(ulp[1:], DRAWN_ZERO),
            color=BLUE,
            linewidth=0.8,
            label=f"{label}, start 1 ulp away{' (0: of 1)' if case.robot.is_read else ''}",
        )
        lines.semilogy(
            c["t"][1:], np.maximum(difference[1:], DRAWN_ZERO), color="black", linewidth=1, label=f"{label} to MuJoCo"
        )
        lines.semilogy(c["t"][:: c["every"]][1:], band[1:], "--", color=ORANGE, label="band of rounding")
        if c["judged_until_s"] < case.duration:
            lines.axvspan(c["judged_until_s"], case.duration, color=(GREY, 0.15))
        lines.set(xlabel="time, s", xlim=(0, case.duration))
        if (
            len(f"{case.duration:g}") > 2 or case.duration < 2.0
        ):  # the last number of a column would meet the first of the next
            few = 3 if len(columns) > 3 and case.duration < 1.0 else 5
            lines.xaxis.set_major_locator(MaxNLocator(few, prune="upper"))
        until.append(f"{c['integrator']} to {c['judged_until_s']:.2f} s")
    place, speed = ("angle", "rate") if unit == "rad" and not case.coordinates.has_balls else ("position", "speed")
    per = " or ".join(f"{one}/s" for one in unit.split(" or "))
    for ax, label in zip(
        axes[:, 0],
        (
            f"{place}, {unit}",
            f"{speed}, {per}",
            f"{place}: difference, {unit}" if unit == "rad" else f"difference, {unit}",
        ),
    ):
        ax.set_ylabel(label)
    handles = [ax.get_legend_handles_labels() for ax in (axes[0, 0], axes[2, 0])]
    fig.legend(
        handles[0][0] + handles[1][0], handles[0][1] + handles[1][1], loc="upper center", ncols=columns_of_legend
    )
    return file_name("trajectory", case.name), fig, run_caption(result, case, until, len(shown))


def run_caption(result: Result, case: Case, until: Sequence[str], shown: int) -> str:
    """How far the engines are apart in a scene, how far from the true motion, and what diverges."""
    rows = [row for row in result.rows if row["scene"] == case.name and row["level"] == "open loop"]
    diverged = [row for row in rows if row["diverged_at_s"] is not None]
    ended = sorted({f"{row['engine_integrator']} at dt = {row['dt_s']:.3g} s" for row in diverged})
    used = [row["difference_over_band"] for row in rows if row["difference_over_band"] is not None]
    most = f"at most {max(used):.1e}" if used else "no measured part"
    errors, unit = result.curves["errors"].get(case.name), movement_unit(case.coordinates)
    count, label = case.coordinates.nv, result.label
    return (
        f"{scene_begins(case.name, case.robot)}. While judged ({', '.join(until)}; grey: not judged) the engines' difference "
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
        + ("Of a ball the turn from its start is drawn, in its own axes. " if case.coordinates.has_balls else "")
        + f"Differences of exactly zero are drawn at {DRAWN_ZERO:g}."
    )


def draw_drift(result: Result) -> tuple[str, Figure, str]:
    """Drift of energy and momentum against the step size, both engines."""
    drifts, steps = (result.curves["drift"][key] for key in ("drifts", "steps"))
    lines = -(-len(drifts) // 3)
    fig = Figure(figsize=(WIDTH, 0.8 + 1.8 * lines), layout="constrained")
    axes = fig.subplots(lines, 3, sharex=True, sharey=True, squeeze=False)
    for ax in axes.flat[len(drifts) :]:
        ax.set_visible(False)
    for ax, ((scene, quantity, unit), of_scene) in zip(axes.flat, drifts.items()):
        for k, (method, engines) in enumerate(of_scene.items()):
            colour, dash = SCHEME_LINES[method.scheme]
            dt = DRIFT_DURATION / np.array(steps[method])
            ax.loglog(dt, engines["tmt"], linestyle=dash, color=colour, label=f"{method.name}, TMT")
            ax.loglog(dt, engines["mujoco"], "o", mfc="none", color=colour, label=None if k else "MuJoCo")
        ax.set_title(f"{scene}: {quantity}, {unit}", fontsize=8)
        ax.set_xticks([2e-4, 1e-3, 4e-3], ["2e-4", "1e-3", "4e-3"])
        ax.minorticks_off()
    fig.supylabel(f"largest drift in {DRIFT_DURATION:g} s", fontsize=9)
    fig.supxlabel("dt, s", fontsize=9)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=LEGEND_COLUMNS)
    return "trajectory_drift", fig, drift_caption(drifts, steps)


def drift_caption(drifts: dict, steps: dict) -> str:
    """At which order the drift falls, how large that of the energy is, and how alike the engines are in it."""
    orders, largest = [], []
    for method in dict.fromkeys(method for of in drifts.values() for method in of):
        of_engine = {name: [of[method][name] for of in drifts.values()] for name in ("tmt", "mujoco")}
        spans = [
            f"{LABELS[name]} {range_in_words([found_order(v) for v in values], '.2f')}"
            for name, values in of_engine.items()
        ]
        orders.append(f"{method.name}: {', '.join(spans)}")
        energy = {name: max(of[method][name][-1] for (_, what, _), of in drifts.items() if what == "energy")
                  for name in of_engine}  # fmt: skip
        of_energy = ", ".join(f"{LABELS[name]} {value:.1e} J" for name, value in energy.items())
        largest.append(f"{method.name} at dt = 1/{steps[method][-1] / DRIFT_DURATION:g} s: {of_energy}")
    pairs = [
        pair for of in drifts.values() for engines in of.values() for pair in zip(engines["tmt"], engines["mujoco"])
    ]
    ratios = [theirs / ours if ours else np.nan for ours, theirs in pairs]
    return (
        "Drift of what should be constant (lines: TMT; marks: MuJoCo). The order at which it falls at the finest step, "
        f"{'; '.join(orders)}. Largest of energy, {'; '.join(largest)}. MuJoCo's drift over TMT's: "
        f"{range_in_words(ratios, '.3g')}."
    )


def range_in_words(values: Sequence[float], digits: str) -> str:
    """The least and the largest of some numbers in words."""
    values = [value for value in values if np.isfinite(value)]
    return f"{min(values):{digits}} to {max(values):{digits}}" if values else "no number"


def draw_growth(result: Result) -> tuple[str, Figure, str]:
    """Growth of a small difference over the whole time, scene by scene."""
    t, curves = (result.curves["growth"][key] for key in ("t", "curves"))
    fig = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    ax = fig.subplots()
    colours = cycle((BLUE, RED, GREEN, ORANGE, PINK, SKY, GREY, "black"))
    last = {name: grown[np.isfinite(grown)][-1] for name, grown in curves.items()}
    ends = sorted(last, key=last.get)
    low = -20.0 if min(last.values()) < -5.0 else -5.0
    high = 65.0 if max(last.values()) > min(CARRIED) else 20.0
    apart, places = 0.065 * (high - low), {}
    for name in ends:  # labels at the ends of the curves, not over each other
        places[name] = max(min(last[name], high - apart), max(places.values(), default=low) + apart)
    for (name, grown), colour in zip(curves.items(), colours):
        ax.plot(t, grown, color=colour)
        ax.text(t[-1] * 1.01, places[name], name, color=colour, va="center", fontsize=8)
    for digits, text in ((16, "doubles"), (30, "30 digits")):
        if digits < high:
            ax.axhline(digits, color="black", linewidth=0.8, linestyle=":")
            ax.text(t[-1] / 120, digits + 0.01 * (high - low), text, fontsize=8)
    ax.set(xlabel="time, s", ylabel="log10 of the growth", xlim=(0, t[-1]), ylim=(low, high))
    soon = early(t)
    each = "; ".join(
        f"{name}: {power(curves[name][soon], 1)} and {power(curves[name][-1], 0)}" for name in reversed(ends)
    )
    caption = (
        f"How much a small difference of the state grows in {t[soon]:g} s and in {t[-1]:g} s: {each}. Where a curve crosses a "
        "dotted line, numbers of so many digits know nothing of the state."
    )
    return "trajectory_growth", fig, caption
