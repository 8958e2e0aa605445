"""The sketch of a robot: a stick figure in two postures with the axes of its joints."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tmt import literal
from tmt.derivation import method

from ..core.finding import Finding
from ..report.style import BLUE, GREEN, GREY, RED, WIDTH, file_name, joint_lines
from ..robots import Robot
from ..robots.coordinates import free_joints
from ..robots.stick import AZIMUTH, ELEVATION, stick_figure
from .figures import OUTLINE

MOST_NAMED = 6  # joints, and bodies, that are named in a sketch
KIND_COLOURS = {"hinge": BLUE, "slide": RED, "ball": GREEN}


def draw_sketch(robot: Robot) -> tuple[str, Figure, Finding]:
    tree, poses = robot.tree, {name: robot.poses[name] for name in robot.sketched or tuple(robot.poses)[:2]}
    coms = {name: literal.com_positions(q, tree) for name, q in poses.items()}
    sticks = {name: sticks_of(robot, q) for name, q in poses.items()}
    extents = [np.ptp(np.concatenate([*sticks[name], coms[name]]), axis=0).max() for name in poses]
    size = max(extents) or 1.0  # m
    is_small = max(len(robot.joints), len(tree.mass)) <= MOST_NAMED
    arrows = {name: axes(robot, q, (0.57 if is_small else 0.1) * size) for name, q in poses.items()}
    points = [part for name in poses for part in (*sticks[name], coms[name], arrows[name].sum(axis=1))]
    low, high = np.concatenate(points).min(axis=0), np.concatenate(points).max(axis=0)
    half, middle = 0.55 * (high - low).max(), (low + high) / 2
    fig = Figure(figsize=(WIDTH, 3.9))
    fig.subplots_adjust(left=0.0, right=0.95, bottom=0.1, top=0.93, wspace=0.05)
    for k, name in enumerate(poses, start=1):
        ax: Any = fig.add_subplot(1, len(poses), k, projection="3d", facecolor="none", title=name)
        for line in sticks[name]:
            ax.plot(*line.T, color=(GREY, 0.6), linewidth=6 if is_small else 3, solid_capstyle="round")
        draw_joints(ax, robot, arrows[name], is_small)
        ax.scatter(*coms[name].T, color="black", s=25 if is_small else 8, depthshade=False)
        for number, com in enumerate(coms[name] if is_small else (), start=1):
            beside = com + size * np.array([0.1, 0.0, -0.16])
            ax.text(*beside, str(number), fontsize=9, path_effects=OUTLINE)
        for axis, label in zip((ax.xaxis, ax.yaxis, ax.zaxis), robot.axes):
            axis.set_label_text(f"{label}, m")
            axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        ax.set(**{f"{axis}lim": (centre - half, centre + half) for axis, centre in zip("xyz", middle)})
        ax.view_init(elev=ELEVATION, azim=AZIMUTH)
        ax.set_box_aspect((1, 1, 1), zoom=1.1)
    counts = {kind: tree.kind.count(kind) for kind in KIND_COLOURS if kind in tree.kind}
    bodies = tree.body_names if is_small else ()
    values = {"noun": robot.noun, "bodies": bodies, "counts": counts, "has_free": bool(free_joints(tree))}
    return file_name(robot.name), fig, Finding("parameters", "sketch", values)


def sticks_of(robot: Robot, q: np.ndarray) -> list[np.ndarray]:
    """The ends of each stick, m."""
    (points,), links = stick_figure(robot, q[None])
    return [points[list(link)] for link in links]


def draw_joints(ax: Any, robot: Robot, arrows: np.ndarray, is_small: bool) -> None:
    """Arrows along hinges and, with a dashed line, slides; circles for balls; few joints have their names."""
    lines = joint_lines(robot)
    for name, joint in zip(robot.joints, robot.tree.coordinates.joints):
        colour = lines[name][0] if is_small else KIND_COLOURS[joint.kind]
        origin, axis = arrows[joint.qd.start]
        if joint.kind == "ball":
            ax.plot(*origin[:, None], marker="o", markersize=11, color=colour, fillstyle="none")
        else:
            linewidth = 2 if is_small else 1.2
            ax.quiver(*origin, *axis, color=colour, linewidth=linewidth, arrow_length_ratio=0.2)
        if joint.kind == "slide":
            ax.plot(*np.stack([origin - axis, origin]).T, color=colour, linewidth=1.2, linestyle="--")
        if is_small:
            place = origin + (0.3 if joint.kind == "ball" else 1.3) * axis
            ax.text(*place, robot.symbol(name), color=colour, path_effects=OUTLINE)


def axes(robot: Robot, q: np.ndarray, length: float) -> np.ndarray:
    """Origin and axis of each speed at joint positions q, (nq,): (nv, 2, 3), m, the axes of this length."""
    frames = method.joint_frames(robot.tree, q.tolist())
    pairs = [[list(frame.origin), [length * c for c in axis]] for frame in frames for axis in frame.axes]
    return np.array(pairs, dtype=float)
