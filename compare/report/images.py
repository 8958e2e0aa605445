"""Figures as small PNG files with a palette, and inside a page."""

import base64
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from PIL import Image

PALETTE = 255  # colours, and white: a chart has fewer that the eye tells apart


def save_figure(figure: Any, path: Path) -> None:
    """A figure of matplotlib as a PNG whose paper stays white; any other figure writes its own file."""
    if path.suffix != ".png":
        figure.savefig(path)
        return
    from .style import pixels  # matplotlib is for the process that draws

    image = Image.fromarray(pixels(figure)).convert("RGB")
    reduced = image.quantize(PALETTE, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    palette, places = (reduced.getpalette() or [])[: 3 * PALETTE], np.array(reduced)
    places[(np.asarray(image) == 255).all(axis=2)] = PALETTE
    reduced = Image.fromarray(places)
    reduced.putpalette([*palette, *[0] * (3 * PALETTE - len(palette)), 255, 255, 255])
    reduced.save(path, optimize=True)


def embedded(path: Path) -> tuple[Markup, int, int]:
    """The address of a figure inside a page, with its data; its width and height, or OSError."""
    with Image.open(path) as image:
        width, height = image.size
    data = base64.b64encode(path.read_bytes()).decode()
    return Markup(f"data:image/{path.suffix[1:]};base64,{data}"), width, height
