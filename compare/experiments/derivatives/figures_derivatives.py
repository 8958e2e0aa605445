"""The figure of derivatives: the error of differences against their eps."""

from matplotlib.figure import Figure

from ...core.check import Result
from ...core.finding import Finding
from ...report.style import BLUE, DASHES, GREY, ORANGE, RED, WIDTH


def draw_errors(result: Result) -> tuple[str, Figure, Finding]:
    fig = Figure(figsize=(WIDTH, 4.2), layout="constrained")
    ax = fig.subplots()
    rows = [(row.way, row.eps, row.error) for row in result.rows]
    rows += [
        ("standing, centred", row.eps, row.error) for row in result.tables.get("contact_derivatives", ())
    ]
    ways = dict.fromkeys(way for way, eps, error in rows if eps and error is not None)
    for way, colour, dash in zip(ways, (BLUE, RED, ORANGE), DASHES):
        points = [(eps, error) for name, eps, error in rows if name == way and error is not None]
        ax.plot(*zip(*points), label=way, color=colour, linestyle=dash, marker="o", markersize=4)
    exact = [error for _, eps, error in rows if not eps and error]
    ax.axhline(max(exact, default=1e-17), color=GREY, linestyle=":", linewidth=1.5, label="tmt, exact")
    ax.set(
        xscale="log", yscale="log", xlabel="eps of the difference", ylabel="error, of the largest of a block"
    )
    fig.legend(loc="outside upper center", ncols=3, fontsize=8)
    answer = next(text for text in result.top if text.kind == "answer")
    return "derivatives_errors", fig, result.finding("errors_caption", **answer.values)
