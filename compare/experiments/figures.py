"""Figures of the experiments that are one file: the sketch, differences, the condition number, holding torques.

Each function returns (file name, figure, caption).
"""

from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.figure import Figure

import tmt
from tmt import method

from ..engines import LABELS
from ..judge.check import Result
from ..judge.scale import EPS, FACTOR, gravity_scale
from ..judge.words import listed
from ..report.style import BLUE, GREY, ORANGE, RED, WIDTH, file_name, joint_lines
from ..robots import Robot

ZERO_AT = 1e-3  # eps: where differences of exactly zero are drawn
ELEVATION, AZIMUTH = 20.0, -70.0  # deg, from where the sketch is seen
CENTRED = {"ha": "center", "va": "center"}
_E, _A = np.radians([ELEVATION, AZIMUTH])
RIGHTWARD = np.array([-np.sin(_A), np.cos(_A), 0.0])  # of who sees it
UPWARD = np.array([-np.sin(_E) * np.cos(_A), -np.sin(_E) * np.sin(_A), np.cos(_E)])


def draw_sketch(robot: Robot) -> tuple[str, Figure, str]:
    """The robot with its hinge axes in two postures, from the method's own frames."""
    poses = {name: robot.poses[name] for name in robot.sketched or tuple(robot.poses)[:2]}
    parts = {name: (chains(robot, q), tmt.com_positions(q, robot.tree)) for name, q in poses.items()}
    size = max(np.ptp(np.concatenate([*lines, coms]), axis=0).max() for lines, coms in parts.values()) or 1.0  # m
    arrows = {name: axes(robot, q, 0.57 * size) for name, q in poses.items()}
    tips = [arrow.sum(axis=1) for arrow in arrows.values()]
    drawn = np.concatenate([*tips, *(part for lines, coms in parts.values() for part in (*lines, coms))])
    half, middle = 0.55 * np.ptp(drawn, axis=0).max(), (drawn.max(axis=0) + drawn.min(axis=0)) / 2
    fontsize = 13 if all(len(robot.symbol(joint)) <= 2 for joint in robot.joints) else 9
    fig = Figure(figsize=(WIDTH, 3.9))
    fig.subplots_adjust(left=0.0, right=0.95, bottom=0.1, top=0.95, wspace=0.05)
    for k, (name, (lines, coms)) in enumerate(parts.items()):
        ax = fig.add_subplot(1, len(poses), k + 1, projection="3d", facecolor="none")
        for line in lines:
            ax.plot(*line.T, color=(GREY, 0.6), linewidth=6, solid_capstyle="round")
        for joint, (origin, axis) in zip(robot.joints, arrows[name]):
            colour = joint_lines(robot)[joint][0]
            ax.quiver(*origin, *axis, color=colour, linewidth=2, arrow_length_ratio=0.2)
            ax.text(*(origin + 1.3 * axis), robot.symbol(joint), color=colour, fontsize=fontsize, **CENTRED)
        for number, com in enumerate(coms, start=1):
            ax.scatter(*com, color="black", s=25, depthshade=False)
            ax.text(*(com + size * np.array([0.12, 0.0, -0.1])), str(number), fontsize=9)
        if robot.landmarks:
            names, (chain,) = robot.landmarks(poses[name]), lines
            for text, point, (right, up) in zip(names, chain, label_directions(chain, arrows[name])):
                side = {"ha": "left" if right > 0.0 else "right", "va": "bottom" if up > 0.5 else "center"}
                ax.text(*(point + 0.1 * size * (right * RIGHTWARD + up * UPWARD)), text, color=GREY, fontsize=8, **side)
        ax.set(title=f"{name}: ({', '.join(f'{a:g}' for a in np.degrees(poses[name]))})°")
        ax.set(**{f"{which}label": f"{axis}, m" for which, axis in zip("xyz", robot.axes)})
        ax.set(**{f"{which}lim": (centre - half, centre + half) for which, centre in zip("xyz", middle)})
        for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
            axis.set_major_locator(matplotlib.ticker.MaxNLocator(4, steps=[1, 2, 5, 10]))
        ax.view_init(elev=ELEVATION, azim=AZIMUTH)
        ax.set_box_aspect((1, 1, 1), zoom=1.1)
    bodies = [f"the {body} ({number})" for number, body in enumerate(robot.tree.body_names, start=1)]
    caption = (
        f"The {robot.name} and its hinges, drawn from the method's own kinematics: {', then '.join(hinges(robot))}. Dots: "
        f"centres of mass of {listed(bodies)}."
    )
    return file_name(robot.name), fig, caption


