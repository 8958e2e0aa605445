"""The table of a fleet: fleet.csv, index.html, and its sentences."""

import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from ..judge.timing import vectors
from ..report.files import csv
from ..report.provenance import commit
from ..version import OURS, installed, own_version
from .kept import write_whole
from .models import place_of
from .page import page
from .row import AGREE, BROKE, COLUMNS, DIFFER, REFUSED, order
from .run import Run

WORDS = {DIFFER: ("differs", "differ"), BROKE: ("broke off", "broke off"), REFUSED: ("was refused", "were refused"),
         AGREE: ("agrees", "agree")}  # fmt: skip


def write_table(
    out: Path,
    run: Run,
    left_out: Sequence[tuple[str, str]],
    changed: Sequence[str] | None,
    command: str,
    took: float,
    workers: int,
) -> list[str]:
    """Write fleet.csv and index.html; the sentences at the top."""
    rows = sorted(run.rows, key=order)
    for row in rows:
        row["has_report"] = (out / place_of(row["file"]) / "index.html").is_file() and row["verdict"] != REFUSED
    said = sentences(rows, [*left_out, *run.parts], run, took, workers)
    origin = {
        "command": command,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": round(took, 1),
        "workers": workers,
        "machine of the command": f"{platform.node()}, {vectors()}",
        "machines": ", ".join(sorted(run.machines)) or "none was needed",
        "commit": commit(),
        OURS: own_version(),
        "mujoco": installed("mujoco"),
    }
    columns = [{name: row[name] for name in COLUMNS} for row in rows]
    write_whole(out / "fleet.csv", csv(columns).encode("utf-8", "backslashreplace"))
    text = page("A fleet compared with MuJoCo", said, rows, [*left_out, *run.parts], changed, origin)
    write_whole(out / "index.html", text.encode("utf-8", "backslashreplace"))
    return said


def sentences(
    rows: Sequence[dict], left_out: Sequence[tuple[str, str]], run: Run, took: float, workers: int
) -> list[str]:
    """How many have which verdict; whose own step is not stable; what is left out; what the workers did."""
    counted = run.verdicts()
    many = [f"{counted[v]} {WORDS[v][counted[v] > 1]}" for v in (AGREE, DIFFER, BROKE, REFUSED) if counted[v]]
    said = [f"{len(rows)} file{'s' if len(rows) != 1 else ''}: {', '.join(many)}."]
    unstable = [row["file"] for row in rows if row["stable_at_file_dt"] is False]
    if unstable:
        more = f" and {len(unstable) - 3} more" if len(unstable) > 3 else ""
        said.append(
            f"Not stable at {'their' if len(unstable) > 1 else 'its'} own step: {', '.join(unstable[:3])}{more}."
        )
    if left_out:
        said.append(f"Left out, for they are parts of others: {len(left_out)}.")
    if run.no_timing:
        said.append(f"Experiments that measure time are left out: {run.no_timing}.")
    if run.done_before:
        said.append(f"Known from before: {run.done_before}.")
    if run.work:
        share = min(run.work / (workers * took), 1.0)
        said.append(f"{workers} worker{'s' if workers != 1 else ''} computed {100.0 * share:.0f} % of {took:.0f} s.")
    return said
