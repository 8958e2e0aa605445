"""A small report, and what is in a folder: for report/test_folder and process/test_interrupt."""

import json

from compare.report.folder import new_report

OLD = {"tables/mass.csv": "old", "results.json": "old"}


def fill(work, text):
    """A small report that lists its files."""
    (work / "tables").mkdir()
    (work / "tables" / "mass.csv").write_text(text)
    listed = ["report.md", "results.json", "tables/mass.csv"]
    (work / "results.json").write_text(json.dumps({"provenance": {"files": listed}, "text": text}))


def files(folder):
    """What is in a folder; of results.json only the text of `fill`."""
    found = {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*") if p.is_file()}
    return {name: json.loads(text)["text"] if name == "results.json" else text for name, text in found.items()}


def old_report(out):
    with new_report(out) as work:
        fill(work, "old")
