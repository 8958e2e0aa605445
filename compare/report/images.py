"""Figures as files, small and sharp: on disk with a palette, in the page whichever of PNG and WebP is smaller."""

import base64
import io
from pathlib import Path

from PIL import Image

PALETTE = 256  # of a palette: a chart has fewer that the eye tells apart
MEDIA = {".png": "image/png", ".webp": "image/webp", ".gif": "image/gif"}


def save_figure(figure: object, path: Path) -> None:
    """A figure of matplotlib as a PNG with a palette; beside it, until the page is written, as a WebP without loss."""
    if path.suffix != ".png":  # a figure that writes its own files
        figure.savefig(path)
        return
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png", pil_kwargs={"compress_level": 0})
    with Image.open(drawn) as image:
        few = image.convert("RGB").quantize(PALETTE, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    few.putpalette(
        [255 if part > 251 else 0 if part < 4 else part for part in few.getpalette()]
    )  # white and black stay so
    few.save(path)
    few.convert("RGB").save(path.with_suffix(".webp"), lossless=True, method=1)


def embedded(path: Path) -> tuple[str, int, int]:
    """A figure inside a page, as the smaller of its files: the address with all its data, and its width and height in pixels.

    OSError if there is no such figure.
    """
    beside = path.with_suffix(".webp")
    least = min([path, *([beside] if beside.exists() else [])], key=lambda file: file.stat().st_size)
    with Image.open(path) as image:
        width, height = image.size
    return f"data:{MEDIA[least.suffix]};base64,{base64.b64encode(least.read_bytes()).decode()}", width, height


def moves(file: str) -> bool:
    """Whether a figure is a GIF, by its name: the page has what moves in another way."""
    return file.endswith(".gif")


def clear_webp(folder: Path) -> None:
    """Take away the files that were for the page alone."""
    for path in folder.glob("*.webp"):
        path.unlink()
