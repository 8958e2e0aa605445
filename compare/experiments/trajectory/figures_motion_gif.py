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
from ...robots.case import Case
from ...robots.stick import as_seen, stick_figure
from .pairs import SCHEMES_OF_RK4, Pair

FRAMES = 64  # of a scene at most, without its start
SCENES = 2
SIZE, DPI = (6.4, 4.2), 80  # inches, and pixels of an inch
MILLISECONDS, PAUSE = 80, 1200  # of a picture, and of the last one of a scene
# of the first engine, and of MuJoCo, which is drawn over it
LOOKS = {"linewidth": 12, "marker": "o", "markersize": 14, "color": BLUE, "solid_capstyle": "round"}, {
    "linewidth": 4, "marker": "o", "markersize": 9, "markerfacecolor": "white", "color": ORANGE,
}  # fmt: skip


class Animation:
    """A figure that is saved as a GIF, which is played again and again."""

    suffix = ".gif"

    def __init__(self, pairs: Sequence[Pair], label: str):
        self.pairs, self.label = pairs, label

    def savefig(self, path: Path) -> None:
        pictures, times = [], list[int]()
        for pair in self.pairs:
            of_pair = list(drawn(pair, self.label))
            times += [MILLISECONDS] * (len(of_pair) - 1) + [PAUSE]
            pictures += of_pair
        pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=times, loop=0)


def draw_motion(pairs: Sequence[Pair], label: str) -> tuple[str, Animation, Finding]:
    engines = [LABELS[name] for name in pairs[0].runs]
    scenes = {pair.case.name: f"{pair.integrator}, {step_in_words(pair.case, pair.steps)}" for pair in pairs}
    caption = Finding("trajectory", "figure_motion", {"engines": engines, "scenes": scenes})
    return "motion", Animation(pairs, label), caption


def drawn_pairs(robot: Robot, pairs: Sequence[Pair]) -> list[Pair]:
    """Those of a held scene, better one that is left, and of a free one, better from the same posture.

    By RK4, a held scene with its own step, as the departure depends on it, others with the finest one.
    """
    chosen: dict[str, Pair] = {}
    for case in robot.cases:
        of_case = [pair for pair in pairs if pair.case.name == case.name and pair.scheme in SCHEMES_OF_RK4]
        if of_case:
            chosen[case.name] = (min if case.is_held else max)(of_case, key=lambda pair: pair.steps)
    held = [pair for pair in chosen.values() if pair.case.is_held]
    held = sorted(held, key=lambda pair: all(run.left is None for run in pair.runs.values()))[:1]
    postures = [pair.case.scene.posture for pair in held]
    free = [pair for pair in chosen.values() if pair.case.is_free]
    free = sorted(free, key=lambda pair: pair.case.scene.posture not in postures)[:1]
    first = {pair.case.name: pair for pair in (*held, *free, *chosen.values())}
    return list(first.values())[:SCENES]


def sticks(case: Case, q: np.ndarray) -> np.ndarray:
    """The sticks of a run as seen, each of two points and a gap: (pictures, 3 sticks, 2) m; NaN where q is."""
    alive = np.isfinite(q).all(axis=1)
    whole = case.positions_of_all(np.where(alive[:, None], q, case.q))
    points, links = stick_figure(case.robot, whole, crosses=True)
    ends = as_seen(points)[:, np.array(links)]
    gaps = np.full_like(ends[:, :, :1], np.nan)
    of_run = np.concatenate([ends, gaps], axis=2).reshape(len(q), -1, 2)
    return np.where(alive[:, None, None], of_run, np.nan)


def drawn(pair: Pair, label: str) -> Iterator[Image.Image]:
    """The pictures of both runs, at equal times."""
    case, every = pair.case, slice(None, None, -(-pair.steps // FRAMES))
    with np.errstate(over="ignore", invalid="ignore"):  # in runs that diverge
        positions = [q[every] for q in pair.until_diverged("q")]
        paths = {engine: sticks(case, q) for engine, q in zip(pair.runs, positions)}
        apart = np.abs(case.coordinates.difference(*positions)).max(axis=1)
    t, unit = pair.t[every], movement_unit(case.coordinates)
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
    figure.text(0.02, 0.87, f"{pair.integrator}, {step_in_words(case, pair.steps)}")
    figure.legend(loc="upper right", ncols=2, markerscale=0.5)
    status = figure.text(0.02, 0.04, "", parse_math=False)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)  # over which each picture draws the sticks alone
    for k, time in enumerate(t):
        for line, path in zip(lines, paths.values()):
            line.set_data(*path[k].T)
        lost = [LABELS[name] for name, path in paths.items() if not np.isfinite(path[k, 0]).all()]
        gone = pair.runs.items() if case.is_held else ()
        left = {LABELS[name]: run.left for name, run in gone if run.left and run.left <= time}
        values = {"t": time, "lost": lost, "apart": apart[k], "unit": unit, "left": left}
        status.set_text(say(Finding("trajectory", "picture_status", values)))
        canvas.restore_region(background)
        for artist in (*lines, status):
            figure.draw_artist(artist)
        yield Image.fromarray(np.asarray(canvas.buffer_rgba())).quantize(16, Image.Quantize.FASTOCTREE)
