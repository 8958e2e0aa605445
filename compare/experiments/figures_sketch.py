"""The sketch of a robot: a stick figure in two postures with the axes of its joints, from the method's own frames."""

from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from tmt import literal
from tmt.equations import method

from ..judge.words import listed
from ..report.style import BLUE, GREEN, GREY, RED, WIDTH, file_name, joint_lines, plain
from ..robots import Robot
from ..robots.stick import AZIMUTH, ELEVATION, RIGHTWARD, UPWARD, free_parts, stick_figure

SKETCHED_BY_NAME = 6  # joints at most, and bodies, that are named in a sketch
KIND_COLOURS = {"hinge": BLUE, "slide": RED, "ball": GREEN}
CENTRED = {"ha": "center", "va": "center"}


def draw_sketch(robot: Robot) -> tuple[str, Figure, str]:
    """The robot with the axes of its joints in two postures, from the method's own frames."""
    poses = sketched(robot)
    parts = {name: (chains(robot, q), literal.com_positions(q, robot.tree)) for name, q in poses.items()}
    size = max(np.ptp(np.concatenate([*lines, coms]), axis=0).max() for lines, coms in parts.values()) or 1.0  # m
    few = max(len(robot.joints), len(robot.tree.mass)) <= SKETCHED_BY_NAME
    arrows = {name: axes(robot, q, (0.57 if few else 0.1) * size) for name, q in poses.items()}
    tips = [arrow.sum(axis=1) for arrow in arrows.values()]
    drawn = np.concatenate([*tips, *(part for lines, coms in parts.values() for part in (*lines, coms))])
    half, middle = 0.55 * np.ptp(drawn, axis=0).max(), (drawn.max(axis=0) + drawn.min(axis=0)) / 2
    fig = Figure(figsize=(WIDTH, 3.9))
    fig.subplots_adjust(left=0.0, right=0.95, bottom=0.1, top=0.93, wspace=0.05)
    for k, (name, (lines, coms)) in enumerate(parts.items()):
        ax = fig.add_subplot(1, len(poses), k + 1, projection="3d", facecolor="none")
        for line in lines:
            ax.plot(*line.T, color=(GREY, 0.6), linewidth=6 if few else 3, solid_capstyle="round")
        draw_joints(ax, robot, arrows[name], few)
        for number, com in enumerate(coms, start=1):
            ax.scatter(*com, color="black", s=25 if few else 8, depthshade=False)
            if few:
                ax.text(*(com + size * np.array([0.12, 0.0, -0.1])), str(number), fontsize=9)
        if robot.landmarks:
            names, (chain,) = robot.landmarks(poses[name]), lines
            for text, point, (right, up) in zip(names, chain, label_directions(chain, arrows[name])):
                side = {"ha": "left" if right > 0.0 else "right", "va": "bottom" if up > 0.5 else "center"}
                ax.text(*(point + 0.1 * size * (right * RIGHTWARD + up * UPWARD)), text, color=GREY, fontsize=8, **side)
        angles = few and set(robot.tree.kind) == {"hinge"}
        at = f": ({', '.join(f'{a:g}' for a in np.degrees(poses[name]))})°" if angles else ""
        ax.set(title=f"{plain(name)}{at}")
        ax.set(**{f"{which}label": f"{axis}, m" for which, axis in zip("xyz", robot.axes)})
        ax.set(**{f"{which}lim": (centre - half, centre + half) for which, centre in zip("xyz", middle)})
        for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
            axis.set_major_locator(matplotlib.ticker.MaxNLocator(4, steps=[1, 2, 5, 10]))
        ax.view_init(elev=ELEVATION, azim=AZIMUTH)
        ax.set_box_aspect((1, 1, 1), zoom=1.1)
    return file_name(robot.name), fig, sketch_in_words(robot, few)


def sketched(robot: Robot) -> dict[str, np.ndarray]:
    """The postures that are drawn, by name."""
    return {name: robot.poses[name] for name in robot.sketched or tuple(robot.poses)[:2]}


