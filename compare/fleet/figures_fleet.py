"""The figure of a fleet: the step of each file as a share of its stable limit."""

import base64
import io
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from ..report.images import with_palette
from ..report.style import BLUE, GREY, RED, WIDTH, pixels, plain
from ..report.text import block

MAX_NAMED, MAX_NAME = 40, 40  # files with their names at the axis; letters of a name


def picture_of(rows: Sequence[dict]) -> dict | None:
    """The figure as PNG: source, caption, width, height; None if fewer than two files have a limit. rows: of the table."""
    limited = [row for row in rows if row["limit_s"] and row["file_dt_s"]]
    if len(limited) < 2:
        return None
    file = io.BytesIO()
    image = with_palette(Image.fromarray(pixels(draw_steps(limited))).convert("RGB"))
    image.save(file, "PNG")
    caption = " ".join(block("fleet", "steps", shown=len(limited), files=len(rows)).split())
    source = f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
    return {"source": source, "caption": caption, "width": image.size[0], "height": image.size[1]}


def draw_steps(limited: list[dict]) -> Figure:
    """Step divided by limit, one point for each row."""
    limited.sort(key=lambda row: row["file_dt_s"] / row["limit_s"])
    share = np.array([row["file_dt_s"] / row["limit_s"] for row in limited])
    places, named = np.arange(len(limited)), len(limited) <= MAX_NAMED
    figure = Figure(figsize=(WIDTH, 1.0 + (0.19 * len(limited) if named else 4.0)), layout="constrained")
    ax = figure.subplots()
    for mask, colour, marker, label in (
        (share <= 1.0, BLUE, "o", "stable"),
        (share > 1.0, RED, "D", "unstable"),
    ):
        if mask.any():
            ax.plot(share[mask], places[mask], marker, color=colour, markersize=5 if named else 3, label=label)
    ax.axvline(1.0, color=GREY, linestyle="--", linewidth=1.0, label="limit")
    low, high = min(share.min(), 0.5), max(share.max(), 2.0)
    ax.set(
        xscale="log",
        xlim=(low / 1.3, high * 1.3),
        ylim=(-0.8, len(limited) - 0.2),
        xlabel="step of the file / largest stable step",
    )
    if named:
        names = [
            row["file"] if len(row["file"]) <= MAX_NAME else f"...{row['file'][3 - MAX_NAME :]}" for row in limited
        ]
        ax.set_yticks(places, [plain(name) for name in names])
    else:
        ax.set_ylabel("files, sorted by this ratio")
    ax.grid(axis="y", visible=False)
    figure.legend(loc="outside upper right", ncols=3)
    return figure
