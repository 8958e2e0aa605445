"""The table of a fleet: rows, fleet.csv, index.html with its summary, changes since an earlier fleet."""

import csv
import io
import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from ..judge.check import About
from ..judge.finding import Finding
from ..judge.timing import vectors
from ..process.crash import Refused
from ..process.streams import in_one_line
from ..report.provenance import OURS, commit, installed
from ..report.text import say
from ..report.verdict import Section, failures, unconfirmed_in_words, unstable_in_words, worst
from ..run.reference import SOLUTION, Reference
from .cache import write_whole
from .models import place_of_report

FLEET_COLUMNS = (
    "file", "sha256", "verdict", "reason", "joints", "worst_ratio",
    "file_integrator", "file_dt_s", "stable_at_file_dt", "limit_s", "seconds",
)  # fmt: skip
AGREE, DIFFER, REFUSED, BROKE = "agree", "differ", "refused", "broke"
UNCONFIRMED, ITSELF = "unconfirmed", "self-consistent"
VERDICTS = (DIFFER, BROKE, UNCONFIRMED, REFUSED, ITSELF, AGREE)  # in the order of the table
BAD_VERDICTS = (DIFFER, BROKE, UNCONFIRMED)  # exit status 1
MOVED = 0.01  # relative change of a step limit that is reported
HEADS = {
    "file": "file", "verdict": "verdict", "reason": "reason or cause", "reference": "compared with", "joints": "joints",
    "worst_ratio": "share of tolerance", "file_integrator": "integrator", "file_dt_s": "step, ms",
    "stable_at_file_dt": "stable", "limit_s": "limit, ms", "seconds": "processor, s",
}  # fmt: skip
EMPTY_ROW = {
    "reason": "", "joints": None, "reference": "", "file_integrator": None, "file_dt_s": None,
    "worst_ratio": None, "stable_at_file_dt": None, "limit_s": None, "seconds": 0.0, "has_report": False,
}  # fmt: skip
REFERENCES = {"arm": "stated numbers", SOLUTION: "the solution", "model": "itself"}
ROW_KINDS = dict.fromkeys(BAD_VERDICTS, "bad") | {REFUSED: "none", ITSELF: "none"}


def row_of_file(sections: Sequence[Section], causes: Sequence[dict], lost: Sequence[str], reference: Reference) -> dict:
    """Verdict and reason, largest share of a tolerance, step. lost: parts of the report that broke off.

    An unstable step of the file and joints that are matched by other names do not change the verdict; the reason names them.
    """
    differing, broke, unstable, unconfirmed = failures(sections)
    top = worst(sections)
    stable, limit = own_step(sections)
    if differing:
        outcome, reason = DIFFER, str(differing[0])
        if causes:
            reason = causes[0]["text"] + (f", and {len(causes) - 1} more" if len(causes) > 1 else "")
    elif broke or lost:
        outcome, reason = BROKE, f"{broke[0].experiment}: {broke[0].note}" if broke else lost[0]
    elif not any(check.about == About.MODELS for section in sections for check in section.result.checks):
        outcome, reason = REFUSED, "no comparison was possible"
    else:
        outcome = UNCONFIRMED if unconfirmed else ITSELF if reference.kind == "model" else AGREE
        reasons = [unconfirmed_in_words(unconfirmed)] if unconfirmed else []
        reasons += [unstable_in_words(unstable)] if unstable else []
        reason = "; ".join(reasons)
    return {
        "verdict": outcome, "reason": "; ".join(filter(None, (reason, reference.matched))),
        "worst_ratio": None if top is None else top.over_tolerance, "stable_at_file_dt": stable, "limit_s": limit,
    }  # fmt: skip


def own_step(sections: Sequence[Section]) -> tuple[bool | None, float | None]:
    """Whether the file's step is stable with its own servos at all postures, None if unknown; the smallest limit, s."""
    rows = [row for section in sections for row in section.result.tables.get("step_limits", ())]
    own = [row for row in rows if row["integrator"] == row["file_integrator"] and row["base"] != "locked"]
    stable = [row["stable_at_file_dt"] for row in own if row["stable_at_file_dt"] is not None]
    limits = [row["predicted_dt_s"] for row in own if row["limit"] == "finite"]
    return (all(stable) if stable else None), min(limits, default=None)


def order(row: dict) -> tuple:
    """Sort key: verdict, unstable steps, largest share of a tolerance."""
    rank = VERDICTS.index(row["verdict"])
    return rank, row["stable_at_file_dt"] is not False, -(row["worst_ratio"] or 0.0), row["file"]


def csv_of_fleet(rows: Sequence[dict]) -> str:
    """The table with all digits; an unknown value is empty."""
    text = io.StringIO()
    table = csv.DictWriter(text, FLEET_COLUMNS, extrasaction="ignore", lineterminator="\n")
    table.writeheader()
    for row in rows:
        table.writerow({name: str(value).lower() if isinstance(value, bool) else value for name, value in row.items()})
    return text.getvalue()


