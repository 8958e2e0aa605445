"""The motion as a GIF: stick figures of both engines over each other, of a scene that is held and of one let go.

Pictures without matplotlib, which takes seconds for a hundred pictures.
"""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ...core.finding import Finding
from ...core.text import say
from ...engines import LABELS
from ...judge.run import movement_unit, step_in_words
from ...report.style import BLUE, ORANGE
from ...robots import Robot
from ...robots.stick import as_seen, stick_figure
from .errors import SCHEMES_OF_RK4
from .runs import Run

FRAMES = 128  # of a scene at most, without its start
SCENES = 2
PIXELS, TOP, BOTTOM = (640, 420), 78, 34  # pixels; and the margins for text above and below
ROOM = PIXELS[0] - 36, PIXELS[1] - TOP - BOTTOM - 36
MIDDLE = PIXELS[0] / 2, (PIXELS[1] + TOP - BOTTOM) / 2
FEW_STICKS = 6  # up to which they are drawn wide
FINE = 2  # a picture is drawn larger by this factor
BLACK = "#1a1a1a"
CENTISECONDS, PAUSE = 4, 120  # of a picture, and of the last one of a scene


class Pictures(NamedTuple):
    """The stick figures of both engines in one scene, at equal times."""

    scene: str
    run: str  # method and step
    t: np.ndarray  # (pictures,) s
    points: dict[str, np.ndarray]  # by engine (pictures, points, 2): right, up, m; NaN once it diverged
    links: list[tuple[int, int]]  # pairs of points that a stick joins
    apart: np.ndarray  # (pictures,): the largest difference of a joint; NaN if an engine has diverged
    unit: str  # of that
    left: dict[str, float | None]  # by engine: when a held robot left its posture, s
    fixed: bool  # whether the first point does not move, as the first joint only turns


def drawn_runs(robot: Robot, runs: Sequence[Run]) -> list[Run]:
    """Those of a held scene, better one that is left, and of a free one, better from the same posture.

    By RK4, a held scene with its own step, as the departure depends on it, others with the finest one.
    """
    chosen: dict[str, Run] = {}
    for case in robot.cases:
        of_case = [run for run in runs if run.case.name == case.name and run.scheme in SCHEMES_OF_RK4]
        if of_case:
            chosen[case.name] = (min if case.is_held else max)(of_case, key=lambda run: run.steps)
    held = [run for run in chosen.values() if run.case.is_held]
    held = sorted(held, key=lambda run: all(path.left is None for path in run.paths.values()))[:1]
    postures = [run.case.scene.posture for run in held]
    free = [run for run in chosen.values() if run.case.is_free]
    free = sorted(free, key=lambda run: run.case.scene.posture not in postures)[:1]
    first = {run.case.name: run for run in (*held, *free, *chosen.values())}
    return list(first.values())[:SCENES]


