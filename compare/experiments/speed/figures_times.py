"""Figures of speed against accuracy."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from ...engines import LABELS
from ...judge.check import Check, Result
from ...judge.units import value
from ...judge.words import capital
from ...report.style import BLUE, GREEN, GREY, ORANGE, PINK, WIDTH, file_name

COLOURS = {"mujoco": ORANGE, "tmt": BLUE, "scipy": GREEN, "heyoka": PINK}
SAME_BITS = ("implicitfast", "discrete")  # as Euler's
MARKS = "osD^v<>PXph*"
COARSE_END, FINE_END = 3.0, 3e-16  # rad: the axis of errors runs from coarse to fine
NO_RESULT = 1.0  # rad: a run that is farther off is none
OF_DIVERGED = 30.0  # rad: where what has diverged is drawn


def written(engine: str) -> str:
    """An engine's name in the figures: tmt's is that of its package here."""
    return "tmt" if engine == "tmt" else LABELS.get(engine, engine)


def colour_of(engine: str) -> str:
    return COLOURS.get(engine, GREY)


def least_in_words(result: Result, scene: str) -> str:
    """What the least error of a scene is, in the legend."""
    return "what is known of the reference" if scene in result.curves.get("doubles", ()) else "rounding: eps × growth"


def rows_of_runs(result: Result) -> list[dict]:
    """The rows that are runs, not those of an engine that is not there."""
    return [row for row in result.rows if row["why_not"] is None]


def runs_of(result: Result, scene: str) -> list[dict]:
    return [row for row in rows_of_runs(result) if row["scene"] == scene]


def curves(result: Result, scene: str) -> dict:
    """The rows of a scene by (engine, method), in the order of their settings."""
    by_method = {}
    for row in runs_of(result, scene):
        by_method.setdefault((row["engine"], row["method"]), []).append(row)
    return by_method


def scenes(result: Result) -> list[str]:
    """The scenes with all their methods, not those of smaller models."""
    return list(result.curves.get("floors", ()))


def marker(method: str) -> str:
    """A mark that is the method's in every figure."""
    names = ("rk4", "dopri8", "dopri8_adaptive", "explicit_euler", "semi_implicit_euler", "implicit", "implicit_midpoint",
             "gauss_legendre_4")  # fmt: skip
    others = ("RK4", "DOP853", "RK45", "implicitfast", "Euler", "discrete", "Radau", "LSODA", "Taylor")
    for group in (names, others):
        if method in group:
            return MARKS[group.index(method) % len(MARKS)]
    return "o"


def pareto(rows: list[dict], of: str) -> list[dict]:
    """The rows that nothing beats in both error and cost, from the cheapest to the most exact."""
    front, least = [], np.inf
    good = (r for r in rows if not r["diverged"] and value(r, "worst_error") < NO_RESULT)
    for row in sorted(good, key=lambda r: (r[of], value(r, "worst_error"))):
        if value(row, "worst_error") < least:
            front.append(row)
            least = value(row, "worst_error")
    return front


