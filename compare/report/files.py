"""Results to files: CSV, JSON, Markdown and HTML."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from .folder import files, save
from .page import markdown, page
from .verdict import Section, passed


def write(
    folder: Path,
    sections: Sequence[Section],
    robot,
    origin: dict,
    verdict: str,
    causes: Sequence[dict] = (),
    skipped: Sequence[tuple[str, str]] = (),
) -> None:
    """All files of a report, the figures excepted, into a folder that has those; `verdict`: in words."""
    (folder / "tables").mkdir()
    for section in sections:
        for name, rows in section.tables.items():
            save(folder / "tables" / f"{name}.csv", for_csv(pd.DataFrame(rows, dtype=object)).to_csv(index=False))
    checks = [check.record() for section in sections for check in section.result.checks]
    save(folder / "report.md", markdown(sections, robot, origin, verdict, causes, skipped))
    save(folder / "index.html", page(folder, sections, robot, origin, verdict, causes, skipped))
    origin = origin | {"files": [*files(folder), "results.json"]}  # what may be replaced by the next report
    results = {
        "passed": passed(sections),
        "checks": checks,
        "causes": [{name: cause[name] for name in ("rank", "place", "stated", "found", "text")} for cause in causes],
        "skipped": [{"experiment": name, "reason": reason} for name, reason in skipped],
        "provenance": origin,
    }
    save(folder / "results.json", json.dumps(results, indent=1, allow_nan=False) + "\n")


def for_csv(table: pd.DataFrame) -> pd.DataFrame:
    """A table of objects for a CSV file: true and false in small letters, whole numbers beside empty cells."""
    return table.map(lambda value: str(value).lower() if isinstance(value, bool | np.bool_) else value)
