"""A report as one document in Markdown: report.md, and index.html, which is made from it, with its figures inside."""

import re
from collections.abc import Sequence
from functools import partial
from html import unescape
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from markdown_it import MarkdownIt
from markupsafe import Markup

from ..core.rows import Row
from ..core.text import block, count, environment
from ..core.words import capital
from ..robots import Robot
from . import tables
from .images import embedded
from .questions import answers
from .verdict import Figure, Report, Section, failures, headline, outcome, standing

MOST_ROWS = 8  # of a table; its file has all
MOST_FIGURES, FIRST_FIGURES = 4, 2  # of a section that are not folded; the first, where there are more
FIRST_CAUSES = 4  # on the first screen
TITLES = {"what_should_i_use": "What should I use?", "engines_answer": "Which engine?"}  # of tables
ON_FIRST_SCREEN = "experiment", "scene", "quantity", "value", "tolerance", "note"
JOINTS = {"hinge": "hinge", "slide": "slide", "ball": "ball joint", "free": "free joint"}


class Picture(NamedTuple):
    figure: Figure  # of the first screen
    link: str  # to a section
    title: str
    alternative: str
    fails: bool  # whether something fails in what it shows


class Listing(NamedTuple):
    """The first rows of a table, and how many it has."""

    total: int
    rows: pd.DataFrame | None  # None: its file alone has them
    name: str = ""  # of its file
    title: str = ""


class Document:
    def __init__(self, report: Report):
        self.report, robot = report, report.robot
        values = {"outcome": outcome, "standing": standing, "headline": headline}
        # its attributes are the macros
        self.template: Any = environment().get_template("document.md.jinja").make_module(values)
        self.answers = answers(report.sections, robot)
        self.title = block("verdict", "title", own=bool(robot.own), robot=robot.described or robot.name)

    def text(self) -> str:
        """The whole document."""
        report, robot = self.report, self.report.robot
        lines = report.verdict.split("\n"), report.top
        first, *others = sum(reversed(lines) if report.answers_first else lines, list[str]())
        parts = [self.template.head(self.title, report.first_lines, first, others, report.passed)]
        introduction = self.template.introduction(robot, robot.described or robot.name, joints_of(robot))
        parts += [self.first_screen(), " ".join(introduction.split())]
        if report.causes:
            parts.append(self.template.causes(tables.of_causes(report.causes)))
        if self.answers is not None:
            parts.append(self.template.questions(self.answers))
        parts += map(self.section, report.sections)
        parts.append(self.template.skipped(report.skipped) if report.skipped else "")
        parts.append(self.template.provenance(tables.of_origin(report.origin)))
        return joined(parts)

    def page(self, folder: Path) -> str:
        """The document as a page; folder: that of the report, with its figures."""
        links = [("questions", False)] if self.answers is not None else []
        links += [(section.name, standing(section)[0] is False) for section in self.report.sections]
        return page_of(self.title, self.text(), self.report.passed, [*links, ("provenance", False)], folder)

    def first_screen(self) -> str:
        """A line for each experiment, the pictures, and what explains that checks fail."""
        report = self.report
        failed = [check for kind in failures(report.sections) for check in kind]
        of_first = tables.of_checks(failed[:FIRST_CAUSES], ON_FIRST_SCREEN)
        failing = Listing(len(failed), of_first, title="Failing checks")
        if report.causes:
            table = tables.of_causes(report.causes[:FIRST_CAUSES]).drop(columns="rank")
            title = "Cause" if len(report.causes) == 1 else "Causes"
            failing = Listing(len(report.causes), table, name="causes", title=title)
        return self.template.first_screen(report.sections, report.skipped, self.pictures(), failing)

    def pictures(self) -> list[Picture]:
        """The pictures, those in which something fails first; a figure of what fails, if none shows it."""
        sections, pictures = self.report.sections, list[Picture]()
        wrong = [section for section in sections if any(failures([section]))]
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

    def section(self, section: Section) -> str:
        not_judged = [check for check in section.result.checks if not check.judged]
        figures = section.own_figures
        first = figures if len(figures) <= MOST_FIGURES else figures[:FIRST_FIGURES]
        first = [figure for figure in figures if figure in first or figure.moves]
        found = {"Failing checks": section.failed, "Not judged": not_judged}
        lists = {k: Listing(len(checks), tables.of_checks(checks[:MOST_ROWS])) for k, checks in found.items()}
        of_section = [self.table(section, name, rows) for name, rows in section.tables.items()]
        folded = [figure for figure in figures if figure not in first]
        return self.template.section(section, lists, of_section, first, folded)

    def table(self, section: Section, name: str, rows: Sequence[Row]) -> Listing:
        """A table with the rows that a reader needs; its rows are None where only its file has them."""
        title = TITLES.get(name, capital(name.replace("_", " ")))
        columns = section.result.shown if name == section.name else None
        if columns == [] or name in section.result.filed:
            return Listing(len(rows), None, name, title)
        return Listing(len(rows), tables.of_rows(rows[:MOST_ROWS], columns), name, title)


def page_of(
    title: str, text: str, good: bool, links: Sequence[tuple[str, bool]] = (), folder: Path | None = None
) -> str:
    """A document in Markdown as a page.

    links: its sections, and whether something fails there; folder: where its figures are, which the page has inside.
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


def joined(paragraphs: Sequence[str]) -> str:
    """Paragraphs as one text, with one empty line between them, but none between the items of a list."""
    lines = "\n".join(line.rstrip() for line in "\n\n".join(paragraphs).split("\n"))
    text = re.sub(r"\n{3,}", "\n\n", lines).strip() + "\n"
    return re.sub(r"(?m)^(- .*)\n\n(?=- )", r"\1\n", text)
