"""The sketch of a robot: a stick figure in two postures with the axes of its joints, from the method's own frames."""

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from tmt import literal
from tmt.equations import method

from ..judge.finding import Finding
from ..report.style import BLUE, GREEN, GREY, RED, WIDTH, file_name, joint_lines, plain
from ..robots import Robot
from ..robots.stick import AZIMUTH, ELEVATION, RIGHTWARD, UPWARD, as_seen, free_parts, stick_figure

MOST_NAMED = 6  # joints, and bodies, that are named in a sketch
KIND_COLOURS = {"hinge": BLUE, "slide": RED, "ball": GREEN}


def draw_sketch(robot: Robot) -> tuple[str, Figure, Finding]:
    """The robot and the axes of its joints in two postures."""
    poses = {name: robot.poses[name] for name in robot.sketched or tuple(robot.poses)[:2]}
    coms = {name: literal.com_positions(q, robot.tree) for name, q in poses.items()}
    sticks = {}
    for name, q in poses.items():
        (points,), links = stick_figure(robot, q[None])
        sticks[name] = [points] if robot.landmarks else [points[list(link)] for link in links]
    size = max(np.ptp(np.concatenate([*sticks[name], coms[name]]), axis=0).max() for name in poses) or 1.0  # m
    few = max(len(robot.joints), len(robot.tree.mass)) <= MOST_NAMED
    arrows = {name: axes(robot, q, (0.57 if few else 0.1) * size) for name, q in poses.items()}
    drawn = np.concatenate([part for name in poses for part in (*sticks[name], coms[name], arrows[name].sum(axis=1))])
    half, middle = 0.55 * np.ptp(drawn, axis=0).max(), (drawn.max(axis=0) + drawn.min(axis=0)) / 2
    fig = Figure(figsize=(WIDTH, 3.9))
    fig.subplots_adjust(left=0.0, right=0.95, bottom=0.1, top=0.93, wspace=0.05)
    for k, (name, q) in enumerate(poses.items(), start=1):
        ax = fig.add_subplot(1, len(poses), k, projection="3d", facecolor="none")
        for line in sticks[name]:
            ax.plot(*line.T, color=(GREY, 0.6), linewidth=6 if few else 3, solid_capstyle="round")
        draw_joints(ax, robot, arrows[name], few)
        ax.scatter(*coms[name].T, color="black", s=25 if few else 8, depthshade=False)
        for number, com in enumerate(coms[name] if few else (), start=1):
            ax.text(*(com + size * np.array([0.12, 0.0, -0.1])), str(number), fontsize=9)
        if robot.landmarks:
            (chain,) = sticks[name]
            for text, point, (right, up) in zip(robot.landmarks(q), chain, label_directions(chain, arrows[name])):
                side = {"ha": "left" if right > 0.0 else "right", "va": "bottom" if up > 0.5 else "center"}
                ax.text(*(point + 0.1 * size * (right * RIGHTWARD + up * UPWARD)), text, color=GREY, fontsize=8, **side)
        angles = few and set(robot.tree.kind) == {"hinge"}
        ax.set(title=plain(name) + (f": ({', '.join(f'{a:g}' for a in np.degrees(q))})°" if angles else ""))
        for axis, label, centre in zip("xyz", robot.axes, middle):
            ax.set(**{f"{axis}label": f"{label}, m", f"{axis}lim": (centre - half, centre + half)})
        for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
            axis.set_major_locator(matplotlib.ticker.MaxNLocator(4, steps=[1, 2, 5, 10]))
        ax.view_init(elev=ELEVATION, azim=AZIMUTH)
        ax.set_box_aspect((1, 1, 1), zoom=1.1)
    kinds, posture = robot.tree.kind, next(iter(poses))
    values = {
        "noun": robot.noun,
        "bodies": robot.tree.body_names,
        "counts": {kind: kinds.count(kind) for kind in KIND_COLOURS if kind in kinds},
        "joints": joints_in_space(robot, poses[posture] if robot.is_read else robot.posture()) if few else [],
        "posture": posture if robot.is_read and len(poses) > 1 else "",
        "has_free": any(free_parts(robot.tree)),
    }
    return file_name(robot.name), fig, Finding("parameters", "sketch", values)


