"""The motion as a GIF: the stick figures of both engines over each other, held and let go.

Drawn without matplotlib, which takes seconds for a hundred pictures: a mask for each engine and one of text, in the colours of
one small palette. The first engine's sticks are wide with discs, MuJoCo's narrow with rings.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageChops, ImageDraw, ImageFont

from ...engines import LABELS
from ...judge.check import Result
from ...judge.finding import Finding
from ...judge.words import capital
from ...report.style import BLUE, ORANGE
from .motion import Drawn

PIXELS, TOP, BOTTOM = (640, 420), 78, 34  # pixels; and the margins for text above and below
FINE = 2  # masks are drawn larger by this factor
LEVELS = 5  # shades of each colour
CENTISECONDS, PAUSE = 4, 120  # of a picture, and of the last one of a scene
NAMES_AT = 16, 150  # pixels from the left: the engines' names
MOST_WIDE = 6  # sticks that are drawn wide


class Animation:
    """A figure that is saved as a GIF."""

    suffix = ".gif"

    def __init__(self, scenes: Sequence[Drawn], label: str):
        self.scenes, self.label = scenes, label

    def savefig(self, path: Path) -> None:
        """Write the GIF, which is played again and again."""
        pictures, times = [], []
        for scene in self.scenes:
            place = place_of(scene)
            still = text_of_scene(scene, self.label, place)
            pictures += [one_picture(scene, k, still, place) for k in range(len(scene.t))]
            times += [10 * CENTISECONDS] * (len(scene.t) - 1) + [10 * PAUSE]
        first, *others = pictures
        first.save(path, save_all=True, append_images=others, duration=times, loop=0, optimize=False)


def draw_motion(result: Result) -> tuple[str, Animation, Finding]:
    """The first two scenes that are drawn in motion, of which one is held and one let go."""
    scenes = result.curves["drawn"][:2]
    engines = [LABELS[name] for name in scenes[0].points]
    seen = [{"name": scene.scene, "run": scene.run, "seen": scene.seen.values} for scene in scenes]
    return "motion", Animation(scenes, result.label), result.finding("figure_motion", engines=engines, scenes=seen)


def place_of(scene: Drawn) -> tuple[float, np.ndarray]:
    """Pixels per m, and the pixels of the origin, (2,), so that all points of a scene are seen."""
    points = np.concatenate([path.reshape(-1, 2) for path in scene.points.values()])
    points = points[np.isfinite(points).all(axis=1)]
    low, high = points.min(axis=0), points.max(axis=0)
    room = np.array([PIXELS[0], PIXELS[1] - TOP - BOTTOM]) - 36.0
    scale = float((room / np.maximum(high - low, 1e-3)).min())
    middle = np.array([PIXELS[0], PIXELS[1] + TOP - BOTTOM]) / 2
    return scale, middle - scale * (low + high) / 2 * [1.0, -1.0]


def one_picture(scene: Drawn, k: int, still: Image.Image, place: tuple) -> Image.Image:
    """The k-th picture of a scene in the colours of the palette; still: the text in all of them."""
    scale, origin = place
    text = still.copy()
    write = partial(ImageDraw.Draw(text).text, fill=255, font=font(17))
    time, apart, gone = words_of_picture(scene, k)
    write((PIXELS[0] - 16, PIXELS[1] - 28), time, anchor="ra")
    write((16, PIXELS[1] - 28), apart)
    write((PIXELS[0] - 16, 68), gone, anchor="ra", font=font(14))
    shades = []
    for which, path in enumerate(scene.points.values()):
        mask = Image.new("L", (FINE * PIXELS[0], FINE * (PIXELS[1] - BOTTOM)))
        if np.isfinite(path[k]).all():
            points = [tuple(FINE * (origin + scale * point * [1.0, -1.0])) for point in path[k]]
            draw_sticks(ImageDraw.Draw(mask), points, scene.links, which)
        draw_sticks(ImageDraw.Draw(mask), [(FINE * (NAMES_AT[which] + x), FINE * 62) for x in (4, 36)], [(0, 1)], which)
        small = Image.new("L", PIXELS)
        small.paste(mask.reduce(FINE), (0, 0))
        shades.append(small.point(SHADES[which]))
    image = ImageChops.lighter(ImageChops.add(*shades), text.point(SHADES[2]))
    image.putpalette(SHADES_OF_ALL)
    return image


def words_of_picture(scene: Drawn, k: int) -> tuple[str, str, str]:
    """The text of the k-th picture: its time; the engines' difference, or which has diverged; which has left by then."""
    lost = [name for name, path in scene.points.items() if not np.isfinite(path[k]).all()]
    apart = "; ".join(f"{capital(LABELS[name])} has diverged" for name in lost)
    left = [(time, LABELS[name]) for name, time in scene.left.items() if time is not None and time <= scene.t[k]]
    gone = "; ".join(f"{capital(name)} has left at {time:.2f} s" for time, name in sorted(left))
    return (
        f"t = {scene.t[k]:.2f} s",
        apart or f"largest difference of a joint: {scene.apart[k]:.2g} {scene.unit}",
        gone,
    )


