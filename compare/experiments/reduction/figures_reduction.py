"""Figures of reduction: the joints that each scene needs and the time of a step; exact swings."""

from collections.abc import Sequence
from itertools import cycle, product
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...core.finding import Finding
from ...core.words import capital
from ...engines import COLOURS, LABELS, MARKS
from ...report.style import BLUE, GREY, LINES, ORANGE, WIDTH, file_name
from ...robots import Robot
from .records import FrontierRow, Need, ReductionResult

KINDS_OF_JOINT: dict[str, dict[str, Any]] = {
    "needed": {"marker": "o", "color": BLUE},
    "never moves": {"marker": "o", "color": BLUE, "mfc": "none"},
    "declared locked": {"marker": "x", "color": GREY},
    "not decided": {"marker": "d", "color": ORANGE, "mfc": "none"},
}
MARKS_OF_INTEGRATORS = "osD^v"
HEIGHTS = {"tmt": -0.15, "mujoco": 0.15}  # of an engine's times in the line of a scene
ABOVE: dict[str, Any] = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "columnspacing": 1.0}


def draw_needs(result: ReductionResult, robot: Robot) -> tuple[str, Figure, Finding]:
    """The joints that each scene needs, and the time of a step of the whole and of the smallest model."""
    scenes, joints = result.needs, robot.joints
    many = len(joints) > 8
    fig = Figure(figsize=(WIDTH, 1.5 + 0.36 * len(scenes)), layout="constrained")
    left, right = fig.subplots(1, 2, sharey=True, width_ratios=(min(len(joints), 8), 7.2))
    for y, need in enumerate(scenes.values()):
        for x, joint in enumerate(joints):
            style = KINDS_OF_JOINT[kind_of_joint(joint, need)]
            left.plot(x, y, markersize=4 if many else 9, linestyle="none", **style)
    left.set(xlim=(-0.6, len(joints) - 0.4), ylim=(len(scenes) - 0.5, -0.5))
    left.set_xticks(range(len(joints)), [robot.symbol(joint) for joint in joints])
    left.tick_params(axis="x", labelrotation=90 if len(joints) > 3 else 0, labelsize=6 if many else 8)
    left.set_yticks(range(len(scenes)), scenes)
    left.tick_params(length=0)
    for y, name in enumerate(scenes):
        mark_times(right, result, name, y)
    right.set(xscale="log", xlabel="time of an RK4 step, ns")
    right.margins(x=0.3)
    kinds = {kind_of_joint(joint, need) for need in scenes.values() for joint in joints}
    handles = [Line2D([], [], linestyle="none", label=kind, markersize=7, **style)
               for kind, style in KINDS_OF_JOINT.items() if kind in kinds]  # fmt: skip
    left.legend(handles=handles, handletextpad=0.2, **ABOVE)
    handles = [
        Line2D([], [], linestyle="none", label=f"{LABELS[engine]}, {model}", **look_of(engine) | more)
        for engine in HEIGHTS
        for model, more in (("whole model", {"mfc": "none"}), ("smallest model", {"markersize": 3.5}))
    ]
    right.legend(handles=handles, ncols=2, handletextpad=0.2, **ABOVE)
    return "reduction_needs", fig, result.finding("needs", robot=robot.name)


def draw_frontier(result: ReductionResult, rows: Sequence[FrontierRow]) -> tuple[str, Figure, Finding]:
    """Time over error: a colour for each model, a mark for each integrator."""
    fig = Figure(figsize=(WIDTH, 4.5), layout="constrained")
    ax = fig.subplots()
    colours = dict(zip(dict.fromkeys(row.model for row in rows), cycle(colour for colour, _ in LINES)))
    marks = dict(zip(dict.fromkeys(row.integrator for row in rows), MARKS_OF_INTEGRATORS))
    for (model, colour), (integrator, mark) in product(colours.items(), marks.items()):
        points = [
            (row.error, row.time_of_second)
            for row in rows
            if (row.model, row.integrator) == (model, integrator)
        ]
        if points:
            ax.plot(*zip(*points), color=colour, marker=mark, markersize=4.5, linewidth=0.7)
    for row in rows:
        if row.best_for:
            ax.plot(row.error, row.time_of_second, "ko", markersize=11, markerfacecolor="none")
            ax.annotate(
                f"{row.best_for}: ×{row.gain:.1f}",
                (row.error, row.time_of_second),
                (6, -10),
                textcoords="offset points",
            )
    handles = [Line2D([], [], color=colour, label=model) for model, colour in colours.items()]
    handles += [
        Line2D([], [], color="black", linestyle="none", marker=mark, label=name)
        for name, mark in marks.items()
    ]
    fig.legend(handles=handles, loc="outside right upper", fontsize=7)
    ax.set(xscale="log", yscale="log", xlabel="error, rad or m", ylabel="time for a second of motion, s")
    return "reduction_frontier", fig, result.finding("frontier", "reduction_of_file")


def look_of(engine: str) -> dict[str, Any]:
    return {"marker": MARKS[engine], "color": COLOURS[engine]}


def kind_of_joint(joint: str, need: Need) -> str:
    if joint in need.locked:
        return "declared locked"
    if joint in need.undecided:
        return "not decided"
    return "never moves" if joint in need.stays else "needed"


def mark_times(ax: Axes, result: ReductionResult, scene: str, y: float) -> None:
    """The time of a step of each engine in a scene, of the whole and of the smallest model."""
    for engine, offset in HEIGHTS.items():
        times = [row.ns_per_step for row in result.rows if (row.scene, row.engine) == (scene, engine)]
        whole_model, smallest = times[0], times[-1]
        ax.plot(whole_model, y + offset, mfc="none", **look_of(engine))
        if len(times) > 1 and smallest:
            ax.plot([smallest, whole_model], [y + offset] * 2, color=COLOURS[engine], linewidth=1)
            ax.plot(smallest, y + offset, markersize=3.5, **look_of(engine))
            speedup = f"×{whole_model / smallest:.2f}"
            ax.text(smallest / 1.15, y + offset, speedup, ha="right", va="center", fontsize=8)


def draw_swing(result: ReductionResult, scene: str) -> tuple[str, Figure, Finding]:
    """Error of a swing of one hinge against the elliptic function, over the step."""
    dt, errors, orders = result.swings[scene]
    fig = Figure(figsize=(WIDTH, 3.0), layout="constrained")
    ax = fig.subplots()
    engines = []
    for engine, values in errors.items():
        ax.loglog(dt, values, **look_of(engine), mfc="none", label=f"{LABELS[engine]}, RK4")
        engines.append({"engine": LABELS[engine], "order": orders.get(engine), "error": values[-1]})
    ax.set(xlabel="dt, s", ylabel="maximum error of the angle, rad")
    ax.legend()
    return file_name("reduction", scene), fig, result.finding("swing", scene=capital(scene), engines=engines)
