"""Figures of all scenes side by side: errors against evaluations, errors of the energy against time."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...judge.check import Check, Result
from ...judge.units import value
from ...report.style import WIDTH, name_ends, plain
from .figures_times import (
    COARSE_END,
    colour_of,
    curves,
    in_full,
    is_twice,
    line_of,
    marker,
    motion,
    rows_of_runs,
    scenes,
    seen,
    unseen_in_words,
    visible,
    written,
)

MOST_ENERGY, LEAST_ENERGY = 10.0, 1e-15  # J, where the axis of errors begins and ends


def draw_evaluations(result: Result) -> tuple[str, Figure, str]:
    """Worst error against evaluations of the right-hand side: independent of the machine and of who wrote the kernel."""

    def numbers(rows: list[dict]) -> tuple:
        good = [r for r in seen(rows) if r["evaluations"]]
        return visible(good), [r["evaluations"] for r in good]

    fig, named = panels(result, numbers, (COARSE_END * 2, 1e-19), f"worst error on the way, {result.curves.get('unit', 'rad')}",
                        "evaluations of the right-hand side")  # fmt: skip
    caption = (
        "The same errors against evaluations of the equations of motion, which do not depend on the machine. "
        f"{agreeing(result.checks)}{fewest(result, result.curves.get('regular'), 1e-9)}Of an implicit method an evaluation with "
        f"its derivatives counts once; a method without evaluations, as heyoka's Taylor, is not drawn.{named}"
        + unseen_in_words(
            result, [row for row in rows_of_runs(result) if row["scene"] in scenes(result) and row["evaluations"]]
        )
    )
    return "speed_evaluations", fig, caption


def agreeing(checks: Sequence[Check]) -> str:
    """For how many settings MuJoCo and the same scheme in tmt make the same error, in words."""
    alike = [check.passed for check in checks if check.quantity.startswith("the same error as tmt's")]
    if not alike:
        return ""
    return (
        f"Of {len(alike)} settings of MuJoCo near the reference {sum(alike)} have the error of the same scheme in tmt, except "
        "for rounding. "
    )


def fewest(result: Result, scene: str, target: float) -> str:
    """How many evaluations RK4 and the 8th-order method need for an error, in words."""
    counts = {}
    for method in ("rk4", "dopri8"):
        rows = curves(result, scene).get(("tmt", method), [])
        good = [r["evaluations"] for r in rows if not r["diverged"] and value(r, "worst_error") <= target]
        counts[method] = min(good, default=None)
    if None in counts.values():
        return ""
    return f"For {target:.0e} {result.curves.get('unit', 'rad')} ({scene}) rk4 needs {counts['rk4']}, dopri8 {counts['dopri8']}. "


def draw_energy(result: Result) -> tuple[str, Figure, str]:
    """Energy error against time."""

    def numbers(rows: list[dict]) -> tuple:
        good = [r for r in rows if not r["diverged"] and r["energy_error_J"] <= MOST_ENERGY]
        return np.maximum([r["energy_error_J"] for r in good], LEAST_ENERGY), [1e3 * r["seconds"] for r in good]

    fig, named = panels(result, numbers, (20, 1e-19), "largest energy error on the grid, J",
                        f"time for {motion(rows_of_runs(result))} of motion, ms")  # fmt: skip
    least = []
    for engine, method in (("tmt", "semi_implicit_euler"), ("tmt", "rk4"), ("mujoco", "Euler"), ("mujoco", "RK4")):
        rows = [r for s in scenes(result) for r in curves(result, s).get((engine, method), []) if not r["diverged"]]
        if rows:
            least.append(f"{written(engine)} {method} {min(r['energy_error_J'] for r in rows):.1e} J")
    beyond = sum(
        not r["diverged"] and r["energy_error_J"] > MOST_ENERGY
        for r in rows_of_runs(result)
        if r["scene"] in scenes(result)
    )
    caption = "Largest error of the energy against time."
    caption += f" {beyond} above {MOST_ENERGY:g} J {'are' if beyond > 1 else 'is'} not drawn." if beyond else ""
    caption += f" The least in any scene: {'; '.join(least)}." if least else ""
    caption += named
    return "speed_energy", fig, caption


def panels(result: Result, numbers: Callable, limits: tuple, across: str, upward: str) -> tuple[Figure, str]:
    """One panel for each scene, a curve for each method; and where their names stand, as a sentence.

    numbers(rows): errors and costs that are drawn of a method's rows; limits: of the errors; across, upward: names of the axes.
    The names of the methods stand in one panel; their marks are the same in all.
    """
    names = scenes(result)
    columns = 2 if len(names) > 1 else 1
    lines = max(1, -(-len(names) // columns))
    high = 0.9 + 3.1 * lines
    fig = Figure(figsize=(WIDTH, high))  # laid out by hand, as names find their places on it
    fig.subplots_adjust(left=0.09, right=0.985, bottom=0.55 / high, top=1.0 - 0.55 / high, hspace=0.13, wspace=0.05)
    axes = fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for ax in axes.flat[len(names) :]:
        ax.set_visible(False)
    regular = result.curves.get("regular")
    of_names, engines = regular if regular in names else next(iter(names), None), {}
    for ax, scene in zip(axes.flat, names):
        ends = []
        for (engine, method), rows in curves(result, scene).items():
            errors, costs = numbers(rows)
            if not len(errors) or is_twice(engine, method):
                continue
            engines[engine] = None
            wide = {"linewidth": 2.5} if engine == "mujoco" else {}  # seen where the same scheme of tmt lies on it
            label, size = f"{written(engine)}: {in_full(engine, method)}", 3 + (engine == "mujoco")
            ax.plot(errors, costs, marker=marker(method), markersize=size, **line_of(engine) | wide, label=label)
            k = int(np.argmin(errors))
            ends.append((errors[k], costs[k], in_full(engine, method), colour_of(engine)))
        ax.set(xscale="log", yscale="log", title=plain(scene), xlim=limits)
        ax.set_xticks([10.0**k for k in range(0, -16, -3)])
        ax.minorticks_off()
        if scene == of_names:
            axes_of_names = ax, ends
    if of_names:
        name_ends(*axes_of_names, size=7.5)
    fig.supxlabel(f"{across} (finer to the right)", fontsize=9)
    fig.supylabel(upward, fontsize=9)
    handles = [Line2D([], [], **line_of(engine) | {"linewidth": 2.5}, label=written(engine)) for engine in engines]
    fig.legend(handles=handles, loc="upper center", ncols=4)
    return fig, f" The names of the methods stand in the panel {of_names}; their marks are the same in all." * (
        len(names) > 1
    )
