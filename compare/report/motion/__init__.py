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
ROOM, MIDDLE = (WIDE - 2 * BORDER, HIGH - 2 * BORDER), (WIDE / 2, HIGH / 2)
SHOWN_FOR = 5.0  # s, at least about: a shorter scene is shown slower
# the only script that the page may run
SCRIPT = Markup((Path(__file__).parent / "motion.js").read_text(encoding="utf-8"))
Outline = list[int] | None  # x and y of each point; None from where the run has diverged


def motion_in_html(sections: Sequence[Section], noun: str) -> str:
    """A <figure> with its style and data, for SCRIPT, at most 300 kB; "" where no scene is drawn.

    It opens on a scene in which the engines differ, if there is one. To stay small, it leaves out every
    second, fourth ... picture, then the last scenes, with a note.
    """
    section = next((section for section in sections if section.scenes), None)
    if section is None:
        return ""
    names = [pictures.scene for pictures in section.scenes]
    differing = {scene_of(check.scene, names) for check in failures([section]).differing}
    scenes = sorted(section.scenes, key=lambda pictures: pictures.scene not in differing)
    engines = [capital(section.result.label), "MuJoCo"]
    data, stride, shown = inlined(scenes, engines)
    still = stride * shown[0]["still"]
    ours, theirs = (outline(path[still], scenes[0].links) for path in on_page(scenes[0]))
    values = {"engines": engines, "scenes": shown, "data": Markup(data), "noun": noun, "stride": stride}
    values |= {"size": (WIDE, HIGH), "outlines": (ours, theirs), "is_simple": scenes[0].few_sticks}
    values["left_out"] = [pictures.scene for pictures in scenes[len(shown) :]]
    text = environment().get_template("motion.html.jinja").render(values)
    return re.sub(r"\n\s*\n", "\n", text)  # an empty line would end the HTML inside of Markdown


def inlined(scenes: Sequence[Pictures], engines: Sequence[str]) -> tuple[str, int, list[dict[str, Any]]]:
    """The scenes as JSON for a page, the stride over their pictures, and the scenes that are in it."""
    stride, count = 1, len(scenes)
    while True:
        shown = [inlined_scene(pictures, stride) for pictures in scenes[:count]]
        text = json.dumps({"engines": engines, "scenes": shown}, separators=(",", ":"), allow_nan=False)
        text = text.replace("<", "\\u003c")
        if len(text.encode()) + STICK_BYTES * len(shown[0]["links"]) <= MOST_BYTES:
            return text, stride, shown
        if stride < LARGEST_STRIDE or count == 1:
            stride *= 2
        else:
            count -= 1


def inlined_scene(pictures: Pictures, stride: int) -> dict[str, Any]:
    """One scene as the script has it: of each engine a list of pictures, see `shorter`."""
    ours, theirs = (path[::stride] for path in on_page(pictures))
    dt = stride * float(pictures.t[1] - pictures.t[0])
    slower = max(1.0, pictures.slower(SHOWN_FOR / (len(pictures.t) - 1)))
    values = {"scene": pictures.scene, "run": pictures.run, "seen": say(pictures.seen), "slower": slower}
    return {
        "name": pictures.scene,
        "seen": say(Finding("trajectory", "picture_in_page", values)),
        "dt": dt,
        "pause": max(1, round(1000.0 * dt * slower)),
        "unit": pictures.unit,
        "still": max(k for k, both in enumerate(zip(ours, theirs)) if None not in both),
        "base": "M{} {}m-18-18h36v36h-36z".format(*(ours[0] or ())[:2]) if pictures.fixed else "",
        "links": pictures.links,
        "apart": [float(f"{off:.1e}") if math.isfinite(off) else None for off in pictures.apart[::stride]],
        "paths": [shorter(ours), shorter(theirs, ours)],
    }


def on_page(pictures: Pictures) -> list[list[Outline]]:
    return [[whole_numbers(points) for points in path] for path in pictures.placed(ROOM, MIDDLE)]


def whole_numbers(points: np.ndarray) -> Outline:
    return points.round().astype(int).ravel().tolist() if np.isfinite(points).all() else None


def shorter(pictures: Sequence[Outline], others: Sequence[Outline] = ()) -> list[Outline | int]:
    """Pictures with 0 for one that equals the one before, and 1 for one that equals the other engine's."""
    short: list[Outline | int] = list(pictures)
    for k, picture in enumerate(pictures):
        if k > 0 and picture == pictures[k - 1]:
            short[k] = 0
        elif others and picture is not None and picture == others[k]:
            short[k] = 1
    return short


def outline(picture: Outline, links: Sequence[Sequence[int]]) -> str:
    points = np.reshape(picture or [], (-1, 2)).tolist()
    return "".join("M{} {}L{} {}".format(*points[i], *points[j]) for i, j in links)