def chains(robot: Robot, q: np.ndarray) -> list[np.ndarray]:
    """The lines of a robot at joint angles q, rad: points in m, (k, 3) each.

    Through its landmarks; else from each joint to the next, and from the last ones to the centres of mass that they move.
    """
    if robot.landmarks:
        return [np.array(list(robot.landmarks(q).values()))]
    tree = robot.tree
    origins = np.array([list(frame.origin) for frame in method.joint_frames(tree, q.tolist())], dtype=float)
    links = [np.stack([origins[parent], origins[joint]]) for joint, parent in enumerate(tree.parent) if parent >= 0]
    ends = [
        np.stack([origins[joint], com])
        for joint, com in zip(tree.body_hinge, tmt.com_positions(q, tree))
        if joint >= 0 and joint not in tree.parent
    ]
    return links + ends


def axes(robot: Robot, q: np.ndarray, length: float) -> np.ndarray:
    """Origin and axis of each hinge at joint angles q, rad: (n, 2, 3), m, the axes of this length."""
    frames = method.joint_frames(robot.tree, q.tolist())
    return np.array([[list(frame.origin), [length * c for c in frame.axes[0]]] for frame in frames], dtype=float)


def label_directions(chain: np.ndarray, arrows: np.ndarray) -> np.ndarray:
    """Where on paper the labels of a chain's points, (k, 3) m, stand free: to the right and up, (k, 2), of length 1.

    Away from the links and from the arrows, (n, 2, 3), that meet in the point; to the left if these are balanced.
    """
    away = np.tile(-0.01 * RIGHTWARD, (len(chain), 1))
    links = np.diff(chain, axis=0)
    links /= np.maximum(np.linalg.norm(links, axis=1), 1e-12)[:, None]
    away[:-1] -= links
    away[1:] += links
    for origin, axis in arrows:
        away -= np.isclose(chain, origin).all(axis=1)[:, None] * axis / np.linalg.norm(axis)
    on_paper = away @ np.stack([RIGHTWARD, UPWARD], axis=1)
    return on_paper / np.linalg.norm(on_paper, axis=1)[:, None]


def hinges(robot: Robot) -> list[str]:
    """What each hinge turns about and where it is at zero, in words, in their order."""
    rest = robot.posture()
    landmarks = robot.landmarks(rest) if robot.landmarks else {"origin": np.zeros(3)}
    words = []
    for joint, frame in zip(robot.joints, method.joint_frames(robot.tree, rest.tolist())):
        axis, origin = ([float(v) + 0.0 for v in vector] for vector in (frame.axes[0], frame.origin))
        about = "xyz"[axis.index(1.0)] if sorted(axis) == [0.0, 0.0, 1.0] else triple(axis)
        near = (f"at the {name}" for name, point in landmarks.items() if np.allclose(point, origin))
        words.append(f"{robot.symbol(joint)} about {about} {next(near, f'at {triple(origin)} m')}")
    return words


def triple(values: Sequence[float]) -> str:
    return f"({', '.join(f'{v:.3g}' for v in values)})"


def draw_distances(result: Result, sample: str, quantities: list[str] | None = None) -> tuple[str, Figure, str]:
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
            values = np.maximum(curves[quantity][name], ZERO_AT)
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
    ours, theirs = (max(curves[q][f"{label} to exact"][-1] for q in quantities) for label in ("TMT", "MuJoCo"))
    known = len(curves[quantities[0]]["TMT to exact"])
    caption = (
        f"Share of the {sample} whose difference is at most so many eps. The engines are at most {worst[0]:.3g} eps apart "
        f"({worst[1]}). Against the exact value, at the first {known} of the states, TMT is at most {ours:.3g} eps off and "
        f"MuJoCo at most {theirs:.3g}. Differences of exactly zero are drawn at {ZERO_AT:g}."
    )
    return f"{result.experiment}_distances", fig, caption


