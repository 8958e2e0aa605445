"""Figures of failures beyond the linear limits: the resonance, silent failure, a minute of motion."""

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ...engines import LABELS
from ...judge.check import Result
from ...judge.words import scene_begins
from ...report.style import BLUE, GREEN, ORANGE, RED, WIDTH, name_ends
from ...robots import Robot
from .choice import coarsest_case, fraction, step_text
from .failure import LARGE_DEVIATION, RESONANCE, fold, gain_in_words, reset_in_words
from .figures_limits import look
from .growth import LINEAR_DEVIATION


def draw_edge(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """The nonlinear edge: tongues of growth over omega dt and the size of the perturbation; the resonance close up."""
    drawn, close = result.curves["edge"], result.curves["near"]
    maps, near, swings = drawn["grown"], close["grown"], close["x"]
    fig = Figure(figsize=(WIDTH, 5.6), layout="constrained")
    above, below = fig.subfigures(2, 1, height_ratios=(1.2, 1))
    axes = above.subplots(1, len(maps), sharey=True, squeeze=False)[0]
    for ax, (method, grown) in zip(axes, maps.items()):
        shown = np.clip(np.where(np.isfinite(grown), grown, 1e6), 1.0, 1e6)
        image = ax.pcolormesh(
            drawn["x"], drawn["y"], shown, norm=LogNorm(1, 1e6), cmap="cividis", shading="nearest", rasterized=True
        )
        ax.set(yscale="log", xlabel="ω dt of the stiffest mode", title=look(method.name)[2])
        ax.set_xticks([1.0, 1.25, 1.5, RESONANCE, 2.0], ["1", "1.25", "1.5", "√3", "2"])
        ax.grid(visible=False)
    axes[0].set_ylabel("perturbation, rad")
    above.colorbar(image, ax=axes, label=f"growth in {drawn['steps']} steps", extend="max").ax.minorticks_off()
    ax = below.subplots()
    looks = ((RED, "-", ""), (BLUE, "--", ""), (RED, "", "o"), (BLUE, "", "s"))
    for (method, grown), (colour, dash, mark) in zip(near.items(), looks):
        values = np.clip(np.where(np.isfinite(grown[1]), grown[1], 1e9), 1.0, 1e9)
        name = method.label.replace("semi_implicit_euler", "semi-implicit Euler")
        ax.semilogy(
            swings, values, linestyle=dash or "none", marker=mark, mfc="none", markersize=5, color=colour, label=name
        )
    ax.semilogy(
        swings,
        next(iter(near.values()))[0],
        ":",
        color="black",
        label=f"{next(iter(near)).label}, from {LINEAR_DEVIATION:g} rad",
    )
    ax.set(
        xlabel="ω dt",
        ylabel=f"growth in {close['steps']} steps,\nfrom {LARGE_DEVIATION:g} rad",
        xlim=(swings[0], swings[-1]),
        ylim=(0.5, 5e9),
    )
    ax.set_xticks([1.72, RESONANCE, 1.74, 1.75], ["1.72", "√3", "1.74", "1.75"])
    ax.legend(loc="upper left")
    worst = "; ".join(
        f"{method.label} {fold(grown[0].max())} and {fold(grown[1].max())}" for method, grown in near.items()
    )
    centre = result.curves["looked at"]["centre"]
    caption = (
        f"The nonlinear edge at {centre}. Above: growth over ω dt and the size of the perturbation; the linear limit is 2. "
        f"Below: near √3, where a swing takes three steps. The largest growth there in {close['steps']} steps, "
        f"from {LINEAR_DEVIATION:g} and from {LARGE_DEVIATION:g} rad: {worst}. Divergence is drawn at 1e9."
    )
    return "stability_edge", fig, caption


def draw_silent(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Runs that fail without a word: reset by MuJoCo, and `implicit` gaining energy."""
    reset, gain = (result.curves["silent"][key] for key in ("reset", "gain"))
    fig = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    grid = fig.add_gridspec(2, 2, height_ratios=(1.5, 1))
    left, right = fig.add_subplot(grid[:, 0]), fig.add_subplot(grid[0, 1])
    under = fig.add_subplot(grid[1, 1], sharex=right)
    left.plot(reset["t"], reset["energy"] - reset["energy"][0], ".-", color=BLUE, markersize=3, linewidth=0.8)
    left.set_yscale("symlog", linthresh=10.0)
    top = np.nanmax(np.abs(reset["energy"] - reset["energy"][0]))
    left.set_yticks([tick for tick in (0, 1e1, 1e4, 1e7, 1e10, 1e13) if tick <= max(top, 10.0)])
    for k, t in enumerate(reset["t"][1:][np.diff(reset["clock"]) <= 0.0]):
        left.axvline(t, color=ORANGE, linewidth=1.5, label="reset by MuJoCo" if k == 0 else None)
    if reset["caught_in_it_s"] is not None:
        left.axvline(reset["caught_in_it_s"], color=RED, linestyle="--", label="caught here")
    left.axhline(gain["range"], color="black", linewidth=0.8, linestyle=":", label="range of the potential")
    left.set(
        xlabel="time, s",
        ylabel="energy gained, J",
        xlim=(0, reset["t"][-1]),
        title="MuJoCo's Euler, automatic reset on",
    )
    right.plot(gain["t"], gain["energy"] - gain["energy"][0], ".-", color=BLUE, markersize=4, linewidth=0.8)
    right.axhline(gain["range"], color="black", linewidth=0.8, linestyle=":")
    right.set(ylabel="energy gained, J", title="MuJoCo's implicit")
    right.tick_params(labelbottom=False)
    under.plot(gain["t"], gain["smallest"], ".-", color=GREEN, markersize=3, linewidth=0.8)
    under.axhline(0.0, color="black", linewidth=0.6)
    under.set(xlabel="time, s", ylabel="smallest eigen-\nvalue, kg m2", xlim=(0, gain["t"][-1]))
    for ax in (right, under):
        if gain["caught_in_it_s"] is not None:
            ax.axvline(gain["caught_in_it_s"], color=RED, linestyle="--")
    fig.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    case = reset["case"]
    caption = (
        f"{scene_begins(case.name, case.robot)}, by MuJoCo at dt = {fraction(case.duration, case.scene.dt)} s. "
        f"Left: {reset_in_words(reset)} Right: {gain_in_words(gain)}"
    )
    return "stability_silent", fig, caption


def draw_minutes(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Energy over a minute of free motion, method by method, at a coarse and a fine step."""
    runs, coarse = result.curves["minutes"], coarsest_case(robot)
    steps = sorted({run["row"]["dt_s"] for run in runs}, reverse=True)
    seconds = runs[0]["seconds"]
    fig = Figure(figsize=(WIDTH, 3.8))  # laid out by hand, as names find their places on it
    fig.subplots_adjust(left=0.085, right=0.985, bottom=0.13, top=0.8, wspace=0.18)
    axes = fig.subplots(1, len(steps), sharex=True, squeeze=False)[0]
    gone = {}
    bound = result.curves["silent"]["gain"]["range"]
    for run in runs:
        row = run["row"]
        ax = axes[steps.index(row["dt_s"])]
        swing = max(1, round(2.0 / (run["t"][1] - run["t"][0])))  # the largest of 2 s: swings would fill the figure
        starts = np.arange(1, len(run["t"]), swing)
        top = np.fmax.reduceat(np.abs(run["off"]), starts)
        at = run["t"][starts]
        colour, dash, name = look(run["scheme"])
        if row["engine"] == "tmt":
            ax.semilogy(at, top, linestyle=dash, color=colour, label=name)
            if row["diverged_at_s"] is not None:
                ax.plot(row["diverged_at_s"], bound, "x", color=colour, markersize=7, markeredgewidth=1.8)
                gone.setdefault(row["dt_s"], []).append((row["diverged_at_s"], bound, name, colour))
        else:
            label = f"{LABELS[row['engine']]}, same scheme" if run["scheme"] == "rk4" else None
            ax.semilogy(at[::3], top[::3], "o", mfc="none", markersize=3.5, color=colour, label=label)
    for ax, dt in zip(axes, steps):
        ax.set(xlabel="time, s", xlim=(0, seconds), title=f"dt = {step_text(coarse, dt)} s")
        name_ends(ax, gone.get(dt, []))
    if gone:
        axes[-1].plot([], [], "x", color="black", markersize=7, markeredgewidth=1.8, label="diverged")
    axes[0].set_ylabel("largest |energy - energy at start|, J")
    fig.legend(*axes[-1].get_legend_handles_labels(), loc="upper center", ncols=5, fontsize=8)
    ours = [run["row"] for run in runs if run["row"]["engine"] == "tmt"]
    texts = []
    for dt in steps:
        names = {
            kind: [look(row["method"])[2] for row in ours if (row["dt_s"], row["energy"]) == (dt, kind)]
            for kind in ("bounded", "drifts", "diverges")
        }
        by_kind = "; ".join(f"{kind}: {', '.join(found)}" for kind, found in names.items() if found)
        texts.append(f"At dt = {dt:.3g} s {by_kind}")
    caption = (
        f"{seconds:g} s of {ours[0]['scene']}: how far the energy is from where it started. {'. '.join(texts)}. Crosses: the "
        "run has diverged, its gain beyond its bound."
    )
    return "stability_energy", fig, caption
