"""What trajectory shows on the first screen: its headline and its picture, scene by scene."""

from typing import NamedTuple

from ...judge.check import About, Result, largest_known
from ...judge.finding import Finding
from ...judge.words import scene_of
from ...robots import Robot


class SceneRun(NamedTuple):
    """One scene: the runs of all integrators and steps together."""

    name: str
    share: float | None  # the largest difference over its band of rounding; None: no number
    judged: tuple[float, float]  # s, the shortest and the longest time to which a run is judged
    duration: float  # s
    diverged: float | None  # s, the earliest time at which a run of MuJoCo diverges
    left: tuple[float | None, float | None] | None  # s, when each engine leaves a held posture; None: not held
    passed: bool


def headline(result: Result) -> Finding | None:
    """The largest share of the band of rounding, and the number of scenes."""
    share = largest_known([row["difference_over_band"] for row in result.rows])
    scenes = len({row["scene"] for row in result.rows})
    return None if share is None else result.finding("headline", scenes=scenes, share=share)


def scene_runs(result: Result, robot: Robot) -> list[SceneRun]:
    """The scenes in their order."""
    names = list(dict.fromkeys(row["scene"] for row in result.rows))
    failing = [check.scene for check in result.checks if not check.passed and check.about == About.MODELS]
    cases, runs = {case.name: case for case in robot.cases}, result.curves.get("runs", {})
    scenes = []
    for name in names:
        rows = [row for row in result.rows if row["scene"] == name]
        open_loop = [row for row in rows if row["level"] == "open loop"] or rows
        until = [row["judged_until_s"] for row in open_loop if row["judged_until_s"] is not None] or [0.0]
        diverged = [row["diverged_at_s"] for row in rows if row["diverged_at_s"] is not None]
        case = cases.get(name)
        longest = [curve["t"][-1] for (scene, *_), curve in runs.items() if scene == name]
        held = runs.get((name, "rk4", case.steps), {}).get("left") if case and case.is_held else None
        scenes.append(
            SceneRun(
                name,
                largest_known([row["difference_over_band"] for row in rows]),
                (min(until), max(until)),
                float(case.duration if case else max([*longest, *until])),
                min(diverged, default=None),
                tuple(held.values()) if held else None,
                not any(scene_of(where, names) == name for where in failing),
            )
        )
    return scenes


def caption(result: Result, scenes: list[SceneRun]) -> Finding:
    """The difference that comes closest to its band, the times judged, and who leaves a posture alone."""
    leaving = []
    for scene in scenes:
        if scene.left and (scene.left[0] is None) != (scene.left[1] is None):
            who, time = next((who, t) for who, t in zip((result.label, "MuJoCo"), scene.left) if t is not None)
            leaving.append({"scene": scene.name, "who": who, "time": time, "duration": scene.duration})
    times = [time for scene in scenes for time in scene.judged]
    return result.finding(
        "overview_caption",
        label=result.label,
        share=max((scene.share for scene in scenes if scene.share is not None), default=None),
        scenes=len(scenes),
        failing=[scene.name for scene in scenes if not scene.passed],
        shortest=min(times),
        longest=max(times),
        leaving=leaving,
    )
