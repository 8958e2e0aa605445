"""Figures as files, small and sharp: on disk with a palette, in the page whichever of PNG and WebP is smaller."""

import base64
import importlib
from pathlib import Path

import numpy as np
from PIL import Image

PALETTE = 255  # colours, and white: a chart has fewer that the eye tells apart
COARSE = 3.0  # of 255: largest mean change of the colours
MEDIA = {".png": "image/png", ".webp": "image/webp", ".gif": "image/gif"}


def save_figure(figure: object, path: Path) -> None:
    """A figure of matplotlib as a PNG with a palette; also, until the page is written, as a lossless WebP."""
    if path.suffix != ".png":  # a figure that writes its own files
        figure.savefig(path)
        return
    pixels = importlib.import_module(".style", __package__).pixels(figure)
    few = with_palette(Image.fromarray(pixels).convert("RGB"))
    few.save(path)
    few.convert("RGB").save(path.with_suffix(".webp"), lossless=True, method=1)


def with_palette(image: Image.Image) -> Image.Image:
    """An image of few colours in which white paper stays white."""
    whole = np.asarray(image, dtype=np.int16)
    paper = (whole == 255).all(axis=2)
    for method in (
        Image.Quantize.FASTOCTREE,
        Image.Quantize.MEDIANCUT,
    ):  # the other one where the fast one is too coarse
        few = image.quantize(PALETTE, method=method, dither=Image.Dither.NONE)
        off = np.abs(whole - np.asarray(few.convert("RGB"))).max(axis=2)
        if off.sum(where=~paper) <= COARSE * max(1, (~paper).sum()):
            break
    palette = few.getpalette()[: 3 * PALETTE]
    places = np.array(few)
    places[paper] = PALETTE
    few = Image.fromarray(places)
    few.putpalette([*palette, *[0] * (3 * PALETTE - len(palette)), 255, 255, 255])
    return few


def embedded(path: Path) -> tuple[str, int, int]:
    """A figure inside a page, as the smaller of its files: the address with all its data, and its width and height in pixels.

    OSError if there is no such figure.
    """
    webp = path.with_suffix(".webp")
    least = min([path, *([webp] if webp.exists() else [])], key=lambda file: file.stat().st_size)
    with Image.open(path) as image:
        width, height = image.size
    return f"data:{MEDIA[least.suffix]};base64,{base64.b64encode(least.read_bytes()).decode()}", width, height


def moves(file: str) -> bool:
    """Whether a figure is a GIF, by its name: the page has what moves in another way."""
    return file.endswith(".gif")


def clear_webp(folder: Path) -> None:
    for path in folder.glob("*.webp"):
        path.unlink()
