"""Figures of the experiments that are one file: the sketch, differences, the condition number, holding torques."""

import matplotlib
import numpy as np
from matplotlib.figure import Figure

import tmt
from tmt import method

from ..judge.scale import EPS, FACTOR, gravity_scale
from ..report.style import BLUE, GREEN, GREY, ORANGE, RED, WIDTH, joint_lines

FLOOR = 1e-3  # eps: where differences of exactly zero are drawn


def sketch():
    """The arm with its hinge axes, from the method's own frames."""
    fig = Figure(figsize=(WIDTH, 3.9))
    fig.subplots_adjust(left=0.0, right=0.95, bottom=0.1, top=0.95, wspace=0.05)
    offsets = {  # of the labels, m, clear of the links
        "zero": {"shoulder": (-0.12, 0.0, 0.0), "elbow": (-0.09, 0.0, 0.0), "hand": (0.0, 0.0, -0.06)},
        "ball catch": {"shoulder": (-0.13, 0.0, 0.0), "elbow": (0.11, 0.0, 0.0), "hand": (0.08, 0.0, 0.03)},
    }
    for k, (name, labels) in enumerate(offsets.items()):
        ax = fig.add_subplot(1, 2, k + 1, projection="3d")
        q = posture(name).tolist()
        joints = np.array([list(p) for p in arm.points(q)], dtype=float)
        ax.plot(*joints.T, color=GREY, linewidth=6, solid_capstyle="round", alpha=0.6)
        for frame, (hinge, colour, _) in zip(method.hinge_frames(tmt.ARM, q), HINGES):
            origin, axis = np.array(list(frame.origin)), 0.22 * np.array(list(frame.axis))
            ax.quiver(*origin, *axis, color=colour, linewidth=2, arrow_length_ratio=0.2)
            ax.text(*(origin + 1.3 * axis), GREEK[hinge], color=colour, fontsize=13, ha="center", va="center")
        for com, body in zip(tmt.com_positions(q), ("1", "2")):
            ax.scatter(*com, color="black", s=25, depthshade=False)
            ax.text(*(com + [0.05, 0.0, -0.045]), body, fontsize=9)
        for point, (text, offset) in zip(joints, labels.items()):
            ax.text(*(point + offset), text, color=GREY, ha="center", va="center", fontsize=8)
        ax.set(title=f"{name}: ({', '.join(f'{a:g}' for a in np.degrees(q))})°")
        ax.set(xlabel="x north, m", ylabel="y west, m", zlabel="z up, m")
        ax.set(xlim=(-0.3, 0.4), ylim=(-0.35, 0.35), zlim=(-0.4, 0.3))
        for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
            axis.set_major_locator(matplotlib.ticker.MultipleLocator(0.2))
        ax.view_init(elev=20, azim=-70)
        ax.set_box_aspect((1, 1, 1), zoom=1.1)
    caption = (
        f"The arm and its hinges, drawn from the method's own kinematics: {', then '.join(hinges())}. Dots: centres of mass "
        f"of the {tmt.ARM.body_names[0]} (1) and the {tmt.ARM.body_names[1]} (2)."
    )
    return "arm", fig, caption


def hinges() -> list[str]:
    """What each hinge turns about and where it is, in words, outward from the shoulder."""
    rest = [0.0] * len(HINGES)
    joints = dict(zip(("shoulder", "elbow", "hand"), map(list, arm.points(rest))))
    words = []
    for (hinge, *_), frame in zip(HINGES, method.hinge_frames(tmt.ARM, rest)):
        axis, origin = [float(v) for v in frame.axis], list(frame.origin)
        about = "xyz"[axis.index(1.0)] if sorted(axis) == [0.0, 0.0, 1.0] else f"({', '.join(f'{v:g}' for v in axis)})"
        place = next(
            (name for name, point in joints.items() if np.allclose(point, origin)), "neither shoulder nor elbow"
        )
        words.append(f"{GREEK[hinge]} about {about} at the {place}")
    return words


