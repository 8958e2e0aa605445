"""The files of a fleet: fleet.csv, index.html, and the summary at its top."""

import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from ..judge.finding import Finding
from ..judge.timing import vectors
from ..report.provenance import commit
from ..report.text import say
from ..report.version import OURS, installed, own_version
from ..run.reference import SOLUTION
from .cache import write_whole
from .models import place_of_report
from .run import Run
from .table import BAD_VERDICTS, ITSELF, REFUSED, VERDICTS, csv_of_fleet, order

HEADS = {
    "file": "file", "verdict": "verdict", "reason": "reason or cause", "reference": "compared with", "joints": "joints",
    "worst_ratio": "share of tolerance", "file_integrator": "integrator", "file_dt_s": "step, ms",
    "stable_at_file_dt": "stable", "limit_s": "limit, ms", "seconds": "processor, s",
}  # fmt: skip
REFERENCES = {"arm": "stated numbers", SOLUTION: "the solution", "model": "itself"}
ROW_KINDS = dict.fromkeys(BAD_VERDICTS, "bad") | {REFUSED: "none", ITSELF: "none"}


def sentence(kind: str, **values: object) -> str:
    return say(Finding("fleet", kind, values))


def write_table(
    out: Path, run: Run, left_out: Sequence[tuple[str, str]], changed: Sequence[str] | None, command: str, took: float
) -> list[str]:
    """Write fleet.csv and index.html; the lines of the summary. changed: since an earlier fleet; None: without --since."""
    rows, left_out = sorted(with_why_itself(run.rows), key=order), [*left_out, *run.parts]
    summary = summary_of(rows, left_out, run)
    origin = {
        "command": command,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": round(took, 1),
        "workers": run.workers,
        "this machine": f"{platform.node()}, {vectors()}",
        "machines of the workers": ", ".join(sorted(run.machines)) or "none",
        "commit": commit(),
        OURS: own_version(),
        "mujoco": installed("mujoco"),
    }
    write_whole(out / "fleet.csv", csv_of_fleet(rows).encode("utf-8", "backslashreplace"))
    text = fleet_page("A fleet compared with MuJoCo", summary, rows, left_out, changed, origin, picture_of_steps(rows))
    write_whole(out / "index.html", text.encode("utf-8", "backslashreplace"))
    return summary


def with_why_itself(rows: Sequence[dict]) -> list[dict]:
    """The rows; if some files are compared with stated numbers, with the reason why others are not."""
    if not any(row["reference"] in ("arm", SOLUTION) for row in rows):
        return list(rows)
    reasons = [row["why_itself"] and sentence("why_itself", reason=row["why_itself"]) for row in rows]
    return [row | {"reason": "; ".join(filter(None, (why, row["reason"])))} for row, why in zip(rows, reasons)]


def picture_of_steps(rows: Sequence[dict]) -> dict | None:
    """The figure of the page: source, caption, width, height; None: nothing to draw, or drawing failed."""
    if not any(row["limit_s"] for row in rows):
        return None
    try:
        from .figures_fleet import picture_of  # imports matplotlib

        return picture_of(rows)
    except Exception:
        return None  # the table has the same numbers


def summary_of(rows: Sequence[dict], left_out: Sequence[tuple[str, str]], run: Run) -> list[str]:
    numbers = run.verdicts()
    lines = [sentence("verdicts", files=len(rows), numbers={v: numbers[v] for v in VERDICTS if numbers[v]})]
    if unstable := [row["file"] for row in rows if row["stable_at_file_dt"] is False]:
        lines.append(sentence("unstable", names=unstable))
    if left_out:
        lines.append(sentence("left_out", files=len(left_out)))
    if run.no_timing:
        lines.append(sentence("no_timing", reason=run.no_timing))
    if numbers[ITSELF]:
        lines.append(sentence("self_consistent"))
    if run.files_cached or run.tasks_cached:
        lines.append(sentence("cached", files=run.files_cached, tasks=run.tasks_cached))
    return lines


def fleet_page(
    title: str,
    summary: Sequence[str],
    rows: Sequence[dict],
    left_out: Sequence[tuple[str, str]],
    changed: Sequence[str] | None,
    origin: dict,
    picture: dict | None = None,
) -> str:
    """The page as HTML; the arguments are those of write_table."""
    environment = Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined,
        loader=FileSystemLoader(Path(__file__).parent),
    )  # fmt: skip
    return environment.get_template("fleet.html.jinja").render(
        title=title, summary=summary, rows=[shown_row(row) for row in rows], left_out=left_out, changed=changed,
        origin=origin, picture=picture, heads=HEADS, is_bad=any(row["verdict"] in BAD_VERDICTS for row in rows),
    )  # fmt: skip


def shown_row(row: dict) -> dict:
    """A row with the text of its cells, its class and the address of its report."""
    return row | {
        "cells": {name: cell(name, row[name]) for name in HEADS if name != "file"},
        "kind": "bad" if row["stable_at_file_dt"] is False else ROW_KINDS.get(row["verdict"], "good"),
        "address": quote(f"{place_of_report(row['report_of'])}/index.html"),
    }


def cell(name: str, value: object) -> str:
    """The text of a cell; steps are in ms."""
    if name == "reference":
        return REFERENCES.get(value, value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.1f}" if name == "seconds" else f"{1e3 * value:.4g}" if name.endswith("_s") else f"{value:.2g}"
    return "" if value is None else str(value)
