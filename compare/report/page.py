"""A report for its readers: Markdown, and HTML as one file."""

import base64
import html
import math
import re
from collections.abc import Sequence
from pathlib import Path
from string import Template

import pandas as pd

from ..judge.words import capital, listed
from .questions import answers
from .verdict import Report, Section, outcome, passed

DIGITS = dict.fromkeys(("published", "exact", "tmt", "mujoco", "stated", "compiled"), 7)  # of a column; else 3
DIGITS |= dict.fromkeys(
    ("predicted_dt_s", "observed_dt_s", "dt_s", "mujoco_dt_s", "tmt_dt_s", "from_dt_s", "to_dt_s"), 5
)
FOLDED = 30  # rows: a longer table is folded in the HTML


def title(robot) -> str:
    return f"{'Your equations' if robot.own else 'TMT'} and MuJoCo compared on {robot.described or robot.name}"


def first_lines(reference) -> Sequence[str]:
    """What the report is of, as on the terminal: what is compared with what, what is open, what MuJoCo warns of."""
    return () if reference is None else reference.lines


def introduction(robot) -> str:
    """What is compared, and how its tables are read."""
    named = robot.described or robot.name
    what = f"{how_many(len(robot.tree.body_names), 'rigid body', 'rigid bodies')} on {joints_in_words(robot)}"
    return (of_file(named, what, robot.features, robot.own) if robot.is_read else of_two_models(named, what)) + (
        " Each difference stands beside a tolerance that was "
        "fixed beforehand (column bar); 'exact' is the method in 50-digit arithmetic, and distances from it are in eps = "
        "2.2e-16 of the quantity's scale. Of the states in a row, the largest difference is the largest of all; the worst is "
        "the one that comes closest to its tolerance."
    )


def of_two_models(named: str, what: str) -> str:
    """What is compared of a robot whose numbers are stated."""
    return (
        f"{capital(named)}, {what}, modelled twice: as MJCF, run by MuJoCo, and by the TMT method in a program that shares "
        "nothing with it."
    )


def of_file(named: str, what: str, features: Sequence, own: Sequence[str] = ()) -> str:
    """What is compared of a robot that is read from a file, and what is switched off for that.

    own: what a user's own equations give, if they are compared.
    """
    if own:
        compared = f"{named}: {what}. Your equations, which give {listed(own)}, are compared with MuJoCo's. "
    else:
        compared = (
            f"{named}: {what}. The numbers are those of the model as MuJoCo compiled it; tmt's equations of motion for these "
            "numbers are compared with MuJoCo's, so that an agreement says that the equations are the same, and not that the "
            "numbers are right. "
        )
    off = [f"{feature.feature} ({feature.count})" for feature in features if feature.treatment != "modelled"]
    return (
        compared
        + (f"Switched off in MuJoCo, because the equations do not have it: {', '.join(off)}." if off else
           "Nothing of the file is switched off.")
    )  # fmt: skip


def joints_in_words(robot) -> str:
    """The joints of a robot by their kinds: of a file as it has them, a free joint as one."""
    words = {"hinge": "hinges", "slide": "slides", "ball": "balls", "free": "free joints"}
    kinds = robot.tree.kind
    known = {feature.feature: feature.count for feature in robot.features} or {k: kinds.count(k) for k in kinds}
    singular = {"free": "free joint"}
    return listed([how_many(known[k], singular.get(k, k), many) for k, many in words.items() if known.get(k)])


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
    sections, robot, origin, verdict, causes, skipped, reference = report
    lines = [plain_markdown(line) for line in first_lines(reference)]
    lines += [f"# {plain_markdown(title(robot))}", f"**{verdict}**"]
    lines += ["**Causes** (1: an option or a convention, 2: a number):", md_table(of_causes(causes))] if causes else []
    lines += [plain_markdown(introduction(robot))]
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


def plain_markdown(text: str) -> str:
    """A text in Markdown in which no sign of a file's name is markup."""
    return re.sub(r"([\\`*<\[])", r"\\\1", text)


def md_table(table: pd.DataFrame) -> str:
    cells = [list(table.columns), ["---"] * len(table.columns), *table.astype(str).values.tolist()]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in cells)


def origins(origin: dict) -> pd.DataFrame:
    return pd.DataFrame([(name, str(value)) for name, value in origin.items()], columns=["what", "value"])


def page(folder: Path, report: Report) -> str:
    """The report as one HTML file with its figures inside; folder: where these are."""
    sections, robot, origin, verdict, causes, skipped, reference = report
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
        title=html.escape(title(robot)),
        reference="".join(f"<p>{html.escape(line)}</p>\n" for line in first_lines(reference)),
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
