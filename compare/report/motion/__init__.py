"""The motion in the page: stick figures of both engines, with a slider; it fetches nothing."""

import json
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from ...core.finding import Finding
from ...core.pictures import Pictures
from ...core.text import environment, say
from ...core.words import capital, scene_of
from ..verdict import Section, failures

MOST_BYTES = 280_000  # of the motion in the page
STICK_BYTES = 48  # of a stick in the picture without script
LARGEST_STRIDE = 8  # every eighth picture of each scene is shown before scenes are left out
WIDE, HIGH, BORDER = 1000, 480, 45  # of the drawing, in its own units
SHOWN_FOR = 5.0  # s, at least about: a shorter scene is shown slower
SCRIPT = Markup(
    (Path(__file__).parent / "motion.js").read_text(encoding="utf-8")
)  # the only one that the page may run
Outline = list[int] | None  # x and y of each point of a picture in the drawing; None: the run has diverged


def motion_in_html(sections: Sequence[Section], noun: str) -> str:
    """A <figure> with its style and data, for SCRIPT, at most 300 kB; "" where no scene is drawn.

    It opens on a scene in which the engines differ, if there is one. To stay small, it has every second,
    fourth ... picture, then fewer scenes, with a note.
    """
    section = next((section for section in sections if getattr(section.result, "pictures", None)), None)
    if section is None:
        return ""
    drawn: list[Pictures] = section.result.pictures  # type: ignore[attr-defined]  # of a TrajectoryResult
    names = [pictures.scene for pictures in drawn]
    differing = {scene_of(check.scene, names) for check in failures([section]).differing}
    drawn = sorted(drawn, key=lambda pictures: pictures.scene not in differing)
    engines = [capital(section.result.label), "MuJoCo"]
    data, stride, scenes = inlined(drawn, engines)
    still = stride * scenes[0]["still"]
    first, second = (outline(path[still], drawn[0].links) for path in on_page(drawn[0]))
    wide, ring = (20, 16) if drawn[0].few_sticks else (9, 7)
    values: dict[str, Any] = {
        "ours": engines[0],
        "theirs": engines[1],
        "scenes": scenes,
        "data": Markup(data),
        "noun": noun,
    }
    values |= {"width": WIDE, "height": HIGH, "wide": wide, "ring": ring, "first": first, "second": second}
    values |= {"stride": stride, "left_out": [pictures.scene for pictures in drawn[len(scenes) :]]}
    text = environment().get_template("motion.html.jinja").render(values)
    return re.sub(r"\n\s*\n", "\n", text)  # an empty line would end the HTML inside of Markdown


def inlined(drawn: Sequence[Pictures], engines: Sequence[str]) -> tuple[str, int, list[dict[str, Any]]]:
    """The scenes as JSON for a page, the stride over their pictures, and the scenes that are in it."""
    stride, count = 1, len(drawn)
    while True:
        scenes = [inlined_scene(pictures, stride) for pictures in drawn[:count]]
        text = json.dumps({"engines": engines, "scenes": scenes}, separators=(",", ":"), allow_nan=False)
        text = text.replace("<", "\\u003c")
        if len(text.encode()) + STICK_BYTES * len(scenes[0]["links"]) <= MOST_BYTES:
            return text, stride, scenes
        if stride < LARGEST_STRIDE or count == 1:
            stride *= 2
        else:
            count -= 1


def inlined_scene(pictures: Pictures, stride: int) -> dict[str, Any]:
    """One scene as the script has it: of each engine a list of pictures, x and y of each point.

    A picture is 0 if it is the one before, 1 if it is that of the first engine, None if the run has diverged.
    """
    slower = max(1.0, pictures.slower(SHOWN_FOR / (len(pictures.t) - 1)))
    first, mujoco = (path[::stride] for path in on_page(pictures))
    dt, start = stride * float(pictures.t[1] - pictures.t[0]), first[0] or [0, 0]
    about = {"scene": pictures.scene, "run": pictures.run, "seen": say(pictures.seen), "slower": slower}
    return {
        "name": pictures.scene,
        "seen": say(Finding("trajectory", "picture_in_page", about)),
        "dt": dt,
        "pause": max(1, round(1000.0 * dt * slower)),
        "unit": pictures.unit,
        "still": max(k for k, both in enumerate(zip(first, mujoco)) if None not in both),
        "base": "M{} {}m-18-18h36v36h-36z".format(*start[:2]) if pictures.fixed else "",
        "links": pictures.links,
        "apart": [float(f"{off:.1e}") if math.isfinite(off) else None for off in pictures.apart[::stride]],
        "paths": [shorter(first, [[]] * len(first)), shorter(mujoco, first)],
    }


def on_page(pictures: Pictures) -> list[list[Outline]]:
    """For each engine and picture the integers that are drawn."""
    paths = pictures.placed((WIDE - 2 * BORDER, HIGH - 2 * BORDER), (WIDE / 2, HIGH / 2))
    return [[whole_numbers(picture) for picture in path] for path in paths]


def whole_numbers(picture: np.ndarray) -> Outline:
    return picture.round().astype(int).ravel().tolist() if np.isfinite(picture).all() else None


def shorter(pictures: Sequence[Outline], others: Sequence[Outline]) -> list[Outline | int]:
    """Pictures with 0 for one that equals the one before, and 1 for one that equals the other engine's."""
    short: list[Outline | int] = []
    for k, picture in enumerate(pictures):
        if k > 0 and picture == pictures[k - 1]:
            short.append(0)
        else:
            short.append(1 if picture is not None and picture == others[k] else picture)
    return short


def outline(picture: Sequence[int], links: Sequence[tuple[int, int]]) -> str:
    points = [f"{x} {y}" for x, y in zip(picture[::2], picture[1::2])]
    return "".join(f"M{points[start]}L{points[end]}" for start, end in links)
