"""The sketch of a robot: a stick figure in two postures, with the axes of its joints and its centres of mass."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tmt import literal
from tmt.derivation import method

from ..core.finding import Finding
from ..report.style import GREY, WIDTH, file_name, joint_lines
from ..robots import Robot
from ..robots.coordinates import free_joints
from ..robots.stick import AZIMUTH, ELEVATION, stick_figure
from .figures import OUTLINE

MOST_NAMED = 6  # joints, and bodies, that are named


def draw_sketch(robot: Robot) -> tuple[str, Figure, Finding]:
    tree, poses = robot.tree, {name: robot.poses[name] for name in robot.sketched or tuple(robot.poses)[:2]}
    is_small, lines = max(len(robot.joints), len(tree.mass)) <= MOST_NAMED, joint_lines(robot)
    fig = Figure(figsize=(WIDTH, 3.9))
    for k, (name, q) in enumerate(poses.items(), start=1):
        look: dict[str, Any] = {"projection": "3d", "elev": ELEVATION, "azim": AZIMUTH, "facecolor": "none"}
        ax: Any = fig.add_subplot(1, len(poses), k, box_aspect=(1, 1, 1), title=name, **look)
        (points,), links = stick_figure(robot, q[None])
        coms, frames = literal.com_positions(tree, q), method.joint_frames(tree, q.tolist())
        size = np.ptp(np.concatenate([points, coms]), axis=0).max() or 1.0  # m
        for link in links:
            ax.plot(*points[list(link)].T, color=(GREY, 0.6), linewidth=6 if is_small else 3)
        ax.scatter(*coms.T, color="black", s=25 if is_small else 8, depthshade=False)
        for number, com in enumerate(coms if is_small else (), start=1):
            ax.text(*com + size * np.array([0.1, 0.0, -0.16]), str(number), path_effects=OUTLINE)
        for joint, kind, frame in zip(robot.joints, tree.kind, frames):
            origin, axis = np.array([[*frame.origin], [*frame.axes[0]]], float)
            axis, colour = (0.57 if is_small else 0.1) * size * axis, lines[joint][0]
            if kind == "ball":
                ax.plot(*origin[:, None], marker="o", markersize=11, color=colour, fillstyle="none")
            else:
                ax.quiver(*origin, *axis, color=colour, arrow_length_ratio=0.2)
            if kind == "slide":
                ax.plot(*np.stack([origin - axis, origin]).T, color=colour, linestyle="--")
            if is_small:
                ax.text(*origin + 1.3 * axis, robot.symbol(joint), color=colour, path_effects=OUTLINE)
        ends = np.reshape(ax.get_w_lims(), (3, 2))
        half = 0.55 * np.ptp(ends, axis=1).max()
        for axis, label, middle in zip("xyz", robot.axes, ends.mean(axis=1)):
            ax.set(**{f"{axis}label": f"{label}, m", f"{axis}lim": (middle - half, middle + half)})
        ax.locator_params(nbins=4)
    fig.subplots_adjust(left=0.0, right=0.95, bottom=0.1, top=0.93, wspace=0.05)
    values = {"noun": robot.noun, "bodies": tree.body_names if is_small else (), "has_free": bool(free_joints(tree)),
              "counts": {kind: tree.kind.count(kind) for kind in tree.kind}}  # fmt: skip
    return file_name(robot.name), fig, Finding("parameters", "sketch", values)