def distances(result, sample, quantities=None):
    """How far apart the engines are over all states, and how far each is from the exact value."""
    curves = result.curves[sample]
    quantities = quantities or [name for name, c in curves.items() if "TMT to exact" in c]
    columns = 2 if len(quantities) == 4 else min(3, len(quantities))
    lines = -(-len(quantities) // columns)
    fig = Figure(figsize=(WIDTH, 0.7 + 2.1 * lines), layout="constrained")
    axes = fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    styles = (("TMT to MuJoCo", "black", "-"), ("TMT to exact", BLUE, "--"), ("MuJoCo to exact", ORANGE, "-."))
    for ax, quantity in zip(axes.flat, quantities):
        for name, colour, dash in styles:
            values = np.maximum(curves[quantity][name], FLOOR)
            share = np.arange(1, len(values) + 1) / len(values)
            ax.step(values, share, where="post", color=colour, linestyle=dash, label=name)
        ax.axvline(FACTOR, color=RED, linewidth=2, label=f"tolerance, {FACTOR} eps")
        ax.set(title=quantity, xscale="log", ylim=(0, 1.02))
    for ax in axes.flat[len(quantities) :]:
        ax.set_visible(False)
    for ax in axes[:, 0]:
        ax.set_ylabel("share of states")
    fig.supxlabel("difference, eps × scale of the quantity", fontsize=9)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    worst = max((curves[q]["TMT to MuJoCo"][-1], q) for q in quantities)
    ours, theirs = (max(curves[q][f"{p} to exact"][-1] for q in quantities) for p in ("TMT", "MuJoCo"))
    known = len(curves[quantities[0]]["TMT to exact"])
    caption = (
        f"Share of the {sample} whose difference is at most so many eps. The engines are at most {worst[0]:.3g} eps apart "
        f"({worst[1]}). Against the exact value, at the first {known} of the states, TMT is at most {ours:.3g} eps off and "
        f"MuJoCo at most {theirs:.3g}. Differences of exactly zero are drawn at {FLOOR:g}."
    )
    return f"{result.experiment}_distances", fig, caption


def condition_map(result):
    """The condition number of Mbar over beta and gamma."""
    beta, gamma, values = result.curves["condition"]
    beta, gamma = np.degrees(beta), np.degrees(gamma)
    worst = np.degrees(result.curves["worst"]["TMT"][1])
    fig = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    ax = fig.subplots()
    image = ax.pcolormesh(beta, gamma, values, cmap="viridis", shading="nearest", rasterized=True)
    lines = ax.contour(beta, gamma, values, levels=[10, 20, 40, 80], colors="white", linewidths=0.7)
    ax.clabel(lines, fontsize=7)
    ax.plot(*worst, marker="o", color=RED, markersize=8, markeredgecolor="white")
    ax.set(xlabel="β, deg", ylabel="γ, deg", xticks=range(-180, 181, 90), yticks=range(-180, 181, 90))
    fig.colorbar(image, label="condition number of Mbar")
    told = []
    for engine, (value, at, mirrored) in result.curves["worst"].items():
        beta, gamma = np.degrees(at)
        other = "the same at -β" if abs(mirrored - value) <= 1e-6 * value else f"{mirrored:.2f} at -β"
        told.append(f"{engine}'s is {value:.2f} at β = {beta:.1f}°, γ = {gamma:.1f}°, and {other}")
    caption = f"Condition number of TMT's Mbar over β and γ, α = 0. The maximum (dot: TMT's): {'; '.join(told)}."
    return "mass_condition", fig, caption


def holding_torques(result):
    """Holding torques at the named postures."""
    postures = result.curves["postures"]
    fig = Figure(figsize=(WIDTH, 2.9), layout="constrained")
    ax = fig.subplots()
    places = np.arange(len(postures))
    for i, (hinge, colour, _) in enumerate(HINGES):
        ours, theirs = (np.array([pair[k][i] for pair in postures.values()]) for k in (0, 1))
        x = places + 0.26 * (i - 1)
        ax.bar(x, ours, width=0.24, color=colour, alpha=0.75, label=f"{GREEK[hinge]}, TMT")
        ax.plot(x, theirs, "_", color="black", markersize=13, markeredgewidth=2, label="MuJoCo" if i == 0 else None)
    ax.axhline(0.0, color="black", linewidth=0.8)
    ax.set_xticks(places, postures)
    ax.set(ylabel="holding torque, N m")
    fig.legend(loc="outside upper center", ncols=4)
    apart = max(np.abs(ours - theirs).max() for ours, theirs in postures.values())
    caption = (
        f"Torque that holds each named posture: TMT (bars) and MuJoCo (black marks), at most {apart:.1e} N m apart. "
        + needless(postures)
    )
    return "gravity_postures", fig, caption


def needless(postures) -> str:
    """Which postures need no torque, but for rounding, in both engines or in one, in words."""
    zero = FACTOR * EPS * gravity_scale()
    rest = {
        engine: [name for name, pair in postures.items() if np.abs(pair[k]).max() <= zero]
        for k, engine in enumerate(("TMT", "MuJoCo"))
    }
    told = [
        f"{engine} needs none, but for rounding, at: {', '.join(names) or 'no posture'}."
        for engine, names in rest.items()
    ]
    return " ".join(told) if rest["TMT"] != rest["MuJoCo"] else told[0].replace("TMT needs", "Both need")
