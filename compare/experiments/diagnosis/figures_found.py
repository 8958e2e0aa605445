"""Figures of the diagnosis. Each function returns (file name, figure, caption)."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ...judge.check import Result
from ...judge.scale import EPS
from ...report.style import GREEN, GREY, WIDTH, plain


def draw_nearest(result: Result) -> tuple[str, Figure, str]:
    """What each of the single explanations that come closest leaves of the difference."""
    names, left = zip(*result.curves["nearest"])
    left = np.maximum(left, EPS)
    fig = Figure(figsize=(WIDTH, 0.9 + 0.25 * len(names)), layout="constrained")
    ax = fig.subplots()
    explaining = {row["place"] for row in result.rows}
    colours = [GREEN if name in explaining else GREY for name in names]
    ax.barh(range(len(names)), left, left=0.0, color=colours)
    ax.set(xscale="log", xlim=(EPS / 3.0, 1.5), xlabel="left of the difference, share", yticks=range(len(names)))
    ax.set_yticklabels(map(plain, names))
    ax.invert_yaxis()
    looks = ((GREEN, "explains the difference down to rounding"), (GREY, "does not"))
    fig.legend(handles=[Patch(color=colour, label=name) for colour, name in looks], loc="outside upper center", ncols=2)
    caption = (
        f"What is left of the difference of M and h when one number, term or coefficient is changed as well as it can be: "
        f"{names[0]} leaves {left[0]:.2g} of it, the next, {names[1]}, {left[1]:.2g}." if len(names) > 1
        else f"What is left of the difference of M and h: {names[0]} leaves {left[0]:.2g} of it."
    )  # fmt: skip
    return "diagnosis_nearest", fig, f"{caption} Green: it explains the difference down to rounding."
