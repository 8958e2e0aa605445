"""A report as Markdown."""

import re
from collections.abc import Sequence

import pandas as pd

from .introduction import first_lines, introduction, title
from .parts import Parts
from .tables import asked_by, failing, heading, of_causes, origins, questions, shown
from .verdict import Report, Section, outcome


def markdown(report: Report, body: Sequence[str], parts: Parts) -> str:
    """The whole report: what it is of, its verdict, what could not be made of it, and its body."""
    lines = [plain_markdown(line) for line in first_lines(report.reference)]
    lines += [f"# {plain_markdown(title(report.robot))}", f"**{report.verdict}**"]
    lines += [f"**{plain_markdown(line)}**" for line in parts.lines]
    lines += report.top
    return joined([*lines, *body])


def joined(paragraphs: Sequence[str]) -> str:
    """Paragraphs as one text; the items of a list without empty lines between them."""
    return "\n\n".join(paragraphs).replace("\n\n- ", "\n- ") + "\n"


def markdown_body(report: Report, parts: Parts) -> list[str]:
    """The paragraphs below the verdict; a part that breaks is left out."""
    sections, robot, origin, _, causes, skipped, _ = report
    lines = ["**Causes** (1: an option or a convention, 2: a number):", md_table(of_causes(causes))] if causes else []
    lines += [plain_markdown(parts.made("the introduction", "", introduction, robot))]
    lines += parts.made("the questions", [], answers_in_markdown, sections, robot)
    for section in sections:
        missing = [f"## {section.title}", "This section could not be made."]
        lines += parts.made(f"{section.name} in report.md", missing, section_in_markdown, section)
    lines += ["## Skipped", *(f"- {name}: {reason}." for name, reason in skipped)] if skipped else []
    return [*lines, "## Where this comes from", md_table(origins(origin))]


def answers_in_markdown(sections: Sequence[Section], robot) -> list[str]:
    """What was asked, and the answers; nothing if there is no question."""
    asked = questions(sections, robot)
    return [f"## {asked_by(robot)}", md_table(asked)] if len(asked) else []


def section_in_markdown(section: Section) -> list[str]:
    """The paragraphs of one experiment."""
    failed = failing(section)
    lines = [
        f"## {section.title}",
        f"*Claim:* {section.claim} **{outcome(section)}**",
        f"*Tolerance:* {section.tolerance}",
    ]
    if len(failed):
        lines += ["**Checks that fail:**", md_table(failed)]
    for name, rows in section.tables.items():
        table = shown(pd.DataFrame(rows), section.result.shown if name == section.name else None)
        lines += [f"**{heading(name)}**"] if name != section.name else []
        lines += [md_table(table)] if len(table.columns) else []
        lines += [f"All columns, {len(rows)} rows: {link(name)}"]
    lines += [f"- {note}" for note in section.result.notes]
    for name, caption in section.figures:
        lines += [f"![{name}](figures/{name if name.endswith('.gif') else f'{name}.png'})", caption]
    return lines


def link(name: str) -> str:
    return f"[tables/{name}.csv](tables/{name}.csv)"


def plain_markdown(text: str) -> str:
    """A text in Markdown in which no sign of a file's name is markup."""
    return re.sub(r"([\\`*<\[])", r"\\\1", text)


def md_table(table: pd.DataFrame) -> str:
    cells = [list(table.columns), ["---"] * len(table.columns), *table.astype(str).values.tolist()]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in cells)
