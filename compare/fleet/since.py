"""What has changed since an earlier fleet: verdicts, and limits of the step."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..process.streams import in_one_line
from .piece import FleetError
from .row import FLEET_COLUMNS

MOVED = 0.01  # relative, of a limit: what is less is not worth a word


def earlier(folder: str) -> dict[str, dict]:
    """The rows of an earlier fleet by their files, `limit_s` a number or None. FleetError if there is none."""
    path = Path(folder) / "fleet.csv"
    shown = in_one_line(str(path))
    try:
        with path.open(encoding="utf-8", newline="") as file:
            table = csv.DictReader(file)
            rows = list(table)
            if not set(FLEET_COLUMNS) <= set(table.fieldnames or ()):
                raise FleetError(f"{shown} is not of a fleet: it has not the columns {', '.join(FLEET_COLUMNS)}")
            return {row["file"]: row | {"limit_s": float(row["limit_s"]) if row["limit_s"] else None} for row in rows}
    except FleetError:
        raise
    except (OSError, ValueError, csv.Error) as error:
        why = getattr(error, "strerror", None) or "it is no table of a fleet"
        raise FleetError(f"cannot read {shown}: {why}; the folder of an earlier fleet is expected") from None


def changes(before: Mapping[str, dict], rows: Sequence[dict]) -> list[str]:
    """What has changed, a sentence for each file: verdict, step, limit; new ones, and those gone."""
    found = []
    for row in rows:
        old = before.get(row["file"])
        parts = [f"new, {row['verdict']}"] if old is None else changed_parts(old, row)
        if parts:
            is_other = old is not None and old["sha256"] != row["sha256"]
            found.append(f"{row['file']}: {'; '.join(parts)}{' (the file has changed)' * is_other}")
    here = {row["file"] for row in rows}
    return found + [f"{name}: gone, {old['verdict']} before" for name, old in before.items() if name not in here]


def changed_parts(old: dict, row: dict) -> list[str]:
    """What has changed of a file."""
    parts, stable = [], {None: "", True: "true", False: "false"}[row["stable_at_file_dt"]]
    if old["verdict"] != row["verdict"]:
        parts.append(f"{old['verdict']} before, now {row['verdict']}" + (f": {row['reason']}" if row["reason"] else ""))
    if old["stable_at_file_dt"] != stable:
        was, now = (
            {"true": "stable", "false": "not stable"}.get(of, "not known") for of in (old["stable_at_file_dt"], stable)
        )
        parts.append(f"at its own step {was} before, now {now}")
    if has_moved(old["limit_s"], row["limit_s"]):
        parts.append("limit {} before, now {}".format(*map(in_ms, (old["limit_s"], row["limit_s"]))))
    return parts


def has_moved(old: float | None, new: float | None) -> bool:
    """Whether a limit has moved by more than MOVED of the old one, has come or gone."""
    if old is None or new is None:
        return old != new
    return abs(new - old) > MOVED * abs(old)


def in_ms(dt: float | None) -> str:
    return "none" if dt is None else f"{1e3 * dt:.4g} ms"
