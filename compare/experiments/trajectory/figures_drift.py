"""Figures of what a whole run does: the drift of what should be constant, the growth of small differences."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.figure import Figure

from ...engines import LABELS
from ...judge.check import Result
from ...report.style import GREY, LINES, WIDTH, in_letters, plain, spread, text_width
from .drift import DRIFT_DURATION, found_order
from .horizon import CARRIED, early, power

SCHEME_LINES = dict(zip(("semi_implicit_euler", "implicit", "rk4"), LINES))  # colour and dash
SCENE_LINES = (*LINES, (GREY, "-"), ("black", (0, (3, 1, 1, 1, 1, 1))))
NAMES_BEGIN = 0.045  # after the end of the curves, as a share of the time


def draw_drift(result: Result) -> tuple[str, Figure, str]:
    """Drift of energy and momentum against the step size, both engines."""
    drifts, steps = (result.curves["drift"][key] for key in ("drifts", "steps"))
    lines = -(-len(drifts) // 3)
    fig = Figure(figsize=(WIDTH, 0.8 + 2.0 * lines), layout="constrained")
    axes = fig.subplots(lines, 3, sharex=True, sharey=True, squeeze=False)
    for ax in axes.flat[len(drifts) :]:
        ax.set_visible(False)
    for ax, ((scene, quantity, unit), of_scene) in zip(axes.flat, drifts.items()):
        for mark, (method, engines) in zip(cycle("osD"), of_scene.items()):
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
        of_energy = ", ".join(
            f"{LABELS[name]} {f'{value:.1e} J' if np.isfinite(value) else 'no number'}"
            for name, value in energy.items()
        )
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
    fig = Figure(figsize=(WIDTH, 4.2))
    longest = max(text_width(plain(name), 9.0) for name in curves) / (72.0 * WIDTH)
    fig.subplots_adjust(
        left=0.085, right=max(0.5, (0.985 - longest + NAMES_BEGIN * 0.085) / (1.0 + NAMES_BEGIN)), bottom=0.11, top=0.97
    )
    ax = fig.subplots()
    last = {name: grown[np.isfinite(grown)][-1] for name, grown in curves.items()}
    ends = sorted(last, key=last.get)
    low, high = (edge(10.0 * edge(value / 10.0)) for edge, value in (
        (np.floor, min(last.values()) - 1.0), (np.ceil, max(last.values()) + 1.0)))  # fmt: skip
    low, high = min(low, -5.0), max(high, 20.0)
    apart = 0.052 * (high - low)  # the height of a name
    places = dict(zip(last, spread(list(last.values()), apart, low + apart / 2, high - apart / 2)))
    for (name, grown), (colour, dash) in zip(curves.items(), cycle(SCENE_LINES)):
        ax.plot(t, grown, color=colour, linestyle=dash, linewidth=1.2)
        beside = {"xytext": ((1.0 + NAMES_BEGIN) * t[-1], places[name]), "va": "center", "annotation_clip": False}
        line = {"arrowstyle": "-", "color": colour, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0}
        ax.annotate(
            plain(name), (t[-1], last[name]), **beside, color=in_letters(colour), arrowprops=line | {"relpos": (0, 0.5)}
        )
    for digits, text in CARRIED.items():
        if digits < high:
            ax.axhline(digits, color="black", linewidth=0.8, linestyle=":")
            ax.text(
                0.985 * t[-1], digits - 0.01 * (high - low), f"above: beyond {text}", fontsize=8, ha="right", va="top"
            )
    ax.set(xlabel="time, s", ylabel="log10 of the growth of a small difference", xlim=(0, t[-1]), ylim=(low, high))
    soon = early(t)
    each = "; ".join(
        f"{name}: {power(curves[name][soon], 1)} and {power(curves[name][-1], 0)}" for name in reversed(ends)
    )
    caption = (
        f"How much a small difference of the state grows in {t[soon]:g} s and in {t[-1]:g} s: {each}. Where a curve crosses a "
        "dotted line, numbers of so many digits know nothing of the state."
    )
    return "trajectory_growth", fig, caption
