"""The picture of trajectory on the first screen."""

from matplotlib.figure import Figure

from ...judge.check import Result
from ...judge.finding import Finding
from ...report.style import BLUE, GREY, ORANGE, RED, plain
from ...robots import Robot
from ..figures_overview import MOST_ROWS, beyond_tolerance, chart, named_rows
from .first_screen import caption, scene_runs

LEAST_SHARE, MOST_SHARE = 1e-4, 1e3  # of a band


def draw_scenes(result: Result, robot: Robot) -> tuple[str, Figure, Finding]:
    """Scene by scene: the difference over its band at the left; at the right how long it is judged, and what ends it."""
    scenes = scene_runs(result, robot)
    wrong_first = sorted(scenes, key=lambda scene: scene.passed)[:MOST_ROWS]
    shown = [scene for scene in scenes if scene in wrong_first]
    fig, (left, right) = chart(2, sharey=True, width_ratios=(1.15, 1))
    most = 10.0 if all(scene.passed for scene in scenes) else MOST_SHARE
    for place, scene in enumerate(shown):
        colour = "black" if scene.passed else RED
        if scene.share is not None:
            at = min(max(scene.share, LEAST_SHARE), most)
            left.hlines(place, LEAST_SHARE, at, color=colour, linewidth=1.2)
            left.plot(at, place, "D" if scene.passed else "X", color=colour, markersize=4.5)
        right.barh(place, scene.duration, height=0.5, color=(GREY, 0.2))
        right.barh(place, scene.judged[1], height=0.5, color=(BLUE, 0.4))
        right.barh(place, scene.judged[0], height=0.5, color=BLUE)
        if scene.diverged is not None:
            right.plot(scene.diverged, place, "x", color=RED, markersize=5, markeredgewidth=1.5)
        for mark, colour, time in zip("os", ("white", ORANGE), scene.left or (None, None)):
            if time is not None:
                right.plot(time, place, mark, color=colour, markersize=4.5, markeredgecolor="black")
    beyond_tolerance(left, 1.0, "1")
    left.set(xscale="log", xlim=(LEAST_SHARE, most), xlabel="difference / band")
    left.set_xticks([1e-4, 1e-2, 1.0])
    left.minorticks_off()
    right.set(xlabel="time, s", xlim=(0, 1.04 * max(scene.duration for scene in shown)))
    named_rows(left, [plain(scene.name) for scene in shown], [scene.passed for scene in shown])
    left.tick_params(axis="y", labelsize=8)
    right.grid(axis="y", visible=False)
    bars = ((BLUE, "judged"), ((BLUE, 0.4), "judged at some dt"), ((GREY, 0.2), "not judged"))
    handles = [right.barh(-9, 1, color=colour, label=text) for colour, text in bars]
    if any(scene.diverged is not None for scene in shown):
        handles += right.plot([], [], "x", color=RED, markeredgewidth=1.5, label="diverges")
    for k, (mark, colour, name) in enumerate((("o", "white", result.label), ("s", ORANGE, "MuJoCo"))):
        if any(scene.left and scene.left[k] is not None for scene in shown):
            look = {"color": colour, "markersize": 4.5, "markeredgecolor": "black", "linestyle": "none"}
            handles += right.plot([], [], mark, label=f"{name} leaves", **look)
    left.set_ylim(len(shown) - 0.4, -0.6)
    fig.legend(handles=handles, loc="outside upper center", ncols=5, fontsize=7, handletextpad=0.3, columnspacing=0.7,
               handlelength=1.0)  # fmt: skip
    return "overview_scenes", fig, caption(result, scenes)
