"""How figures look. Colours are Okabe and Ito's, which the colour-blind can tell apart; lines differ in dash and markers too.

A function that draws returns (file name, figure, caption), and computes nothing but positions on paper.
"""

import re
from collections.abc import Sequence
from itertools import pairwise

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.textpath import TextPath

BLUE, ORANGE, GREEN, RED, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#666666"
PINK, SKY = "#CC79A7", "#56B4E9"
LINES = (
    (BLUE, "-"),
    (RED, "--"),
    (GREEN, "-."),
    (ORANGE, ":"),
    (PINK, (0, (5, 1))),
    (SKY, (0, (3, 1, 1, 1))),
)  # of joints
STYLE = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "savefig.dpi": 150,
}
WIDTH = 7.5  # inches, a page
matplotlib.rcParams.update(STYLE)


def joint_lines(robot) -> dict[str, tuple]:
    """Colour and dash of each joint's line, by its name."""
    return {name: LINES[k % len(LINES)] for k, name in enumerate(robot.joints)}


def file_name(*parts: str) -> str:
    """The name of a figure: letters, digits, minus signs and underscores, no more than a file's name may have."""
    return "_".join(re.sub(r"[^\w-]+", "_", part) for part in parts)[:60]


def plain(text: str) -> str:
    return text.replace("$", r"\$")


