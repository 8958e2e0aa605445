"""The table of a fleet: rows, their order, fleet.csv, and the changes since an earlier fleet."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..judge.check import ENDS, About, Check
from ..process.streams import in_one_line
from ..report.verdict import Section, failures, unconfirmed_in_words, unstable_in_words, worst
from .tasks import FleetError

if TYPE_CHECKING:
    from ..run.reference import Reference

FLEET_COLUMNS = (
    "file", "sha256", "verdict", "reason", "joints", "worst_ratio",
    "file_integrator", "file_dt_s", "stable_at_file_dt", "limit_s", "seconds",
)  # fmt: skip
AGREE, DIFFER, REFUSED, BROKE = "agree", "differ", "refused", "broke"
UNCONFIRMED, ITSELF = "unconfirmed", "self-consistent"
VERDICTS = (DIFFER, BROKE, UNCONFIRMED, REFUSED, ITSELF, AGREE)  # in the order of the table
BAD_VERDICTS = (DIFFER, BROKE, UNCONFIRMED)  # exit status 1
MOVED = 0.01  # relative change of a step limit that is reported


def row_of_file(
    sections: Sequence[Section], causes: Sequence[dict], lost: Sequence[str], reference: "Reference"
) -> dict:
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
        outcome, reason = BROKE, exception_of(broke[0]) if broke else lost[0]
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


def exception_of(check: Check) -> str:
    quantity = "" if check.quantity == ENDS else f": {check.quantity}:"
    return f"{check.experiment}{quantity} {check.note}"


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
    """The rows of an earlier fleet by file name, `limit_s` a number or None. FleetError if they cannot be read."""
    path = Path(folder) / "fleet.csv"
    shown = in_one_line(str(path))
    try:
        with path.open(encoding="utf-8", newline="") as file:
            table = csv.DictReader(file)
            rows = list(table)
            if not set(FLEET_COLUMNS) <= set(table.fieldnames or ()):
                raise FleetError(f"{shown} is not a table of a fleet: expected the columns {', '.join(FLEET_COLUMNS)}")
            return {row["file"]: row | {"limit_s": float(row["limit_s"]) if row["limit_s"] else None} for row in rows}
    except FleetError:
        raise
    except (OSError, ValueError, csv.Error) as error:
        why = getattr(error, "strerror", None) or "not a table of a fleet"
        raise FleetError(f"cannot read {shown}: {why}; expected the folder of an earlier fleet") from None


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