def draw_sticks(pen: ImageDraw.ImageDraw, points: Sequence[tuple], links: Sequence[tuple], which: int) -> None:
    """The sticks of an engine: of the first (0) wide with discs, of the other narrow with rings."""
    few = len(links) <= MOST_WIDE
    width = FINE * ((14 if few else 8), (4 if few else 3))[which]
    disc = FINE * ((7 if few else 4), (6 if few else 3))[which]
    for start, end in links:
        pen.line([points[start], points[end]], fill=255, width=width)
    for x, y in points:
        pen.ellipse([x - disc, y - disc, x + disc, y + disc], fill=255)
        if which:
            inner = disc - 3 * FINE / 2
            pen.ellipse([x - inner, y - inner, x + inner, y + inner], fill=0)


def text_of_scene(scene: Drawn, label: str, place: tuple) -> Image.Image:
    """The text in all pictures of a scene: its name, its run, the engines' names, a frame where the robot is fixed."""
    text = Image.new("L", PIXELS)
    pen = ImageDraw.Draw(text)
    pen.text((16, 10), scene.scene, fill=255, font=font(20))
    pen.text((PIXELS[0] - 16, 50), f"{scene.run}{slower(scene)}", fill=255, font=font(14), anchor="ra")
    for at, name in zip(NAMES_AT, (label, LABELS["mujoco"])):
        pen.text((at + 48, 62), name, fill=255, font=font(16), anchor="lm")
    if scene.fixed:
        x, y = place[1] + place[0] * next(iter(scene.points.values()))[0, 0] * [1.0, -1.0]
        pen.rectangle([x - 11, y - 11, x + 11, y + 11], outline=255, width=2)
    return text


def slower(scene: Drawn) -> str:
    """By what factor a scene is shown slower, in words; nothing where that is hardly seen."""
    times = CENTISECONDS / 100.0 / float(scene.t[1] - scene.t[0])
    if 0.9 < times < 1.1:
        return ""
    return f", shown {times:.2g} times slower" if times > 1.0 else f", shown {1.0 / times:.2g} times faster"


def font(size: int) -> ImageFont.FreeTypeFont:
    """The font of all figures, size in pixels."""
    if size not in FONTS:
        FONTS[size] = ImageFont.truetype(
            str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), size
        )
    return FONTS[size]


def palette() -> bytes:
    """The colours: shades of both figures over each other on white, then of the text."""
    white, black = np.full(3, 255.0), np.full(3, 26.0)
    blue, orange = (np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)], float) for colour in (BLUE, ORANGE))
    share = np.linspace(0.0, 1.0, LEVELS)[:, None, None]
    under = white + share * (blue - white)
    both = under + share.reshape(1, LEVELS, 1) * (orange - under)
    dark = white + share[:, 0] * (black - white)
    return np.concatenate([both.reshape(-1, 3), dark]).round().astype(np.uint8).tobytes()


FONTS: dict[int, ImageFont.FreeTypeFont] = {}
SHADE = [round(level * (LEVELS - 1) / 255.0) for level in range(256)]
# of a mask's level, its part of the palette's index: of the first engine, of MuJoCo, which lies over it, of text
SHADES = [LEVELS * shade for shade in SHADE], SHADE, [shade and LEVELS**2 + shade for shade in SHADE]
SHADES_OF_ALL = palette()
