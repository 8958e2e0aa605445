"""A report for its readers: Markdown, and HTML as one file."""

import base64
import html
import math
import re
from collections.abc import Sequence
from pathlib import Path
from string import Template

import pandas as pd

from ..judge.words import capital
from .questions import answers
from .verdict import Report, Section, outcome, passed

DIGITS = dict.fromkeys(("published", "exact", "tmt", "mujoco", "stated", "compiled"), 7)  # of a column; else 3
DIGITS |= dict.fromkeys(
    ("predicted_dt_s", "observed_dt_s", "dt_s", "mujoco_dt_s", "tmt_dt_s", "from_dt_s", "to_dt_s"), 5
)
FOLDED = 30  # rows: a longer table is folded in the HTML


def title(robot) -> str:
    return f"TMT and MuJoCo compared on {robot.described or robot.name}"


def introduction(robot) -> str:
    """What is compared, and how its tables are read."""
    tree, named = robot.tree, robot.described or robot.name
    bodies = how_many(len(tree.body_names), "rigid body", "rigid bodies")
    hinges = how_many(len(tree.hinge_names), "hinge", "hinges")
    return (
        f"{capital(named)}, {bodies} on {hinges}, modelled twice: as MJCF, run by MuJoCo, and "
        "by the TMT method in a program that shares nothing with it. Each difference stands beside a tolerance that was "
        "fixed beforehand (column bar); 'exact' is the method in 50-digit arithmetic, and distances from it are in eps = "
        "2.2e-16 of the quantity's scale. Of the states in a row, the largest difference is the largest of all; the worst is "
        "the one that comes closest to its tolerance."
    )


def how_many(count: int, one: str, many: str) -> str:
    """So many of something, a small number in words."""
    words = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
    return f"{words[count] if count < len(words) else count} {one if count == 1 else many}"


