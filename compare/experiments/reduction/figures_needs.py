"""Figures of what a scene needs, joints and time, and of what additions cost in MuJoCo."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...engines import LABELS
from ...engines.mujoco.additions import AGAIN, CAPSULES, MINIMAL, ON_FLOOR
from ...judge.check import Result
from ...report.style import BLUE, GREEN, GREY, ORANGE, WIDTH, plain
from ...robots import Robot

SIDE_BY_SIDE, MOST_TICKS = 3, 12  # joints whose names stand side by side; that are named
MOST_WIDTH = 8  # joints that get more width with their number
KINDS_OF_JOINT = {
    "needed": {"marker": "o", "color": BLUE},
    "never moves": {"marker": "o", "color": BLUE, "mfc": "none"},
    "declared locked": {"marker": "x", "color": GREY},
    "not decided": {"marker": "d", "color": ORANGE, "mfc": "none"},
}
WIDTH_OF_LABEL = 10.0  # on the axis of times, as a ratio
ALWAYS = 3  # of these kinds that the legend names
TIME_MARKS = {"tmt": (-0.15, {"marker": "o", "color": GREEN}), "mujoco": (0.15, {"marker": "s", "color": ORANGE})}


def draw_needs(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Which joints each scene needs, and the time of a step of the whole and of the smallest model."""
    scenes, joints = result.curves["needs"], robot.joints
    size, many = 9 if len(joints) <= MOST_WIDTH else 4, len(joints) > SIDE_BY_SIDE
    fig = Figure(figsize=(WIDTH, (1.5 if many else 0.9) + 0.36 * len(scenes)), layout="constrained")
    left, right = fig.subplots(1, 2, sharey=True, width_ratios=(min(len(joints), MOST_WIDTH), 7.2))
    for y, found in enumerate(scenes.values()):
        for x, joint in enumerate(joints):
            left.plot(x, y, markersize=size, linestyle="none", **KINDS_OF_JOINT[kind_of_joint(joint, found)])
    left.set(xlim=(-0.6, len(joints) - 0.4), ylim=(max(1, len(scenes)) - 0.5, -0.5))
    if len(joints) <= MOST_TICKS:
        left.set_xticks(range(len(joints)), [plain(robot.symbol(joint)) for joint in joints])
    else:
        numbers = [1, *range(5, len(joints) + 1, 5)]
        left.set_xticks([number - 1 for number in numbers], [f"{number}" for number in numbers])
        left.set_xlabel("joint, in the order of the file")
    if SIDE_BY_SIDE < len(joints) <= MOST_TICKS:
        left.tick_params(axis="x", labelrotation=90, labelsize=8)
    left.set_yticks(range(len(scenes)), [plain(name) for name in scenes])
    left.tick_params(length=0)
    for y, name in enumerate(scenes):
        mark_times(right, result, name, y)
    slowest = max((row["ns_per_step"] or 0.0 for row in result.rows), default=0.0)
    right.set(xscale="log", xlabel="time of an RK4 step, ns", xlim=(15, max(100000, 10 * slowest)))
    ticks = [100, 1000, 10000] if slowest < 1e5 else [100, 10**4, 10**6]
    right.set_xticks(ticks, [f"{tick}" for tick in ticks])
    undecided = any(found.get("undecided") for found in scenes.values())
    handles = [
        Line2D([], [], linestyle="none", label=kind, markersize=7, **style)
        for kind, style in list(KINDS_OF_JOINT.items())[: None if undecided else ALWAYS]
    ]
    above = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "handletextpad": 0.2, "columnspacing": 1.0}
    left.legend(handles=handles, ncols=1, **above)
    handles = [
        Line2D([], [], linestyle="none", label=f"{LABELS[engine]}, {model}", **style | more)
        for engine, (_, style) in TIME_MARKS.items()
        for model, more in (("whole model", {"mfc": "none"}), ("smallest model", {"markersize": 3.5}))
    ]
    right.legend(handles=handles, ncols=2, **above)
    held = [name for name, found in scenes.items() if not found["locked"] and len(found["stays"]) == len(joints)]
    fewer = [name for name, found in scenes.items() if found["stays"] and name not in held]
    words = [f"Nothing for {'; '.join(held)}: the exact solution stays."] if held else []
    one = "hinge" if set(robot.coordinates.all_kinds) == {"hinge"} else "joint"
    words += [f"Fewer than all {len(joints)} {one}s, proved, for {'; '.join(fewer)}."] if fewer else []
    start = f"What each scene of the {'' if robot.is_read else 'stated '}{robot.name} needs."
    words.append(gain(result.rows, robot.coordinates.nv, "speed" if robot.coordinates.has_balls else one))
    return "reduction_needs", fig, " ".join([start, *words])


def kind_of_joint(joint: str, found: dict) -> str:
    """What a scene has to do with a joint."""
    if joint in found["locked"]:
        return "declared locked"
    if joint in found.get("undecided", ()):
        return "not decided"
    return "never moves" if joint in found["stays"] else "needed"