def draw_joints(ax, robot: Robot, arrows: np.ndarray, few: bool) -> None:
    """The axes of hinges as arrows, the directions of slides as dashed lines through them, balls as a dot in a circle.

    few: each joint has its colour and its name; else the colour is that of its kind.
    """
    tree, lines = robot.tree, joint_lines(robot)
    fontsize = 13 if all(len(robot.symbol(joint)) <= 2 for joint in robot.joints) else 9
    for joint, free, (kind, _, by) in zip(robot.joints, free_parts(tree), tree.coordinates.joints):
        colour = lines[joint][0] if few else KIND_COLOURS[kind]
        origin, axis = arrows[by.start]
        if kind == "ball":
            ax.plot(*origin[:, None], marker="o", markersize=11, color=colour, fillstyle="none")
            ax.plot(*origin[:, None], marker="o", markersize=3, color=colour)
        else:
            ax.quiver(*origin, *axis, color=colour, linewidth=2 if few else 1.2, arrow_length_ratio=0.2)
        if kind == "slide":
            ax.plot(*np.stack([origin - axis, origin]).T, color=colour, linewidth=1.2, linestyle="--")
        if few and kind == "ball":
            ax.text(
                *(origin + 0.2 * np.linalg.norm(axis) * (RIGHTWARD - 2.0 * UPWARD if free else RIGHTWARD + UPWARD)),
                plain(joint),
                color=colour,
                fontsize=fontsize,
            )
        elif few:
            ax.text(*(origin + 1.3 * axis), plain(robot.symbol(joint)), color=colour, fontsize=fontsize, **CENTRED)


def sketch_in_words(robot: Robot, few: bool) -> str:
    """The caption of the sketch: what each of a few joints does, or how many there are of each kind."""
    bodies = [f"the {body} ({number})" for number, body in enumerate(robot.tree.body_names, start=1)]
    kinds, (posture, *others) = robot.tree.kind, sketched(robot)
    at = f", at {posture}" if robot.is_read and others else ""
    if few and set(kinds) == {"hinge"}:
        return (
            f"The {robot.noun} and its hinges, drawn from the method's own kinematics{at}: {', then '.join(hinges(robot))}. "
            f"Dots: centres of mass of {listed(bodies)}."
        )
    signs = {
        "hinge": "an arrow along its axis",
        "slide": "a dashed line along its direction",
        "ball": "a dot in a circle",
    }
    counted = [
        f"{kinds.count(kind)} {kind}{'s' if kinds.count(kind) > 1 else ''} ({sign})"
        for kind, sign in signs.items()
        if kind in kinds
    ]
    free = "; a free body is three slides and a ball" if any(free_parts(robot.tree)) else ""
    which = f"{at}: {', then '.join(hinges(robot))}" if few else ""
    of = listed(bodies) if few else f"{len(bodies)} bodies"
    return (
        f"The {robot.noun}, drawn from the method's own kinematics: {listed(counted)}{free}{which}. Sticks: from joint to joint, "
        f"and to the last centres of mass. Dots: centres of mass of {of}."
    )


def chains(robot: Robot, q: np.ndarray) -> list[np.ndarray]:
    """The lines of a robot at joint positions q, (nq,): points in m, (k, 3) each.

    Through its landmarks; else from each joint to the next, and from the last ones to the centres of mass that they move.
    """
    (points,), links = stick_figure(robot, q[None])
    return [points] if robot.landmarks else [points[list(link)] for link in links]


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
    """What each hinge turns about, or slide moves along, and where it is, in words, in their order.

    At the reference; of a file's robot where it is drawn, in the first posture.
    """
    rest = next(iter(sketched(robot).values())) if robot.is_read else robot.posture()
    landmarks = robot.landmarks(rest) if robot.landmarks else {"origin": np.zeros(3)}
    words = []
    way = {"hinge": " about ", "slide": " along ", "ball": ""}
    for joint, kind, frame in zip(robot.joints, robot.tree.kind, method.joint_frames(robot.tree, rest.tolist())):
        axis, origin = ([float(v) + 0.0 for v in vector] for vector in (frame.axes[0], frame.origin))
        about = "" if kind == "ball" else "xyz"[axis.index(1.0)] if sorted(axis) == [0.0, 0.0, 1.0] else triple(axis)
        near = (f"at the {name}" for name, point in landmarks.items() if np.allclose(point, origin))
        words.append(f"{robot.symbol(joint)}{way[kind]}{about} {next(near, f'at {triple(origin)} m')}")
    return words


def triple(values: Sequence[float]) -> str:
    return f"({', '.join(f'{v:.3g}' for v in values)})"