def pictures_of(run: Run) -> Pictures:
    case, every = run.case, slice(None, None, -(-run.steps // FRAMES))
    positions, points = [], {}
    for engine, path in run.paths.items():
        q = run.until_diverged(engine, path.q)[every]
        alive = np.isfinite(q).all(axis=1)
        whole = case.positions_of_all(np.where(alive[:, None], q, case.q))
        of_robot, links = stick_figure(case.robot, whole, crosses=True)
        points[engine] = np.where(alive[:, None, None], as_seen(of_robot), np.nan)
        positions.append(np.where(alive[:, None], q, np.nan))
    apart = np.abs(case.coordinates.difference(*positions)).max(axis=1)
    left = {engine: path.left if case.is_held else None for engine, path in run.paths.items()}
    label, unit = f"{run.integrator}, {step_in_words(case, run.steps)}", movement_unit(case.coordinates)
    fixed = case.robot.tree.kind[0] != "slide"
    return Pictures(case.name, label, run.t[every], points, links, apart, unit, left, fixed)


class Animation:
    """A figure that is saved as a GIF, which is played again and again."""

    suffix = ".gif"

    def __init__(self, scenes: Sequence[Pictures], label: str):
        self.scenes, self.label = scenes, label

    def savefig(self, path: Path) -> None:
        pictures, times = [], list[int]()
        for scene in self.scenes:
            paths = placed(scene)
            still = text_of_scene(scene, self.label, paths[0][0, 0])
            pictures += [one_picture(scene, k, still, paths) for k in range(len(scene.t))]
            times += [10 * CENTISECONDS] * (len(scene.t) - 1) + [10 * PAUSE]
        first, *others = [picture.quantize(method=Image.Quantize.FASTOCTREE) for picture in pictures]
        first.save(path, save_all=True, append_images=others, duration=times, loop=0)


def draw_motion(runs: Sequence[Run], label: str) -> tuple[str, Animation, Finding]:
    with np.errstate(over="ignore", invalid="ignore"):  # in runs that diverge
        scenes = [pictures_of(run) for run in runs]
    engines = [LABELS[name] for name in scenes[0].points]
    caption = Finding("trajectory", "figure_motion", {"engines": engines, "scenes": scenes})
    return "motion", Animation(scenes, label), caption


def placed(scene: Pictures) -> list[np.ndarray]:
    """The points of each engine in a drawing whose y goes down, pixels."""
    points = np.concatenate([path.reshape(-1, 2) for path in scene.points.values()])
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    scale = (np.array(ROOM) / np.maximum(high - low, 1e-3)).min()
    return [MIDDLE + scale * (path - (low + high) / 2) * [1.0, -1.0] for path in scene.points.values()]


def one_picture(scene: Pictures, k: int, still: Image.Image, paths: Sequence[np.ndarray]) -> Image.Image:
    """The k-th picture of a scene; still: the text in all of them; paths: of each engine, in pixels."""
    image = still.copy()
    pen = ImageDraw.Draw(image)
    alive = [bool(np.isfinite(path[k]).all()) for path in paths]
    for which, path in enumerate(paths):
        if alive[which]:
            draw_sticks(pen, path[k], scene.links, which, len(scene.links) <= FEW_STICKS)
    lost = [LABELS[name] for name, is_alive in zip(scene.points, alive) if not is_alive]
    left = {LABELS[name]: time for name, time in scene.left.items() if time and time <= scene.t[k]}
    write(pen, (PIXELS[0] - 16, PIXELS[1] - 28), f"t = {scene.t[k]:.2f} s", 17, "ra")
    write(pen, (16, PIXELS[1] - 28), said("apart", lost=lost, apart=scene.apart[k], unit=scene.unit), 17)
    write(pen, (PIXELS[0] - 16, 68), said("left", left=left), 14, "ra")
    return image.reduce(FINE)


def said(kind: str, **values: object) -> str:
    return say(Finding("trajectory", f"picture_{kind}", values))


def draw_sticks(
    pen: ImageDraw.ImageDraw, points: np.ndarray, links: Sequence[tuple[int, int]], which: int, few: bool
) -> None:
    """The sticks of an engine: of the first (0) wide with discs, else narrow with rings. points: (n, 2)."""
    colour = (BLUE, ORANGE)[which]
    places = [tuple(FINE * point) for point in points]
    width, disc = ((14, 7), (4, 6))[which] if few else ((8, 4), (3, 3))[which]
    for start, end in links:
        pen.line([places[start], places[end]], fill=colour, width=FINE * width)
    for place in places:
        pen.circle(place, FINE * disc, fill=colour)
        if which:
            pen.circle(place, FINE * (disc - 1.5), fill="white")


def text_of_scene(scene: Pictures, label: str, base: np.ndarray) -> Image.Image:
    """What is in all pictures of a scene: its name, run, the engines, a frame where the robot is fixed."""
    image = Image.new("RGB", (FINE * PIXELS[0], FINE * PIXELS[1]), "white")
    pen = ImageDraw.Draw(image)
    write(pen, (16, 10), scene.scene, 20)
    factor = CENTISECONDS / 100.0 / float(scene.t[1] - scene.t[0])
    run = said("run", run=scene.run, slower=1.0 if 0.9 < factor < 1.1 else factor)
    write(pen, (PIXELS[0] - 16, 50), run, 14, "ra")
    for which, (x, name) in enumerate(((16, label), (150, LABELS["mujoco"]))):
        draw_sticks(pen, np.array([[x + 4, 62], [x + 36, 62]]), [(0, 1)], which, few=True)
        write(pen, (x + 48, 62), name, 16, "lm")
    if scene.fixed:
        pen.rectangle([*(FINE * (base - 11)), *(FINE * (base + 11))], outline=BLACK, width=2 * FINE)
    return image


def write(
    pen: ImageDraw.ImageDraw, place: tuple[float, float], text: str, size: int, anchor: str = "la"
) -> None:
    pen.text((FINE * place[0], FINE * place[1]), text, fill=BLACK, font=font(FINE * size), anchor=anchor)


@cache
def font(size: int) -> ImageFont.FreeTypeFont:
    """The font of all figures, size in pixels."""
    return ImageFont.truetype(str(Path(matplotlib.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")), size)
