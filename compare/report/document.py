"""A report as one document in two media: report.md, which is short, and index.html, which has all and folds it.

Both are rendered from document.md.jinja; here is chosen how much of each part is shown.
"""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd
from markdown_it import MarkdownIt
from markupsafe import Markup

from ..core.check import Check
from ..core.text import block, count, environment
from ..core.words import capital
from ..experiments import EXPERIMENTS, Experiment
from .images import embedded
from .motion import SCRIPT, motion_in_html
from .questions import answers
from .tables import TITLES, closest_checks, of_causes, origins, records, shortened, shown
from .verdict import Parts, Report, Section, failures, headline, outcome, passed, standing

MOST_ROWS, MOST_IN_MARKDOWN = 40, 6  # of a table; its file has all
FIRST_NOTES, MOST_NOTES = 3, 12  # of a section: of the page, which folds the others; of report.md
MOST_FIGURES, FIRST_FIGURES = 4, 2  # of a section that are not folded; the first, where there are more
FIRST_CAUSES = 4  # on the first screen
OVERVIEW = "overview_"  # how the files of the pictures of the first screen begin
LINKED = ("_distances", "_limits")  # how the files of the figures to which they lead end
MAIN_TABLES = ("what_should_i_use",)  # further tables of report.md, in addition to a section's own


class Document:
    """One report in one medium. folder: where its figures are, for a page; None: report.md."""

    def __init__(self, report: Report, parts: Parts, folder: Path | None = None):
        self.report, self.parts, self.folder = report, parts, folder
        self.page, self.motion = folder is not None, ""
        self.file = "index.html" if self.page else "report.md"
        data = {"page": self.page, "embedded": self.embedded}
        self.template = environment().get_template("document.md.jinja").make_module(data)
        self.answers = parts.attempt("the questions", None, answers, report.sections, report.robot)

    def embedded(self, file: str) -> tuple[str, int, int]:
        return embedded(self.folder / "figures" / f"{file}.png")

    def body(self) -> list[str]:
        """All parts below the verdict; those that break are left out."""
        report = self.report
        texts = [self.made("the first screen", self.first_screen)]
        if self.page:
            what = "the motion in index.html"
            self.motion = self.parts.attempt(what, "", motion_in_html, report.sections, report.robot.noun)
            texts.append(self.motion)
        texts.append(self.made("the introduction", self.introduction))
        if report.causes:
            texts.append(self.template.causes(table_of(of_causes(report.causes))))
        if self.answers is not None and len(self.answers):
            texts.append(self.template.questions(table_of(self.answers)))
        for section in report.sections:
            text = self.parts.attempt(f"{section.name} in {self.file}", None, self.section, section)
            texts.append(self.template.missing(section.name, section.title) if text is None else text)
        texts.append(self.template.skipped(report.skipped) if report.skipped else "")
        return [*texts, self.template.provenance(table_of(origins(report.origin)))]

    def made(self, name: str, make: Callable[[], str]) -> str:
        return self.parts.attempt(f"{name} in {self.file}", "", make)

    def text(self, body: Sequence[str]) -> str:
        """The whole document, with what could not be made of it."""
        report, good = self.report, passed(self.report.sections) and not self.parts.broken
        reference = () if report.reference is None else report.reference.lines
        lines, robot = report.verdict.split("\n"), report.robot
        title = block("verdict", "title", own=bool(robot.own), robot=robot.described or robot.name)
        head = self.template.head(title, reference, lines, self.parts.lines, report.top, good)
        if not self.page:
            return joined([head, *body])
        html = Markup(MarkdownIt("commonmark", {"html": True}).render(joined([head, *body])))
        values = {
            "title": title,
            "good": good,
            "links": self.links(),
            "script": SCRIPT if self.motion else "",
        }
        return environment().get_template("page.html.jinja").render(values, body=html)

    def links(self) -> list[tuple[str, bool]]:
        names = [("questions", False)] if self.answers is not None and len(self.answers) else []
        names += [(section.name, standing(section)[0] is False) for section in self.report.sections]
        return [*names, ("provenance", False)]

    def first_screen(self) -> str:
        """A line for each experiment, the pictures; on the page also what explains that checks fail."""
        report, failing, more = self.report, None, 0
        lines = [
            self.parts.attempt(f"the line of {one.name}", None, self.line, one) for one in report.sections
        ]
        failed = [check for kind in failures(report.sections) for check in kind]
        if report.causes:
            failing = table_of(of_causes(report.causes[:FIRST_CAUSES]).drop(columns="rank"))
            failing["label"] = "Cause" if len(report.causes) == 1 else "Causes"
            more = len(report.causes) - FIRST_CAUSES
        elif failed:
            columns = ["experiment", "scene", "quantity", "value", "tolerance", "note"]
            failing = table_of(records(failed[:FIRST_CAUSES])[columns]) | {"label": "Failing checks"}
            more = len(failed) - FIRST_CAUSES
        if failing:
            failing["known"] = bool(report.causes)
        pictures = self.parts.attempt("the pictures of the first screen", [], self.pictures)
        lines = [line for line in lines if line]
        return self.template.first_screen(lines, report.skipped, pictures, failing, max(more, 0))

    def line(self, section: Section) -> dict:
        """The line of one experiment: what it asks, whether it passes, its headline."""
        good, words = standing(section)
        named = {
            "name": section.name,
            "title": section.title,
            "outcome": words,
            "headline": headline(section),
        }
        if 0 < sum(check.failed for check in section.result.checks) == len(section.explained):
            named["headline"] = block("verdict", "consequence")
        return named | {"good": good, "kind": kind(good)}

    def pictures(self) -> list[dict]:
        """The pictures, those in which something fails first, each with the anchor of its figure.

        If none of them shows a failure, a figure of the first failing experiment comes first.
        """
        wrong = [section for section in self.report.sections if any(failures([section]))]
        pictures, shown = [], []
        for section in self.report.sections:
            for file, caption in section.figures:
                if file.startswith(OVERVIEW):
                    of = [one for one in self.report.sections if picture_of(one) == picture_of(section)]
                    shown += [one for one in of if one in wrong]
                    about = {
                        "file": file,
                        "path": f"{file}.png",
                        "caption": caption,
                        "link": linked_figure(of),
                    }
                    words = {"title": block(section.name, "overview_title")}
                    words["alternative"] = block(section.name, "overview_alternative")
                    pictures.append(about | words | {"fails": any(one in wrong for one in of)})
        still = [(section, [one for one in figures_of(section) if not one["moves"]]) for section in wrong]
        own = [(section, figures) for section, figures in still if figures]
        if own and not shown and self.page:
            section, figures = own[0]
            figure = next((one for one in figures if one["file"].endswith("_distances")), figures[0])
            about = {"alternative": figure["caption"], "caption": "", "link": f"figure-{figure['file']}"}
            pictures.insert(0, figure | about | {"title": section.title, "fails": True})
        return sorted(pictures, key=lambda picture: not picture["fails"]) if self.page else pictures

    def introduction(self) -> str:
        robot = self.report.robot
        joints = joints_of(robot)
        return " ".join(self.template.introduction(robot, robot.described or robot.name, joints).split())

    def section(self, section: Section) -> str:
        """One experiment: what was found, figures, tolerance, and the details."""
        result, (good, _) = section.result, standing(section)
        consequences = section.explained
        failed = [check for check in result.checks if check.failed and check not in consequences]
        not_judged = [check for check in result.checks if not check.judged]
        few, most = (MOST_ROWS, FIRST_NOTES) if self.page else (MOST_IN_MARKDOWN, MOST_NOTES)
        notes, figures = (
            section.notes,
            [one for one in figures_of(section) if not (self.page and one["moves"])],
        )
        first = figures if len(figures) <= MOST_FIGURES else figures[:FIRST_FIGURES]
        first = [one for one in figures if one in first or one["file"].endswith(LINKED)]
        return self.template.section(
            name=section.name,
            title=section.title,
            good=good,
            kind=kind(good),
            outcome=outcome(section),
            headline=headline(section) if result.headline else "",
            claim=section.claim,
            tolerance=section.tolerance,
            failing=listing(failed, few),
            not_judged=listing(not_judged, few),
            explained=listing(consequences, MOST_ROWS),
            notes=notes[:most],
            further=notes[most:],
            tables=[self.table(section, name, rows) for name, rows in section.tables.items()],
            checks={"count": len(result.checks), "rows": table_of(closest_checks(section, MOST_ROWS))},
            open_figures=first,
            folded_figures=[one for one in figures if one not in first],
        )

    def table(self, section: Section, name: str, rows: Sequence[dict]) -> dict:
        """A table with the rows that a reader needs; its rows are None where only its file has them."""
        title = TITLES.get(name, capital(name.replace("_", " ")))
        about = {"name": name, "title": title, "count": len(rows), "which": "", "rows": None}
        columns = section.result.shown if name == section.name else None
        is_main = self.page or name == section.name or name in MAIN_TABLES
        if columns == [] or name in section.result.filed or not is_main:
            return about
        few, about["which"] = shortened(rows, MOST_ROWS if self.page else MOST_IN_MARKDOWN)
        about["rows"] = table_of(shown(pd.DataFrame(few), columns if few else None))
        return about


