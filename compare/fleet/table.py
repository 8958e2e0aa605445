"""The table of a fleet: fleet.csv, index.html, and its sentences."""

import csv
import io
import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from ..judge.timing import vectors
from ..report.provenance import commit
from ..report.version import OURS, installed, own_version
from ..run.reference import SOLUTION
from .kept import write_whole
from .page import fleet_page
from .row import AGREE, BROKE, DIFFER, FLEET_COLUMNS, ITSELF, REFUSED, UNCONFIRMED, VERDICTS, order
from .run import Run
from .times import time_of_workers

VERDICT_WORDS = {DIFFER: ("differs", "differ"), BROKE: ("broke off", "broke off"), REFUSED: ("was refused", "were refused"),
         AGREE: ("agrees", "agree"), UNCONFIRMED: ("has a prediction that is not confirmed",
         "have predictions that are not confirmed"), ITSELF: ("is self-consistent", "are self-consistent")}  # fmt: skip


def write_table(
    out: Path, run: Run, left_out: Sequence[tuple[str, str]], changed: Sequence[str] | None, command: str, took: float
) -> list[str]:
    """Write fleet.csv and index.html; the sentences at the top. changed: since an earlier fleet, None: that was not asked."""
    rows, left_out = sorted(with_why_itself(run.rows), key=order), [*left_out, *run.parts]
    spent = time_of_workers(run.took, run.workers, took, run.door.times_alone)
    said = sentences_of(rows, left_out, run)
    origin = {
        "command": command,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": round(took, 1),
        "workers": run.workers,
        "their time": spent.words(run.workers, took),
        "machine of the command": f"{platform.node()}, {vectors()}",
        "machines of the workers": ", ".join(sorted(run.machines)) or "none was needed",
        "commit": commit(),
        OURS: own_version(),
        "mujoco": installed("mujoco"),
    }
    write_whole(out / "fleet.csv", csv_of_fleet(rows).encode("utf-8", "backslashreplace"))
    text = fleet_page("A fleet compared with MuJoCo", said, rows, left_out, changed, origin, picture_of_steps(rows))
    write_whole(out / "index.html", text.encode("utf-8", "backslashreplace"))
    return [*said, spent.words(run.workers, took)] if round(spent.computing, 2) else said


def with_why_itself(rows: Sequence[dict]) -> list[dict]:
    """The rows; beside files that are compared with stated numbers those that are not have the reason for that."""
    if not any(row["reference"] in ("arm", SOLUTION) for row in rows):
        return list(rows)
    reasons = [
        f"{row['why_itself']}: compared with its own compiled model only" if row["why_itself"] else "" for row in rows
    ]
    return [row | {"reason": "; ".join(filter(None, (why, row["reason"])))} for row, why in zip(rows, reasons)]


def csv_of_fleet(rows: Sequence[dict]) -> str:
    """The table with all digits, true and false in small letters, empty what is not known."""
    text = io.StringIO()
    table = csv.DictWriter(text, FLEET_COLUMNS, extrasaction="ignore", lineterminator="\n")
    table.writeheader()
    for row in rows:
        table.writerow({name: str(value).lower() if isinstance(value, bool) else value for name, value in row.items()})
    return text.getvalue()


def picture_of_steps(rows: Sequence[dict]) -> tuple[bytes, str, tuple[int, int]] | None:
    """The picture of the page, see figures_fleet; None: there is nothing to draw, or it could not be drawn."""
    if not any(row["limit_s"] for row in rows):
        return None
    try:
        from .figures_fleet import picture_of  # what draws takes its time to be imported

        return picture_of(rows)
    except Exception:
        return None  # the table says the same


def sentences_of(rows: Sequence[dict], left_out: Sequence[tuple[str, str]], run: Run) -> list[str]:
    """How many have which verdict; whose own step is not stable; what is left out; what is known from before."""
    counted = run.verdicts()
    many = [f"{counted[v]} {VERDICT_WORDS[v][counted[v] > 1]}" for v in VERDICTS if counted[v]]
    said = [f"{len(rows)} file{'s' if len(rows) != 1 else ''}: {', '.join(many)}."]
    unstable = [row["file"] for row in rows if row["stable_at_file_dt"] is False]
    if unstable:
        more = f" and {len(unstable) - 3} more" if len(unstable) > 3 else ""
        whose = "their" if len(unstable) > 1 else "its"
        said.append(f"Not stable at {whose} own step: {', '.join(unstable[:3])}{more}.")
    if left_out:
        said.append(
            f"Left out: {len(left_out)} file{'s' if len(left_out) != 1 else ''}, each with its reason in index.html."
        )
    if run.no_timing:
        said.append(f"Experiments that measure time are left out: {run.no_timing}.")
    if counted[ITSELF]:
        said.append(
            "Self-consistent: compared with the own compiled model only, not with stated numbers; --reference compares "
            "all files with the arm or a solution."
        )
    known = (run.done_before, "file", ""), (run.pieces_before, "piece", " of others")
    if before := [f"{many} {what}{'s' * (many != 1)}{of}" for many, what, of in known if many]:
        said.append(f"Known from before: {' and '.join(before)}.")
    return said