def zero_at_the_end(axis: Axis, end: float, far: float, most: int) -> None:
    """Ticks at powers of ten on a logarithmic axis, at most `most`; the first is labelled 0."""
    first, last = round(np.log10(end)), int(np.ceil(np.log10(far)))
    powers = range(first, last + 1, max(1, -(-(last - first) // (most - 1))))
    axis.set_ticks([10.0**power for power in powers], ["0", *(f"$10^{{{power}}}$" for power in powers[1:])])
    axis.set_ticks([], minor=True)


# labels next to their points

BRIGHTNESS, BRIGHTEST_LETTERS = (
    np.array([0.3, 0.59, 0.11]),
    0.46,
)  # of red, green and blue; of a colour as letters have it
WIDER = 1.05  # are letters on the screen
HEIGHT_OF_TEXT = 1.3  # of its size
FARTHEST_NAME, FAR_ENOUGH = (
    62.0,
    9.0,
)  # points: the largest distance of a name from its point, and the distance from which it has a line
DIRECTIONS = (0, 20, -20, 45, -45, 70, -70, 90, -90, 110, -110, 135, -135, 160, -160, 180)  # deg, to a name
OVER_A_LABEL, OVER_A_LINE, OUTSIDE, TO_THE_LEFT = (
    1e4,
    10.0,
    1e5,
    6.0,
)  # what makes a place worse; a point of distance is 1


def spread(values: Sequence[float], apart: float, low: float, high: float) -> np.ndarray:
    """Places for labels as near as can be to their values, (n,), so far apart at least and within low and high."""
    order = np.argsort(values, kind="stable")
    groups = []  # of labels that touch: middle and number
    for value in np.asarray(values, dtype=float)[order]:
        groups.append([value, 1])
        while len(groups) > 1 and groups[-1][0] - groups[-2][0] < apart * (groups[-1][1] + groups[-2][1]) / 2:
            (middle, count), (before, others) = groups.pop(), groups.pop()
            groups.append([(middle * count + before * others) / (count + others), count + others])
    sorted_places = np.concatenate(
        [middle + apart * (np.arange(count) - (count - 1) / 2) for middle, count in groups] or [[]]
    )
    for k in range(len(order)):  # from below, then from above
        sorted_places[k] = max(sorted_places[k], low + k * apart)
    for k in range(len(order)):
        sorted_places[-1 - k] = min(sorted_places[-1 - k], high - k * apart)
    places = np.empty(len(order))
    places[order] = sorted_places
    return places


def name_ends(ax: Axes, ends: Sequence[tuple], size: float = 8.0) -> None:
    """Write names next to points of a panel, where they cover neither lines nor each other: (x, y, name, colour).

    The panel has its place on the paper already. A name far from its point has a thin line to it.
    """
    scale = ax.figure.dpi / 72.0  # pixels of a point
    ax.set(xlim=ax.get_xlim(), ylim=ax.get_ylim())  # which are found now, and stay
    taken, crowd = np.empty((0, 4)), on_paper(ax) if ends else np.empty((0, 2))
    far, angle = (of.ravel() for of in np.meshgrid(np.arange(5.0, FARTHEST_NAME, 4.0), np.radians(DIRECTIONS)))
    steps = far[:, None] * scale * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for x, y, name, colour in sorted(ends, key=lambda end: -end[1]):
        wide, high = text_width(name, size) * scale, HEIGHT_OF_TEXT * size * scale
        at = ax.transData.transform((x, y))
        corner = (
            at + steps - np.stack([np.where(steps[:, 0] < -1e-9, wide, 0.0), np.full(len(steps), high / 2)], axis=1)
        )
        boxes = np.concatenate([corner, corner + [wide, high]], axis=1)  # left, lower, right, upper
        worse = far + TO_THE_LEFT * (1.0 - np.cos(angle))
        worse += OVER_A_LINE * points_in(boxes, crowd[np.abs(crowd - at).max(axis=1) < FARTHEST_NAME * scale + wide])
        worse += OVER_A_LABEL * meet(boxes[:, None] + [-3.0, 0.0, 3.0, 0.0], taken).sum(axis=1)
        worse += OUTSIDE * ~inside(boxes, ax.bbox.extents)
        best = int(np.argmin(worse))
        box, taken = boxes[best], np.vstack([taken, boxes[best]])
        to_data = ax.transData.inverted().transform
        ax.text(*to_data((box[0], (box[1] + box[3]) / 2)), name, color=in_letters(colour), fontsize=size, va="center",
                path_effects=[withStroke(linewidth=1.5, foreground="white")])  # fmt: skip
        if far[best] > FAR_ENOUGH:
            near = to_data(np.clip(at, box[:2], box[2:]))
            ax.plot([x, near[0]], [y, near[1]], color=colour, linewidth=0.5, zorder=1.5, label="_leader")


def points_in(boxes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How many points, (n, 2), are in each of the boxes, (k, 4): left, lower, right, upper."""
    x, y = points.T
    left, lower, right, upper = (edge[:, None] for edge in boxes.T)
    return ((x >= left - 1.0) & (x <= right + 1.0) & (y >= lower - 1.0) & (y <= upper + 1.0)).sum(axis=1)


def meet(boxes: np.ndarray, others: np.ndarray) -> np.ndarray:
    return ((boxes[..., :2] < others[..., 2:]) & (others[..., :2] < boxes[..., 2:])).all(axis=-1)


def inside(boxes: np.ndarray, frame: np.ndarray) -> np.ndarray:
    return ((boxes[..., :2] >= frame[:2]) & (boxes[..., 2:] <= frame[2:])).all(axis=-1)


def in_letters(colour: str) -> tuple[float, float, float]:
    rgb = np.array(to_rgb(colour))
    return tuple(rgb * BRIGHTEST_LETTERS / max(BRIGHTEST_LETTERS, float(rgb @ BRIGHTNESS)))


def text_width(text: str, size: float) -> float:
    return TextPath((0, 0), text, size=size).get_extents().width * WIDER


def on_paper(ax: Axes) -> np.ndarray:
    """Points on all lines of a panel, close to each other, (n, 2), pixels."""
    points = [np.empty((0, 2))]
    for line in ax.lines:
        path = ax.transData.transform(line.get_xydata()) if line.get_transform() == ax.transData else np.empty((0, 2))
        path = path[np.isfinite(path).all(axis=1)]
        if line.get_linestyle() == "None":
            points.append(path)
            continue
        for start, end in pairwise(path):
            count = min(300, 1 + int(np.abs(end - start).max() / 3.0))
            points.append(start + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - start))
    return np.concatenate(points)


def pixels(figure: Figure) -> np.ndarray:
    """A figure as it is saved, (height, width, 4), drawn once: `savefig` would draw it once more to find its places."""
    figure.set_dpi(STYLE["savefig.dpi"])
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())