def earlier(folder: str) -> dict[str, dict]:
    """The rows of an earlier fleet by file name, `limit_s` a number or None. Refused if they cannot be read."""
    path = Path(folder) / "fleet.csv"
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = [
                row | {"limit_s": float(row["limit_s"]) if row["limit_s"] else None} for row in csv.DictReader(file)
            ]
        return {row["file"]: {name: row[name] for name in FLEET_COLUMNS} for row in rows}
    except (OSError, ValueError, KeyError, csv.Error) as error:
        why = getattr(error, "strerror", None) or "not a table of a fleet"
        shown = in_one_line(str(path))
        raise Refused(f"cannot read {shown}: {why}; expected the folder of an earlier fleet") from None


def changes(before: Mapping[str, dict], rows: Sequence[dict]) -> list[str]:
    """The changes since an earlier fleet, one line for each file: verdict, step, limit; new and removed files."""
    lines = []
    for row in rows:
        old = before.get(row["file"])
        parts = [f"new, {row['verdict']}"] if old is None else changed_parts(old, row)
        if parts:
            is_other = old is not None and old["sha256"] != row["sha256"]
            lines.append(f"{row['file']}: {'; '.join(parts)}{' (the file has changed)' * is_other}")
    names = {row["file"] for row in rows}
    return lines + [f"{name}: removed, was {old['verdict']}" for name, old in before.items() if name not in names]


def changed_parts(old: dict, row: dict) -> list[str]:
    parts, stable = [], {None: "", True: "true", False: "false"}[row["stable_at_file_dt"]]
    if old["verdict"] != row["verdict"]:
        parts.append(f"{old['verdict']} -> {row['verdict']}" + (f": {row['reason']}" if row["reason"] else ""))
    if old["stable_at_file_dt"] != stable:
        states = {"true": "stable", "false": "unstable"}
        was, now = (states.get(value, "unknown") for value in (old["stable_at_file_dt"], stable))
        parts.append(f"at its own step: {was} -> {now}")
    before, after = old["limit_s"], row["limit_s"]
    has_both = before is not None and after is not None
    if abs(after - before) > MOVED * abs(before) if has_both else before != after:
        in_ms = ["none" if dt is None else f"{1e3 * dt:.4g} ms" for dt in (before, after)]
        parts.append(f"step limit: {' -> '.join(in_ms)}")
    return parts


# the files of a fleet


def sentence(kind: str, **values: object) -> str:
    return say(Finding("fleet", kind, values))


def write_table(
    out: Path,
    run: object,
    left_out: Sequence[tuple[str, str]],
    changed: Sequence[str] | None,
    command: str,
    took: float,
) -> list[str]:
    """Write fleet.csv and index.html; the lines of the summary. run: a run.Run; changed: lines of --since, None: without it."""
    rows, left_out = sorted(run.rows, key=order), [*left_out, *run.parts]
    summary = summary_of(rows, left_out, run)
    origin = {
        "command": command,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": round(took, 1),
        "workers": run.executor.workers,
        "this machine": f"{platform.node()}, {vectors()}",
        "commit": commit(),
        OURS: installed(OURS),
        "mujoco": installed("mujoco"),
    }
    write_whole(out / "fleet.csv", csv_of_fleet(rows).encode("utf-8", "backslashreplace"))
    text = fleet_page(
        rows, title="A fleet compared with MuJoCo", summary=summary, left_out=left_out, changed=changed, origin=origin
    )
    write_whole(out / "index.html", text.encode("utf-8", "backslashreplace"))
    return summary


def summary_of(rows: Sequence[dict], left_out: Sequence[tuple[str, str]], run: object) -> list[str]:
    numbers = run.verdicts
    lines = [sentence("verdicts", files=len(rows), numbers={v: numbers[v] for v in VERDICTS if numbers[v]})]
    if unstable := [row["file"] for row in rows if row["stable_at_file_dt"] is False]:
        lines.append(sentence("unstable", names=unstable))
    if left_out:
        lines.append(sentence("left_out", files=len(left_out)))
    if numbers[ITSELF]:
        lines.append(sentence("self_consistent"))
    if copies := sum(map(len, run.copies.values())):
        lines.append(sentence("copies", files=copies))
    if run.cached:
        lines.append(sentence("cached", files=run.cached))
    return lines


def fleet_page(rows: Sequence[dict], **values: object) -> str:
    """The page as HTML. values: title, summary, left_out, changed and origin, as in write_table."""
    environment = Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined,
        loader=FileSystemLoader(Path(__file__).parent),
    )  # fmt: skip
    is_bad = any(row["verdict"] in BAD_VERDICTS for row in rows)
    page = environment.get_template("fleet.html.jinja")
    return page.render(rows=list(map(shown_row, rows)), heads=HEADS, is_bad=is_bad, **values)


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
