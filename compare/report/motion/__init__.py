"""The motion in the page: stick figures of both engines over each other, with a slider; it fetches nothing."""

import json
import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from markupsafe import Markup

from ...core.text import environment, say
from ...core.words import capital, scene_of
from ..verdict import Section, failures

MOST_BYTES = 280_000  # of the motion in the page
STICK_BYTES = 48  # of a stick in the picture without script
LARGEST_STRIDE = 8  # every eighth picture of each scene is shown before scenes are left out
DRAWN_IN = "trajectory"  # the experiment whose scenes are drawn
WIDE, HIGH, BORDER = 1000, 480, 45  # of the drawing, in its own units
SCRIPT = Markup(
    (Path(__file__).parent / "motion.js").read_text(encoding="utf-8")
)  # the only one that the page may run
FEW_STICKS = 6  # up to which they are drawn wide
SHOWN_FOR = 5.0  # s, at least about: a shorter scene is shown slower
UNDER = 0.9  # of motion shown at its own speed


def motion_in_html(sections: Sequence[Section], robot: object) -> str:
    """A <figure> with its style and data, for SCRIPT, at most 300 kB; "" where no scene is drawn.

    It opens on a scene in which the engines differ, if there is one. To stay small, it leaves out every second, fourth ...
    picture, then the last scenes, with a note.
    """
    section = next((section for section in sections if section.name == DRAWN_IN), None)
    drawn = section.result.curves.get("drawn") if section else None
    if not drawn:
        return ""
    names = [one.scene for one in drawn]
    differing = {scene_of(check.scene, names) for check in failures([section]).differing}
    drawn = sorted(drawn, key=lambda one: one.scene not in differing)
    engines = [capital(section.result.label), "MuJoCo"]
    data, stride, scenes = inlined(drawn, engines)
    links, still = scenes[0]["links"], stride * scenes[0]["still"]
    first, second = (outline(path[still], links) for path in on_page(drawn[0]))
    wide, ring = (20, 16) if len(links) <= FEW_STICKS else (9, 7)
    values = {
        "ours": engines[0],
        "theirs": engines[1],
        "scenes": scenes,
        "data": Markup(data),
        "noun": robot.noun,
    }
    values |= {"width": WIDE, "height": HIGH, "wide": wide, "ring": ring, "first": first, "second": second}
    values |= {"stride": stride, "left_out": [one.scene for one in drawn[len(scenes) :]]}
    text = environment().get_template("motion.html.jinja").render(values)
    return re.sub(r"\n\s*\n", "\n", text)  # an empty line would end the HTML inside of Markdown


def inlined(drawn: Sequence, engines: Sequence[str]) -> tuple[str, int, list[dict]]:
    """The scenes as JSON for a page, the stride over their pictures, and the scenes that are in it."""
    stride, count = 1, len(drawn)
    while True:
        scenes = [inlined_scene(one, stride) for one in drawn[:count]]
        text = json.dumps({"engines": engines, "scenes": scenes}, separators=(",", ":"), allow_nan=False)
        text = text.replace("<", "\\u003c")
        if len(text.encode()) + STICK_BYTES * len(scenes[0]["links"]) <= MOST_BYTES:
            return text, stride, scenes
        if stride < LARGEST_STRIDE or count == 1:
            stride *= 2
        else:
            count -= 1


def inlined_scene(one: object, stride: int) -> dict:
    """One scene as the script has it: of each engine a list of pictures, x and y of each point.

    A picture is 0 where it is the one before, 1 where it is that of the first engine, None where the run has diverged.
    """
    ours, theirs = (path[::stride] for path in on_page(one))
    dt = stride * float(one.t[1] - one.t[0])
    slow = max(1.0, SHOWN_FOR / float(one.t[-1]))
    slow = slow if slow > 1.0 / UNDER else 1.0
    shown = f" It is shown {slow:.2g} times slower." if slow > 1.0 else ""
    alive = [k for k in range(len(ours)) if ours[k] is not None and theirs[k] is not None]
    return {
        "name": one.scene,
        "seen": f"{capital(one.scene)}, {one.run}. {say(one.seen)}{shown}",
        "dt": dt,
        "pause": max(1, round(1000.0 * dt * slow)),
        "unit": one.unit,
        "still": alive[-1],
        "base": "M{} {}m-18-18h36v36h-36z".format(*ours[0][:2]) if one.fixed else "",
        "links": [list(link) for link in one.links],
        "apart": [float(f"{off:.1e}") if math.isfinite(off) else None for off in one.apart[::stride]],
        "paths": [shorter(ours, [()] * len(ours)), shorter(theirs, ours)],
    }


def on_page(one: object) -> list[list]:
    """For each engine and picture a list of integers, x and y of each point in the drawing; None for NaN."""
    paths = one.placed((WIDE - 2 * BORDER, HIGH - 2 * BORDER), (WIDE / 2, HIGH / 2))
    return [[whole_numbers(picture) for picture in path] for path in paths]


def whole_numbers(picture: np.ndarray) -> list[int] | None:
    return picture.round().astype(int).ravel().tolist() if np.isfinite(picture).all() else None


def shorter(pictures: Sequence, others: Sequence) -> list:
    """Pictures with 0 for one that equals the one before, and 1 for one that equals the other engine's."""
    found = []
    for k, picture in enumerate(pictures):
        same = k > 0 and picture == pictures[k - 1]
        found.append(0 if same else 1 if picture is not None and picture == others[k] else picture)
    return found


def outline(picture: Sequence[int], links: Sequence) -> str:
    return "".join(
        f"M{picture[2 * i]} {picture[2 * i + 1]}L{picture[2 * j]} {picture[2 * j + 1]}" for i, j in links
    )
