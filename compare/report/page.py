"""A report as one HTML file: the first screen, then a section for each experiment."""

import html
from collections.abc import Sequence
from pathlib import Path
from string import Template

import pandas as pd

from .first_screen import LINKED, causes_in_html, list_in_html, mark, pictures_in_html, verdict_in_html
from .images import moves
from .introduction import first_lines, introduction, title
from .markup import details, figure, html_table, of_section, words
from .motion import motion_in_html
from .one_number import one_number
from .parts import Parts
from .shortened import shortened
from .tables import asked_by, closest_checks, failing, heading, of_causes, origins, questions, shown
from .verdict import Report, Section, outcome, passed, standing

MOST_ROWS, MOST_OF_RUNS = 40, 60  # of a table in the page; its file has all
FIRST_NOTES = 3  # that stand open, the others are folded
MOST_FIGURES, FIRST_FIGURES = 4, 2  # of a section that stand open; the first, where there are more


def page(report: Report, body: Sequence[str], parts: Parts) -> str:
    """The whole page: links that stay in view, and around the body the title and the verdict, with what could not be made."""
    sections = report.sections
    has_questions = any('id="questions"' in text for text in body)
    links = ["questions"] * has_questions + [section.name for section in sections] + ["provenance"]
    wrong = {section.name for section in sections if standing(section)[0] is False}
    return Template((Path(__file__).parent / "report.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title(report.robot)),
        reference="".join(f'<p class="reference">{html.escape(line)}</p>\n' for line in first_lines(report.reference)),
        good="good" if passed(sections) and not parts.broken else "bad",
        verdict=verdict_in_html(report, parts),
        links="".join(f'<a href="#{name}">{mark(False) if name in wrong else ""}{name}</a>' for name in links),
        body="\n".join(body),
    )


def page_body(folder: Path, report: Report, parts: Parts) -> list[str]:
    """What stands below the verdict, with its figures inside; folder: where these are. A part that breaks is left out."""
    sections, robot, origin, _, causes, skipped, _ = report
    texts = [parts.made("the causes in index.html", "", causes_in_html, report)]
    pictures = parts.made("the pictures of the first screen", "", pictures_in_html, folder, report)
    texts += [f'<div class="screen">{list_in_html(report, parts)}{pictures}</div>']
    texts += [parts.made("the motion in index.html", "", motion_in_html, sections, robot)]
    texts += [f'<p class="wide">{words(parts.made("the introduction", "", introduction, robot))}</p>']
    if causes:
        table = html_table(of_causes(causes), "Causes", "text")
        texts.append(
            f'<section id="causes"><h2>Causes (1: an option or a convention, 2: a number)</h2>{table}</section>'
        )
    texts += parts.made("the questions", [], answers_in_html, sections, robot)
    for section in sections:
        missing = [top(section), "<p>This section could not be made.</p>"]
        made = parts.made(f"{section.name} in index.html", missing, section_in_html, folder, section)
        texts += [f'<section id="{section.name}" aria-labelledby="title-{section.name}">', *made, "</section>"]
    if skipped:
        reasons = "".join(f"<li>{html.escape(name)}: {words(reason)}.</li>" for name, reason in skipped)
        texts.append(f'<section id="skipped"><h2>Skipped</h2><ul>{reasons}</ul></section>')
    table = html_table(origins(origin), "Where this report comes from", "text")
    return [*texts, f'<section id="provenance"><h2>Where this comes from</h2>{table}</section>']


def answers_in_html(sections: Sequence[Section], robot: object) -> list[str]:
    """What was asked, and the answers; nothing if there is no question."""
    asked = questions(sections, robot)
    if not len(asked):
        return []
    title = asked_by(robot)
    return [f'<section id="questions"><h2>{html.escape(title)}</h2>{html_table(asked, title, "text")}</section>']


def top(section: Section) -> str:
    """The heading of an experiment."""
    return f'<h2 id="title-{section.name}">{html.escape(section.title)}</h2>'


def section_in_html(folder: Path, section: Section) -> list[str]:
    """What stands in the page of one experiment: what was found, figures, the tolerance, and the details folded."""
    good, _ = standing(section)
    kind = "good" if good else "none" if good is None else "bad"
    number, notes = one_number(section), section.notes
    texts = [
        top(section),
        f'<p class="outcome {kind}">{mark(good)} <strong>{html.escape(outcome(section))}</strong> {words(number)}.</p>',
        f"<p><em>Claim:</em> {words(section.claim)}</p>",
    ]
    failed = failing(section)
    if len(failed):
        many = f"{len(failed)} checks that fail"
        table = html_table(failed.head(MOST_ROWS), many)
        texts += ["<p><strong>Checks that fail:</strong></p>", table if len(failed) <= 8 else details(many, table)]
    texts += [listed_in_html(notes[:FIRST_NOTES])] if notes else []
    texts += figures_in_html(folder, section)
    texts += [f"<h3>What the tolerance is, and why</h3><p>{words(section.tolerance)}</p>"] if section.tolerance else []
    more = notes[FIRST_NOTES:]
    texts += [details(f"Further findings ({len(more)})", listed_in_html(more))] if more else []
    texts += [table_in_html(section, name, rows) for name, rows in section.tables.items()]
    return [*texts, checks_in_html(section)]


def figures_in_html(folder: Path, section: Section) -> list[str]:
    """The figures of a section; of many the first open, with those to which the first screen links, the others folded."""
    figures = [(file, caption) for file, caption in of_section(section) if not moves(file)]
    firsts = figures if len(figures) <= MOST_FIGURES else figures[:FIRST_FIGURES]
    texts, folded = [], []
    for file, caption in figures:
        is_open = (file, caption) in firsts or file.endswith(LINKED)
        (texts if is_open else folded).append(figure(folder, file, caption))
    more = f"{len(folded)} more figure{'s' if len(folded) > 1 else ''}"
    return [*texts, details(more, "".join(folded))] if folded else texts


def listed_in_html(notes: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{words(note)}</li>" for note in notes) + "</ul>"


def table_in_html(section: Section, name: str, rows: Sequence[dict]) -> str:
    """A table, folded, with the rows that a reader needs; or where it stands, if its file alone has it."""
    file = f"tables/{name}.csv"
    link = f'<a href="{file}">{file}</a>'
    columns = section.result.shown if name == section.name else None
    if name in section.result.filed or columns == []:
        return f"<p>{heading(name)}: {len(rows)} rows in {link}.</p>"
    few, which = shortened(rows, MOST_ROWS, MOST_OF_RUNS)
    title = f"{heading(name)}: {which or f'{len(rows)} rows'}"
    table = html_table(shown(pd.DataFrame(few), columns), heading(name)) if few else ""
    return details(title, f"{table}<p>All columns, {len(rows)} rows: {link}, beside this page.</p>")


def checks_in_html(section: Section) -> str:
    """The checks that come closest to their tolerance, folded."""
    checks = section.result.checks
    if not checks:
        return "<p>Nothing was checked.</p>"
    table = closest_checks(section, MOST_ROWS)
    which = (
        f"All {len(checks)} checks"
        if len(table) == len(checks)
        else f"{len(checks)} checks: the {len(table)} that fail or come closest"
    )
    more = "" if len(table) == len(checks) else "<p>All of them: results.json, beside this page.</p>"
    return details(which, html_table(table, "Checks") + more)
