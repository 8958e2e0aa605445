"""How figures look. Colours are Okabe and Ito's, which the colour-blind can tell apart; lines differ in dash and markers too.

A function that draws returns (file name, figure, caption), and computes nothing but positions on paper.
"""

import re

import matplotlib

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


def file_name(start: str, scene: str) -> str:
    """The name of a scene's figure: letters, digits, minus signs and underscores."""
    return start + "_" + re.sub(r"[^\w-]+", "_", scene)


def plain(text: str) -> str:
    """A name as it is drawn: a dollar sign begins no formula."""
    return text.replace("$", r"\$")
