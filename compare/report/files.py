"""Results to files: CSV, JSON, Markdown and HTML."""

import json
import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..core.rows import Row, columns_of
from ..core.text import escaped
from .document import Document, joined
from .folder import files, save
from .verdict import Parts, Report, passed

COMPUTED = "=", "+", "-", "@", "\t", "\r"  # how the texts begin that a spreadsheet would compute


def write(folder: Path, report: Report, parts: Parts | None = None) -> Parts:
    """Write the files of a report, beside its figures; parts that break are left out and named."""
    parts = Parts() if parts is None else parts
    (folder / "tables").mkdir()
    for section in report.sections:
        for name, rows in section.tables.items():
            text = parts.attempt(f"tables/{name}.csv", "", csv, rows)
            if text:
                save(folder / "tables" / f"{name}.csv", text)
    made = [check.record() for section in report.sections for check in section.result.checks]
    found = [cause.record() for cause in report.causes]
    checks, causes = (records(parts, *named) for named in (("check", made), ("cause", found)))
    documents = Document(report, parts), Document(report, parts, folder)
    bodies: list[list[str]] = [parts.attempt(document.file, [], document.body) for document in documents]
    for document, body in zip(documents, bodies):
        text = parts.attempt(f"the head of {document.file}", "", document.text, body)
        if text or not document.page:
            save(folder / document.file, text or joined([*map(escaped, parts.lines), *body]))
    results = {
        "passed": passed(report.sections) and not parts.broken,
        "reference": report.reference,
        "checks": checks + [check.record() for check in parts.checks],
        "causes": causes,
        "skipped": [{"experiment": name, "reason": reason} for name, reason in report.skipped],
        # its files: what may be replaced by the next report
        "provenance": report.origin | {"files": [*files(folder), "results.json"]},
    }
    save(folder / "results.json", json.dumps(results, indent=1, allow_nan=False) + "\n")
    return parts


def records(parts: Parts, name: str, found: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Those of the records that can be written as JSON."""
    written = []
    for number, record in enumerate(found, start=1):
        what = f"{name} {number} in results.json"
        text = parts.attempt(what, "", partial(json.dumps, allow_nan=False), record)
        written += [json.loads(text)] if text else []
    return written


def csv(rows: Sequence[Row], columns: Sequence[str] = ()) -> str:
    """A table with these or all columns: true and false in lower case, nothing for what is no number."""
    cells = [{name: cell(value) for name, value in row.record().items()} for row in rows]
    table = pd.DataFrame(cells, columns=list(columns or columns_of(rows)), dtype=object)
    return table.to_csv(index=False, lineterminator="\n")


def cell(value: Any) -> Any:
    """What stands for a value; a text that a spreadsheet would compute begins with an apostrophe."""
    if isinstance(value, bool | np.bool_):
        return str(value).lower()
    if isinstance(value, float) and math.isnan(value):
        return ""
    return f"'{value}" if isinstance(value, str) and value.startswith(COMPUTED) else value
