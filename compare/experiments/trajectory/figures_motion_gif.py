"""The motion as a GIF: stick figures of both engines over each other, of a scene that is held and of one let go."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from ...core.finding import Finding
from ...core.text import say
from ...engines import LABELS
from ...judge.run import movement_unit, step_in_words
from ...report.style import BLUE, ORANGE
from ...robots import Robot
from ...robots.stick import as_seen, stick_figure
from .runs import SCHEMES_OF_RK4, Run

FRAMES = 128  # of a scene at most, without its start
SCENES = 2
SIZE, DPI = (6.4, 4.2), 100  # inches, and pixels of an inch
MILLISECONDS, PAUSE = 40, 1200  # of a picture, and of the last one of a scene
# of the first engine, and of MuJoCo, which is drawn over it
LOOKS = {"linewidth": 12, "marker": "o", "markersize": 14, "color": BLUE, "solid_capstyle": "round"}, {
    "linewidth": 4, "marker": "o", "markersize": 9, "markerfacecolor": "white", "color": ORANGE,
}  # fmt: skip


class Animation:
    """A figure that is saved as a GIF, which is played again and again."""

    suffix = ".gif"

    def __init__(self, runs: Sequence[Run], label: str):
        self.runs, self.label = runs, label

    def savefig(self, path: Path) -> None:
        pictures, times = [], list[int]()
        for run in self.runs:
            of_run = list(drawn(run, self.label))
            times += [MILLISECONDS] * (len(of_run) - 1) + [PAUSE]
            pictures += of_run
        pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=times, loop=0)


def draw_motion(runs: Sequence[Run], label: str) -> tuple[str, Animation, Finding]:
    engines = [LABELS[name] for name in runs[0].paths]
    scenes = {run.case.name: f"{run.integrator}, {step_in_words(run.case, run.steps)}" for run in runs}
    caption = Finding("trajectory", "figure_motion", {"engines": engines, "scenes": scenes})
    return "motion", Animation(runs, label), caption


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


def sticks(run: Run, engine: str, every: slice) -> np.ndarray:
    """The sticks of an engine's run as seen, each of two points and a gap: (pictures, 3 sticks, 2) m; NaN once it diverged."""
    q = run.until_diverged(engine, run.paths[engine].q)[every]
    alive = np.isfinite(q).all(axis=1)
    whole = run.case.positions_of_all(np.where(alive[:, None], q, run.case.q))
    points, links = stick_figure(run.case.robot, whole, crosses=True)
    ends = as_seen(points)[:, np.array(links)]
    gaps = np.full_like(ends[:, :, :1], np.nan)
    of_run = np.concatenate([ends, gaps], axis=2).reshape(len(q), -1, 2)
    return np.where(alive[:, None, None], of_run, np.nan)


def drawn(run: Run, label: str) -> Iterator[Image.Image]:
    """The pictures of a run, at equal times."""
    case, every = run.case, slice(None, None, -(-run.steps // FRAMES))
    with np.errstate(over="ignore", invalid="ignore"):  # in runs that diverge
        paths = {engine: sticks(run, engine, every) for engine in run.paths}
        positions = [run.until_diverged(engine, path.q)[every] for engine, path in run.paths.items()]
        apart = np.abs(case.coordinates.difference(*positions)).max(axis=1)
    t, unit = run.t[every], movement_unit(case.coordinates)
    figure = Figure(SIZE, DPI)
    canvas, ax = FigureCanvasAgg(figure), figure.add_axes((0.04, 0.1, 0.92, 0.72))
    points = np.concatenate([path.reshape(-1, 2) for path in paths.values()])
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    room = 0.06 * (high - low).max() + 1e-3
    ax.set(xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room), aspect="equal")
    ax.set_axis_off()
    names = (label, LABELS["mujoco"])
    lines = [ax.plot([], [], label=name, **look)[0] for name, look in zip(names, LOOKS)]  # type: ignore[arg-type]
    figure.text(0.02, 0.93, case.name, fontsize=14, parse_math=False)  # a name is no formula
    figure.text(0.02, 0.87, f"{run.integrator}, {step_in_words(case, run.steps)}")
    figure.legend(loc="upper right", ncols=2, markerscale=0.5)
    status = figure.text(0.02, 0.04, "", parse_math=False)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)  # over which each picture draws the sticks alone
    for k, time in enumerate(t):
        for line, path in zip(lines, paths.values()):
            line.set_data(*path[k].T)
        lost = [LABELS[name] for name, path in paths.items() if not np.isfinite(path[k, 0]).all()]
        gone = run.paths.items() if case.is_held else ()
        left = {LABELS[name]: path.left for name, path in gone if path.left and path.left <= time}
        values = {"t": time, "lost": lost, "apart": apart[k], "unit": unit, "left": left}
        status.set_text(say(Finding("trajectory", "picture_status", values)))
        canvas.restore_region(background)
        for artist in (*lines, status):
            figure.draw_artist(artist)
        yield Image.fromarray(np.asarray(canvas.buffer_rgba())).quantize(32, Image.Quantize.FASTOCTREE)
