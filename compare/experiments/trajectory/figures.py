"""Figures of runs: angles and rates against time, differences in their bands, drift, growth of errors."""

from itertools import cycle

import numpy as np
from matplotlib.figure import Figure

from .draw import BLUE, GREEK, GREEN, GREY, HINGES, ORANGE, RED, WIDTH
from .drift import DURATION, found_order
from .horizon import FEW
from .leaving import words
from .motion import step
from .told import agreement, rad

TWINS = (("semi_implicit_euler", "Euler"), ("implicit", "implicit"), ("rk4", "RK4"))
DASHES = {"Euler": (BLUE, "-"), "implicit": (RED, "--"), "RK4": (GREEN, "-.")}
ZERO = 1e-18  # rad: where differences of exactly zero are drawn


def over_time(ax, t, ours, theirs, hinges):
    """Hinge angles or rates against time: lines for TMT, up to 65 marks for MuJoCo."""
    every = slice(None, None, max(1, len(t) // 64))
    marks = {"marker": "o", "linestyle": "none", "mfc": "none", "markersize": 2.5}
    for i, (hinge, colour, dash) in enumerate(style for style in HINGES if style[0] in hinges):
        ax.plot(t, ours[:, i], dash, color=colour, label=f"{GREEK[hinge]}, TMT")
        ax.plot(t[every], theirs[every, i], color=colour, clip_on=False, **marks)
    ax.plot([], [], color="black", label="MuJoCo", **marks)


def held(result, scene, name):
    """The assignment's figure of a held posture: hinge angles against time."""
    curve = result.curves["runs"][(scene, "rk4", 64)]
    hinges = [hinge for hinge, *_ in HINGES]
    fig = Figure(figsize=(WIDTH, 2.9), layout="constrained")
    ax = fig.subplots()
    over_time(ax, curve["t"], np.degrees(curve["tmt"][0]), np.degrees(curve["mujoco"][0]), hinges)
    ax.set(xlabel="time, s", ylabel="hinge angle, deg", xlim=(0, curve["t"][-1]))
    fig.legend(loc="outside upper center", ncols=4)
    number = name.removeprefix("assignment_figure_")
    ours, theirs = result.curves["errors"][scene]
    end = f"{curve['t'][-1]:g}"
    caption = (
        f"The assignment's Figure {number} redrawn: {scene} with TMT's torque in both engines, RK4, "
        f"dt = {end}/{len(curve['t']) - 1} s. In {end} s the arm of TMT {words(curve['left']['TMT'])}, that of MuJoCo "
        f"{words(curve['left']['MuJoCo'])}. "
        f"The true motion is rest: of that TMT is at most {rad(ours)} off, MuJoCo {rad(theirs)}; while judged, to "
        f"{curve['judged_until_s']:.2f} s, they are {agreement(curve):.1e} rad apart."
    )
    return name, fig, caption


def run(result, scene):
    """One scene under each scheme: angles, rates, and the difference under its band; grey: not judged."""
    steps = max((n for name, _, n in result.curves["runs"] if name == scene.name and n <= 16 * scene.steps))
    fig = Figure(figsize=(WIDTH, 6.2))  # laid out by hand: nine axes take a second otherwise
    fig.subplots_adjust(left=0.105, right=0.985, bottom=0.075, top=0.87, hspace=0.12, wspace=0.08)
    axes = fig.subplots(3, len(TWINS), sharex=True, sharey="row")
    until = []
    for column, (twin, title) in zip(axes.T, TWINS):
        c = result.curves["runs"][(scene.name, twin, steps)]
        for row, ax in enumerate(column[:2]):
            over_time(ax, c["t"], c["tmt"][row], c["mujoco"][row], scene.hinges)
            ax.ticklabel_format(axis="y", scilimits=(-2, 3))
        column[0].set_title(f"{title}, {step(scene, steps)}")
        difference = np.abs(c["tmt"][0] - c["mujoco"][0]).max(axis=1)
        ulp = np.abs(c["tmt"][0] - c["ulp"]).max(axis=1)
        band = np.where(c["band"] < 1e3, c["band"], np.nan)
        lines = column[2]
        lines.semilogy(c["t"][1:], np.maximum(ulp[1:], ZERO), color=BLUE, linewidth=0.8, label="TMT, start 1 ulp away")
        lines.semilogy(c["t"][1:], np.maximum(difference[1:], ZERO), color="black", linewidth=1, label="TMT to MuJoCo")
        lines.semilogy(c["t"][:: c["every"]][1:], band[1:], "--", color=ORANGE, label="band of rounding")
        if c["judged_until_s"] < scene.duration:
            lines.axvspan(c["judged_until_s"], scene.duration, color=GREY, alpha=0.15)
        lines.set(xlabel="time, s", xlim=(0, scene.duration))
        until.append(f"{title} to {c['judged_until_s']:.2f} s")
    for ax, label in zip(axes[:, 0], ("angle, rad", "rate, rad/s", "angle: difference, rad")):
        ax.set_ylabel(label)
    handles = [ax.get_legend_handles_labels() for ax in (axes[0, 0], axes[2, 0])]
    fig.legend(handles[0][0] + handles[1][0], handles[0][1] + handles[1][1], loc="upper center", ncols=4)
    rows = [row for row in result.rows if row["scene"] == scene.name and row["level"] == "open loop"]
    diverged = [row for row in rows if row["diverged_at_s"] is not None]
    ended = sorted({f"{row['engine_integrator']} at dt = {row['dt_s']:.3g} s" for row in diverged})
    used = [row["difference_over_band"] for row in rows if row["difference_over_band"] is not None]
    most = f"at most {max(used):.1e}" if used else "no measured part"
    errors = result.curves["errors"].get(scene.name)
    caption = (
        f"{scene.name[0].upper()}{scene.name[1:]}. While judged ({', '.join(until)}; grey: not judged) the engines' difference "
        f"is {most} of the band, over all steps and integrators. "
        + (
            f"With {scene.steps} steps of RK4 TMT is {rad(errors[0])} and MuJoCo {rad(errors[1])} from the true motion. "
            if errors
            else ""
        )
        + (f"MuJoCo's run diverged: {', '.join(ended)}. " if ended else "")
        + f"Differences of exactly zero are drawn at {ZERO:g}."
    )
    return "trajectory_" + scene.name.replace(", ", "_").replace(" ", "_"), fig, caption


def drift(result):
    """Drift of energy and momentum against the step size, both engines."""
    drifts, steps = (result.curves["drift"][key] for key in ("drifts", "steps"))
    lines = -(-len(drifts) // 3)
    fig = Figure(figsize=(WIDTH, 0.8 + 1.8 * lines), layout="constrained")
    axes = fig.subplots(lines, 3, sharex=True, sharey=True, squeeze=False)
    for ax in axes.flat[len(drifts) :]:
        ax.set_visible(False)
    for ax, ((scene, quantity, unit), of_scene) in zip(axes.flat, drifts.items()):
        for integrator, engines in of_scene.items():
            colour, dash = DASHES[integrator]
            dt = DURATION / np.array(steps[integrator])
            ax.loglog(dt, engines["TMT"], dash, color=colour, label=f"{integrator}, TMT")
            label = "MuJoCo" if integrator == "Euler" else None
            ax.loglog(dt, engines["MuJoCo"], "o", mfc="none", color=colour, label=label)
        ax.set_title(f"{scene}: {quantity}, {unit}", fontsize=8)
        ax.set_xticks([2e-4, 1e-3, 4e-3], ["2e-4", "1e-3", "4e-3"])
        ax.minorticks_off()
    fig.supylabel(f"largest drift in {DURATION:g} s", fontsize=9)
    fig.supxlabel("dt, s", fontsize=9)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return "trajectory_drift", fig, drift_caption(drifts, steps)


def drift_caption(drifts, steps) -> str:
    """At which order the drift falls, how large that of the energy is, and how alike the engines are in it."""
    orders, worst = [], []
    for integrator in DASHES:
        of_engine = {name: [of[integrator][name] for of in drifts.values()] for name in ("TMT", "MuJoCo")}
        spans = [f"{name} {span([found_order(v) for v in values], '.2f')}" for name, values in of_engine.items()]
        orders.append(f"{integrator}: {', '.join(spans)}")
        energy = {name: max(of[integrator][name][-1] for (_, what, _), of in drifts.items() if what == "energy")
                  for name in of_engine}  # fmt: skip
        told = ", ".join(f"{name} {value:.1e} J" for name, value in energy.items())
        worst.append(f"{integrator} at dt = 1/{steps[integrator][-1] / DURATION:g} s: {told}")
    pairs = [
        pair for of in drifts.values() for engines in of.values() for pair in zip(engines["TMT"], engines["MuJoCo"])
    ]
    ratios = [theirs / ours if ours else np.nan for ours, theirs in pairs]
    return (
        "Drift of what should be constant (lines: TMT; marks: MuJoCo). The order at which it falls at the finest step, "
        f"{'; '.join(orders)}. Largest of energy, {'; '.join(worst)}. MuJoCo's drift over TMT's: {span(ratios, '.3g')}."
    )


def span(values, digits) -> str:
    """The least and the largest of some numbers in words."""
    values = [value for value in values if np.isfinite(value)]
    return f"{min(values):{digits}} to {max(values):{digits}}" if values else "no number"


def growth(result):
    """Growth of a small difference over the whole time, scene by scene."""
    t, curves = (result.curves["growth"][key] for key in ("t", "curves"))
    fig = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    ax = fig.subplots()
    colours = cycle((BLUE, RED, GREEN, ORANGE, "#CC79A7", "#56B4E9", GREY, "black"))
    ends = sorted(curves, key=lambda name: curves[name][-1])
    places = {}
    for name in ends:  # labels at the ends of the curves, not over each other
        places[name] = max(min(curves[name][-1], 60.0), max(places.values(), default=-20.0) + 5.5)
    for (name, grown), colour in zip(curves.items(), colours):
        ax.plot(t, grown, color=colour)
        ax.text(t[-1] * 1.01, places[name], name, color=colour, va="center", fontsize=8)
    for digits, text in ((16, "doubles"), (30, "30 digits")):
        ax.axhline(digits, color="black", linewidth=0.8, linestyle=":")
        ax.text(0.5, digits + 0.8, text, fontsize=8)
    ax.set(xlabel="time, s", ylabel="log10 of the growth", xlim=(0, t[-1]), ylim=(-20, 65))
    few = int(np.searchsorted(t, FEW))
    told = "; ".join(f"{name}: 10^{curves[name][few]:.1f} and 10^{curves[name][-1]:.0f}" for name in reversed(ends))
    caption = (
        f"How much a small difference of the state grows in {t[few]:g} s and in {t[-1]:g} s: {told}. Where a curve crosses a "
        "dotted line, numbers of so many digits know nothing of the state."
    )
    return "trajectory_growth", fig, caption
