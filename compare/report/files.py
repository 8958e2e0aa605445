"""Results to files: CSV, JSON, Markdown and HTML."""

import json
from pathlib import Path

import numpy as np
import pandas as pd

from .folder import files, save
from .page import markdown, page
from .verdict import Report, passed


def write(folder: Path, report: Report) -> None:
    """All files of a report, the figures excepted, into a folder that has those."""
    (folder / "tables").mkdir()
    for section in report.sections:
        for name, rows in section.tables.items():
            save(folder / "tables" / f"{name}.csv", for_csv(pd.DataFrame(rows, dtype=object)).to_csv(index=False))
    checks = [check.record() for section in report.sections for check in section.result.checks]
    save(folder / "report.md", markdown(report))
    save(folder / "index.html", page(folder, report))
    reference = report.reference
    results = {
        "passed": passed(report.sections),
        "reference": None if reference is None else {"kind": reference.kind, "name": reference.name},
        "checks": checks,
        "causes": [
            {name: cause[name] for name in ("rank", "place", "stated", "found", "text")} for cause in report.causes
        ],
        "skipped": [{"experiment": name, "reason": reason} for name, reason in report.skipped],
        # its files: what may be replaced by the next report
        "provenance": report.origin | {"files": [*files(folder), "results.json"]},
    }
    save(folder / "results.json", json.dumps(results, indent=1, allow_nan=False) + "\n")


def for_csv(table: pd.DataFrame) -> pd.DataFrame:
    """A table of objects for a CSV file: true and false in small letters, whole numbers beside empty cells."""
    return table.map(lambda value: str(value).lower() if isinstance(value, bool | np.bool_) else value)
