"""The picture of trajectory on the first screen: its scenes."""

from typing import Any, NamedTuple

from matplotlib.figure import Figure

from ...core.check import About, largest_known
from ...core.finding import Finding
from ...core.words import scene_of
from ...report.style import BLUE, GREY, ORANGE, RED
from ...robots import Robot
from ..figures_overview import MOST_ROWS, beyond_tolerance, chart, lines_to, named_rows
from .runs import TrajectoryResult

LEAST_SHARE, MOST_SHARE = 1e-4, 1e3  # of a band


class SceneRuns(NamedTuple):
    """One scene: the runs of all integrators and steps together."""

    name: str
    share: float | None  # the largest difference over its band of rounding; None: no number
    shortest: float  # s, for which each run is judged
    longest: float  # s, for which some run is judged
    duration: float  # s
    diverged: float | None  # s, the earliest time at which a run of MuJoCo diverges
    left: tuple[float | None, ...]  # s, when each engine leaves a held posture; (): not held
    passed: bool


def scenes_of(result: TrajectoryResult, robot: Robot) -> list[SceneRuns]:
    names = {row.scene for row in result.rows}
    failing = [check.scene for check in result.checks if check.failed and check.about == About.MODELS]
    scenes = []
    for case in (case for case in robot.cases if case.name in names):
        rows = [row for row in result.rows if row.scene == case.name]
        until = [row.judged_until for row in rows]
        diverged = min((row.diverged_at for row in rows if row.diverged_at is not None), default=None)
        run = result.run_of(case, "rk4") if case.is_held else None
        left = tuple(path.left for path in run.paths.values()) if run else ()
        passed = not any(scene_of(where, [*names]) == case.name for where in failing)
        share = largest_known([row.difference_over_band for row in rows])
        times = min(until), max(until), case.duration, diverged
        scenes.append(SceneRuns(case.name, share, *times, left, passed))
    return scenes


def draw_scenes(result: TrajectoryResult, robot: Robot) -> tuple[str, Figure, Finding]:
    """Each scene: at the left the difference over its band; at the right how long it is judged."""
    scenes = scenes_of(result, robot)
    wrong_first = sorted(scenes, key=lambda scene: scene.passed)[:MOST_ROWS]
    shown = [scene for scene in scenes if scene in wrong_first]
    fig, (left, right) = chart(2, sharey=True, width_ratios=(1.15, 1))
    most = 10.0 if all(scene.passed for scene in scenes) else MOST_SHARE
    left.set(xscale="log", xlim=(LEAST_SHARE, most), xlabel="difference / band")
    marks = {}  # what ends a run: a mark, by its label
    for place, scene in enumerate(shown):
        colour = "black" if scene.passed else RED
        if scene.share is not None:
            lines_to(left, [scene.share], [place], "D" if scene.passed else "X", colour, markersize=4.5)
        right.barh(place, scene.duration, height=0.5, color=(GREY, 0.2))
        right.barh(place, scene.longest, height=0.5, color=(BLUE, 0.4))
        right.barh(place, scene.shortest, height=0.5, color=BLUE)
        ends = {"diverges": ("X", RED, scene.diverged)}
        for name, mark, colour, time in zip((result.label, "MuJoCo"), "os", ("white", ORANGE), scene.left):
            ends[f"{name} leaves"] = mark, colour, time
        for label, (mark, colour, time) in ends.items():
            if time is not None:
                look = {"color": colour, "markersize": 4.5, "markeredgecolor": "black", "linestyle": "none"}
                (marks[label],) = right.plot(time, place, mark, label=label, **look)
    beyond_tolerance(left, 1.0, "1")
    left.set_xticks([1e-4, 1e-2, 1.0])
    left.minorticks_off()
    right.set(xlabel="time, s", xlim=(0, 1.04 * max(scene.duration for scene in shown)))
    named_rows(left, [scene.name for scene in shown], [scene.passed for scene in shown])
    left.tick_params(axis="y", labelsize=8)
    right.grid(axis="y", visible=False)
    bars = ((BLUE, "judged"), ((BLUE, 0.4), "judged at some dt"), ((GREY, 0.2), "not judged"))
    handles = [right.barh(-9, 1, color=colour, label=text) for colour, text in bars]
    left.set_ylim(len(shown) - 0.4, -0.6)
    look = {"ncols": 5, "fontsize": 7, "handletextpad": 0.3, "columnspacing": 0.7, "handlelength": 1.0}
    fig.legend(handles=[*handles, *marks.values()], loc="outside upper center", **look)
    share = largest_known([scene.share for scene in scenes])
    failing = [scene.name for scene in scenes if not scene.passed]
    shortest, longest = min(scene.shortest for scene in scenes), max(scene.longest for scene in scenes)
    values: dict[str, Any] = {"label": result.label, "share": share, "scenes": len(scenes)}
    values |= {"failing": failing, "shortest": shortest, "longest": longest}
    return "overview_scenes", fig, result.finding("overview_caption", **values)
