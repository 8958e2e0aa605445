"""Figures as small PNG files with a palette, and inside a page."""

import base64
from pathlib import Path

import numpy as np
from markupsafe import Markup
from PIL import Image

PALETTE = 255  # colours, and white: a chart has fewer that the eye tells apart


def save_figure(figure: object, path: Path) -> None:
    """A figure of matplotlib as a PNG in which white paper stays white; any other figure writes its own file."""
    if path.suffix != ".png":
        figure.savefig(path)
        return
    from .style import pixels  # matplotlib is for the process that draws

    whole = Image.fromarray(pixels(figure)).convert("RGB")
    few = whole.quantize(PALETTE, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    palette, places = few.getpalette()[: 3 * PALETTE], np.array(few)
    places[(np.asarray(whole) == 255).all(axis=2)] = PALETTE
    few = Image.fromarray(places)
    few.putpalette([*palette, *[0] * (3 * PALETTE - len(palette)), 255, 255, 255])
    few.save(path, optimize=True)


def embedded(path: Path) -> tuple[str, int, int]:
    """A figure inside a page: the address with all its data, its width and height in pixels. OSError if there is none."""
    with Image.open(path) as image:
        width, height = image.size
    return Markup(f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}"), width, height
