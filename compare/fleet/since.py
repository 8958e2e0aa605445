"""What has changed since an earlier fleet: verdicts, and limits of the step."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..process.streams import in_one_line
from .piece import FleetError
from .row import COLUMNS

MOVED = 0.01  # relative, of a limit: what is less is not worth a word


def earlier(folder: str) -> dict[str, dict]:
    """The rows of an earlier fleet by their files. FleetError if there is none."""
    path = Path(folder) / "fleet.csv"
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    except (OSError, ValueError, csv.Error) as error:
        why = getattr(error, "strerror", None) or "it is no table"
        raise FleetError(
            f"cannot read {in_one_line(str(path))}: {why}; the folder of an earlier fleet is expected"
        ) from None
    if rows and not set(COLUMNS) <= set(rows[0]):
        raise FleetError(f"{in_one_line(str(path))} is not of a fleet: it has not the columns {', '.join(COLUMNS)}")
    return {row["file"]: row for row in rows}


def changes(before: Mapping[str, dict], rows: Sequence[dict]) -> list[str]:
    """What has changed, a sentence for each file: verdict, step, limit; new ones, and those gone."""
    found = []
    for row in rows:
        old = before.get(row["file"])
        if old is None:
            found.append(f"{row['file']}: new, {row['verdict']}")
            continue
        same = "" if old["sha256"] == row["sha256"] else " (the file has changed)"
        parts = []
        if old["verdict"] != row["verdict"]:
            parts.append(
                f"{old['verdict']} before, now {row['verdict']}" + (f": {row['reason']}" if row["reason"] else "")
            )
        stable = {None: "", True: "true", False: "false"}[row["stable_at_file_dt"]]
        if old["stable_at_file_dt"] != stable:
            parts.append(
                f"stable at its own step: {old['stable_at_file_dt'] or 'not known'} before, now {stable or 'not known'}"
            )
        limits = [float(old["limit_s"]) if old["limit_s"] else None, row["limit_s"]]
        if limits[0] != limits[1] and (None in limits or abs(limits[1] / limits[0] - 1.0) > MOVED):
            parts.append("limit {} before, now {}".format(*("none" if dt is None else f"{dt:.4g} s" for dt in limits)))
        if parts:
            found.append(f"{row['file']}: {'; '.join(parts)}{same}")
    here = {row["file"] for row in rows}
    return found + [f"{name}: gone, {old['verdict']} before" for name, old in before.items() if name not in here]
