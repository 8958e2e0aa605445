"""The table of a fleet: rows, fleet.csv, index.html with its summary, changes since an earlier fleet."""

import csv
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from io import StringIO
from pathlib import Path
from urllib.parse import quote

from markupsafe import Markup

from ..core.check import About
from ..core.errors import Refused
from ..core.finding import Finding
from ..core.text import block, environment, say
from ..core.words import in_one_line
from ..report import files
from ..report.provenance import OURS, commit, installed
from ..report.verdict import Section, failures, worst
from ..run.reference import SOLUTION, Reference
from .cache import write_whole
from .models import place_of_report

AGREE, DIFFER, REFUSED, BROKE = "agree", "differ", "refused", "broke"
NOT_JUDGED, UNCONFIRMED, ITSELF = "not judged", "unconfirmed", "self-consistent"
VERDICTS = (DIFFER, BROKE, NOT_JUDGED, UNCONFIRMED, REFUSED, ITSELF, AGREE)  # in the order of the table
BAD_VERDICTS = (DIFFER, BROKE, NOT_JUDGED, UNCONFIRMED)  # exit status 1
HEADS = {  # columns of the page, after the file
    "verdict": "verdict", "reason": "reason or cause", "reference": "compared with", "joints": "joints",
    "worst_ratio": "share of tolerance", "file_integrator": "integrator", "file_dt_s": "step, ms",
    "stable_at_file_dt": "stable", "limit_s": "limit, ms", "seconds": "processor, s",
}  # fmt: skip
NUMBERS = "joints", "worst_ratio", "file_dt_s", "stable_at_file_dt", "limit_s", "seconds", "has_report"
FLEET_COLUMNS = ("file", "sha256", "same_as", *HEADS)
EMPTY_ROW = dict.fromkeys(FLEET_COLUMNS) | {"reason": "", "seconds": 0.0, "has_report": False}
REFERENCES = {"arm": "stated numbers", SOLUTION: "the solution", "model": "itself"}
CHANGES = {
    "verdict": "verdict",
    "stable_at_file_dt": "stable",
    "limit_s": "limit in s",
}  # columns and their names
MOVED = 0.01  # relative change of a step limit that is reported


def row_of_file(
    sections: Sequence[Section], causes: Sequence[dict], lost: Sequence[str], reference: Reference
) -> dict:
    """Verdict and reason, largest share of a tolerance, step. lost: parts of the report that broke off.

    An unstable step of the file and joints that are matched by other names do not change the verdict; the reason names them.
    """
    differing, broke, unstable, unconfirmed, _, not_judged = failures(sections)
    unfinished = [*(f"{check.experiment}: {check.note}" for check in broke), *lost]
    top = worst(sections)
    stable, limit = own_step(sections)
    if differing:
        outcome, reasons = DIFFER, [first_of([cause["text"] for cause in causes] or [str(differing[0])])]
    elif unfinished:
        outcome, reasons = BROKE, []
    elif not any(check.about == About.MODELS for section in sections for check in section.result.checks):
        outcome, reasons = REFUSED, ["no comparison was possible"]
    else:
        outcome = UNCONFIRMED if unconfirmed else ITSELF if reference.kind == "model" else AGREE
        outcome = NOT_JUDGED if not_judged else outcome
        said = {"not_judged": not_judged, "unconfirmed": unconfirmed, "unstable": unstable}
        reasons = [
            say(Finding("verdict", kind, {"checks": checks})) for kind, checks in said.items() if checks
        ]
    reasons += [f"not finished: {first_of(unfinished)}"] if unfinished else []
    return {
        "verdict": outcome, "reason": "; ".join(filter(None, (*reasons, reference.matched))),
        "worst_ratio": None if top is None else top.over_tolerance, "stable_at_file_dt": stable, "limit_s": limit,
    }  # fmt: skip


def first_of(reasons: Sequence[str]) -> str:
    return reasons[0] + (f", and {len(reasons) - 1} more" if len(reasons) > 1 else "")


def own_step(sections: Sequence[Section]) -> tuple[bool | None, float | None]:
    """Whether the file's step is stable in its runs and with its own servos, None if unknown; the smallest limit, s."""
    rows = [row for section in sections for row in section.result.tables.get("step_limits", ())]
    own = [row for row in rows if row.integrator == row.file_integrator]
    stable = [row.stable_at_file_dt for row in own if row.stable_at_file_dt is not None]
    runs = [row for section in sections for row in section.result.tables.get("own_run", ())]
    stable += [row.outcome in ("calm", "alike") for row in runs]
    limits = [row.predicted_dt for row in own if row.limit == "finite"]
    return (all(stable) if stable else None), min(limits, default=None)