def picture_of(section: Section) -> str:
    return EXPERIMENTS.get(section.name, Experiment(0)).overview


def kind(good: bool | None) -> str:
    return "none" if good is None else "good" if good else "bad"


def table_of(table: pd.DataFrame) -> dict:
    return {"columns": list(table.columns), "cells": table.astype(str).to_numpy().tolist()}


def listing(checks: Sequence[Check], most: int) -> dict:
    """How many checks there are, and the first of them as a table."""
    return {"count": len(checks), "rows": table_of(records(checks[:most]))}


def figures_of(section: Section) -> list[dict]:
    return [
        {"file": file, "path": file if moves else f"{file}.png", "caption": caption, "moves": moves}
        for file, caption in section.figures
        for moves in [file.endswith(".gif")]  # the page has another form of it
        if not file.startswith(OVERVIEW)
    ]


def linked_figure(sections: Sequence[Section]) -> str:
    """The anchor of the figure behind a picture: of distances or limits, else the first of the last section."""
    files = [one["file"] for section in sections for one in figures_of(section) if not one["moves"]]
    best = [file for file in files if file.endswith(LINKED)] or files
    return f"figure-{best[0]}" if best else sections[-1].name


def joints_of(robot) -> list[str]:
    """The joints of a robot by their kinds with their counts: of a file as it has them, a free joint as one."""
    counts = {feature.feature: feature.count for feature in robot.features}
    counts = counts or {name: robot.tree.kind.count(name) for name in robot.tree.kind}
    names = {"hinge": "hinge", "slide": "slide", "ball": "ball joint", "free": "free joint"}
    return [count(counts[key], name) for key, name in names.items() if counts.get(key)]


def joined(paragraphs: Sequence[str]) -> str:
    """Paragraphs as one text, with one empty line between them, but none between the items of a list."""
    lines = "\n".join(line.rstrip() for line in "\n\n".join(paragraphs).split("\n"))
    text = re.sub(r"\n{3,}", "\n\n", lines).strip() + "\n"
    return re.sub(r"(?m)^(- .*)\n\n(?=- )", r"\1\n", text)
