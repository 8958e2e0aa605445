"""A report as Markdown, short enough to be read: what is longer stands in its tables."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import pandas as pd

from .images import moves
from .introduction import first_lines, introduction, title
from .markup import of_section
from .one_number import one_number
from .overview import BEGINNING
from .parts import Parts
from .shortened import shortened
from .tables import asked_by, failing, heading, of_causes, origins, questions, shown
from .verdict import Report, Section, outcome, standing

REPORT_LINES = 300  # of the whole report, at most


class Size(NamedTuple):
    """How much of each section is written."""

    rows: int  # of a table; 0: no tables
    runs: int  # of a table that has a row for each scene and integrator
    notes: int
    failing: int  # checks that fail


SECTION_SIZES = (Size(40, 60, 99, 40), Size(16, 48, 99, 20), Size(12, 48, 8, 12), Size(12, 48, 5, 8), Size(10, 48, 3, 6),
         Size(8, 48, 2, 5), Size(6, 24, 2, 4), Size(4, 8, 1, 3), Size(2, 6, 1, 1), Size(0, 0, 1, 1))  # fmt: skip
MAIN = ("what_should_i_use",)  # tables that stand beside a section's own


def markdown(report: Report, body: Sequence[str], parts: Parts) -> str:
    """The whole report: what it is of, its verdict, what could not be made of it, and its body."""
    lines = [plain_markdown(line) for line in first_lines(report.reference)]
    lines += [f"# {plain_markdown(title(report.robot))}", f"**{report.verdict}**"]
    lines += [f"**{plain_markdown(line)}**" for line in parts.lines]
    lines += report.top
    return joined([*lines, *body])


def joined(paragraphs: Sequence[str]) -> str:
    """Paragraphs as one text; the items of a list without empty lines between them. No name in it is a tag of HTML."""
    text = "\n\n".join(paragraphs).replace("\n\n- ", "\n- ") + "\n"
    return re.sub(r"(`[^`\n]*`)|(?<!\\)<(?=[A-Za-z/!?])", lambda found: found[1] or r"\<", text)


def markdown_body(report: Report, parts: Parts) -> list[str]:
    """The paragraphs below the verdict; a part that breaks is left out. As much of each section as REPORT_LINES has room for."""
    fewest, most, bodies = 0, len(SECTION_SIZES) - 1, {}
    while fewest < most:  # the first size that fits
        middle = (fewest + most) // 2
        bodies[middle] = body_of_size(report, parts, SECTION_SIZES[middle])
        if joined(bodies[middle]).count("\n") + 2 * len(report.top) + 2 * len(parts.lines) + 6 <= REPORT_LINES:
            most = middle
        else:
            fewest = middle + 1
    return bodies.get(most) or body_of_size(report, parts, SECTION_SIZES[most])


def body_of_size(report: Report, parts: Parts, size: Size) -> list[str]:
    """The paragraphs below the verdict, each section in this size."""
    sections, robot, origin, _, causes, _, _ = report
    lines = parts.made("the experiments in report.md", [], experiments_in_markdown, report)
    lines += ["**Causes** (1: an option or a convention, 2: a number):", md_table(of_causes(causes))] if causes else []
    lines += [plain_markdown(parts.made("the introduction", "", introduction, robot))]
    lines += parts.made("the questions", [], answers_in_markdown, sections, robot)
    for section in sections:
        missing = [f"## {section.title}", "This section could not be made."]
        lines += parts.made(f"{section.name} in report.md", missing, section_in_markdown, section, size)
    return [*lines, "## Where this comes from", "; ".join(f"{a}: {b}" for a, b in origins(origin).to_numpy()) + "."]


def experiments_in_markdown(report: Report) -> list[str]:
    """A line for each experiment, and the pictures that matter."""
    rows = [(section.name, section.title, standing(section)[1], one_number(section)) for section in report.sections]
    rows += [(name, "", "skipped", reason) for name, reason in report.skipped]
    table = pd.DataFrame(rows, columns=["experiment", "asked", "outcome", "found"])
    pictures = [one for section in report.sections for one in section.figures if one[0].startswith(BEGINNING)]
    return [md_table(table), *([in_one_paragraph(pictures)] if pictures else [])]


def in_one_paragraph(figures: Sequence[tuple[str, str]]) -> str:
    """Figures with their captions, one after the other."""
    files = {name: name if moves(name) else f"{name}.png" for name, _ in figures}
    return " ".join(f"![{name}](figures/{files[name]}) {caption}" for name, caption in figures)


def answers_in_markdown(sections: Sequence[Section], robot: object) -> list[str]:
    """What was asked, and the answers; nothing if there is no question."""
    asked = questions(sections, robot)
    return [f"## {asked_by(robot)}", md_table(asked)] if len(asked) else []


def section_in_markdown(section: Section, size: Size = SECTION_SIZES[0]) -> list[str]:
    """The paragraphs of one experiment: what was found, the tolerance, the worst rows, figures, and where the rest is."""
    failed, notes = failing(section), section.notes
    number = one_number(section)
    lines = [f"## {section.title}", f"**{outcome(section)}** {number}{'.' if number else ''}"]
    lines += [f"- *Claim:* {section.claim}", f"- *Tolerance:* {section.tolerance}"]
    lines += [f"- {note}" for note in notes[: size.notes]]
    more = len(notes) - size.notes
    lines += [f"- And {more} further findings: [index.html](index.html#{section.name})"] if more > 0 else []
    lines += [f"- All rows: {', '.join(map(link, section.tables))}"] if section.tables else []
    if len(failed):
        few = f", the first {size.failing} of {len(failed)}" if len(failed) > size.failing else ""
        lines += [f"**Checks that fail{few}:**", md_table(failed.head(size.failing))]
    for name, rows in section.tables.items():
        if name == section.name or name in MAIN:
            lines += table_in_markdown(section, name, rows, size)
    figures = of_section(section)
    return [*lines, *([in_one_paragraph(figures)] if figures else [])]


def table_in_markdown(section: Section, name: str, rows: Sequence[dict], size: Size) -> list[str]:
    """The worst rows of a table, and which these are."""
    columns = section.result.shown if name == section.name else None
    if columns == [] or name in section.result.filed or not size.rows:
        return []
    few, which = shortened(rows, size.rows, size.runs)
    if not few:
        return [f"{heading(name)}: {which}."]
    title = [f"{heading(name)}: {which}."] if which or name != section.name else []
    table = shown(pd.DataFrame(few), columns)
    return [*title, md_table(table)] if len(table.columns) else []


def link(name: str) -> str:
    return f"[tables/{name}.csv](tables/{name}.csv)"


def plain_markdown(text: str) -> str:
    """A text in Markdown in which no sign of a file's name is markup."""
    return re.sub(r"([\\`*<\[])", r"\\\1", text)


def md_table(table: pd.DataFrame) -> str:
    cells = [list(table.columns), ["---"] * len(table.columns), *table.astype(str).values.tolist()]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in cells)
