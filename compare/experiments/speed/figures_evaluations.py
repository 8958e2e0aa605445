"""The figure of what one evaluation of the dynamics costs."""

from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ...judge.check import Result
from ...report.style import BLUE, GREY, ORANGE, WIDTH
from .evaluations import FORWARD, WHOLE
from .ways import EACH


def draw_cost(result: Result, name: str) -> tuple[str, Figure, str]:
    """What one evaluation costs, way by way; name: of the robot."""
    rows = [row for row in result.tables["evaluations"] if row["quantity"] == FORWARD and row["ns_per_state"]]
    fig = Figure(figsize=(WIDTH, 0.9 + 0.24 * len(rows)), layout="constrained")
    ax = fig.subplots()
    names = [f"{r['implementation']}, {r['states']:,} state{'s' * (r['states'] > 1)}"
             + (f", {r['threads']} threads" if r["threads"] > 1 else "") for r in rows]  # fmt: skip
    values = [r["ns_per_state"] for r in rows]
    whose = {"MuJoCo": ORANGE, "heyoka": GREY, "Pinocchio": GREY}
    colours = [whose.get(r["implementation"].split(",")[0], BLUE) for r in rows]
    ax.barh(range(len(rows)), values, color=colours, height=0.7)
    for k, value in enumerate(values):
        ax.text(value * 1.1, k, spelled(value), va="center", fontsize=8)
    ax.set_yticks(range(len(rows)), names, fontsize=8)
    ax.set(xscale="log", xlabel="ns per state")
    ax.grid(axis="y", visible=False)
    ax.margins(y=0.01)
    looks = [(BLUE, "tmt"), (ORANGE, "MuJoCo"), (GREY, "others")]
    looks = [(colour, name) for colour, name in looks if colour in colours]
    if looks:
        fig.legend(
            handles=[Patch(color=colour, label=name) for colour, name in looks], loc="outside upper center", ncols=3
        )
    caption = f"Forward dynamics of the {name} for one state."
    if rows:
        ax.set_xlim(min(values) / 2, max(values) * 16)  # the longest bar has its number beside it
        slow, fast = (names[values.index(pick(values))] for pick in (max, min))
        caption = (
            f"Forward dynamics of the {name} for one state: from {spelled(max(values))} ns ({slow}) to {spelled(min(values))} ns "
            f"({fast})."
        )
    whole = next((r["ns_per_state"] for r in rows if r["implementation"] == WHOLE), None)
    caption += f" MuJoCo's mj_forward takes {spelled(whole)} ns." if whole else ""
    caption += " Blue is tmt, orange MuJoCo, grey are others."
    if EACH in {r["implementation"] for r in rows}:
        caption += f" tmt's compiled code is made for this one {name}."
    return "speed_evaluation_cost", fig, caption


def spelled(value: float) -> str:
    """Nanoseconds in three digits or so."""
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}"