def draw_condition(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """The condition number of Mbar over the two joints on which it is said to depend."""
    *angles, values = result.curves["condition"]
    first, second = np.degrees(angles)
    x, y = (robot.symbol(joint) for joint in robot.conditioning.joints)
    worst = np.degrees(result.curves["worst"]["tmt"][1])
    fig = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    ax = fig.subplots()
    image = ax.pcolormesh(first, second, values, cmap="viridis", shading="nearest", rasterized=True)
    lines = ax.contour(first, second, values, levels=[10, 20, 40, 80], colors="white", linewidths=0.7)
    ax.clabel(lines, fontsize=7)
    ax.plot(*worst, marker="o", color=RED, markersize=8, markeredgecolor="white")
    ax.set(xlabel=f"{x}, deg", ylabel=f"{y}, deg", xticks=range(-180, 181, 90), yticks=range(-180, 181, 90))
    fig.colorbar(image, label="condition number of Mbar")
    largest = []
    for name, (value, at, mirrored) in result.curves["worst"].items():
        a, b = np.degrees(at)
        other = f"the same at -{x}" if abs(mirrored - value) <= 1e-6 * value else f"{mirrored:.2f} at -{x}"
        largest.append(f"{LABELS[name]}'s is {value:.2f} at {x} = {a:.1f}°, {y} = {b:.1f}°, and {other}")
    others = "".join(f", {robot.symbol(joint)} = 0" for joint in robot.joints if joint not in robot.conditioning.joints)
    caption = (
        f"Condition number of TMT's Mbar over {x} and {y}{others}. The maximum (dot: TMT's): {'; '.join(largest)}."
    )
    return "mass_condition", fig, caption


def draw_holding_torques(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Holding torques at the named postures."""
    postures = result.curves["postures"]
    fig = Figure(figsize=(WIDTH, 2.9), layout="constrained")
    ax = fig.subplots()
    places, width = np.arange(len(postures)), 0.78 / len(robot.joints)
    for i, (joint, (colour, _)) in enumerate(joint_lines(robot).items()):
        ours, theirs = (np.array([of[name][i] for of in postures.values()]) for name in ("tmt", "mujoco"))
        x = places + width * (i - (len(robot.joints) - 1) / 2)
        ax.bar(x, ours, width=0.92 * width, color=(colour, 0.75), label=f"{robot.symbol(joint)}, TMT")
        mark = {"markersize": 50 * width, "markeredgewidth": 2, "label": "MuJoCo" if i == 0 else None}
        ax.plot(x, theirs, "_", color="black", **mark)
    ax.axhline(0.0, color="black", linewidth=0.8)
    ax.set_xticks(places, postures)
    ax.set(ylabel="holding torque, N m")
    fig.legend(loc="outside upper center", ncols=min(len(robot.joints) + 1, 6))
    apart = max(np.abs(of["tmt"] - of["mujoco"]).max() for of in postures.values())
    caption = (
        f"Torque that holds each named posture: TMT (bars) and MuJoCo (black marks), at most {apart:.1e} N m apart. "
        + needless(postures, robot)
    )
    return "gravity_postures", fig, caption


def needless(postures: dict, robot: Robot) -> str:
    """Which postures need no torque, but for rounding, in both engines or in one, in words."""
    zero = FACTOR * EPS * gravity_scale(robot.tree)
    rest = {
        name: [posture for posture, of in postures.items() if np.abs(of[name]).max() <= zero]
        for name in ("tmt", "mujoco")
    }
    words = [
        f"{LABELS[name]} needs none, but for rounding, at: {', '.join(at) or 'no posture'}."
        for name, at in rest.items()
    ]
    return " ".join(words) if rest["tmt"] != rest["mujoco"] else words[0].replace("TMT needs", "Both need")
