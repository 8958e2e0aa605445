"""The first screen of the page: the verdict, a line for each experiment, the causes of what fails, the pictures that matter."""

import html
import re
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from .images import moves
from .markup import html_table, image, of_section, words
from .one_number import one_number
from .overview import BEGINNING, PICTURES
from .parts import Parts
from .tables import failing, of_causes
from .verdict import Report, Section, failures, passed, standing

LONG_SENTENCE = 80  # characters
FIRST_CAUSES = 4  # on the first screen; all of them stand below it
LINKED = ("_distances", "_limits")  # ends of the names of figures to which a picture leads
TITLES = {
    "agreement": "The same equations?",
    "scenes": "The same motion?",
    "times": "Time against error",
    "limits": "Limits of the step",
}
ALTERNATIVES = {  # what stands for a picture that is not seen
    "agreement": "Chart: how far the engines are apart in M, h and accelerations, and from exact, in eps beside the tolerance",
    "scenes": "Chart: for each scene the difference of the engines over its band of rounding, and for how long it is judged",
    "times": "Chart: time against worst error, a curve of the cheapest settings of each engine",
    "limits": "Chart: for each method the largest stable step, predicted and observed",
}


def verdict_in_html(report: Report, parts: Parts) -> str:
    """The verdict: its first sentence large, what follows smaller; what could not be made, and what is said of the robot."""
    first, rest = in_two(report.verdict)
    good = passed(report.sections) and not parts.broken
    lines = [rest] * bool(rest) + [*parts.lines, *report.top]
    small = "".join(f'<p class="small">{words(line)}</p>' for line in lines)
    return (
        f'<div class="verdict {"good" if good else "bad"}"><p class="big">{mark(good)} {words(first)}</p>{small}</div>'
    )


def in_two(verdict: str) -> tuple[str, str]:
    """The first sentence of a verdict, short, and what follows: names of many experiments stand there."""
    first, _, rest = verdict.partition(". ")
    first = first if first.endswith(".") else f"{first}."
    names = re.search(r" in ([\w, ]+) \((\d+ of \d+ experiments)[^)]*\)", first)
    if names is None or len(first) <= LONG_SENTENCE:
        return first, rest
    short = first.replace(names.group(), "")
    return short, f"{names.group(2)}: {names.group(1)}. {rest}".strip()


def mark(good: bool | None) -> str:
    """A sign that is no colour alone."""
    sign, name = {True: ("✓", "good"), False: ("✗", "bad"), None: ("–", "none")}[good]
    return f'<span class="mark {name}" aria-hidden="true">{sign}</span>'


def list_in_html(report: Report, parts: Parts) -> str:
    """A line for each experiment: what was asked, whether it passes, its one number; those that were skipped with the reason."""
    lines = [parts.made(f"the line of {section.name}", "", line_in_html, section) for section in report.sections]
    lines += [
        f'<li class="skipped">{mark(None)}<div>{html.escape(name)} <small>skipped: {words(reason)}</small></div></li>'
        for name, reason in report.skipped
    ]
    return f'<ul class="experiments" aria-label="Experiments">{"".join(lines)}</ul>'


def line_in_html(section: Section) -> str:
    """The line of one experiment, with a link to its section."""
    good, said = standing(section)
    number = one_number(section)
    return (
        f'<li class="{"good" if good else "none" if good is None else "bad"}">{mark(good)}<div>'
        f'<a href="#{section.name}">{html.escape(section.title)}</a> <strong>{html.escape(said)}</strong>'
        + (f"<small>{words(number)}</small>" if number else "")
        + "</div></li>"
    )


def causes_in_html(report: Report) -> str:
    """What explains that checks fail, stated beside found; the first failing checks where no cause is known; '' if none fails."""
    if report.causes:
        few, more = report.causes[:FIRST_CAUSES], len(report.causes) - FIRST_CAUSES
        table, title = of_causes(few).drop(columns="rank"), "Cause" if len(report.causes) == 1 else "Causes"
        rest = f'<p class="small"><a href="#causes">and {more} more</a></p>' if more > 0 else ""
    else:
        failed = [check for part in failures(report.sections) for check in part]
        if not failed:
            return ""
        table = pd.concat([failing(section) for section in report.sections], ignore_index=True)
        table, title = (
            table.head(FIRST_CAUSES)[["experiment", "scene", "quantity", "value", "tolerance", "note"]],
            "Fails",
        )
        more = len(failed) - FIRST_CAUSES
        rest = f'<p class="small">and {more} more, in their sections</p>' if more > 0 else ""
    return f'<div class="causes"><h2>{title}</h2>{html_table(table, title, "text")}{rest}</div>'


def pictures_in_html(folder: Path, report: Report) -> str:
    """The pictures that matter, each with a link to its figures; first those in which something fails.

    Where what fails is in none of them, a figure of the first failing experiment comes before them.
    """
    shown, showing = [], set()
    wrong = [section for section in report.sections if any(map(len, failures([section])))]
    for name, needs in PICTURES.items():
        sections = [section for section in report.sections if section.name in needs]
        for section in sections:
            caption = next((caption for file, caption in section.figures if file == BEGINNING + name), None)
            if caption is not None:
                fails = [other.name for other in sections if other in wrong]
                showing.update(fails)
                shown.append((not fails, picture(folder, name, caption, sections, bool(fails))))
    if wrong and not showing:
        more = next((one for section in wrong if (one := first_figure(folder, section))), "")
        shown.insert(0, (False, more))
    shown.sort(key=lambda one: one[0])
    return f'<div class="pictures">{"".join(text for _, text in shown)}</div>' if shown else ""


def picture(folder: Path, name: str, caption: str, sections: Sequence[Section], fails: bool) -> str:
    """One picture of the first screen; fails: checks of what it shows do."""
    link = linked_figure(sections)
    title = f"{mark(False)} {TITLES[name]}" if fails else TITLES[name]
    drawn = image(folder, BEGINNING + name, ALTERNATIVES[name])
    return (
        f'<figure class="{"bad" if fails else "good"}"><a href="#{link}">{drawn}</a>'
        f"<figcaption><strong>{title}</strong> {words(caption)}</figcaption></figure>"
    )


def linked_figure(sections: Sequence[Section]) -> str:
    """The anchor of the whole figure behind a picture: of distances or limits, else the first of the last section."""
    files = [file for section in sections for file, _ in of_section(section) if not moves(file)]
    best = [file for file in files if file.endswith(LINKED)] or files
    return f"figure-{best[0]}" if best else sections[-1].name


def first_figure(folder: Path, section: Section) -> str:
    """The first figure of a failing experiment, small; '' if it has none."""
    figures = [one for one in of_section(section) if not moves(one[0])]
    if not figures:
        return ""
    file, caption = next((one for one in figures if one[0].endswith("_distances")), figures[0])
    return (
        f'<figure class="bad"><a href="#figure-{file}">{image(folder, file, caption)}</a>'
        f"<figcaption><strong>{mark(False)} {html.escape(section.title)}</strong></figcaption></figure>"
    )
