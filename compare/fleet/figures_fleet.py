"""The picture of a fleet: each file's own step beside the limit of its servos."""

import io
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from ..report.images import with_palette
from ..report.style import BLUE, GREY, RED, WIDTH, pixels, plain

MOST_NAMED_FILES, LONGEST_FILE = 40, 40  # files with a name beside their points; letters of a name
STEP_CAPTION = (
    "Each file's own step as a share of the largest step that is stable with its own integrator, under its own servos, springs "
    "and damping, at the posture where that is least: right of the line it is not stable. {} of {} files have such a limit."
)


def draw_steps(rows: Sequence[dict]) -> tuple[str, Figure, str] | None:
    """The figure; None where fewer than two files have a limit. rows: of the table."""
    known = [row for row in rows if row["limit_s"] and row["file_dt_s"]]
    if len(known) < 2:
        return None
    known.sort(key=lambda row: row["file_dt_s"] / row["limit_s"])
    share = np.array([row["file_dt_s"] / row["limit_s"] for row in known])
    places, named = np.arange(len(known)), len(known) <= MOST_NAMED_FILES
    figure = Figure(figsize=(WIDTH, 1.0 + (0.19 * len(known) if named else 4.0)), layout="constrained")
    ax = figure.subplots()
    for of, colour, marker, label in (
        (share <= 1.0, BLUE, "o", "within its limit"),
        (share > 1.0, RED, "D", "above it"),
    ):
        if of.any():
            ax.plot(share[of], places[of], marker, color=colour, markersize=5 if named else 3, label=label)
    ax.axvline(1.0, color=GREY, linestyle="--", linewidth=1.0, label="the limit")
    low, high = min(share.min(), 0.5), max(share.max(), 2.0)
    ax.set(xscale="log", xlim=(low / 1.3, high * 1.3), ylim=(-0.8, len(known) - 0.2), xlabel="own step / limit")
    if named:
        names = [
            row["file"] if len(row["file"]) <= LONGEST_FILE else f"...{row['file'][3 - LONGEST_FILE :]}"
            for row in known
        ]
        ax.set_yticks(places, [plain(name) for name in names])
    else:
        ax.set_ylabel("files, in this order")
    ax.grid(axis="y", visible=False)
    figure.legend(loc="outside upper right", ncols=3)
    return "fleet_steps", figure, STEP_CAPTION.format(len(known), len(rows))


def picture_of(rows: Sequence[dict]) -> tuple[bytes, str, tuple[int, int]] | None:
    """The figure as PNG, its caption, its width and height in pixels; None where there is nothing to draw."""
    drawn = draw_steps(rows)
    if drawn is None:
        return None
    _, figure, caption = drawn
    image = with_palette(Image.fromarray(pixels(figure)).convert("RGB"))
    file = io.BytesIO()
    image.save(file, "PNG")
    return file.getvalue(), caption, image.size
