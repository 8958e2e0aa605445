"""A report as one HTML file."""

import base64
import html
import re
from collections.abc import Sequence
from pathlib import Path
from string import Template

import pandas as pd

from .introduction import first_lines, introduction, title
from .parts import Parts
from .tables import asked_by, failing, heading, of_causes, origins, questions, shown
from .verdict import Report, Section, outcome, passed

FOLDED = 30  # rows: a longer table is folded


def page(report: Report, body: Sequence[str], parts: Parts) -> str:
    """The whole page: what the report is of, its verdict, what could not be made of it, links, and its body."""
    sections, robot = report.sections, report.robot
    has_questions = any('id="questions"' in text for text in body)
    links = ["questions"] * has_questions + [section.name for section in sections] + ["provenance"]
    return Template((Path(__file__).parent / "report.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title(robot)),
        reference="".join(f"<p>{html.escape(line)}</p>\n" for line in first_lines(report.reference)),
        colour="#009E73" if passed(sections) and not parts.broken else "#D55E00",
        verdict=html.escape(report.verdict) + "".join(f"<br>{html.escape(line)}" for line in parts.lines),
        top="".join(f"<p>{words(line)}</p>\n" for line in report.top),
        contents="".join(f'<a href="#{name}">{name}</a>' for name in links),
        body="\n".join(body),
    )


def page_body(folder: Path, report: Report, parts: Parts) -> list[str]:
    """What stands below the links, with its figures inside; folder: where these are. A part that breaks is left out."""
    sections, robot, origin, _, causes, skipped, _ = report
    texts = []
    if causes:
        texts += [
            "<h2>Causes (1: an option or a convention, 2: a number)</h2>",
            html_table(of_causes(causes), "text"),
        ]
    texts.append(f"<p>{html.escape(parts.made('the introduction', '', introduction, robot))}</p>")
    texts += parts.made("the questions", [], answers_in_html, sections, robot)
    for section in sections:
        missing = [top(section), "<p>This section could not be made.</p>"]
        texts += parts.made(f"{section.name} in index.html", missing, section_in_html, folder, section)
    if skipped:
        reasons = "".join(f"<li>{name}: {words(reason)}.</li>" for name, reason in skipped)
        texts.append(f'<h2 id="skipped">Skipped</h2><ul>{reasons}</ul>')
    return [*texts, '<h2 id="provenance">Where this comes from</h2>', html_table(origins(origin))]


def answers_in_html(sections: Sequence[Section], robot) -> list[str]:
    """What was asked, and the answers; nothing if there is no question."""
    asked = questions(sections, robot)
    top = f'<h2 id="questions">{html.escape(asked_by(robot))}</h2>'
    return [top, html_table(asked, "text")] if len(asked) else []


def top(section: Section) -> str:
    """The heading of an experiment."""
    return f'<h2 id="{section.name}">{html.escape(section.title)}</h2>'


def section_in_html(folder: Path, section: Section) -> list[str]:
    """What stands in the page of one experiment."""
    failed = failing(section)
    texts = [
        top(section),
        f"<p><em>Claim:</em> {words(section.claim)} <strong>{html.escape(outcome(section))}</strong></p>",
        f"<p><em>Tolerance:</em> {words(section.tolerance)}</p>",
    ]
    if len(failed):
        texts += ["<p><strong>Checks that fail:</strong></p>", foldable(failed, f"{len(failed)} checks")]
    for name, caption in section.figures:
        if name.endswith(".gif"):  # it is in the page as what moves
            continue
        data = base64.b64encode((folder / "figures" / f"{name}.png").read_bytes()).decode()
        image = f'<img alt="{name}" src="data:image/png;base64,{data}">'
        texts.append(f"<figure>{image}<figcaption>{words(caption)}</figcaption></figure>")
    for name, rows in section.tables.items():
        table = shown(pd.DataFrame(rows), section.result.shown if name == section.name else None)
        texts += [f"<h3>{heading(name)}</h3>"] if name != section.name else []
        texts += [foldable(table, f"Table, {len(table)} rows")] if len(table.columns) else []
    checks = shown(pd.DataFrame([check.record() for check in section.result.checks]))
    texts.append(f"<details><summary>All {len(checks)} checks</summary>{html_table(checks)}</details>")
    if section.result.notes:
        texts.append("<ul>" + "".join(f"<li>{words(note)}</li>" for note in section.result.notes) + "</ul>")
    return texts


def words(text: str) -> str:
    """A sentence in HTML; what stands between backticks is code."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", html.escape(text))


def foldable(table: pd.DataFrame, summary: str) -> str:
    """A table in HTML, folded if it is long."""
    text = html_table(table)
    return f"<details><summary>{summary}</summary>{text}</details>" if len(table) > FOLDED else text


def html_table(table: pd.DataFrame, kind: str = "data") -> str:
    return f'<div class="scroll">{table.to_html(index=False, border=0, classes=kind)}</div>'