def shown(table: pd.DataFrame, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """A table as text, with the digits that a reader needs."""
    table = table if columns is None else table[columns]

    def text(value, digits):
        if isinstance(value, float):
            if not math.isfinite(value):
                return ""
            return f"{value:.0f}" if value.is_integer() and 1.0 <= abs(value) < 1e7 else f"{value:.{digits}g}"
        return "" if value is None else str(value)

    columns = {c: [text(v, DIGITS.get(c, 3)) for v in table[c].astype(object)] for c in table.columns}
    return pd.DataFrame(columns).rename(columns=lambda c: c.replace("_", " "))


def of_causes(causes: Sequence[dict]) -> pd.DataFrame:
    """The causes as a table for readers."""
    return pd.DataFrame([(cause["rank"], cause["text"]) for cause in causes], columns=["rank", "cause"])


def questions(sections: Sequence[Section], robot) -> pd.DataFrame:
    """What was asked and the answers, as a table for readers."""
    return pd.DataFrame(answers(sections, robot), columns=["part", "asked", "answered in", "answer"])


def asked_by(robot) -> str:
    """The heading of the questions."""
    return "The assignment's questions" if robot.questions else "Questions"


def failing(section: Section) -> pd.DataFrame:
    """The checks of a section that fail, as text."""
    failed = [check.record() for check in section.result.checks if not check.passed]
    return shown(pd.DataFrame(failed).drop(columns="passed", errors="ignore"))


def markdown(report: Report) -> str:
    """The report as Markdown."""
    sections, robot, origin, verdict, causes, skipped = report
    lines = [f"# {title(robot)}", f"**{verdict}**"]
    lines += ["**Causes** (1: an option or a convention, 2: a number):", md_table(of_causes(causes))] if causes else []
    lines += [introduction(robot)]
    asked = questions(sections, robot)
    lines += [f"## {asked_by(robot)}", md_table(asked)] if len(asked) else []
    for section in sections:
        failed = failing(section)
        lines += [
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
            lines += [f"![{name}](figures/{name}.png)", caption]
    lines += ["## Skipped", *(f"- {name}: {reason}." for name, reason in skipped)] if skipped else []
    lines += ["## Where this comes from", md_table(origins(origin))]
    return "\n\n".join(lines).replace("\n\n- ", "\n- ") + "\n"


def heading(name: str) -> str:
    """A table's name as words."""
    return {"what_should_i_use": "What should I use?"}.get(name, name.replace("_", " ").capitalize())


def link(name: str) -> str:
    return f"[tables/{name}.csv](tables/{name}.csv)"


def md_table(table: pd.DataFrame) -> str:
    cells = [list(table.columns), ["---"] * len(table.columns), *table.astype(str).values.tolist()]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in cells)


def origins(origin: dict) -> pd.DataFrame:
    return pd.DataFrame([(name, str(value)) for name, value in origin.items()], columns=["what", "value"])


def page(folder: Path, report: Report) -> str:
    """The report as one HTML file with its figures inside; folder: where these are."""
    sections, robot, origin, verdict, causes, skipped = report
    body = (
        ["<h2>Causes (1: an option or a convention, 2: a number)</h2>", html_table(of_causes(causes), "text")]
        if causes
        else []
    )
    asked = questions(sections, robot)
    body.append(f"<p>{html.escape(introduction(robot))}</p>")
    body += [f'<h2 id="questions">{html.escape(asked_by(robot))}</h2>', html_table(asked, "text")] if len(asked) else []
    for section in sections:
        failed = failing(section)
        body += [
            f'<h2 id="{section.name}">{html.escape(section.title)}</h2>',
            f"<p><em>Claim:</em> {words(section.claim)} <strong>{html.escape(outcome(section))}</strong></p>",
            f"<p><em>Tolerance:</em> {words(section.tolerance)}</p>",
        ]
        if len(failed):
            body += ["<p><strong>Checks that fail:</strong></p>", foldable(failed, f"{len(failed)} checks")]
        for name, caption in section.figures:
            data = base64.b64encode((folder / "figures" / f"{name}.png").read_bytes()).decode()
            image = f'<img alt="{name}" src="data:image/png;base64,{data}">'
            body.append(f"<figure>{image}<figcaption>{words(caption)}</figcaption></figure>")
        for name, rows in section.tables.items():
            table = shown(pd.DataFrame(rows), section.result.shown if name == section.name else None)
            body += [f"<h3>{heading(name)}</h3>"] if name != section.name else []
            body += [foldable(table, f"Table, {len(table)} rows")] if len(table.columns) else []
        checks = shown(pd.DataFrame([check.record() for check in section.result.checks]))
        body.append(f"<details><summary>All {len(checks)} checks</summary>{html_table(checks)}</details>")
        if section.result.notes:
            body.append("<ul>" + "".join(f"<li>{words(note)}</li>" for note in section.result.notes) + "</ul>")
    if skipped:
        reasons = "".join(f"<li>{name}: {words(reason)}.</li>" for name, reason in skipped)
        body.append(f'<h2 id="skipped">Skipped</h2><ul>{reasons}</ul>')
    body += ['<h2 id="provenance">Where this comes from</h2>', html_table(origins(origin))]
    links = [
        *[("questions", "questions")] * bool(len(asked)),
        *((s.name, s.name) for s in sections),
        ("provenance", "provenance"),
    ]
    return Template((Path(__file__).parent / "report.html").read_text(encoding="utf-8")).substitute(
        title=title(robot),
        colour="#009E73" if passed(sections) else "#D55E00",
        verdict=html.escape(verdict),
        contents="".join(f'<a href="#{anchor}">{text}</a>' for anchor, text in links),
        body="\n".join(body),
    )


def words(text: str) -> str:
    """A sentence in HTML; what stands between backticks is code."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", html.escape(text))


def foldable(table: pd.DataFrame, summary: str) -> str:
    """A table in HTML, folded if it is long."""
    text = html_table(table)
    return f"<details><summary>{summary}</summary>{text}</details>" if len(table) > FOLDED else text


def html_table(table: pd.DataFrame, kind: str = "data") -> str:
    return f'<div class="scroll">{table.to_html(index=False, border=0, classes=kind)}</div>'