def draw_times(result: Result, scene: str, beginning: str = "") -> tuple[str, Figure, str]:
    """One scene: worst error against time, a curve for each method, the Pareto front marked."""
    fig = Figure(figsize=(WIDTH, 5.2), layout="constrained")
    ax = fig.subplots()
    by_method = curves(result, scene)
    ends = []
    for (engine, method), rows in by_method.items():
        colour = colour_of(engine)
        good = [r for r in rows if not r["diverged"]]
        errors, spent = visible(good), [1e3 * r["seconds"] for r in good]
        ax.plot(errors, spent, marker=marker(method), markersize=3.5, linewidth=1, color=colour)
        if good:
            k = int(np.argmin(errors))
            if engine != "mujoco" or method not in SAME_BITS:
                name = ", ".join([method, *SAME_BITS]) if (engine, method) == ("mujoco", "Euler") else method
                ends.append([errors[k], spent[k], name, colour])
    front = pareto([r for rows in by_method.values() for r in rows], "seconds")
    ax.plot(
        visible(front), [1e3 * r["seconds"] for r in front], "o", markersize=9, markerfacecolor="none",
        markeredgecolor="black", label="nothing is both faster and more exact",
    )  # fmt: skip
    for engine in dict.fromkeys(engine for engine, _ in by_method):
        ax.plot([], [], color=colour_of(engine), linewidth=3, label=written(engine))
    ax.axvline(result.curves["floors"][scene], color=GREY, linestyle=":", label=least_in_words(result, scene))
    ax.set(xscale="log", yscale="log", xlim=(OF_DIVERGED * 3, FINE_END / 30))
    ax.set(
        xlabel=f"worst error on the way, {result.curves.get('unit', 'rad')} (finer to the right)",
        ylabel=f"time for {motion(runs_of(result, scene))} of motion, ms",
    )
    labelled(ax, ends)
    lost = [r for rows in by_method.values() for r in rows if r["diverged"]]
    for row in lost:
        ax.plot(OF_DIVERGED, 1e3 * row["seconds"], "x", color=colour_of(row["engine"]), markersize=6)
    if lost:
        ax.plot([], [], "x", color="black", label="diverged (no error)")
    fig.legend(loc="outside upper center", ncols=3, fontsize=8)
    caption = f"{beginning or capital(scene)}: {spoken(result, scene)}"
    if lost:
        caption += f" {len(lost)} {'settings diverge' if len(lost) > 1 else 'setting diverges'} (crosses at the left)."
    return file_name("speed", scene), fig, caption


def visible(rows: list[dict]) -> np.ndarray:
    """The worst errors of rows, as far as the axis goes, rad."""
    return np.clip([value(r, "worst_error") for r in rows], FINE_END, COARSE_END)


def motion(rows: list[dict]) -> str:
    """How long the motion is that was timed."""
    times = {round(r["dt_s"] * r["steps"], 9) for r in rows if r["dt_s"]}
    return " or ".join(f"{t:g} s" for t in sorted(times)) or "the scene"


def labelled(ax: Axes, ends: list[list]) -> None:
    """The name of each curve beside its most exact point, none over another."""
    ends.sort(key=lambda end: end[1])
    placed = []
    for error, time, name, colour in ends:
        y = np.log10(time)
        while any(abs(np.log10(error / e)) < 2.9 and abs(y - p) < 0.17 for e, p in placed):
            y += 0.04
        placed.append((error, y))
        ax.annotate(
            name, (error, time), (error / 1.8, 10**y), fontsize=7, color=colour, va="center",
            path_effects=[withStroke(linewidth=2, foreground="white")],
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.4} if 10**y > 1.3 * time else None,
        )  # fmt: skip


def spoken(result: Result, scene: str) -> str:
    """The message of a scene: how many times faster at the errors asked for."""
    unit = result.curves.get("unit", "rad")
    lines = [line for line in result.tables["what_should_i_use"] if line["scene"] == scene and line["ratio"]]
    slower, faster = (
        ", ".join(
            f"{ratio:.{0 if ratio >= 3.0 else 1}f} times as long for {value(line, 'target'):.0e} {unit}"
            for line in lines
            if (ratio := line["ratio"] if longer else 1.0 / line["ratio"]) > 1.0 or (longer and ratio == 1.0)
        )
        for longer in (True, False)
    )
    said = [f"MuJoCo's cheapest setting takes {slower} as tmt's"] if slower else []
    said += [f"tmt's cheapest setting takes {faster} as MuJoCo's"] if faster else []
    return f"{'; '.join(said) or 'no error asked for is reached by both MuJoCo and tmt'}."


