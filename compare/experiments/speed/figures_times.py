"""Figures of speed against accuracy: one scene, a curve for each method."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...engines import LABELS
from ...judge.check import Result
from ...judge.units import value
from ...judge.words import capital
from ...report.style import BLUE, GREEN, GREY, ORANGE, PINK, WIDTH, file_name, name_ends

COLOURS = {"mujoco": ORANGE, "tmt": BLUE, "scipy": GREEN, "heyoka": PINK}
SAME_BITS = ("implicitfast", "discrete")  # as Euler's
MARKS = "osD^v<>PXph*"
COARSE_END, FINE_END = 3.0, 3e-16  # rad: the axis of errors runs from coarse to fine
NO_RESULT = 1.0  # rad: a run that is farther off is none
OF_DIVERGED, COLUMN = 30.0, 2.0  # rad: where what has diverged is drawn, and the ratio to the next method's place
LINES_OF_ENGINES = {"mujoco": ("-", 1.6), "tmt": ("-", 1.0), "scipy": ("--", 1.0), "heyoka": ("-.", 1.0)}  # dash, width


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
    fig = Figure(figsize=(WIDTH, 5.6))  # laid out by hand, as names find their places on it
    fig.subplots_adjust(left=0.085, right=0.985, bottom=0.085, top=0.905)
    ax = fig.subplots()
    by_method = curves(result, scene)
    ends = []
    for (engine, method), rows in by_method.items():
        good = seen(rows)
        errors, spent = visible(good), [1e3 * r["seconds"] for r in good]
        ax.plot(errors, spent, marker=marker(method), markersize=3.5, **line_of(engine))
        if good and not is_twice(engine, method):
            k = int(np.argmin(errors))
            ends.append((errors[k], spent[k], in_full(engine, method), colour_of(engine)))
    front = pareto([r for rows in by_method.values() for r in rows], "seconds")
    ax.plot(
        visible(front), [1e3 * r["seconds"] for r in front], "o", markersize=9, markerfacecolor="none",
        markeredgecolor="black", label="nothing is both faster and more exact",
    )  # fmt: skip
    engines = list(dict.fromkeys(engine for engine, _ in by_method))
    for engine in engines:
        ax.plot([], [], **line_of(engine) | {"linewidth": 2.5}, label=written(engine))
    ax.axvline(result.curves["floors"][scene], color=GREY, linestyle=":", label=least_in_words(result, scene))
    lost, widest = draw_diverged(ax, by_method)
    ax.set(xscale="log", yscale="log", xlim=(widest, FINE_END / 30))
    ax.set(
        xlabel=f"worst error on the way, {result.curves.get('unit', 'rad')} (finer to the right)",
        ylabel=f"time for {motion(runs_of(result, scene))} of motion, ms",
    )
    ax.minorticks_off()
    ax.set_xticks([10.0**k for k in range(0, -17, -2)])
    name_ends(ax, ends)
    handles, labels = ax.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda k: labels[k] not in map(written, engines))  # the engines first
    fig.legend(*([of[k] for k in order] for of in (handles, labels)), loc="upper center", ncols=4, fontsize=8)
    caption = f"{beginning or capital(scene)}: {spoken(result, scene)}"
    if lost:
        count, whose = sum(lost.values()), ", ".join(f"{name} {number}" for name, number in lost.items())
        caption += f" {count} {'settings diverge' if count > 1 else 'setting diverges'} (at the left): {whose}."
    return file_name("speed", scene), fig, caption + unseen_in_words(result, runs_of(result, scene))


def draw_diverged(ax: Axes, by_method: dict) -> tuple[dict[str, int], float]:
    """What has diverged, at the left, each method's own mark in a column of its own.

    How many settings of each method have, and where the axis of errors begins.
    """
    lost, place = {}, OF_DIVERGED
    for (engine, method), rows in by_method.items():
        gone = [r for r in rows if r["diverged"]]
        if not gone:
            continue
        lost[f"{written(engine)}'s {method}"] = len(gone)
        if is_twice(engine, method):
            continue
        times = [1e3 * r["seconds"] for r in gone]
        ax.plot(
            [place] * len(gone), times, marker(method), mfc="white", markersize=5, color=colour_of(engine),
            label=f"_{written(engine)} {method}, diverged",
        )  # fmt: skip
        place *= COLUMN
    if lost:
        ax.axvspan(OF_DIVERGED / 2.0, 2.0 * place, color=(GREY, 0.15), linewidth=0, label="diverged: no error")
    return lost, 2.0 * place


def is_twice(engine: str, method: str) -> bool:
    """Whether MuJoCo's method gives the bits of another one, which is drawn."""
    return engine == "mujoco" and method in SAME_BITS


def in_full(engine: str, method: str) -> str:
    """A method's name, with those that give its bits."""
    return ", ".join([method, *SAME_BITS]) if (engine, method) == ("mujoco", "Euler") else method


def line_of(engine: str) -> dict:
    """How an engine's lines look."""
    dash, wide = LINES_OF_ENGINES.get(engine, ("-", 1.0))
    return {"color": colour_of(engine), "linestyle": dash, "linewidth": wide}


def seen(rows: list[dict]) -> list[dict]:
    """The rows that are drawn at their errors: what is farther off than the axis goes, has no error that says anything."""
    return [r for r in rows if not r["diverged"] and value(r, "worst_error") <= COARSE_END]


def unseen_in_words(result: Result, rows: list[dict]) -> str:
    """How many of some rows are not drawn, as a sentence; nothing where all are."""
    count = sum(not r["diverged"] for r in rows) - len(seen(rows))
    unit = result.curves.get("unit", "rad")
    one = (
        f"{count} setting{'s' if count > 1 else ''} more than {COARSE_END:g} {unit} off {'are' if count > 1 else 'is'}"
    )
    return f" {one} not drawn." if count else ""


def visible(rows: list[dict]) -> np.ndarray:
    """The worst errors of rows, as far as the axis goes, rad."""
    return np.clip([value(r, "worst_error") for r in rows], FINE_END, COARSE_END)


def motion(rows: list[dict]) -> str:
    """How long the motion is that was timed."""
    times = {round(r["dt_s"] * r["steps"], 9) for r in rows if r["dt_s"]}
    return " or ".join(f"{t:g} s" for t in sorted(times)) or "the scene"


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