def draw_joints(ax, robot: Robot, arrows: np.ndarray, few: bool) -> None:
    """Arrows along hinges, dashed lines along slides, a dot in a circle for balls; of few joints each has its name."""
    tree, lines = robot.tree, joint_lines(robot)
    fontsize = 13 if all(len(robot.symbol(joint)) <= 2 for joint in robot.joints) else 9
    for joint, free, (kind, _, by) in zip(robot.joints, free_parts(tree), tree.coordinates.joints):
        colour = lines[joint][0] if few else KIND_COLOURS[kind]
        origin, axis = arrows[by.start]
        if kind == "ball":
            ax.plot(*origin[:, None], marker="o", markersize=11, color=colour, fillstyle="none")
            ax.plot(*origin[:, None], marker="o", markersize=3, color=colour)
            label = origin + 0.2 * np.linalg.norm(axis) * (RIGHTWARD + (-2.0 if free else 1.0) * UPWARD)
        else:
            ax.quiver(*origin, *axis, color=colour, linewidth=2 if few else 1.2, arrow_length_ratio=0.2)
            label = origin + 1.3 * axis
        if kind == "slide":
            ax.plot(*np.stack([origin - axis, origin]).T, color=colour, linewidth=1.2, linestyle="--")
        if few:
            ax.text(*label, plain(robot.symbol(joint)), color=colour, fontsize=fontsize, ha="center", va="center")


def axes(robot: Robot, q: np.ndarray, length: float) -> np.ndarray:
    """Origin and axis of each speed at joint positions q, (nq,): (nv, 2, 3), m, the axes of this length.

    The slides of a free joint are drawn where its ball is.
    """
    frames, free = method.joint_frames(robot.tree, q.tolist()), free_parts(robot.tree)
    for i in reversed(range(len(frames))):
        if free[i] and frames[i].slides:
            frames[i] = frames[i]._replace(origin=frames[i + 1].origin)
    pairs = [[list(frame.origin), [length * c for c in axis]] for frame in frames for axis in frame.axes]
    return np.array(pairs, dtype=float)


def label_directions(chain: np.ndarray, arrows: np.ndarray) -> np.ndarray:
    """Directions on paper, (k, 2), away from the links and arrows, (n, 2, 3), that meet in a chain's points, (k, 3) m."""
    away = np.tile(-0.01 * RIGHTWARD, (len(chain), 1))
    links = np.diff(chain, axis=0)
    links /= np.maximum(np.linalg.norm(links, axis=1), 1e-12)[:, None]
    away[:-1] -= links
    away[1:] += links
    for origin, axis in arrows:
        away -= np.isclose(chain, origin).all(axis=1)[:, None] * axis / np.linalg.norm(axis)
    on_paper = as_seen(away)
    return on_paper / np.linalg.norm(on_paper, axis=1)[:, None]


def joints_in_space(robot: Robot, q: np.ndarray) -> list[dict]:
    """Name, kind, axis and place of each joint at positions q, (nq,): "y", "shoulder", or numbers."""
    landmarks = robot.landmarks(q) if robot.landmarks else {"origin": np.zeros(3)}
    joints = []
    for joint, kind, frame in zip(robot.joints, robot.tree.kind, method.joint_frames(robot.tree, q.tolist())):
        axis, origin = ([float(v) + 0.0 for v in vector] for vector in (frame.axes[0], frame.origin))
        along = "xyz"[axis.index(1.0)] if sorted(axis) == [0.0, 0.0, 1.0] else axis
        place = next((name for name, point in landmarks.items() if np.allclose(point, origin)), origin)
        joints.append({"name": robot.symbol(joint), "kind": kind, "axis": along, "place": place})
    return joints
