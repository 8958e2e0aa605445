"""How figures look. Colours are Okabe and Ito's, for the colour-blind; lines differ in dash and marker too.

A function that draws returns (file name, figure, caption), and computes nothing but positions on paper.
"""

import re
import warnings
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from ..robots import Robot

Line = tuple[str, Any]  # colour, dash
BLUE, ORANGE, GREEN, RED, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#666666"
PINK, SKY = "#CC79A7", "#56B4E9"
# of joints
DASHES: tuple[Any, ...] = "-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1))
LINES = tuple(zip((BLUE, RED, GREEN, ORANGE, PINK, SKY), DASHES))
DPI = 110
WIDTH = 7.5  # inches, a page
NUMBER = re.compile(r"\$(\\mathdefault\{)?[-0-9.^{}]*(\\times10)?[-0-9.^{}]*\$")  # of an axis, as a formula
matplotlib.rc("font", size=9)
matplotlib.rc("axes", titlesize=9, grid=True, axisbelow=True)
matplotlib.rc("grid", alpha=0.3)
matplotlib.rc("legend", frameon=False)
matplotlib.rc("savefig", dpi=DPI)
# names that leave no room for what is drawn, or have letters that no font has
warnings.filterwarnings("ignore", "constrained_layout not applied|Glyph .* missing from")


def joint_lines(robot: Robot) -> dict[str, Line]:
    return {name: LINES[k % len(LINES)] for k, name in enumerate(robot.joints)}


def file_name(*parts: str) -> str:
    """The name of a figure: letters, digits, minus signs and underscores, not too many."""
    return "_".join(re.sub(r"[^\w-]+", "_", part) for part in parts)[:60]


def zero_at_the_end(axis: Axis, end: float, far: float, most: int) -> None:
    """Ticks at powers of ten on a logarithmic axis, at most `most`; the first is labelled 0."""
    first, last = round(np.log10(end)), int(np.ceil(np.log10(far)))
    powers = range(first, last + 1, max(1, -(-(last - first) // (most - 1))))
    axis.set_ticks([10.0**power for power in powers], ["0", *(f"$10^{{{power}}}$" for power in powers[1:])])
    axis.set_ticks([], minor=True)


def pixels(figure: Figure) -> np.ndarray:
    """A figure as it is saved, (height, width, 4), drawn once: `savefig` would draw it once more."""
    for text in figure.findobj(Text):
        text.set_parse_math("$" not in text.get_text() or NUMBER.fullmatch(text.get_text()) is not None)
    figure.set_dpi(DPI)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())
