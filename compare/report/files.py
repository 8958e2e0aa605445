"""Results to files: CSV, JSON, Markdown and HTML."""

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from .document import Document, joined
from .folder import files, save
from .text import escaped
from .verdict import Parts, Report, passed


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
            save(folder / document.file, joined([*map(escaped, parts.lines), *body]) if text is None else text)
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
        text = parts.attempt(f"{name} {number} in results.json", None, partial(json.dumps, allow_nan=False), record)
        written += [json.loads(text)] if text else []
    return written


def csv(rows: Sequence[dict], columns: Sequence[str] | None = None) -> str:
    """A table with true and false in lower case, and integers also in columns with empty cells."""
    return pd.DataFrame(rows, columns=columns, dtype=object).map(cell).to_csv(index=False, lineterminator="\n")


def cell(value: object) -> object:
    """What stands in a file for a value; a text that a spreadsheet would compute begins with an apostrophe."""
    if isinstance(value, bool | np.bool_):
        return str(value).lower()
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")) else value