def order(row: dict) -> tuple:
    """Sort key: verdict, unstable steps, largest share of a tolerance."""
    rank = VERDICTS.index(row["verdict"])
    return rank, row["stable_at_file_dt"] is not False, -(row["worst_ratio"] or 0.0), row["file"]


def is_row(row: object) -> bool:
    """Whether what lay in the folder of a report is a row of the table."""
    if not isinstance(row, dict) or not EMPTY_ROW.keys() >= row.keys() or row.get("verdict") not in VERDICTS:
        return False
    kinds = {name: float | int | None if name in NUMBERS else str | None for name in row}
    return all(isinstance(row[name], kind) for name, kind in kinds.items())


def earlier(folder: str) -> dict[str, dict]:
    """The columns of CHANGES of an earlier fleet, by file name. Refused if they cannot be read."""
    path = Path(folder) / "fleet.csv"
    try:
        return by_file(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, KeyError, csv.Error):
        raise Refused(
            f"cannot read {in_one_line(str(path))}; expected the folder of an earlier fleet"
        ) from None


def by_file(table: str) -> dict[str, dict]:
    """The columns of CHANGES by file name, as text."""
    return {row["file"]: {name: row[name] for name in CHANGES} for row in csv.DictReader(StringIO(table))}


def changes(before: Mapping[str, dict], rows: Sequence[dict]) -> list[str]:
    """The changes since an earlier fleet, one line for each file: verdict, step, limit; new and removed files."""
    now = by_file(files.csv(rows, FLEET_COLUMNS))
    lines = [f"{file}: new, {row['verdict']}" for file, row in now.items() if file not in before]
    lines += [f"{file}: removed, was {row['verdict']}" for file, row in before.items() if file not in now]
    for file in now.keys() & before.keys():
        pairs = {column: (before[file][column], now[file][column]) for column in CHANGES}
        moved = [f"{CHANGES[column]} {' -> '.join(value or 'unknown' for value in pair)}"
                 for column, pair in pairs.items() if is_change(*pair)]  # fmt: skip
        lines += [f"{file}: {'; '.join(moved)}"] * bool(moved)
    return sorted(lines)


def is_change(old: str, new: str) -> bool:
    try:
        return abs(float(new) - float(old)) > MOVED * abs(float(old))
    except ValueError:  # not two numbers
        return old != new


def write_table(
    out: Path, run: object, left_out: Sequence[tuple[str, str]], changed: Sequence[str] | None, command: str
) -> list[str]:
    """Write fleet.csv and index.html; the lines of the summary. run: a run.Run; changed: lines of --since, None: without it."""
    rows = sorted(run.rows, key=order)
    numbers = run.verdicts
    unstable = [row["file"] for row in rows if row["stable_at_file_dt"] is False]
    copies = sum(row["same_as"] is not None for row in rows)
    text = block("fleet", "summary", numbers={v: numbers[v] for v in VERDICTS if numbers[v]}, copies=copies,
                 unstable=unstable, left_out=left_out)  # fmt: skip
    summary = [line for line in text.split("\n") if line]
    origin = {"command": command, "date": datetime.now(UTC).isoformat(timespec="seconds"), "commit": commit()}
    origin |= {OURS: installed(OURS), "mujoco": installed("mujoco")}
    page = fleet_page(rows, summary=summary, left_out=left_out, changed=changed, origin=origin)
    write_whole(out / "fleet.csv", files.csv(rows, FLEET_COLUMNS).encode("utf-8", "backslashreplace"))
    write_whole(out / "index.html", page.encode("utf-8", "backslashreplace"))
    return summary


def fleet_page(rows: Sequence[dict], **values: object) -> str:
    """The page as HTML. values: summary, left_out, changed and origin, as in write_table."""
    title, good = "A fleet of models compared", not any(row["verdict"] in BAD_VERDICTS for row in rows)
    pages = environment()
    values |= {"rows": list(map(shown_row, rows)), "heads": HEADS, "title": title, "good": good}
    body = pages.get_template("fleet.html.jinja").render(values)
    return pages.get_template("page.html.jinja").render(
        title=title, links=(), good=good, script="", body=Markup(body)
    )


def shown_row(row: dict) -> dict:
    """A row with the text of its cells, its class and the address of its report."""
    is_bad = row["verdict"] in BAD_VERDICTS or row["stable_at_file_dt"] is False
    return row | {
        "cells": {name: cell(name, row[name]) for name in HEADS},
        "kind": "bad" if is_bad else "good" if row["verdict"] == AGREE else "none",
        "address": quote(f"{place_of_report(row['same_as'] or row['file'])}/index.html"),
    }


def cell(name: str, value: object) -> str:
    """The text of a cell; steps are in ms."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return (
            f"{value:.1f}"
            if name == "seconds"
            else f"{1e3 * value:.4g}"
            if name.endswith("_s")
            else f"{value:.2g}"
        )
    return "" if value is None else REFERENCES.get(value, str(value))
