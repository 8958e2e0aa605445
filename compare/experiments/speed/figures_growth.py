"""The figure of what forward dynamics cost as a chain grows."""

from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from ...judge.check import Result
from ...report.style import BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY, WIDTH
from .growth import cost_by_joints, label

# colour, dash and mark of each implementation
LOOKS = {
    "literal": (GREY, ":", "o"),
    "mj_forward": (ORANGE, "-", "s"),
    "mujoco_equal_work": (RED, "--", "D"),
    "mujoco_batch": (ORANGE, ":", "^"),
    "pinocchio_aba": (PINK, "-.", "v"),
    "straight_line": (BLUE, "-", "P"),
    "loop": (GREEN, "-", "X"),
    "loop_lanes": (SKY, "--", "*"),
}


def draw_chain(result: Result) -> tuple[str, Figure, str]:
    """Nanoseconds of a state against joints, a line for each implementation, with its exponent."""
    rows, powers = result.tables["growth"], result.curves["exponents"]
    fig = Figure(figsize=(WIDTH, 5.6), layout="constrained")
    # what is in Python is far above what is compiled
    upper, lower = fig.subplots(2, 1, sharex=True, height_ratios=(1, 2.5))
    for name in dict.fromkeys(row["implementation"] for row in rows):
        times = cost_by_joints(rows, name)
        colour, dash, mark = LOOKS.get(name, (GREY, "-", "x"))
        power = f" ($n^{{{powers[name].power:.2f}}}$)" if name in powers else ""
        (upper if name == "literal" else lower).plot(
            list(times), list(times.values()), color=colour, linestyle=dash, marker=mark, markersize=5, linewidth=1.2,
            label=label(name) + power,
        )  # fmt: skip
    numbers = list(dict.fromkeys(row["n"] for row in rows))
    for ax in (upper, lower):
        ax.set(xscale="log", yscale="log", ylabel="ns per state")
    lower.set_xlabel("joints of the chain, n")
    lower.set_xticks(numbers, [str(n) for n in numbers])
    lower.xaxis.set_minor_locator(NullLocator())
    fig.legend(loc="outside upper center", ncols=3, fontsize=8)
    fitted = {(power.first, power.last) for power in powers.values()}
    ranges = " and ".join(f"{first} to {last}" for first, last in sorted(fitted, reverse=True))
    caption = (
        f"What a state takes, forward dynamics of a chain of 1 to {max(numbers)} hinges, none of them along a coordinate axis; "
        "above the literal form in Python, below what is compiled, one state after the other but in lanes and in MuJoCo's batch."
    )
    caption += f" Powers of n are fitted by least squares to the logarithms, over {ranges} joints." if fitted else ""
    return "speed_growth", fig, caption
