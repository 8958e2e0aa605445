"""The row of a file in the table of a fleet."""

from collections.abc import Sequence

from ..judge.check import ENDS, Check
from ..report.verdict import Section, failures, unconfirmed_in_words, unstable_in_words, worst

FLEET_COLUMNS = (
    "file", "sha256", "verdict", "reason", "joints", "worst_ratio",
    "file_integrator", "file_dt_s", "stable_at_file_dt", "limit_s", "seconds",
)  # fmt: skip
AGREE, DIFFER, REFUSED, BROKE = "agree", "differ", "refused", "broke"


def row_of_file(sections: Sequence[Section], causes: Sequence[dict], lost: Sequence[str]) -> dict:
    """The verdict and its reason, the largest share of a tolerance, and the step. lost: parts of the report that broke.

    A file whose own step is not stable agrees all the same, and the reason says where the limit is; so with predictions that
    no run confirms.
    """
    differing, broke, unstable, unconfirmed = failures(sections)
    top = worst(sections)
    stable, limit = own_step(sections)
    if differing:
        outcome, reason = DIFFER, causes[0]["text"] if causes else str(differing[0])
    elif broke or lost:
        outcome, reason = BROKE, break_in_words(broke[0]) if broke else lost[0]
    elif not any(section.result.checks for section in sections):
        outcome, reason = REFUSED, "nothing could be compared"
    else:
        reasons = [unconfirmed_in_words(unconfirmed)] if unconfirmed else []
        reasons += [unstable_in_words(unstable)] if unstable else []
        outcome, reason = AGREE, "; ".join(reasons)
    return {
        "verdict": outcome, "reason": reason, "worst_ratio": None if top is None else top.over_tolerance,
        "stable_at_file_dt": stable, "limit_s": limit,
    }  # fmt: skip


def break_in_words(check: Check) -> str:
    """What broke off."""
    what = "" if check.quantity == ENDS else f": {check.quantity}:"
    return f"{check.experiment}{what} {check.note}"


def own_step(sections: Sequence[Section]) -> tuple[bool | None, float | None]:
    """Whether the file's own step is stable under its own servos wherever that is known, and the least limit, s."""
    rows = [row for section in sections for row in section.result.tables.get("step_limits", ())]
    own = [row for row in rows if row["integrator"] == row["file_integrator"] and row["base"] != "locked"]
    known = [row["stable_at_file_dt"] for row in own if row["stable_at_file_dt"] is not None]
    limits = [row["predicted_dt_s"] for row in own if row["limit"] == "finite"]
    return (all(known) if known else None), min(limits, default=None)


def order(row: dict) -> tuple:
    """What needs a look comes first: it differs, broke off, could not be compared, is not stable; then the largest ratio."""
    rank = (DIFFER, BROKE, REFUSED, AGREE).index(row["verdict"])
    return rank, row["stable_at_file_dt"] is not False, -(row["worst_ratio"] or 0.0), row["file"]