def draw_evaluations(result: Result) -> tuple[str, Figure, str]:
    """Worst error against evaluations of the right-hand side: independent of the machine and of who wrote the kernel."""
    fig, axes = panels(result)
    for ax, scene in zip(axes, scenes(result)):
        for (engine, method), rows in curves(result, scene).items():
            good = [r for r in rows if not r["diverged"] and r["evaluations"]]
            if good and not (engine == "mujoco" and method in SAME_BITS):
                errors = np.clip([value(r, "worst_error") for r in good], FINE_END, COARSE_END)
                line(ax, engine, method, errors, [r["evaluations"] for r in good])
        ax.set(xlim=(COARSE_END * 2, 2e-16), ylim=(40, 2e6))
    fig.supylabel("evaluations of the right-hand side", fontsize=9)
    finish(fig, axes, f"worst error on the way, {result.curves.get('unit', 'rad')}")
    caption = (
        "The same errors against evaluations of the equations of motion, which do not depend on the machine. "
        f"{agreeing(result.checks)}{fewest(result, result.curves.get('regular'), 1e-9)}Of an implicit method an evaluation with "
        "its derivatives counts once; a method without evaluations, as heyoka's Taylor, is not drawn."
    )
    return "speed_evaluations", fig, caption


def agreeing(checks: Sequence[Check]) -> str:
    """For how many settings MuJoCo and the same scheme in tmt make the same error, in words."""
    alike = [check.passed for check in checks if check.quantity.startswith("the same error as tmt's")]
    if not alike:
        return ""
    return (
        f"Of {len(alike)} settings of MuJoCo near the reference {sum(alike)} have the error of the same scheme in tmt, but for "
        "rounding. "
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
    fig, axes = panels(result)
    for ax, scene in zip(axes, scenes(result)):
        for (engine, method), rows in curves(result, scene).items():
            good = [r for r in rows if not r["diverged"]]
            if good and not (engine == "mujoco" and method in SAME_BITS):
                errors = np.clip([r["energy_error_J"] for r in good], 1e-15, 10)
                line(ax, engine, method, errors, [1e3 * r["seconds"] for r in good])
        ax.set(xlim=(20, 3e-16))
    fig.supylabel(f"time for {motion(rows_of_runs(result))} of motion, ms", fontsize=9)
    finish(fig, axes, "largest energy error on the grid, J")
    least = []
    for engine, method in (("tmt", "semi_implicit_euler"), ("tmt", "rk4"), ("mujoco", "Euler"), ("mujoco", "RK4")):
        rows = [r for s in scenes(result) for r in curves(result, s).get((engine, method), []) if not r["diverged"]]
        if rows:
            least.append(f"{written(engine)} {method} {min(r['energy_error_J'] for r in rows):.1e} J")
    caption = "Largest error of the energy against time."
    caption += f" The least in any scene: {'; '.join(least)}." if least else ""
    return "speed_energy", fig, caption


def panels(result: Result) -> tuple[Figure, list[Axes]]:
    """One panel for each scene."""
    names = scenes(result)
    columns = 2 if len(names) > 1 else 1
    lines = max(1, -(-len(names) // columns))
    fig = Figure(figsize=(WIDTH, 1.2 + 2.6 * lines), layout="constrained")
    axes = list(fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).flat)
    for ax, name in zip(axes, names):
        ax.set(xscale="log", yscale="log", title=name)
    return fig, axes


def line(ax: Axes, engine: str, method: str, errors: np.ndarray, costs: Sequence[float]) -> None:
    name, colour = written(engine), colour_of(engine)
    dash = "-" if engine in ("mujoco", "tmt") else "--"
    wide = 2.5 if engine == "mujoco" else 0.9  # seen where the same scheme of tmt lies on it
    label = f"{name}: {'Euler, implicitfast, discrete' if engine == 'mujoco' and method == 'Euler' else method}"
    size = 3 + (engine == "mujoco")
    ax.plot(errors, costs, dash, marker=marker(method), markersize=size, linewidth=wide, color=colour, label=label)


def finish(fig: Figure, axes: Sequence[Axes], label: str) -> None:
    fig.supxlabel(f"{label} (finer to the right)", fontsize=9)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=7)
