"""How figures look. Colours are Okabe and Ito's, which the colour-blind can tell apart; lines differ in dash and markers too.

A function that draws returns (file name, figure, caption), and computes nothing but positions on paper.
"""

import re
from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
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
    """A name as it is drawn: a dollar sign begins no formula."""
    return text.replace("$", r"\$")


def zero_at_the_end(axis: Axis, end: float, far: float, most: int) -> None:
    """Powers of ten on a logarithmic axis, so many at most, from a small number, which stands for 0, to one far above."""
    first, last = round(np.log10(end)), int(np.ceil(np.log10(far)))
    powers = range(first, last + 1, max(1, -(-(last - first) // (most - 1))))
    axis.set_ticks([10.0**power for power in powers], ["0", *(f"$10^{{{power}}}$" for power in powers[1:])])
    axis.minorticks_off()


# labels beside what they name

HEIGHT_OF_TEXT = 1.3  # of its size
FARTHEST_NAME = 45.0  # points: the farthest that a name stands from its point
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
    """Write names beside points of a panel, where they cover neither lines nor each other: (x, y, name, colour).

    The panel has its limits and its place on the paper already. A name that stands away from its point has a thin line to it.
    """
    scale = ax.figure.dpi / 72.0  # pixels of a point
    frame, taken = ax.bbox.extents, []
    crowd = on_paper(ax) if ends else np.empty((0, 2))
    angles = np.radians([0, 20, -20, 45, -45, 70, -70, 90, -90, 110, -110, 135, -135, 160, -160, 180])
    for x, y, name, colour in sorted(ends, key=lambda end: -end[1]):
        wide, high = text_width(name, size) * scale, HEIGHT_OF_TEXT * size * scale
        at = ax.transData.transform((x, y))
        best = None
        for far in np.arange(5.0, FARTHEST_NAME, 4.0) * scale:
            for angle in angles:
                step = far * np.array([np.cos(angle), np.sin(angle)])
                left = at[0] + step[0] - (0.0 if step[0] >= -1e-9 else wide)
                box = np.array([left, at[1] + step[1] - high / 2, left + wide, at[1] + step[1] + high / 2])
                worse = OVER_A_LINE * np.sum(within(crowd, box)) + OVER_A_LABEL * sum(
                    meet(box, other) for other in taken
                )
                worse += OUTSIDE * (box[:2] < frame[:2]).any() + OUTSIDE * (box[2:] > frame[2:]).any()
                worse += far / scale + TO_THE_LEFT * (1.0 - np.cos(angle))
                if best is None or worse < best[0]:
                    best = worse, box, far
        _, box, far = best
        taken.append(box)
        place = ax.transData.inverted().transform((box[0], (box[1] + box[3]) / 2))
        ax.text(*place, name, color=colour, fontsize=size, va="center", ha="left",
                path_effects=[withStroke(linewidth=1.5, foreground="white")])  # fmt: skip
        if far > 9.0 * scale:
            near = ax.transData.inverted().transform(np.clip(at, box[:2], box[2:]))
            ax.plot([x, near[0]], [y, near[1]], color=colour, linewidth=0.5, zorder=1.5, label="_leader")


def text_width(text: str, size: float) -> float:
    """How wide a text is, points."""
    return TextPath((0, 0), text, size=size).get_extents().width


def on_paper(ax: Axes) -> np.ndarray:
    """Points on all lines of a panel, close to each other, (n, 2), pixels."""
    points = [np.empty((0, 2))]
    for line in ax.lines:
        path = ax.transData.transform(line.get_xydata()) if line.get_transform() == ax.transData else np.empty((0, 2))
        path = path[np.isfinite(path).all(axis=1)]
        if line.get_linestyle() == "None":
            points.append(path)
            continue
        for start, end in zip(path[:-1], path[1:]):
            count = min(300, 1 + int(np.abs(end - start).max() / 3.0))
            points.append(start + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - start))
    return np.concatenate(points)


def within(points: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Which points, (n, 2), are in a box: left, lower, right, upper."""
    return ((points >= box[:2] - 1.0) & (points <= box[2:] + 1.0)).all(axis=1)


def meet(box: np.ndarray, other: np.ndarray) -> bool:
    """Whether two boxes overlap."""
    return bool((box[:2] < other[2:]).all() and (other[:2] < box[2:]).all())
