"""Figures of the experiments at single states: differences, condition number, holding torques, corrections.

Each function returns (file name, figure, caption).
"""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..engines import LABELS
from ..judge.check import Result
from ..judge.entries import unit
from ..judge.finding import Finding
from ..judge.scale import EPS, FACTOR
from ..report.style import BLUE, GREEN, GREY, LINES, ORANGE, RED, WIDTH, plain, zero_at_the_end
from ..robots import Robot

ZERO_AT = 1e-3  # eps: where differences of exactly zero are drawn
WORST_LOOKS = (  # of the maximum of each engine, the second in the first
    {"marker": "o", "color": RED, "markersize": 10, "markeredgecolor": "white"},
    {"marker": "P", "color": "white", "markersize": 6, "markeredgecolor": "black"},
)
MOST_DRAWN = 600  # points of a curve: more are not seen
SHOWN_POSTURES = 8  # in one figure
HATCHES = (None, "///", "...", "xxx", "\\\\\\", "+++")  # of joints, for who prints in grey


def draw_distances(result: Result, sample: str, quantities: list[str] | None = None) -> tuple[str, Figure, Finding]:
    """Cumulative distributions of the differences between the engines, and of each from the exact value."""
    curves = result.curves[sample]
    label = result.label
    exact = [name for name, c in curves.items() if f"{label} to exact" in c]  # none where exact values take too long
    quantities = quantities or exact or list(curves)[:6]
    columns = 2 if len(quantities) == 4 else min(3, len(quantities))
    lines = -(-len(quantities) // columns)
    fig = Figure(figsize=(WIDTH, 0.7 + 2.1 * lines), layout="constrained")
    axes = fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    styles = (
        (f"{label} to MuJoCo", "black", "-"),
        (f"{label} to exact", BLUE, "--"),
        ("MuJoCo to exact", ORANGE, "-."),
    )
    for ax, quantity in zip(axes.flat, quantities):
        for name, colour, dash in styles if exact else styles[:1]:
            values = np.maximum(curves[quantity][name], ZERO_AT)
            share = np.arange(1, len(values) + 1) / len(values)
            shown = np.unique(np.linspace(0, len(values) - 1, min(len(values), MOST_DRAWN)).round().astype(int))
            ax.step(values[shown], share[shown], where="post", color=colour, linestyle=dash, label=name)
        ax.axvline(FACTOR, color=RED, linewidth=2, label=f"tolerance, {FACTOR} eps")
        ax.set(title=quantity, xscale="log", ylim=(0, 1.02))
    for ax in axes.flat[len(quantities) :]:
        ax.set_visible(False)
    drawn = [line.get_xdata() for ax in axes.flat for line in ax.lines]
    largest = max((values[-1] for values in drawn if np.isfinite(values[-1])), default=FACTOR)
    zeros = min(values[0] for values in drawn) <= ZERO_AT
    if zeros:
        zero_at_the_end(axes[0, 0].xaxis, ZERO_AT, largest, most=4 + 2 * (columns < 3))
    for ax in axes[:, 0]:
        ax.set_ylabel("share of states")
    fig.supxlabel("difference, eps × scale of the quantity", fontsize=9)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    worst, of_worst = max((largest_of(curves[q][f"{label} to MuJoCo"]), q) for q in quantities)
    distances = None
    if exact:
        ours, theirs = (
            max(largest_of(curves[q][f"{engine} to exact"]) for q in quantities) for engine in (label, "MuJoCo")
        )
        distances = {"states": len(curves[quantities[0]][f"{label} to exact"]), "ours": ours, "theirs": theirs}
    values = {"sample": sample, "label": label, "worst": worst, "of_worst": of_worst, "exact": distances}
    caption = result.finding("distances", of="shared", **values, zero_at=ZERO_AT if zeros else None)
    return f"{result.experiment}_distances", fig, caption


def largest_of(curve: np.ndarray) -> float:
    """The last of sorted differences; inf where one is NaN, as a user's own equations may give."""
    return float(curve[-1]) if np.isfinite(curve[-1]) else np.inf


def draw_condition(result: Result, robot: Robot) -> tuple[str, Figure, Finding]:
    """Condition number of Mbar over the two joints of the robot's `conditioning`."""
    *angles, values = result.curves["condition"]
    first, second = np.degrees(angles)
    x, y = (robot.symbol(joint) for joint in robot.conditioning.joints)
    fig = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    ax = fig.subplots()
    image = ax.pcolormesh(first, second, values, cmap="viridis", shading="nearest", rasterized=True)
    lines = ax.contour(first, second, values, levels=[10, 20, 40, 80], colors="white", linewidths=0.7)
    ax.clabel(lines, fontsize=7)
    ax.set(xlabel=f"{x}, deg", ylabel=f"{y}, deg", xticks=range(-180, 181, 90), yticks=range(-180, 181, 90))
    fig.colorbar(image, label="condition number of Mbar")
    maxima = []
    for (name, (value, worst)), look in zip(result.curves["worst"].items(), WORST_LOOKS):
        place = np.degrees(worst)
        ax.plot(*place[:, None], linestyle="none", **look, label=f"maximum, {LABELS[name]}")
        maxima.append({"label": LABELS[name], "value": value, "at": tuple(place)})
    fig.legend(loc="outside upper center", ncols=2)
    zero = [robot.symbol(joint) for joint in robot.joints if joint not in robot.conditioning.joints]
    return "mass_condition", fig, result.finding("condition", joints=[x, y], zero=zero, maxima=maxima)


def draw_holding_torques(result: Result, robot: Robot) -> tuple[str, Figure, Finding]:
    """Holding torques of at most six joints, those with the largest, at the first eight named postures."""
    torques, speeds = result.curves["postures"], robot.coordinates.speeds
    postures = dict(list(torques.items())[:SHOWN_POSTURES])
    first, second = robot.compared
    most = np.max([np.abs(of[first]) for of in postures.values()], axis=0)
    shown = sorted(np.argsort(-most, kind="stable")[: len(LINES)])
    fig = Figure(figsize=(WIDTH, 2.9), layout="constrained")
    ax = fig.subplots()
    places, width, labels = np.arange(len(postures)), 0.78 / len(shown), []
    for i, k in enumerate(shown):
        ours, theirs = (np.array([of[name][k] for of in postures.values()]) for name in (first, second))
        x = places + width * (i - (len(shown) - 1) / 2)
        labels.append(f"{plain(robot.symbol(speeds[k]))}, {LABELS[first]}")
        look = {"facecolor": (LINES[i % len(LINES)][0], 0.75), "hatch": HATCHES[i % len(HATCHES)], "edgecolor": "white"}
        ax.bar(x, ours, width=0.92 * width, **look, linewidth=0, label=labels[-1])
        mark = {"markersize": min(50 * width, 20), "markeredgewidth": 2, "label": "MuJoCo" if i == 0 else None}
        ax.plot(x, theirs, "_", color="black", **mark)
    ax.axhline(0.0, color="black", linewidth=0.8)
    ax.set_xticks(places, [plain(name) for name in postures])
    ax.set(ylabel=f"holding torque, {unit(robot.tree, 'N m', 'N')}")
    columns = 100 // (8 + max(map(len, labels)))  # of a legend that fits the page
    entries = sorted(zip(*ax.get_legend_handles_labels()), key=lambda entry: entry[1] == "MuJoCo")
    fig.legend(*zip(*entries), loc="outside upper center", ncols=max(1, min(len(shown) + 1, 6, columns)))
    caption = {
        "shown": len(postures),
        "postures": len(torques),
        "of_joints": len(shown),
        "joints": len(speeds),
        "label": LABELS[first],
        "springs": robot.tree.has_springs,
        "difference": np.max([np.abs(of[first] - of[second]) for of in torques.values()]),
        "unit": unit(robot.tree, "N m", "N"),
    }
    return "gravity_postures", fig, result.finding("postures", **caption)


def draw_nearest(result: Result) -> tuple[str, Figure, Finding]:
    """The share of the difference that remains after each of the best single corrections."""
    names, left = zip(*result.curves["nearest"])
    left = np.maximum(left, EPS)
    fig = Figure(figsize=(WIDTH, 0.9 + 0.25 * len(names)), layout="constrained")
    ax = fig.subplots()
    explaining = {row["place"] for row in result.rows}
    ax.barh(range(len(names)), left, color=[GREEN if name in explaining else GREY for name in names])
    ax.set(xscale="log", xlim=(EPS / 3.0, 1.5), xlabel="remaining share of the difference", yticks=range(len(names)))
    ax.set_yticklabels(map(plain, names))
    ax.invert_yaxis()
    looks = ((GREEN, "explains the difference down to rounding"), (GREY, "does not explain it"))
    fig.legend(handles=[Patch(color=colour, label=name) for colour, name in looks], loc="outside upper center", ncols=2)
    return "diagnosis_nearest", fig, result.finding("nearest", names=names[:2], left=left[:2].tolist())
