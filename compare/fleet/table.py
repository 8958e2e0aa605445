"""The table of a fleet: rows, fleet.csv, index.html with its summary, changes since an earlier fleet."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from ..core.check import About
from ..core.rows import Row, column
from ..core.text import block, environment
from ..report import files
from ..report.document import joined, page_of
from ..report.provenance import OURS, commit, installed
from ..report.verdict import Report, failures, worst
from ..run.reference import Reference
from ..stability.answer import worst_step
from .cache import write_whole
from .models import place_of_report

AGREE, DIFFER, REFUSED, BROKE = "agree", "differ", "refused", "broke"
NOT_JUDGED, UNCONFIRMED, ENGINE, ITSELF = "not judged", "unconfirmed", "engine differs", "self-consistent"
# in the order of the table
VERDICTS = DIFFER, BROKE, NOT_JUDGED, UNCONFIRMED, ENGINE, REFUSED, ITSELF, AGREE
# of the kinds of checks that fail; exit status 1. An unstable step is a column
VERDICT_OF = {
    "differing": DIFFER, "broke": BROKE, "not_judged": NOT_JUDGED, "unconfirmed": UNCONFIRMED, "of_engines": ENGINE,
}  # fmt: skip


@dataclass(kw_only=True)
class FileRow(Row):
    """A file of a fleet. What is not known of it is None."""

    file: str
    sha256: str | None = None
    same_as: str | None = None  # the file of which it is a copy
    verdict: str
    reason: str = ""
    reference: str | None = None  # the kind of a run.reference.Reference
    joints: int | None = None
    worst_ratio: float | None = None  # largest share of a tolerance
    file_integrator: str | None = None
    file_dt: float | None = column("s", default=None)
    # in its runs and with its own servos
    stable_at_file_dt: bool | None = None
    limit: float | None = column("s", default=None)  # the smallest one
    seconds: float = 0.0  # of the processor
    has_report: bool = False

    @property
    def is_bad(self) -> bool:
        return self.verdict in VERDICT_OF.values()

    @property
    def kind(self) -> str:
        """How the page marks it."""
        if self.is_bad or self.stable_at_file_dt is False:
            return "bad"
        return "good" if self.verdict == AGREE else "none"

    @property
    def address(self) -> str:
        """Of its report, from the page."""
        return quote(f"{place_of_report(self.same_as or self.file)}/index.html")

    @property
    def order(self) -> tuple[int, bool, float, str]:
        """Of the rows of a table: verdict, unstable steps first, largest share of a tolerance first."""
        is_stable = self.stable_at_file_dt is not False
        return VERDICTS.index(self.verdict), is_stable, -(self.worst_ratio or 0.0), self.file


LeftOut = Sequence[tuple[str, str]]  # files that are no models, and why
FLEET_COLUMNS = tuple(name for name in FileRow(file="", verdict="").columns() if name != "has_report")


def judge(row: FileRow, report: Report, reference: Reference) -> None:
    """Set the verdict, reason, largest share of a tolerance, and step of a row.

    The reason is the cause of what differs, else the first check of each other kind, and joints of other
    names.
    """
    sections = report.sections
    failed, top = failures(sections), worst(sections)
    checks = [check for section in sections for check in section.result.checks]
    kinds = [kind for kind, found in failed.items() if found]
    judged = [VERDICT_OF[kind] for kind in kinds if kind in VERDICT_OF]
    row.verdict = min(judged, key=VERDICTS.index, default=ITSELF if reference.kind == "model" else AGREE)
    said = [block("verdict", "first", checks=failed[kind], kind=kind) for kind in kinds]
    if not any(check.about == About.MODELS for check in checks) and not failed["broke"]:
        row.verdict, said = REFUSED, [block("fleet", "nothing_compared")]
    elif failed["differing"]:
        names = [cause.text for cause in report.causes] or said[:1]
        said = [block("fleet", "some", reasons=names, most=3), *(said[1:2] if failed["broke"] else [])]
    matched = block("fleet", "matched", renamed=reference.renamed)
    row.reason = "; ".join(filter(None, (*said, matched, *reference.otherwise, *reference.to_know)))
    row.worst_ratio = None if top is None else top.over_tolerance
    steps = [row for section in sections for row in section.result.tables.get("step_limits", ())]
    row.stable_at_file_dt, row.limit = worst_step(steps)


def write_table(out: Path, rows: Sequence[FileRow], left_out: LeftOut, command: str) -> list[str]:
    """Write fleet.csv, report.md and index.html; the lines of the summary."""
    rows = sorted(rows, key=lambda row: row.order)
    about = {
        "numbers": dict(Counter(row.verdict for row in rows)),  # in the order of VERDICTS
        "copies": sum(row.same_as is not None for row in rows),
        "unstable": [row.file for row in rows if row.stable_at_file_dt is False],
    }
    summary = [line for line in block("fleet", "summary", **about, left_out=left_out).split("\n") if line]
    origin = {"command": command, "date": datetime.now(UTC).isoformat(timespec="seconds"), "commit": commit()}
    origin |= {OURS: installed(OURS), "mujoco": installed("mujoco")}
    text = document_of(rows, summary=summary, left_out=left_out, origin=origin)
    page = page_of(block("fleet", "title"), text, not any(row.is_bad for row in rows))
    texts = {"fleet.csv": files.csv(rows, FLEET_COLUMNS), "report.md": text, "index.html": page}
    for name, content in texts.items():
        write_whole(out / name, content)
    return summary


def document_of(rows: Sequence[FileRow], **values: object) -> str:
    """report.md. values: summary, left_out and origin, as in write_table."""
    about = {"rows": rows, "title": block("fleet", "title"), "good": not any(row.is_bad for row in rows)}
    return joined(environment().get_template("fleet_document.md.jinja").render(**about, **values))
