"""How figures look. Colours are Okabe and Ito's, which the colour-blind can tell apart; lines differ in dash and markers too.

A function that draws returns (file name, figure, caption), and computes nothing but positions on paper.
"""

import re
import warnings
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
from matplotlib.text import Text
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
NUMBER = re.compile(r"\$(\\mathdefault\{)?[-0-9.^{}]*(\\times10)?[-0-9.^{}]*\$")  # of an axis, as a formula
matplotlib.rcParams.update(STYLE)
warnings.filterwarnings("ignore", "constrained_layout not applied")  # names that leave no room for what is drawn


def joint_lines(robot) -> dict[str, tuple]:
    """Colour and dash of each joint's line, by its name."""
    return {name: LINES[k % len(LINES)] for k, name in enumerate(robot.joints)}


def file_name(*parts: str) -> str:
    """The name of a figure: letters, digits, minus signs and underscores, no more than a file's name may have."""
    return "_".join(re.sub(r"[^\w-]+", "_", part) for part in parts)[:60]


def zero_at_the_end(axis: Axis, end: float, far: float, most: int) -> None:
    """Ticks at powers of ten on a logarithmic axis, at most `most`; the first is labelled 0."""
    first, last = round(np.log10(end)), int(np.ceil(np.log10(far)))
    powers = range(first, last + 1, max(1, -(-(last - first) // (most - 1))))
    axis.set_ticks([10.0**power for power in powers], ["0", *(f"$10^{{{power}}}$" for power in powers[1:])])
    axis.set_ticks([], minor=True)


# names next to their points

LETTERS = (
    np.array([0.3, 0.59, 0.11]),
    0.46,
)  # weights of red, green and blue in brightness; the largest brightness of letters
DISTANCES, LEADER = (
    np.arange(5.0, 62.0, 4.0),
    9.0,
)  # points: of a name from its point; from where it has a line to its point
DIRECTIONS = np.radians([0, 20, -20, 45, -45, 70, -70, 90, -90, 110, -110, 135, -135, 160, -160, 180])  # to a name
OVER_A_NAME, OVER_A_LINE, OUTSIDE, TO_THE_LEFT = 1e4, 10.0, 1e5, 6.0  # cost of a place; a point of distance costs 1


def name_ends(ax: Axes, ends: Sequence[tuple], size: float = 8.0) -> None:
    """Write names next to points of a panel, where they cover neither lines nor each other: (x, y, name, colour).

    The panel has its place on the paper already. A name far from its point has a thin line to it.
    """
    scale = ax.figure.dpi / 72.0  # pixels of a point
    ax.set(xlim=ax.get_xlim(), ylim=ax.get_ylim())  # which are found now, and stay
    crowd, placed, to_data = on_paper(ax), np.empty((0, 2, 2)), ax.transData.inverted().transform
    far, angles = (part.ravel() for part in np.meshgrid(DISTANCES, DIRECTIONS, indexing="ij"))
    steps = scale * far[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    corners = ax.bbox.get_points()
    for x, y, name, colour in sorted(ends, key=lambda end: -end[1]):
        at = ax.transData.transform((x, y))
        wide, high = 1.05 * scale * TextPath((0, 0), name, size=size).get_extents().width, 1.3 * scale * size
        low = at + steps - np.stack([wide * (steps[:, 0] < -1e-9), np.full(len(steps), high / 2)], axis=1)
        boxes = np.stack([low, low + [wide, high]], axis=1)  # (places, corners, 2)
        cost = far + TO_THE_LEFT * (1.0 - np.cos(angles)) + OVER_A_LINE * overlaps(boxes, crowd[:, None], 1.0)
        cost += OVER_A_NAME * overlaps(boxes, placed, (8.0, 0.0))
        cost += OUTSIDE * ((low < corners[0]).any(axis=1) + 1.0 * (boxes[:, 1] > corners[1]).any(axis=1))
        best = np.argmin(cost)
        box, placed = boxes[best], np.concatenate([placed, boxes[[best]]])
        halo = [withStroke(linewidth=1.5, foreground="white")]
        start = to_data((box[0, 0], box[:, 1].mean()))
        ax.text(*start, name, color=in_letters(colour), fontsize=size, va="center", path_effects=halo)
        if far[best] > LEADER:
            near = to_data(np.clip(at, *box))
            ax.plot([x, near[0]], [y, near[1]], color=colour, linewidth=0.5, zorder=1.5, label="_leader")


def overlaps(boxes: np.ndarray, others: np.ndarray, margin) -> np.ndarray:
    """How many of the others, (n, 1 or 2 corners, 2), each box with a margin overlaps, (boxes,)."""
    low, high = boxes[:, None, 0] - margin, boxes[:, None, 1] + margin
    return ((others[:, -1] > low) & (others[:, 0] < high)).all(axis=-1).sum(axis=1)


def in_letters(colour: str) -> tuple[float, float, float]:
    rgb, (weights, brightest) = np.array(to_rgb(colour)), LETTERS
    return tuple(rgb * brightest / max(brightest, float(rgb @ weights)))


def on_paper(ax: Axes) -> np.ndarray:
    """Points on all lines of a panel, close to each other, (n, 2), pixels."""
    points = [np.empty((0, 2))]
    for line in ax.lines:
        if line.get_transform() == ax.transData:
            path = ax.transData.transform(line.get_xydata())
            path = path[np.isfinite(path).all(axis=1)]
            points.append(path)
            for start, end in pairwise(path if line.get_linestyle() != "None" else ()):
                count = min(300, 1 + int(np.abs(end - start).max() / 3.0))
                points.append(start + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - start))
    return np.concatenate(points)


def pixels(figure: Figure) -> np.ndarray:
    """A figure as it is saved, (height, width, 4), drawn once: `savefig` would draw it once more to find its places.

    A text with a $ is no formula, unless it is a number of an axis.
    """
    for text in figure.findobj(Text):
        text.set_parse_math("$" not in text.get_text() or NUMBER.fullmatch(text.get_text()) is not None)
    figure.set_dpi(STYLE["savefig.dpi"])
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())
