"""Results to files: CSV, JSON, Markdown and HTML."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..core.rows import Row, columns_of
from . import reproduce
from .document import Document
from .folder import files
from .verdict import Report

COMPUTED = "=", "+", "-", "@", "\t", "\r"  # how the texts begin that a spreadsheet would compute


def write(folder: Path, report: Report) -> None:
    """Write the files of a report, beside its figures."""
    (folder / "tables").mkdir()
    for section in report.sections:
        for name, rows in section.tables.items():
            save(folder / "tables" / f"{name}.csv", csv(rows))
    document = Document(report)
    save(folder / "report.md", document.text())
    save(folder / "index.html", document.page(folder))
    save(folder / "tolerances.html", document.tolerances())
    save(folder / "reproduce.py", reproduce.script(report))
    results = {
        "passed": report.passed,
        "reference": report.reference,
        "checks": [check.record() for section in report.sections for check in section.result.checks],
        "causes": [cause.record() for cause in report.causes],
        "skipped": [{"experiment": name, "reason": reason} for name, reason in report.skipped],
        # its files: what may be replaced by the next report
        "provenance": report.origin | {"files": [*files(folder), "results.json"]},
    }
    save(folder / "results.json", json.dumps(results, indent=1, allow_nan=False) + "\n")


def save(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", errors="backslashreplace")


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
