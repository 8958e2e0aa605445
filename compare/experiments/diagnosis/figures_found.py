"""Figures of the diagnosis. Each function returns (file name, figure, caption)."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ...judge.check import Result
from ...judge.scale import EPS
from ...report.style import BLUE, GREEN, GREY, ORANGE, RED, WIDTH, plain


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


def draw_outcomes(result: Result) -> tuple[str, Figure, str]:
    """How many made faults of each kind were found, by outcome."""
    counts = result.curves["outcomes"]  # kind: {outcome: count}
    colours = {"right": GREEN, "tied": BLUE, "invisible": GREY, "none": ORANGE, "wrong": RED}
    fig = Figure(figsize=(WIDTH, 0.9 + 0.25 * len(counts)), layout="constrained")
    ax, start = fig.subplots(), np.zeros(len(counts))
    for outcome, colour in colours.items():
        values = np.array([of.get(outcome, 0) for of in counts.values()])
        ax.barh(range(len(counts)), values, left=start, color=colour, label=outcome)
        start += values
    ax.set(xlabel="made faults", yticks=range(len(counts)))
    ax.set_yticklabels(map(plain, counts))
    ax.invert_yaxis()
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    total = {outcome: sum(of.get(outcome, 0) for of in counts.values()) for outcome in colours}
    visible = sum(total.values()) - total["invisible"]
    caption = (
        f"Made faults by kind and outcome. Of {visible} that change M, h or accelerations {total['right']} are named, "
        f"{total['tied']} named beside others that do the same, {total['none']} not explained and {total['wrong']} explained by "
        "something else."
    )
    return "diagnosis_outcomes", fig, caption
