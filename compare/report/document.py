"""A report as one document in Markdown: report.md, and index.html, which is made from it, with its figures inside."""

import re
from collections.abc import Sequence
from functools import partial
from html import unescape
from pathlib import Path
from typing import NamedTuple

import pandas as pd
from markdown_it import MarkdownIt
from markupsafe import Markup

from ..core.finding import Finding
from ..core.text import block, count, environment, escaped, say
from ..robots import Robot
from . import tables
from .images import embedded
from .questions import answers
from .verdict import Figure, Report, failures, has_failed, headline, standing

MOST_ROWS, FIRST_CHECKS = 8, 4  # of a table, whose file has all; of the first screen
TITLES = {"what_should_i_use": "What should I use?", "engines_answer": "Which engine?"}  # of tables
ON_FIRST_SCREEN = "experiment", "scene", "quantity", "value", "tolerance", "note"
JOINTS = {"hinge": "hinge", "slide": "slide", "ball": "ball joint", "free": "free joint"}


class Picture(NamedTuple):
    figure: Figure  # of the first screen
    link: str  # to a section
    title: str
    alternative: str
    fails: bool  # whether something fails in what it shows


class Document:
    def __init__(self, report: Report):
        self.report, robot = report, report.robot
        self.answers = answers(report.sections, robot)
        self.name = robot.described or robot.name
        names = [section.name for section in report.sections] if report.runs_file else []
        self.title = block("introduction", "title", own=bool(robot.own), robot=self.name, names=names)

    def text(self) -> str:
        """The whole document."""
        report, robot = self.report, self.report.robot
        lines = report.verdict.split("\n"), report.top
        about = {"name": self.name, "joints": joints_of(robot), "runs_file": report.runs_file}
        introduction = block("introduction", "introduction", robot=robot, **about)
        template = environment().get_template("document.md.jinja")
        return joined(template.render(
            report=report, title=self.title, lines=sum(reversed(lines) if report.answers_first else lines, list[str]()),
            explained=self.explained(), pictures=self.pictures(), introduction=" ".join(introduction.split()),
            answers=self.answers, standing=standing, headline=headline, most=MOST_ROWS, titles=TITLES, tables=tables,
        ))  # fmt: skip

    def page(self, folder: Path) -> str:
        """The document as a page; folder: that of the report, with its figures."""
        links = [("questions", False)] if self.answers is not None else []
        links += [(section.name, standing(section)[0] is False) for section in self.report.sections]
        return page_of(self.title, self.text(), self.report.passed, [*links, ("provenance", False)], folder)

    def tolerances(self) -> str:
        """A page with the formulas of the tolerances."""
        sections = [section for section in self.report.sections if section.tolerance]
        parts = [
            f"# Tolerances of {escaped(self.title)}",
            escaped(say(Finding("introduction", "tolerances"))),
        ]
        for section in sections:
            texts = section.title, " ".join(section.tolerance.partition("\n\n")[2].split())
            parts.append(
                '<section id="{}">\n\n## {}\n\n{}\n\n</section>'.format(section.name, *map(escaped, texts))
            )
        return page_of(
            "Tolerances", "\n\n".join(parts), True, [(section.name, False) for section in sections]
        )

    def explained(self) -> list[tuple[pd.DataFrame, str, int]]:
        """What explains that checks fail, else the first of them, as a table with its title and how many more there are."""
        causes = self.report.causes
        if causes:
            table, label = tables.of_causes(causes[:MOST_ROWS]), "Cause" if len(causes) == 1 else "Causes"
            return [(table, label, len(causes) - MOST_ROWS)]
        failed = [check for kind in failures(self.report.sections).values() for check in kind]
        table = tables.of_checks(failed[:FIRST_CHECKS], ON_FIRST_SCREEN)
        return [(table, "Failing checks", len(failed) - FIRST_CHECKS)] if failed else []

    def pictures(self) -> list[Picture]:
        """The pictures, those in which something fails first; a figure of what fails, if none shows it."""
        sections, pictures = self.report.sections, list[Picture]()
        wrong = [section for section in sections if has_failed([section])]
        for section in sections:
            group = [other for other in sections if other.record.overview == section.record.overview]
            fails = any(other in wrong for other in group)
            for figure in section.figures:
                if figure.is_overview:
                    texts = (block(section.name, f"overview_{x}") for x in ("title", "alternative"))
                    title, alternative = (" ".join(text.split()) for text in texts)
                    pictures.append(Picture(figure, section.name, title, alternative, fails))
        failing = [(section, figure) for section in wrong for figure in section.own_figures]
        if failing and not any(picture.fails for picture in pictures):
            section, figure = failing[0]
            without_caption = figure._replace(caption="")
            pictures.append(Picture(without_caption, section.name, section.title, figure.caption, True))
        return sorted(pictures, key=lambda picture: not picture.fails)


def page_of(
    title: str, text: str, good: bool, links: Sequence[tuple[str, bool]] = (), folder: Path | None = None
) -> str:
    """A document in Markdown as a page.

    links: its sections, and whether something fails there; folder: where its figures are, which the page has
    inside.
    """
    html = MarkdownIt("commonmark", {"html": True}).enable("table").render(text)
    if folder:
        html = re.sub(r'(?<=<img )(alt="[^"]*" )src="(figures/[^"]+)"', partial(inside, folder), html)
    values = {"title": title, "good": good, "links": links, "body": Markup(html)}
    return environment().get_template("page.html.jinja").render(values)


def inside(folder: Path, image: re.Match[str]) -> str:
    """The attributes of a figure with its data."""
    data, width, height = embedded(folder / unescape(image[2]))
    return f'{image[1]}width="{width}" height="{height}" src="{data}"'


def joints_of(robot: Robot) -> list[str]:
    """The joints of a robot by their kinds, counted; a free joint of a file is one."""
    counts = {feature.feature: feature.count for feature in robot.features}
    counts = counts or {name: robot.tree.kind.count(name) for name in robot.tree.kind}
    return [count(counts[kind], name) for kind, name in JOINTS.items() if counts.get(kind)]


def joined(text: str) -> str:
    """A text with one empty line between its paragraphs, but none between the items of a list."""
    lines = "\n".join(line.rstrip() for line in text.split("\n"))
    text = re.sub(r"\n{3,}", "\n\n", lines).strip() + "\n"
    return re.sub(r"(?m)^(- .*)\n\n(?=- )", r"\1\n", text)
