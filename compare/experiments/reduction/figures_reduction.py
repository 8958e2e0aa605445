"""Figures of reduction: the joints that each scene needs and the time of a step; exact swings."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...engines import LABELS
from ...judge.check import Result
from ...judge.words import capital
from ...report.style import BLUE, GREEN, GREY, ORANGE, WIDTH, file_name, plain
from ...robots import Robot
from .needs import joint_word

SIDE_BY_SIDE, MOST_TICKS = 3, 12  # joints whose names fit side by side; that are named at all
MOST_WIDTH = 8  # joints above which the panel grows no wider
KINDS_OF_JOINT = {
    "needed": {"marker": "o", "color": BLUE},
    "never moves": {"marker": "o", "color": BLUE, "mfc": "none"},
    "declared locked": {"marker": "x", "color": GREY},
    "not decided": {"marker": "d", "color": ORANGE, "mfc": "none"},
}
TIME_MARKS = {"tmt": (-0.15, {"marker": "o", "color": GREEN}), "mujoco": (0.15, {"marker": "s", "color": ORANGE})}
SWING_LINES = {"RK4": (GREEN, "-"), "Euler": (BLUE, "--")}


def draw_needs(result: Result, robot: Robot) -> tuple:
    """The joints that each scene needs, and the time of a step of the whole and of the smallest model."""
    scenes, joints = result.curves["needs"], robot.joints
    size, many = 9 if len(joints) <= MOST_WIDTH else 4, len(joints) > SIDE_BY_SIDE
    fig = Figure(figsize=(WIDTH, (1.5 if many else 0.9) + 0.36 * len(scenes)), layout="constrained")
    left, right = fig.subplots(1, 2, sharey=True, width_ratios=(min(len(joints), MOST_WIDTH), 7.2))
    kinds = dict.fromkeys(list(KINDS_OF_JOINT)[:3])
    for y, need in enumerate(scenes.values()):
        for x, joint in enumerate(joints):
            kind = kind_of_joint(joint, need)
            kinds[kind] = None
            left.plot(x, y, markersize=size, linestyle="none", **KINDS_OF_JOINT[kind])
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
    above = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "handletextpad": 0.2, "columnspacing": 1.0}
    no_line = {"linestyle": "none"}
    handles = [Line2D([], [], **no_line, label=kind, markersize=7, **KINDS_OF_JOINT[kind]) for kind in kinds]
    left.legend(handles=handles, ncols=1, **above)
    handles = [
        Line2D([], [], **no_line, label=f"{LABELS[engine]}, {model}", **style | more)
        for engine, (_, style) in TIME_MARKS.items()
        for model, more in (("whole model", {"mfc": "none"}), ("smallest model", {"markersize": 3.5}))
    ]
    right.legend(handles=handles, ncols=2, **above)
    resting = [name for name, need in scenes.items() if not need["locked"] and len(need["stays"]) == len(joints)]
    fewer = [name for name, need in scenes.items() if need["stays"] and name not in resting]
    word, count = joint_word(robot.coordinates), len(joints)
    best = largest_gain(result.rows, robot.coordinates.nv)
    values = {"robot": robot.name, "joint": word, "count": count, "resting": resting, "fewer": fewer, "best": best}
    return "reduction_needs", fig, result.finding("needs", **values, nv=robot.coordinates.nv)


def kind_of_joint(joint: str, need: dict) -> str:
    if joint in need["locked"]:
        return "declared locked"
    if joint in need["undecided"]:
        return "not decided"
    return "never moves" if joint in need["stays"] else "needed"


def mark_times(ax: Axes, result: Result, scene: str, y: float) -> None:
    """The time of a step of each engine in a scene, of the whole and of the smallest model."""
    for engine, (offset, style) in TIME_MARKS.items():
        place = (scene, engine, "RK4")
        rows = [row for row in result.rows if (row["scene"], row["engine"], row["integrator"]) == place]
        if not rows:
            continue
        whole, smallest = rows[0]["ns_per_step"], rows[-1]["ns_per_step"]
        ax.plot(whole, y + offset, mfc="none", **style)
        if smallest is None:
            look = {"ha": "right", "va": "center", "fontsize": 8, "transform": ax.get_yaxis_transform()}
            if engine == "tmt":  # once for both
                ax.text(0.98, y, "no run needed", **look)
            continue
        ax.plot([smallest, whole], [y + offset] * 2, color=style["color"], linewidth=1)
        ax.plot(smallest, y + offset, markersize=3.5, **style)
        if len(rows) > 1:
            ax.text(smallest / 1.15, y + offset, f"×{whole / smallest:.2f}", ha="right", va="center", fontsize=8)


def largest_gain(rows: list[dict], nv: int) -> dict | None:
    """The row of the largest speedup among models with fewer speeds; None if there is none."""
    smaller = [row for row in rows if row["speedup"] and row["nv"] < nv]
    return max(smaller, key=lambda row: row["speedup"], default=None)


def draw_swing(result: Result, scene: str) -> tuple:
    """Error of a swing of one hinge against the elliptic function, over the step."""
    dt, errors, orders, stated = (result.curves["swings"][scene][key] for key in ("dt", "errors", "orders", "stated"))
    fig = Figure(figsize=(WIDTH, 3.0), layout="constrained")
    ax = fig.subplots()
    for integrator, (colour, dash) in SWING_LINES.items():
        values = errors["tmt", integrator]
        ax.loglog(dt, values, dash, color=colour, label=f"{integrator}, TMT")
        ax.loglog(dt, errors["mujoco", integrator], "o", mfc="none", color=colour, label=f"{integrator}, MuJoCo")
        if ("tmt", integrator) in orders:
            place = {"xy": (dt[3], values[3]), "xytext": (0, 8), "textcoords": "offset points", "ha": "right"}
            ax.annotate(f"order {stated[integrator]}", **place, color=colour)
    ax.set(xlabel="dt, s", ylabel="largest error of the angle, rad")
    fig.legend(loc="outside upper center", ncols=4)
    lines = [
        {
            "integrator": integrator,
            "orders": [orders.get((engine, integrator)) for engine in ("tmt", "mujoco")],
            "errors": [errors[engine, integrator][-1] for engine in ("tmt", "mujoco")],
        }
        for integrator in SWING_LINES
    ]
    return file_name("reduction", scene), fig, result.finding("swing", scene=capital(scene), lines=lines)
