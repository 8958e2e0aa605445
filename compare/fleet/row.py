"""The row of a file in the table of a fleet."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..judge.check import ENDS, About, Check
from ..report.verdict import Section, failures, unconfirmed_in_words, unstable_in_words, worst

if TYPE_CHECKING:
    from ..run.reference import Reference

FLEET_COLUMNS = (
    "file", "sha256", "verdict", "reason", "joints", "worst_ratio",
    "file_integrator", "file_dt_s", "stable_at_file_dt", "limit_s", "seconds",
)  # fmt: skip
AGREE, DIFFER, REFUSED, BROKE = "agree", "differ", "refused", "broke"
UNCONFIRMED, ITSELF = (
    "unconfirmed",
    "self-consistent",
)  # ITSELF: compared only with its own compiled model, and that agrees
VERDICTS = (DIFFER, BROKE, UNCONFIRMED, REFUSED, ITSELF, AGREE)  # what needs a look comes first
BAD_VERDICTS = (DIFFER, BROKE, UNCONFIRMED)  # with which the exit status is 1


def row_of_file(
    sections: Sequence[Section], causes: Sequence[dict], lost: Sequence[str], reference: "Reference"
) -> dict:
    """The verdict and its reason, the largest share of a tolerance, and the step. lost: parts of the report that broke.

    A file whose own step is not stable agrees all the same, and the reason says where the limit is. reference: what it is
    compared with; joints that are not matched by their names are in the reason.
    """
    differing, broke, unstable, unconfirmed = failures(sections)
    top = worst(sections)
    stable, limit = own_step(sections)
    if differing:
        outcome, reason = DIFFER, first_cause(causes) if causes else str(differing[0])
    elif broke or lost:
        outcome, reason = BROKE, break_in_words(broke[0]) if broke else lost[0]
    elif not any(check.about == About.MODELS for section in sections for check in section.result.checks):
        outcome, reason = REFUSED, "nothing could be compared"
    else:
        outcome = UNCONFIRMED if unconfirmed else ITSELF if reference.kind == "model" else AGREE
        reasons = [unconfirmed_in_words(unconfirmed)] if unconfirmed else []
        reasons += [unstable_in_words(unstable)] if unstable else []
        reason = "; ".join(reasons)
    return {
        "verdict": outcome, "reason": "; ".join(filter(None, (reason, reference.matched))),
        "worst_ratio": None if top is None else top.over_tolerance, "stable_at_file_dt": stable, "limit_s": limit,
    }  # fmt: skip


def first_cause(causes: Sequence[dict]) -> str:
    """The gravest cause, and how many more there are."""
    return causes[0]["text"] + (f", and {len(causes) - 1} more" if len(causes) > 1 else "")


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
    """What needs a look comes first, see VERDICTS: then what is not stable, then the largest ratio."""
    rank = VERDICTS.index(row["verdict"])
    return rank, row["stable_at_file_dt"] is not False, -(row["worst_ratio"] or 0.0), row["file"]
