"""The figure of the diagnosis."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ...judge.check import Result
from ...judge.finding import Finding
from ...judge.scale import EPS
from ...report.style import GREEN, GREY, WIDTH, plain


def draw_nearest(result: Result) -> tuple[str, Figure, Finding]:
    """The share of the difference that remains after each of the best single corrections."""
    names, left = zip(*result.curves["nearest"])
    left = np.maximum(left, EPS)
    fig = Figure(figsize=(WIDTH, 0.9 + 0.25 * len(names)), layout="constrained")
    ax = fig.subplots()
    explaining = {row["place"] for row in result.rows}
    ax.barh(range(len(names)), left, color=[GREEN if name in explaining else GREY for name in names])
    ax.set(xscale="log", xlim=(EPS / 3.0, 1.5), xlabel="remaining share of the difference", yticks=range(len(names)))
    ax.set_yticklabels(map(plain, names))
    ax.invert_yaxis()
    looks = ((GREEN, "explains the difference down to rounding"), (GREY, "does not explain it"))
    fig.legend(handles=[Patch(color=colour, label=name) for colour, name in looks], loc="outside upper center", ncols=2)
    return "diagnosis_nearest", fig, result.finding("nearest", names=names[:2], left=left[:2].tolist())
