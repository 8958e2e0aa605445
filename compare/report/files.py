"""Results to files: CSV, JSON, Markdown and HTML."""

import json
import math
from collections.abc import Sequence
from csv import DictWriter
from functools import partial
from io import StringIO
from pathlib import Path

import numpy as np

from ..core.text import escaped
from .document import Document, joined
from .folder import files, save
from .verdict import Parts, Report, passed

COMPUTED = "=", "+", "-", "@", "\t", "\r"  # how the texts begin that a spreadsheet would compute


def write(folder: Path, report: Report, parts: Parts | None = None) -> Parts:
    """All files of a report, the figures excepted, into a folder that has those; what could not be made of it.

    A part that breaks is left out and named in all files; the others are written.
    """
    parts = Parts() if parts is None else parts
    (folder / "tables").mkdir()
    for section in report.sections:
        for name, rows in section.tables.items():
            text = parts.attempt(f"tables/{name}.csv", None, csv, rows)
            if text is not None:
                save(folder / "tables" / f"{name}.csv", text)
    made = [check for section in report.sections for check in section.result.checks]
    checks = records(parts, "check", [check.record() for check in made])
    fields = ("rank", "place", "stated", "found", "text")
    causes = records(parts, "cause", [{name: cause[name] for name in fields} for cause in report.causes])
    markdown, page = Document(report, parts), Document(report, parts, folder)
    bodies = {document: parts.attempt(document.file, [], document.body) for document in (markdown, page)}
    for document, body in bodies.items():
        text = parts.attempt(f"the head of {document.file}", None, document.text, body)
        if text is not None or document is markdown:
            save(
                folder / document.file, joined([*map(escaped, parts.lines), *body]) if text is None else text
            )
    reference = report.reference
    results = {
        "passed": passed(report.sections) and not parts.broken,
        "reference": None if reference is None else {"kind": reference.kind, "name": reference.name},
        "checks": checks + [check.record() for check in parts.checks],
        "causes": causes,
        "skipped": [{"experiment": name, "reason": reason} for name, reason in report.skipped],
        # its files: what may be replaced by the next report
        "provenance": report.origin | {"files": [*files(folder), "results.json"]},
    }
    save(folder / "results.json", json.dumps(results, indent=1, allow_nan=False) + "\n")
    return parts


def records(parts: Parts, name: str, found: Sequence[dict]) -> list[dict]:
    """Those of the records that can be written as JSON."""
    written = []
    for number, record in enumerate(found, start=1):
        text = parts.attempt(
            f"{name} {number} in results.json", None, partial(json.dumps, allow_nan=False), record
        )
        written += [json.loads(text)] if text else []
    return written


def csv(rows: Sequence[dict], columns: Sequence[str] = ()) -> str:
    """A table with these or all columns: true and false in lower case, nothing for what is unknown or not a number."""
    text, known = StringIO(), dict.fromkeys(name for row in rows for name in row)
    table = DictWriter(text, columns or known, extrasaction="ignore", lineterminator="\n")
    table.writeheader()
    for row in rows:
        table.writerow({name: cell(value) for name, value in row.items()})
    return text.getvalue()


def cell(value: object) -> object:
    """What stands in a file for a value; a text that a spreadsheet would compute begins with an apostrophe."""
    if isinstance(value, bool | np.bool_):
        return str(value).lower()
    if isinstance(value, float) and math.isnan(value):
        return ""
    return f"'{value}" if isinstance(value, str) and value.startswith(COMPUTED) else value