def mark_times(ax: Axes, result: Result, name: str, y: float) -> None:
    """The time of a step of each engine in a scene, of the whole model and of the smallest one."""
    idle = []  # where the whole model is drawn of which no run is needed
    for engine, (offset, style) in TIME_MARKS.items():
        times = [row["ns_per_step"] for row in rows_of(result, name, engine)]
        if not times:
            continue
        whole, smallest = times[0], times[-1]
        ax.plot(whole, y + offset, mfc="none", **style)
        if smallest is None:
            idle.append((whole, y + offset))
            continue
        ax.plot([smallest, whole], [y + offset] * 2, color=style["color"], linewidth=1)
        ax.plot(smallest, y + offset, markersize=3.5, **style)
        if len(times) > 1:
            ax.text(smallest / 1.15, y + offset, f"×{whole / smallest:.2f}", ha="right", va="center", fontsize=8)
    if len(idle) == 2 and max(idle)[0] < WIDTH_OF_LABEL * min(idle)[0]:  # two labels would stand in each other
        ax.text(min(idle)[0] / 1.4, y, "no run needed", ha="right", va="center", fontsize=8)
        return
    for x, height in idle:
        ax.text(x * 1.25, height, "no run needed", va="center", fontsize=8)


def gain(rows: list[dict], nv: int, one: str = "hinge") -> str:
    """The largest gain of a model with fewer speeds than so many, in words; one: what a speed is called."""
    smaller = [row for row in rows if row["speedup"] and row["nv"] < nv]
    best = max(smaller, key=lambda row: row["speedup"], default=None)
    if best is None:
        return "No smaller model was timed."
    return (
        f"The largest gain is that of {LABELS[best['engine']]} in {best['scene']}, {best['integrator']}: with {best['nv']} of "
        f"{nv} {one}s a step takes {1 / best['speedup']:.2f} of the time of the whole model's."
    )


def rows_of(result: Result, scene: str, engine: str) -> list[dict]:
    """The rows of a scene and an engine with RK4, the whole model first."""
    return [row for row in result.rows if (row["scene"], row["engine"], row["integrator"]) == (scene, engine, "RK4")]


def draw_costs(result: Result) -> tuple[str, Figure, str]:
    """Cost in MuJoCo of each thing that is added, as a ratio to the minimal model."""
    table = result.tables["cost_in_mujoco"]
    names = [name for name in dict.fromkeys(row["added"] for row in table) if name != MINIMAL]
    fig = Figure(figsize=(WIDTH, 0.9 + 0.32 * len(names)), layout="constrained")
    ax = fig.subplots()
    most = max((row["ratio"] for row in table), default=1.0)
    for offset, integrator, colour in ((-0.19, "Euler", BLUE), (0.19, "RK4", GREEN)):
        rows = {row["added"]: row for row in table if row["integrator"] == integrator}
        for y, name in enumerate(names):
            row = rows[name]
            look = {"facecolor": (colour, 0.8), "edgecolor": "white", "hatch": None if row["same_bits"] else "////"}
            ax.barh(y + offset, row["ratio"] - 1.0, left=1.0, height=0.36, **look)
            ax.text(max(row["ratio"], 1.0) + 0.01 * most, y + offset, f"{row['ratio']:.2f}", va="center", fontsize=7)
    ax.set_yticks(range(len(names)), names)
    ax.axvline(1.0, color="black", linewidth=0.8)
    ax.set(
        ylim=(max(1, len(names)) - 0.5, -0.5),
        xlabel="time of a step / that of the minimal model",
        xlim=(0.9, 1.08 * most),
    )
    ax.grid(axis="y", visible=False)
    handles = [Patch(color=(colour, 0.8), label=name) for name, colour in (("Euler", BLUE), ("RK4", GREEN))]
    handles.append(Patch(facecolor=GREY, hatch="////", edgecolor="white", label="changes the motion"))
    fig.legend(handles=handles, loc="outside upper center", ncols=3)
    ratio = {(row["added"], row["integrator"]): row["ratio"] for row in table}
    changing = {row["added"] for row in table if not row["same_bits"]}
    again = [abs(row["ratio"] - 1.0) for row in table if row["added"] == AGAIN]
    words = [
        f"{ratio[name, 'Euler']:.2f} and {ratio[name, 'RK4']:.2f} with {name}"
        for name in ("default flags", CAPSULES, ON_FLOOR)
        if (name, "Euler") in ratio
    ]
    same = len({row["added"] for row in table} - changing - {MINIMAL, AGAIN})
    caption = (
        "What each addition costs in MuJoCo, a step of Euler and of RK4 as ratios to the minimal model: "
        f"{'; '.join(words)}. The minimal model timed again differs by {100 * max(again, default=np.nan):.1f} %. "
        + (
            f"The motion is changed by: {'; '.join(sorted(changing))}; {same} additions leave the same bits."
            if changing
            else f"No addition changes the motion: all {same} leave the same bits."
        )
    )
    return "reduction_cost_in_mujoco", fig, caption
